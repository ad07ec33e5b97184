"""How much a point's motion speaks for a vehicle that goes the ego's way: log likelihood ratios.

What is static and seen y px below the horizon lies on the ground or above it, so it is at most ``f H / y``
away and expands at least at ``e = g y``. A vehicle that drives along expands at ``u / Z`` with u the small
closing speed. An oncoming one expands faster than the ground, so it counts with the scenery here. This is
p(x, v | B) and p(x, v | C) of paper 1 with the row of the point put in place of the unknown depth, and both
axes of the flow in place of one.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car.yaw import FLOW_NOISE, HEIGHT

Floats = NDArray[np.float64]

# Vehicle: standard deviation of the closing speed as a share of the ego's and beside it (m/s), and sideways
# (m/s).
CLOSING_SHARE, CLOSING, SIDEWAYS = 0.13, 1.5, 0.8
# Ego speed below which standing still speaks less and less against a vehicle, m/s.
WALK = 3.0
# Static: share of points on the ground itself; those above it follow an exponential in e / (g y) - 1 with
# this mean.
ON_GROUND, ABOVE = 0.45, 1.0
# Least and greatest distance of what stands at or above the horizon, metres.
NEAR, FAR = 6.0, 1000.0


@njit(cache=True)
def _gauss(value, sigma):  # type: ignore[no-untyped-def]
    return math.exp(-0.5 * (value / sigma) ** 2) / (sigma * 2.5066282746310002)


@njit(cache=True)
def _tail_exponential(value, sigma, mean):  # type: ignore[no-untyped-def]
    """Density of Gaussian noise plus an exponential: value = E + noise."""
    rate = 1.0 / mean
    argument = (rate * sigma - value / sigma) / 1.4142135623730951
    exponent = rate * (0.5 * rate * sigma * sigma - value)
    if argument > 8.0:
        # erfc underflows: its asymptotic form times the exponential is the Gaussian's tail.
        return _gauss(value, sigma) * rate * sigma / max(argument * 1.4142135623730951, 1e-9)
    return 0.5 * rate * math.exp(min(exponent, 60.0)) * math.erfc(argument)


@njit(cache=True)
def log_ratios(x, y, dx, dy, seconds, speed, ground, focal, turn, noise, horizon_error):  # type: ignore[no-untyped-def]
    """Return ln p(motion | vehicle) - ln p(motion | static or oncoming) for N points (N,).

    Args:
        x: (N,) px right of the focus of expansion, middle of the motion.
        y: (N,) px below it.
        dx: (N,) displacement without rotation, px.
        dy: (N,) likewise.
        seconds: (N,) in which it happened.
        speed: Of the ego, m/s, from the ground.
        ground: g, 1/(px s).
        focal: Px.
        turn: f R_y, px/s: on a bend a vehicle ahead moves along with the camera's turn.
        noise: Of a displacement, px.
        horizon_error: Standard deviation of the horizon's row, px.
    """
    ratios = np.zeros(x.size)
    for i in range(x.size):
        time = seconds[i]
        if time <= 0.0:
            continue
        r = math.sqrt(x[i] * x[i] + y[i] * y[i])
        reach = max(r, 4.0)
        along = (dx[i] * x[i] + dy[i] * y[i]) / reach
        across = (dx[i] * y[i] - dy[i] * x[i]) / reach
        rate = along / (reach * time)
        rate_error = noise / (reach * time)
        # --- static
        if y[i] > 3.0:
            least = ground * y[i]
            sigma = math.sqrt(rate_error**2 + (ground * horizon_error) ** 2 + (0.1 * least) ** 2)
            mean = ABOVE * least + 1e-3
            static = ON_GROUND * _gauss(rate - least, sigma) + (1 - ON_GROUND) * _tail_exponential(
                rate - least, sigma, mean
            )
        else:
            # Depth between FAR and NEAR, 1/Z spread as an exponential above its least value.
            least = speed / FAR
            sigma = math.sqrt(rate_error**2 + (0.2 * least) ** 2)
            static = _tail_exponential(rate - least, sigma, speed / 40.0 + 1e-3)
        static *= _gauss(across, noise)
        # --- vehicle: its depth from a height of half a metre under the camera's, no nearer than NEAR
        depth = focal * 0.6 * HEIGHT / max(y[i], 6.0)
        depth = max(depth, NEAR)
        closing = CLOSING_SHARE * speed + CLOSING
        sigma_rate = math.sqrt(rate_error**2 + (closing / depth) ** 2)
        sideways = focal * SIDEWAYS / depth * time
        bend = turn * time
        # On a steady bend the vehicle ahead turns with the road: in the unturned frame it moves by f R_y.
        moved_x = dx[i] - 0.7 * bend
        sideways = math.sqrt(sideways**2 + (0.5 * bend) ** 2)
        along_car = (moved_x * x[i] + dy[i] * y[i]) / reach
        across_car = (moved_x * y[i] - dy[i] * x[i]) / reach
        weight_x = abs(x[i]) / reach
        weight_y = abs(y[i]) / reach
        spread_along = math.sqrt((sigma_rate * reach * time) ** 2 + (weight_x * sideways) ** 2)
        spread_across = math.sqrt(noise**2 + (weight_y * sideways) ** 2)
        vehicle = _gauss(along_car, spread_along) * reach * time * _gauss(across_car, spread_across)
        # A share of points moves like neither: slipped windows, reflections.
        stray = 0.02 / (1.0 + speed / 6.0) * 0.05 / noise
        ratios[i] = math.log(vehicle + stray) - math.log(static + stray)
    return ratios


def motion_evidence(
    relative: Floats,
    moved: Floats,
    seconds: Floats,
    *,
    ground: float,
    focal: float,
    yaw_rate: float,
    horizon_error: float = 2.5,
) -> Floats:
    """Return `log_ratios` of points at (N, 2) from the focus of expansion that moved by (N.

    2) in (N,) seconds.
    """
    middle = relative - 0.5 * moved
    speed = ground * focal * HEIGHT
    ratios: Floats = log_ratios(
        np.ascontiguousarray(middle[:, 0]),
        np.ascontiguousarray(middle[:, 1]),
        np.ascontiguousarray(moved[:, 0]),
        np.ascontiguousarray(moved[:, 1]),
        seconds,
        speed,
        ground,
        focal,
        focal * yaw_rate,
        2.0 * FLOW_NOISE,
        horizon_error,
    )
    # While the ego stands, vehicles in a queue stand like everything else; what moves is no scenery
    # even then.
    return np.where(ratios < 0.0, ratios * min(1.0, speed / WALK), ratios)
