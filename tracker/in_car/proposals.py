"""Where a vehicle may be: windows of a vehicle's size, filled with points that move like one."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Width over the height of the horizon above the contact row: metres of width over metres of camera height.
SLIMMEST, USUAL, WIDEST = 0.85, 1.55, 2.6


# Room that a point takes on a vehicle up to so wide (px), px^2 a point: a window much larger than its
# points' room is none.
# Wider vehicles have no more points: they are near, where the grid of corners is coarse.
ROOM, ROOM_WIDTH = 200.0, 60.0


# How far around a window its cut-off parts are looked for, as a share of its width: less than the gap
# between two lanes.
CUT = 0.5
# Log odds beyond which more points add nothing: how well they fill a window is to decide, not how many they
# are.
ENOUGH = 60.0
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
        cost = 0.35 * misfit(s, sx, sy, sxx, syy, x0, y1, wide) + 0.5 * size * size + scatter / moves**2
        whole = s / (s + cut)
        scores[k, 0] = min(total, ENOUGH) * np.exp(-0.8 * cost) * whole**4 - wide * tall / (
            ROOM * max(1.0, wide / ROOM_WIDTH) ** 2
        )
    return scores


# Contact rows that are tried follow each other by this factor of their height below the horizon.
ROW_STEP = 1.14
# Least and greatest width that is tried, as multiples of the usual one.
WIDTHS = (0.65, 1.5)


@njit(cache=True)
def _edge_windows(grey, x, y, horizon, rows, ratios, limit):  # type: ignore[no-untyped-def]
    """Pair vertical edges a vehicle's width apart, at each contact row.

    Where there is a likely point between them.
    """
    height, width = grey.shape
    windows = np.empty((limit, 4))
    clear = np.empty(limit)
    used = 0
    sides = np.zeros(width)
    ground = np.zeros((5, width + 1))
    for row in rows:
        contact = row - horizon
        usual = USUAL * contact
        top, bottom = int(max(row - 0.55 * usual, 1)), int(min(row - 0.1 * usual, height - 1))
        if bottom - top < 2:
            continue
        # Columns with a likely point that could lie in a window standing on this row.
        least, most = width, -1
        for k in range(x.size):
            if row - usual < y[k] <= row + 1:
                least = min(least, int(x[k] - 1.5 * usual))
                most = max(most, int(x[k] + 1.5 * usual))
        least, most = max(least, 1), min(most, width - 1)
        if most - least < 4:
            continue
        skip = max(1, (bottom - top) // 16)
        mean = 0.0
        for j in range(least, most):
            total, count = 0.0, 0
            for i in range(top, bottom, skip):
                total += abs(float(grey[i, j]) - float(grey[i, j - 1]))
                count += 1
            sides[j] = total / count
            mean += sides[j]
        mean = mean / (most - least) + 1.0
        for offset in range(5):
            i = min(max(int(row) + offset - 2, 1), height - 2)
            for j in range(least, most):
                ground[offset, j + 1] = ground[offset, j] + float(grey[i + 1, j]) - float(grey[i - 1, j])
        for left in range(least + 1, most - 1):
            # A side is a local maximum.
            if sides[left] < 0.8 * mean or sides[left] < sides[left - 1] or sides[left] <= sides[left + 1]:
                continue
            for right in range(
                left + int(usual * ratios[0]), min(left + int(usual * ratios[-1]) + 2, most - 1)
            ):
                if (
                    sides[right] < 0.8 * mean
                    or sides[right] < sides[right - 1]
                    or sides[right] <= sides[right + 1]
                ):
                    continue
                within = 0
                for k in range(x.size):
                    if left <= x[k] <= right and row - usual < y[k] <= row + 1:
                        within += 1
                if within < 2 or used == limit:
                    continue
                wide = float(right - left)
                foot = 0.0
                for offset in range(5):
                    foot = max(foot, (ground[offset, right] - ground[offset, left]) / wide)
                windows[used, 0] = left
                windows[used, 1] = row - 0.85 * wide
                windows[used, 2] = right
                windows[used, 3] = row
                clear[used] = min(min(sides[left], sides[right]) / mean, 3.0) / 3.0 + 0.5 * min(
                    foot / 20.0, 1.0
                )
                used += 1
    return windows[:used], clear[:used]


def windows_from_edges(
    grey: NDArray[np.uint8],
    likely: Floats,
    horizon: float,
    nearest: float,
    farthest: float,
    *,
    limit: int = 6000,
) -> tuple[Floats, Floats]:
    """Return windows between vertical edges that are a vehicle's width apart for their contact row.

    Args:
        grey: (h, w).
        likely: (N, 2) points that move like a vehicle, below the horizon.
        horizon: Row, px.
        nearest: Height of the horizon above the nearest contact row, px.
        farthest: Above the farthest one.
        limit: Windows returned at most.

    Returns:
        Windows (K, 4), and how clear their sides and foot are (K,), about 0.3 to 1.5.
    """
    steps = int(np.ceil(np.log(nearest / farthest) / np.log(ROW_STEP))) + 1
    rows = horizon + farthest * ROW_STEP ** np.arange(steps)
    rows = rows[rows < len(grey)]
    x, y = np.ascontiguousarray(likely.T)
    found: tuple[Floats, Floats] = _edge_windows(grey, x, y, horizon, rows, np.array(WIDTHS), limit)
    return found


def propose(
    windows: Floats,
    clear: Floats,
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
        clear: (K,) how clear their edges are.
        position: (N, 2) of the points that no vehicle owns.
        moved: (N, 2) how far they moved over the remembered time, px.
        evidence: (N,) their log odds.
        horizon: Row, px.
        least: Least sum of log odds.
        most: Windows returned at most; they do not overlap.

    Returns:
        (M, 4) windows, best first, and what each is worth (M,).
    """
    if not len(windows) or not len(position):
        return np.zeros((0, 4)), np.zeros(0)
    x, y = np.ascontiguousarray(position.T)
    u, v = np.ascontiguousarray(moved.T)
    scores = _score(windows, x, y, u, v, evidence, horizon)
    scores[:, 0] *= np.where(scores[:, 0] > 0, clear, 1.0)
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


@njit(cache=True)
def _edge_clearness(grey, x0, x1, row, usual):  # type: ignore[no-untyped-def]
    height, width = grey.shape
    top, bottom = int(max(row - 0.55 * usual, 1)), int(min(row - 0.1 * usual, height - 1))
    least, most = int(max(x0 - 0.5 * usual, 1)), int(min(x1 + 0.5 * usual, width - 1))
    if bottom - top < 2 or most - least < 4:
        return 0.0
    mean, left, right = 0.0, 0.0, 0.0
    for j in range(least, most):
        total = 0.0
        for i in range(top, bottom):
            total += abs(float(grey[i, j]) - float(grey[i, j - 1]))
        total /= bottom - top
        mean += total
        if abs(j - x0) <= 2:
            left = max(left, total)
        if abs(j - x1) <= 2:
            right = max(right, total)
    mean = mean / (most - least) + 1.0
    foot = 0.0
    for offset in range(-2, 3):
        i = min(max(int(row) + offset, 1), height - 2)
        total = 0.0
        for j in range(max(int(x0), 0), min(int(x1), width)):
            total += float(grey[i + 1, j]) - float(grey[i - 1, j])
        foot = max(foot, total / max(x1 - x0, 1.0))
    return (0.2 + min(min(left, right) / mean, 4.0) / 4.0) * (0.5 + min(foot / 25.0, 1.0))


def worth(
    box: Floats,
    grey: NDArray[np.uint8],
    position: Floats,
    moved: Floats,
    evidence: Floats,
    horizon: float,
) -> float:
    """Return what a given box (4,) is worth, measured like the windows of `propose`."""
    x, y = np.ascontiguousarray(position.T)
    u, v = np.ascontiguousarray(moved.T)
    score = float(_score(box[None], x, y, u, v, evidence, horizon)[0, 0])
    return score * float(_edge_clearness(grey, box[0], box[2], box[3], USUAL * (box[3] - horizon)))
