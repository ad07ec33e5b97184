"""Where a vehicle may be that is not tracked yet: windows of a vehicle's size, filled with points that move like one."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car import segments as seg

Floats = NDArray[np.float64]

# Width over the height of the horizon above the contact row: metres of width over metres of camera height.
SLIMMEST, USUAL, WIDEST = 0.85, 1.45, 2.6


# Room that a point takes on a vehicle up to so wide (px), px^2 a point: a window much larger than its points' room is none.
# Wider vehicles have no more points: they are near, where the grid of corners is coarse.
ROOM, ROOM_WIDTH = 200.0, 60.0


# How far around a window its cut-off parts are looked for, as a share of its width: less than the gap between two lanes.
CUT = 0.3
# Log odds beyond which more points add nothing: how well they fill a window is to decide, not how many they are.
ENOUGH = 50.0
# How far the points of one body may move apart over the remembered time: px, and as a share of its width.
BODY_PLAY, BODY_SHARE = 1.0, 0.02
# Where the points of a vehicle lie in its window, as shares of its width: their mean above the ground, with its play, and
# their spreads in x and y, which for a filled rear are those of a uniform density.
MEAN_HEIGHT, MEAN_PLAY, SPREAD_X, SPREAD_Y = 0.38, 0.13, 0.27, 0.16


@njit(cache=True)
def misfit(weight, x, y, xx, yy, x0, y1, wide):  # type: ignore[no-untyped-def]
    """Return how badly the points' moments (sums over the weights) fit a vehicle's window, 0 for well."""
    mean_x, mean_y = x / weight, y / weight
    off_x = (mean_x - x0) / wide - 0.5
    off_y = ((y1 - mean_y) / wide - MEAN_HEIGHT) / MEAN_PLAY
    spread_x = math.sqrt(max(xx / weight - mean_x * mean_x, 0.0)) / wide
    spread_y = math.sqrt(max(yy / weight - mean_y * mean_y, 0.0)) / wide
    cost = (off_x / 0.15) ** 2 + off_y**2
    cost += (min(spread_x / SPREAD_X - 1.0, 0.0) / 0.35) ** 2 + 0.5 * (
        min(spread_y / SPREAD_Y - 1.0, 0.0) / 0.5
    ) ** 2
    return 0.5 * cost


@njit(cache=True)
def _score(windows, x, y, u, v, evidence, horizon):  # type: ignore[no-untyped-def]
    """Return for each window its worth and the numbers of points for and against."""
    scores = np.zeros((windows.shape[0], 3))
    for k in range(windows.shape[0]):
        x0, y0, x1, y1 = windows[k, 0], windows[k, 1], windows[k, 2], windows[k, 3]
        wide, tall = x1 - x0, y1 - y0
        play = 0.04 * wide + 1.0
        total, positive, negative = 0.0, 0, 0
        s, sx, sy, sxx, syy = 0.0, 0.0, 0.0, 0.0, 0.0
        su, sv, suu = 0.0, 0.0, 0.0
        for i in range(x.size):
            if not (x0 - play <= x[i] <= x1 + play and y0 - play <= y[i] <= y1 + play):
                continue
            value = min(max(evidence[i], -4.0), 4.0)
            # Above the horizon far scenery moves like a vehicle: it cannot speak for one.
            if y[i] < horizon + 2.0:
                value = min(value, 0.0)
            total += value
            if value > 0.8:
                positive += 1
                s += value
                sx += value * x[i]
                sy += value * y[i]
                sxx += value * x[i] * x[i]
                syy += value * y[i] * y[i]
                su += value * u[i]
                sv += value * v[i]
                suu += value * (u[i] * u[i] + v[i] * v[i])
            elif value < -0.8:
                negative += 1
        scores[k, 1] = positive
        scores[k, 2] = negative
        if positive < 2:
            scores[k, 0] = -1e9
            continue
        # One body moves as one; and what lies just outside and moves along is a part of it that was cut off.
        moves = BODY_PLAY + BODY_SHARE * wide
        scatter = max(suu - (su * su + sv * sv) / s, 0.0) / s
        cut = 0.0
        reach = CUT * wide
        for i in range(x.size):
            if (
                x[i] < x0 - reach
                or x[i] > x1 + reach
                or y[i] < max(y0 - reach, horizon + 2.0)
                or y[i] > y1 + reach
            ):
                continue
            if x0 - play <= x[i] <= x1 + play and y0 - play <= y[i] <= y1 + play:
                continue
            if evidence[i] > 0.8 and abs(u[i] - su / s) < moves and abs(v[i] - sv / s) < moves:
                cut += min(evidence[i], 4.0)
        size = np.log(wide / ((y1 - horizon) * USUAL)) / 0.3
        cost = misfit(s, sx, sy, sxx, syy, x0, y1, wide) + 0.5 * size * size + scatter / moves**2
        whole = s / (s + cut)
        scores[k, 0] = min(total, ENOUGH) * np.exp(-0.8 * cost) * whole * whole - wide * tall / (
            ROOM * max(1.0, wide / ROOM_WIDTH) ** 2
        )
    return scores


def windows_from_points(x: Floats, y: Floats, horizon: float) -> Floats:
    """Return windows (K, 4) around points (N,) that move like a vehicle: the point at several places of the rear."""
    below = y - horizon
    keep = below > 2.0
    x, below = x[keep], below[keep]
    lift = np.array([1.05, 1.25, 1.5, 1.85, 2.4])
    place = np.array([-0.4, -0.2, 0.0, 0.2, 0.4])
    contact = below[:, None, None] * lift[None, :, None] + np.zeros((1, 1, len(place)))
    wide = USUAL * contact
    middle = x[:, None, None] + place[None, None, :] * wide
    boxes = np.stack(
        [
            middle - 0.5 * wide,
            horizon + contact - 0.85 * wide,
            middle + 0.5 * wide,
            horizon + contact,
        ],
        -1,
    )
    return np.asarray(boxes.reshape(-1, 4))


def windows_from_segments(segments: Floats, horizon: float) -> Floats:
    """Return windows (K, 4) that stand on horizontal segments as wide as a vehicle at that row (its shadow, its bumper)."""
    x0, x1, y = segments[:, seg.X0], segments[:, seg.X1], segments[:, seg.Y]
    wide, contact = x1 - x0, y - horizon
    keep = (contact > 5.0) & (wide > SLIMMEST * contact) & (wide < WIDEST * contact)
    x0, x1, y, wide = x0[keep], x1[keep], y[keep], wide[keep]
    return np.stack([x0, y - 0.85 * wide, x1, y], 1)


def propose(
    windows: Floats,
    position: Floats,
    moved: Floats,
    evidence: Floats,
    horizon: float,
    *,
    least: float,
    most: int = 4,
) -> Floats:
    """Choose the windows that hold the most points that move like a vehicle.

    Args:
        windows: (K, 4) px.
        position: (N, 2) of the points that no vehicle owns.
        moved: (N, 2) how far they moved over the remembered time, px.
        evidence: (N,) their log odds.
        horizon: Row, px.
        least: Least sum of log odds.
        most: Windows returned at most; they do not overlap.

    Returns:
        (M, 4) windows, best first.
    """
    if not len(windows) or not len(position):
        return np.zeros((0, 4))
    x, y = np.ascontiguousarray(position.T)
    u, v = np.ascontiguousarray(moved.T)
    scores = _score(windows, x, y, u, v, evidence, horizon)
    good = (scores[:, 0] >= least) & (scores[:, 1] >= 2) & (scores[:, 1] >= 2.0 * scores[:, 2])
    chosen: list[Floats] = []
    for index in np.argsort(-scores[:, 0], kind="stable"):
        if not good[index] or len(chosen) == most:
            continue
        box = windows[index]
        if all(
            min(box[2], o[2]) <= max(box[0], o[0]) or min(box[3], o[3]) <= max(box[1], o[1]) for o in chosen
        ):
            chosen.append(box)
    return np.array(chosen).reshape(-1, 4)
