"""Where a vehicle may be: windows of a vehicle's size, filled with points that move like one."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car.extent import Relief, clear, outlines

Floats = NDArray[np.float64]

# How far around a window its cut-off parts are looked for, as a share of its width: less than the gap
# between two lanes.
CUT = 0.3
# Log odds beyond which more points add nothing: the picture's edges are to decide then.
ENOUGH = 10.0
# How far the points of one body may move apart over the remembered time: px, and as a share of its width.
BODY_PLAY, BODY_SHARE = 1.0, 0.02
# Where the points of a vehicle lie in its window, as shares of its width: their mean above the ground, with
# its play, and
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
        wide = x1 - x0
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
            scores[k, 0] = 0.0
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
        whole = s / (s + 0.5 * cut)
        filled = 0.3 + 0.7 * min(total, ENOUGH) / ENOUGH
        scores[k, 0] = filled * np.exp(-0.5 * min(scatter / moves**2, 4.0)) * whole if total > 0.0 else 0.0
    return scores


# Contact rows that are tried follow each other by this factor of their height below the horizon, and by at
# least a pixel.
ROW_STEP = 1.03
# Windows that are weighed in a frame at most: the clearest.
WEIGHED = 500


def windows_from_edges(
    relief: Relief, likely: Floats, nearest: float, farthest: float, *, limit: int = 8000
) -> tuple[Floats, Floats]:
    """Return windows between vertical edges that are a vehicle's width apart for their contact row.

    Args:
        relief: Of the picture.
        likely: (N, 2) points that move like a vehicle, below the horizon.
        nearest: Height of the horizon above the nearest contact row, px.
        farthest: Above the farthest one.
        limit: Windows looked at most.

    Returns:
        Windows (K, 4), and how clear their sides and foot are (K,).
    """
    height = len(relief.across) - 1
    rows = [relief.horizon + farthest]
    while rows[-1] < min(height - 1.0, relief.horizon + nearest):
        rows.append(
            relief.horizon + max((rows[-1] - relief.horizon) * ROW_STEP, rows[-1] - relief.horizon + 1)
        )
    x, y = np.ascontiguousarray(likely.T)
    found = outlines(
        relief.across,
        relief.signed,
        relief.down,
        x,
        y,
        relief.horizon,
        relief.middle,
        relief.focal,
        np.round(np.array(rows)),
        limit,
    )
    found = found[np.argsort(-found[:, 3], kind="stable")[:WEIGHED]]
    wide = found[:, 1] - found[:, 0]
    windows = np.stack([found[:, 0], found[:, 2] - 0.85 * wide, found[:, 1], found[:, 2]], 1)
    return windows, found[:, 3]


def propose(
    windows: Floats,
    clearness: Floats,
    position: Floats,
    moved: Floats,
    evidence: Floats,
    horizon: float,
    *,
    least: float,
    most: int = 4,
) -> tuple[Floats, Floats]:
    """Choose the windows that hold the most points that move like a vehicle.

    Args:
        windows: (K, 4) px.
        clearness: (K,) how clear their edges are.
        position: (N, 2) of the points that no vehicle owns.
        moved: (N, 2) how far they moved over the remembered time, px.
        evidence: (N,) their log odds.
        horizon: Row, px.
        least: Least worth.
        most: Windows returned at most; they do not overlap.

    Returns:
        (M, 4) windows, best first, and what each is worth (M,).
    """
    if not len(windows) or not len(position):
        return np.zeros((0, 4)), np.zeros(0)
    x, y = np.ascontiguousarray(position.T)
    u, v = np.ascontiguousarray(moved.T)
    scores = _score(windows, x, y, u, v, evidence, horizon)
    scores[:, 0] *= clearness
    good = (scores[:, 0] >= least) & (scores[:, 1] >= 2) & (scores[:, 1] >= 2.0 * scores[:, 2])
    chosen: list[Floats] = []
    worths: list[float] = []
    for index in np.argsort(-scores[:, 0], kind="stable"):
        if not good[index] or len(chosen) == most:
            continue
        box = windows[index]
        if all(
            min(box[2], o[2]) <= max(box[0], o[0]) or min(box[3], o[3]) <= max(box[1], o[1]) for o in chosen
        ):
            chosen.append(box)
            worths.append(float(scores[index, 0]))
    return np.array(chosen).reshape(-1, 4), np.array(worths)


def worth(
    box: Floats,
    relief: Relief,
    position: Floats,
    moved: Floats,
    evidence: Floats,
) -> float:
    """Return what a given box (4,) is worth, measured like the windows of `propose`."""
    x, y = np.ascontiguousarray(position.T)
    u, v = np.ascontiguousarray(moved.T)
    score = float(_score(box[None], x, y, u, v, evidence, relief.horizon)[0, 0])
    return score * clear(relief, box)
