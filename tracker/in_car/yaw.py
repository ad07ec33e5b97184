"""The camera's own motion from the flow of all points: rotation, focus of expansion, speed.

A static point moves by ``e (p - foe)`` away from the focus of expansion, ``e = V / Z``, plus what the
rotation adds: ``-k(x) R_y`` along x and a like term along y for the pitch (methods.md 1.2). The rotation and
the focus follow from the direction of the flow alone (the epipolar constraint), whatever the depths are, and
vehicles that keep their lane obey it too. The ground then gives the speed: a point of the road y px below the
horizon expands at ``e = g y`` with ``g = V / (f H)``.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Noise of one frame's optical flow, px.
FLOW_NOISE = 0.25
# Camera height assumed where the scale of the ground is not yet known, metres (typical of a dash camera).
HEIGHT = 1.25
# The ground's expansion is sought on a scale of logarithms: its step, and the speeds that it spans, m/s.
LOG_STEP, SLOWEST, FASTEST = 0.04, 0.7, 90.0
# Usual speed, m/s, and the log spread of speed without an odometer, of the camera's height with one.
USUAL_SPEED, SPEED_SPREAD, HEIGHT_SPREAD = 20.0, 1.0, 0.4
# Standard deviation of the rotation that is left over after a frame's estimate, px, and seconds for which the
# focus of expansion is remembered.
LEFT_OVER, FOCUS_MEMORY = 3.0, 5.0
# Seconds for which the histogram of the ground's expansion remembers, without and with an odometer.
MEMORY, LONG_MEMORY = 0.7, 4.0
# The ego stands where no more than a share of all points, at least so far from the focus of expansion and
# followed for so long (px, s), moved by this many px; of fewer points nothing is concluded.
STIRRING, OFF_FOCUS, FOLLOWED, STIRRED, ENOUGH = 0.35, 40.0, 0.25, 1.5, 20


@njit(cache=True)
def _rotation(  # type: ignore[no-untyped-def]
    x, y, dx, dy, weight, focal, guess_a, guess_b, sigma_a, sigma_b, noise
):
    """Robust least squares for the rotation's shifts a (x) and b (y) of the picture's middle, px a frame.

    Residual of a static point: ((dx + a kx) y - (dy - b ky) x) / r with kx = 1 + x^2/f^2, ky = 1 +
    y^2/f^2; mixed terms x y / f^2 included. Cauchy weights, six rounds.
    """
    a, b = guess_a, guess_b
    for _ in range(6):
        m00, m01, m11 = 1.0 / sigma_a**2, 0.0, 1.0 / sigma_b**2
        v0, v1 = guess_a / sigma_a**2, guess_b / sigma_b**2
        for i in range(x.size):
            r = np.sqrt(x[i] * x[i] + y[i] * y[i])
            if r < 8.0:
                continue
            mixed = x[i] * y[i] / (focal * focal)
            # flow of rotation: (-a kx + b mixed, b ky - a mixed)
            coef_a = ((1.0 + x[i] * x[i] / (focal * focal)) * y[i] - mixed * x[i]) / r
            coef_b = (-mixed * y[i] + (1.0 + y[i] * y[i] / (focal * focal)) * x[i]) / r
            free = (dx[i] * y[i] - dy[i] * x[i]) / r
            residual = free + coef_a * a + coef_b * b
            w = weight[i] / (noise * noise) / (1.0 + (residual / (2.0 * noise)) ** 2)
            m00 += w * coef_a * coef_a
            m01 += w * coef_a * coef_b
            m11 += w * coef_b * coef_b
            v0 -= w * coef_a * free
            v1 -= w * coef_b * free
        determinant = m00 * m11 - m01 * m01
        a = (m11 * v0 - m01 * v1) / determinant
        b = (m00 * v1 - m01 * v0) / determinant
    return a, b


@njit(cache=True)
def _epipolar(position, moved, weight, focus, focal):  # type: ignore[no-untyped-def]
    """Gather normal equations for a rotation that is left over and for a shift of the focus of expansion.

    Both turn the flow of a static point away from the focus. A near point tells of the shift, a far one,
    which hardly moves otherwise, of the rotation: only together do they tell the two apart.

    Args:
        position: (N, 2) now.
        moved: (N, 2) displacement, rotation removed as far as it is known.
        weight: (N,) 0 for points that are left out.
        focus: (2,) as far as it is known.
        focal: Px.

    Returns:
        (4, 4) and (4,): for the rotation's shifts a and b of the picture's middle (see `_rotation`), px, and
        the shift of the focus along x and y, px.
    """
    matrix, vector = np.zeros((4, 4)), np.zeros(4)
    coefficient = np.empty(4)
    noise = 2.0 * FLOW_NOISE
    for i in range(weight.size):
        if weight[i] <= 0.0:
            continue
        u, v = moved[i, 0], moved[i, 1]
        x, y = position[i, 0] - 0.5 * u - focus[0], position[i, 1] - 0.5 * v - focus[1]
        r = np.sqrt(x * x + y * y)
        if r < 8.0:
            continue
        mixed = x * y / (focal * focal)
        coefficient[0] = ((1.0 + x * x / (focal * focal)) * y - mixed * x) / r
        coefficient[1] = ((1.0 + y * y / (focal * focal)) * x - mixed * y) / r
        coefficient[2] = v / r
        coefficient[3] = -u / r
        residual = (u * y - v * x) / r
        # Neighbouring points and frames share their errors: they count a fraction each.
        w = 0.08 * weight[i] / (noise * noise) / (1.0 + (residual / (2.0 * noise)) ** 2)
        for j in range(4):
            vector[j] -= w * coefficient[j] * residual
            for k in range(4):
                matrix[j, k] += w * coefficient[j] * coefficient[k]
    return matrix, vector


@njit(cache=True)
def _deposit(pile, places, spreads, weights):  # type: ignore[no-untyped-def]
    """Add a Gaussian of weight ``weights`` at each of ``places`` (in bins) to a histogram, in place."""
    for j in range(places.size):
        reach = 3.0 * spreads[j]
        first, last = max(0, int(places[j] - reach)), min(pile.size - 1, int(places[j] + reach) + 1)
        scale = weights[j] / spreads[j]
        for i in range(first, last + 1):
            pile[i] += scale * np.exp(-0.5 * ((i - places[j]) / spreads[j]) ** 2)


class EgoMotion:
    """Estimates the camera's motion. Working px; y counts downward from the focus of expansion.

    Attributes:
        focal: Px.
        focus: (2,) focus of expansion; its row is the horizon.
        ground: g = V / (f H), 1/(px s): expansion of the road per px below the horizon.
        yaw_rate: R_y, rad/s, positive to the right.
        shift: (2,) px that the rotation moved the middle of the picture in the last frame.
    """

    def __init__(self, *, focal: float, focus: tuple[float, float], sure: bool, rate: float) -> None:
        """Start with a guess.

        Args:
            focal: Px.
            focus: Where the focus of expansion is expected.
            sure: Whether the camera is calibrated, so that the focus lies near the principal point.
            rate: Frames a second.
        """
        self.focal, self._rate = focal, rate
        self.focus = np.array(focus, float)
        self._expected = self.focus.copy()
        spread = np.array([12.0, 6.0]) if sure else np.array([60.0, 60.0])
        self._information = np.diag(1.0 / spread**2)
        self._vector = self._information @ self.focus
        self._prior_information, self._prior_vector = self._information.copy(), self._vector.copy()
        self.ground = 15.0 / (focal * HEIGHT)
        self._pile = np.zeros(round(np.log(FASTEST / SLOWEST) / LOG_STEP) + 1)
        self._metered = False
        self._moving = 1.0
        self.yaw_rate = 0.0
        self.shift = np.zeros(2)
        self._drift = 0.0
        self._per_speed = 1.0 / (focal * HEIGHT)

    @property
    def speed(self) -> float:
        """The ego's speed, m/s, as far as the camera's height is the usual one."""
        return self.ground * self.focal * HEIGHT

    def rotate(self, position: Floats, flow: Floats, weight: Floats) -> Floats:
        """Estimate the rotation since the last frame and return the flow that it caused at each point.

        Args:
            position: (N, 2) of the points now.
            flow: (N, 2) since the last frame.
            weight: (N,) 0 for new points, little for those on vehicles.
        """
        relative = position - self.focus
        usual = -self.yaw_rate * self.focal / self._rate
        a, b = _rotation(
            relative[:, 0] - 0.5 * flow[:, 0],
            relative[:, 1] - 0.5 * flow[:, 1],
            flow[:, 0],
            flow[:, 1],
            weight,
            self.focal,
            -usual,
            0.0,
            0.7,
            3.0,
            FLOW_NOISE,
        )
        # A car does not pitch one way for long: a lasting mean comes from a focus that is off, and
        # is left to move it.
        self._drift += min(1.0, 0.5 / self._rate) * (b - self._drift)
        b -= self._drift
        self.shift = np.array([-a, b])
        measured = a * self._rate / self.focal
        self.yaw_rate += min(1.0, 6.0 / self._rate) * (measured - self.yaw_rate)
        return self.rotational_flow(position, a, b)

    def rotational_flow(self, position: Floats, a: float, b: float) -> Floats:
        """Return the flow (N, 2) of a rotation that moves the middle by (-a, b)."""
        x, y = (position - self.focus).T / self.focal
        return np.stack([-a * (1.0 + x * x) + b * x * y, b * (1.0 + y * y) - a * x * y], 1)

    def expansion(self, position: Floats, moved: Floats, seconds: Floats) -> tuple[Floats, Floats]:
        """Return each point's expansion rate e, 1/s, and its standard deviation (N,).

        Args:
            position: (N, 2) now.
            moved: (N, 2) displacement without rotation.
            seconds: (N,) in which it happened.
        """
        middle = position - self.focus - 0.5 * moved
        power = np.maximum((middle * middle).sum(1), 16.0)
        time = np.maximum(seconds, 1e-3)
        return (moved * middle).sum(1) / power / time, 2.0 * FLOW_NOISE / np.sqrt(power) / time

    def learn(
        self, position: Floats, moved: Floats, seconds: Floats, weight: Floats, speed: float | None = None
    ) -> None:
        """Improve the focus of expansion and the speed over ground.

        Args:
            position: (N, 2) now.
            moved: (N, 2) displacement without rotation.
            seconds: (N,) in which it happened.
            weight: (N,) 0 for points on vehicles and for those that are too young.
            speed: Of the odometer, m/s, where there is one.
        """
        self._learn_focus(position, moved, weight)
        self._learn_ground(position, moved, seconds, weight, speed)

    def _learn_focus(self, position: Floats, moved: Floats, weight: Floats) -> None:
        matrix, vector = _epipolar(position, moved, weight, self.focus, self.focal)
        # What the left-over rotation can explain tells nothing about the focus.
        turn = matrix[:2, :2] + np.eye(2) / LEFT_OVER**2
        solved = np.linalg.solve(turn, np.column_stack([matrix[:2, 2:], vector[:2]]))
        information = matrix[2:, 2:] - matrix[2:, :2] @ solved[:, :2]
        shift = vector[2:] - matrix[2:, :2] @ solved[:, 2]
        forget = np.exp(-1.0 / (self._rate * FOCUS_MEMORY))
        self._information = forget * self._information + (1 - forget) * self._prior_information + information
        self._vector = (
            forget * self._vector + (1 - forget) * self._prior_vector + information @ self.focus + shift
        )
        self.focus = np.linalg.solve(self._information, self._vector)

    def _learn_ground(
        self, position: Floats, moved: Floats, seconds: Floats, weight: Floats, speed: float | None
    ) -> None:
        if speed is not None and not self._metered:
            self._metered, self._pile = True, np.zeros_like(self._pile)
        # Rate and row both of the middle of the time.
        below = position - 0.5 * moved - self.focus
        rate, error = self.expansion(position, moved, seconds)
        # The corridor of the road: three metres to each side.
        use = (weight > 0) & (below[:, 1] > 14.0) & (np.abs(below[:, 0]) < 3.0 * below[:, 1])
        per_metre = self.focal * HEIGHT / below[use, 1]
        speeds, errors = rate[use] * per_metre, error[use] * per_metre
        value = weight[use] * np.minimum(below[use, 1] / 60.0, 1.5)
        # What stands still in the picture may be a vehicle, the bonnet, dirt on the glass or an
        # edge that hides its own motion; what expands like the ground can only be the ground. So few
        # expanding points outvote many still ones, and they are gathered over a while.
        expanding = speeds > np.maximum(3.0 * errors, 1.0)
        if speed is None:
            self._gather(speeds[expanding], errors[expanding], value[expanding], MEMORY)
            total = float(value.sum())
            gain = min(1.0, 3.0 / self._rate) * total / (total + 2.0)
            self._moving += gain * (float(value[expanding].sum()) / max(total, 1e-9) - self._moving)
            going, support = self._peak(USUAL_SPEED, SPEED_SPREAD)
            gain = min(1.0, 6.0 / self._rate)
            if self._stands(position, moved, seconds):
                going = 0.0
            else:
                gain *= support / (support + 2.0)
                if self._moving < 0.1:
                    going = 0.0
            self.ground += gain * (going / (self.focal * HEIGHT) - self.ground)
            return
        if speed > 3.0:
            # Metres a second for each one of the odometer's: the height, once for all.
            ratio, loose = speeds[expanding] / speed, errors[expanding] / speed
            self._gather(USUAL_SPEED * ratio, USUAL_SPEED * loose, value[expanding], LONG_MEMORY)
            place, support = self._peak(USUAL_SPEED, HEIGHT_SPREAD)
            factor = place / USUAL_SPEED / (self.focal * HEIGHT)
            self._per_speed += 0.1 * support / (support + 20.0) * (factor - self._per_speed)
        self.ground = max(0.0, speed * self._per_speed)

    def _stands(self, position: Floats, moved: Floats, seconds: Floats) -> bool:
        """Tell whether so little moves in the picture, vehicles included, that the ego cannot move."""
        away = position - self.focus
        told = (seconds > FOLLOWED) & (np.hypot(away[:, 0], away[:, 1]) > OFF_FOCUS)
        stirred = np.abs(moved[told]).max(1) > STIRRED
        return len(stirred) >= ENOUGH and float(stirred.mean()) < STIRRING

    def _gather(self, speeds: Floats, errors: Floats, weights: Floats, memory: float) -> None:
        """Add measured speeds, m/s, to the histogram of their logarithms."""
        self._pile *= np.exp(-1.0 / (self._rate * memory))
        places = np.log(np.maximum(speeds, 1e-3) / SLOWEST) / LOG_STEP
        spreads = np.hypot(errors / np.maximum(speeds, 1e-3), 0.06) / LOG_STEP
        _deposit(self._pile, places, spreads, weights)

    def _peak(self, usual: float, spread: float) -> tuple[float, float]:
        """Return the speed at which the histogram is highest under a prior, and the support there."""
        logs = np.log(SLOWEST) + LOG_STEP * np.arange(len(self._pile))
        prior = np.exp(-0.5 * ((logs - np.log(usual)) / spread) ** 2)
        value = self._pile * prior
        best = int(value.argmax())
        near = slice(max(0, best - 2), best + 3)
        if value[best] <= 0.0:
            return usual, 0.0
        return float(np.exp((value[near] * logs[near]).sum() / value[near].sum())), float(self._pile[best])
