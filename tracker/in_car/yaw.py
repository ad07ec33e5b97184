"""The camera's own motion from the flow of all points: rotation, focus of expansion, speed.

A static point moves by ``e (p - foe)`` away from the focus of expansion, ``e = V / Z``, plus what the
rotation adds:
``-k(x) R_y`` along x and a like term along y for the pitch (methods.md 1.2). The rotation and the focus
follow from the
direction of the flow alone (the epipolar constraint), whatever the depths are, and vehicles that keep their
lane obey it too. The
ground then gives the speed: a point of the road y px below the horizon expands at ``e = g y`` with ``g = V
/ (f H)``.
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


@njit(cache=True)
def _rotation(  # type: ignore[no-untyped-def]
    x, y, dx, dy, weight, focal, guess_a, guess_b, sigma_a, sigma_b, noise
):
    """Robust least squares for the rotation's shifts a (x) and b (y) of the picture's middle, px a frame.

    Residual of a static point: ((dx + a kx) y - (dy - b ky) x) / r with kx = 1 + x^2/f^2, ky = 1 + y^2/f^2;
    mixed terms
    x y / f^2 included. Cauchy weights, six rounds.
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
def _mode(ratio, spread, weight, prior, prior_spread):  # type: ignore[no-untyped-def]
    """Return where weighted kernels of their own spread pile up highest under a Gaussian prior.

    And the support there.
    """
    best, place, support = -1.0, prior, 0.0
    for i in range(ratio.size + 1):
        candidate = prior if i == ratio.size else ratio[i]
        total = 0.0
        for j in range(ratio.size):
            total += weight[j] * np.exp(-0.5 * ((ratio[j] - candidate) / spread[j]) ** 2)
        value = (total + 0.5) * np.exp(-0.5 * ((candidate - prior) / prior_spread) ** 2)
        if value > best:
            best, place, support = value, candidate, total
    numerator, divisor = 0.0, 1e-9
    for j in range(ratio.size):
        near = weight[j] * np.exp(-0.5 * ((ratio[j] - place) / spread[j]) ** 2) / (spread[j] * spread[j])
        numerator += near * ratio[j]
        divisor += near
    if support > 0.5:
        place = numerator / divisor
    return place, support


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
        self._ground_spread = 0.8
        self.yaw_rate = 0.0
        self.shift = np.zeros(2)
        self._drift = 0.0
        self._per_speed = 1.0 / (focal * HEIGHT)
        self._calibrated = 0.0

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
        middle = position - 0.5 * moved
        size = np.hypot(moved[:, 0], moved[:, 1])
        use = (weight > 0) & (size > 1.5)
        if use.sum() < 6:
            return
        # The line through a point along its flow passes through the focus: n . focus = n . p, n the
        # flow's normal.
        normal = np.stack([-moved[use, 1], moved[use, 0]], 1) / size[use, None]
        offset = (normal * middle[use]).sum(1)
        distance = np.maximum(np.hypot(*(middle[use] - self.focus).T), 5.0)
        # Angular noise of the flow, carried to the focus.
        sigma = 1.0 + distance * 2.0 * FLOW_NOISE / size[use]
        residual = offset - normal @ self.focus
        strength = weight[use] / sigma**2 / (1.0 + (residual / (2.0 * sigma)) ** 2)
        forget = 0.985 ** (30.0 / self._rate)
        # Neighbouring points and frames share their errors: they count a fraction each.
        strength *= 0.08
        self._information = (
            forget * self._information
            + (1 - forget) * self._prior_information
            + (normal * strength[:, None]).T @ normal
        )
        self._vector = (
            forget * self._vector + (1 - forget) * self._prior_vector + normal.T @ (strength * offset)
        )
        self.focus = np.linalg.solve(self._information, self._vector)

    def _learn_ground(
        self, position: Floats, moved: Floats, seconds: Floats, weight: Floats, speed: float | None
    ) -> None:
        # Rate and row both of the middle of the time.
        below = position - 0.5 * moved - self.focus
        rate, error = self.expansion(position, moved, seconds)
        # The corridor of the road: three metres to each side.
        use = (weight > 0) & (below[:, 1] > 14.0) & (np.abs(below[:, 0]) < 3.0 * below[:, 1])
        ratio = rate[use] / below[use, 1]
        spread = np.hypot(error[use] / below[use, 1], 0.08 * self.ground + 2e-4)
        value = weight[use] * np.minimum(below[use, 1] / 60.0, 1.5)
        prior, loose = self.ground, self._ground_spread * self.ground + 2e-3
        if speed is not None and self._calibrated > 0.3:
            prior, loose = speed * self._per_speed, 0.15 * speed * self._per_speed + 3e-4
        # What stands still in the picture may be a vehicle, the bonnet, dirt on the glass or an
        # edge that hides its own
        # motion; what expands like the ground can only be the ground. So few expanding points
        # outvote many still ones.
        expanding = ratio > np.maximum(3.0 * error[use] / below[use, 1], 0.3 * self.ground)
        if value[expanding].sum() > 0.15 * value[~expanding].sum():
            ratio, spread, value = ratio[expanding], spread[expanding], value[expanding]
        place, support = _mode(ratio, spread, value, prior, loose)
        gain = min(1.0, 8.0 / self._rate) * support / (support + 2.0)
        self.ground = max(0.0, self.ground + gain * (place - self.ground))
        self._ground_spread += gain * (0.15 - self._ground_spread)
        if speed is not None:
            if speed > 3.0:
                learn = 0.03 * support / (support + 2.0)
                self._per_speed += learn * (self.ground / speed - self._per_speed)
                self._calibrated = min(1.0, self._calibrated + learn)
            if self._calibrated > 0.3:
                self.ground += 0.2 * (speed * self._per_speed - self.ground)
