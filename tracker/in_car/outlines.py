"""Where a vehicle may stand: pairs of vertical edges, a vehicle's width apart for their contact row."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car.relief import ACROSS, DOWN, SIGNED, Relief, mean

Floats = NDArray[np.float64]

# Rear of a vehicle: width over the height of the horizon above its contact row, i.e. metres over metres of
# camera height, and the standard deviation of its logarithm.
REAR, REAR_SPREAD = 1.5, 0.24
# Length of a vehicle over the camera's height: how much of its side is seen from another lane.
LENGTH = 3.5
# What an edge of the frame counts in place of a vehicle's side.
FRAME_SIDE = 1.5
# Height over width of a car's rear and its spread, and of a van's or lorry's; the bounds of all, and between.
ASPECT, ASPECT_SPREAD = 0.77, 0.13
TALL_ASPECT, TALL_SPREAD = 1.25, 0.3
LOWEST, DIVIDE, TALLEST = 0.5, 0.95, 1.65
# Contact rows that are tried follow each other by this factor of their height below the horizon.
ROW_STEP = 1.03
# Least distance of two edges, as a share of a usual vehicle's width.
APART = 0.04
# Pairs of edges over a row that get their foot looked at, and those that are returned.
PAIRS, KEPT = 30, 8


@njit(cache=True)
def rear_edges(x0, x1, contact, middle, focal):  # type: ignore[no-untyped-def]
    """Return the columns between which the rear stands on its row.

    The side of a vehicle in another lane is seen between its rear and the middle of the picture: its front,
    LENGTH farther away, lies nearer to the focus of expansion, and its foot rises from the rear on.
    """
    share = LENGTH * contact / focal
    return x0 + max(x0 - middle, 0.0) * share, x1 - max(middle - x1, 0.0) * share


@njit(cache=True)
def rear_width(x0, x1, contact, middle, focal, width):  # type: ignore[no-untyped-def]
    """Return the width of the rear; where the frame cuts the vehicle off it is no less than usual."""
    a, b = rear_edges(x0, x1, contact, middle, focal)
    cut = x0 < 3.0 or x1 > width - 3.0
    return max(b - a, (1.0 if cut else 0.4) * REAR * contact)


@njit(cache=True)
def side(sums, place, top, bottom):  # type: ignore[no-untyped-def]
    """Return the strength of the strongest vertical edge within a pixel of a place, in grey levels."""
    best = 0.0
    for j in range(int(place + 0.5) - 1, int(place + 0.5) + 2):
        best = max(best, mean(sums, ACROSS, j, top, j + 1, bottom))
    return best


@njit(cache=True)
def _divide(left, right, width, borders, scales):  # type: ignore[no-untyped-def]
    """Divide columns [left, right), cut to the picture, into equal parts.

    Writes the borders (P + 1,), and what makes a part's sum a mean in grey levels (P,).
    """
    parts = scales.size
    for part in range(parts + 1):
        borders[part] = min(max(left + (part * (right - left)) // parts, 0), width)
    for part in range(parts):
        scales[part] = 0.5 / max(borders[part + 1] - borders[part], 1)


@njit(cache=True)
def _sums_to(sums, row, borders, before):  # type: ignore[no-untyped-def]
    """Sum the steps of each part (P,) over the rows above a row."""
    place = min(max(row, 0), sums.shape[1] - 1)
    for part in range(before.size):
        before[part] = sums[SIGNED, place, borders[part + 1]] - sums[SIGNED, place, borders[part]]


@njit(cache=True)
def _next_step(sums, row, borders, before, part):  # type: ignore[no-untyped-def]
    """Return the sum of a part's steps at a row, and carry that over the rows above on to the next."""
    place = min(max(row + 1, 0), sums.shape[1] - 1)
    now = sums[SIGNED, place, borders[part + 1]] - sums[SIGNED, place, borders[part]]
    gain = now - before[part]
    before[part] = now
    return gain


@njit(cache=True)
def foot(sums, left, right, row, play, level):  # type: ignore[no-untyped-def]
    """Return the row within ``play`` of ``row`` that is the likeliest lower end of a vehicle.

    And how strong the edge is there: its weakest part, and its mean. It has to run from side to side: two
    vehicles and the road between them have none. Dark over bright (the shadow) is worth more than bright over
    dark.
    """
    borders, before, scales = np.empty(5, np.int64), np.empty(4, np.int64), np.empty(4)
    _divide(left, right, sums.shape[2] - 1, borders, scales)
    _sums_to(sums, int(row) - play, borders, before)
    scales /= level
    best, best_least, best_mean = int(row), -1.0, -1.0
    for i in range(int(row) - play, int(row) + play + 1):
        least, total = 1e9, 0.0
        for part in range(4):
            step = scales[part] * _next_step(sums, i, borders, before, part)
            value = min(max(step, -0.5 * step), 4.0)
            least = min(least, value)
            total += 0.25 * value
        if least + total > best_least + best_mean:
            best, best_least, best_mean = i, least, total
    return best, best_least, best_mean


@njit(cache=True)
def roof(sums, x0, x1, row, rear, body_top, tall):  # type: ignore[no-untyped-def]
    """Return the likeliest row of the roof over a vehicle's sides and foot, and how strong the edge is there.

    Args:
        sums: See `Relief`.
        x0: Px.
        x1: Px.
        row: Of the contact with the ground.
        rear: Width of the vehicle's rear, to which its height is in proportion.
        body_top: Row of the highest point that moves with the vehicle: it lies under the roof.
        tall: Whether a van's or a lorry's roof is sought, or a car's.
    """
    width = sums.shape[2] - 1
    wide = x1 - x0
    left, right = int(max(x0 + 0.12 * wide, 0.0)), int(min(x1 - 0.12 * wide, width))
    usual, spread = (TALL_ASPECT, TALL_SPREAD) if tall else (ASPECT, ASPECT_SPREAD)
    first = int(max(row - (TALLEST if tall else DIVIDE) * rear, 2))
    last = int(row - (DIVIDE if tall else LOWEST) * rear)
    level = mean(sums, DOWN, left, first, right, int(row)) + 3.0
    borders, before, scales = np.empty(4, np.int64), np.empty(3, np.int64), np.empty(3)
    _divide(left, right, width, borders, scales)
    _sums_to(sums, first, borders, before)
    scales /= level
    best, found, strength = -1e9, row - usual * rear, 0.0
    per_rear, per_spread, third = 1.0 / rear, 1.0 / spread, 1.0 / 3.0
    for i in range(first, last):
        off = ((row - i) * per_rear - usual) * per_spread
        least, total = 1e9, 0.0
        for part in range(3):
            value = min(scales[part] * abs(_next_step(sums, i, borders, before, part)), 4.0)
            least = min(least, value)
            total += third * value
        beyond = min(max((i - body_top) * per_rear - 0.04, 0.0) * 12.0, 4.0)
        value = 0.5 * least + 0.7 * total - 0.5 * off * off - beyond
        if value > best:
            best, found, strength = value, float(i), 0.5 * (least + total)
    return found, strength


@njit(cache=True)
def _strengths(sums, least, most, top, bottom, strength):  # type: ignore[no-untyped-def]
    """Write the mean vertical edge over rows [top, bottom) of columns [least, most]; 0 beyond the picture."""
    height, width = sums.shape[1] - 1, sums.shape[2] - 1
    top, bottom = min(max(top, 0), height), min(max(bottom, 0), height)
    below, above = sums[ACROSS, bottom], sums[ACROSS, top]
    before = below[least] - above[least]
    scale = 0.5 / max(bottom - top, 1)
    for j in range(least, most + 1):
        now = below[min(j + 1, width)] - above[min(j + 1, width)]
        strength[j] = scale * (now - before)
        before = now


@njit(cache=True)
def _pairs(sums, x, y, horizon, middle, focal, rows, limit):  # type: ignore[no-untyped-def]
    """Pair vertical edges over every row: (K, 5) x0, x1, row, promise, number of the row."""
    width = sums.shape[2] - 1
    found = np.empty((limit, 5))
    used = 0
    strength, counts = np.zeros(width + 1), np.zeros(width + 2)
    places = np.zeros(width + 1, np.int64)
    for number_of_row, row in enumerate(rows):
        contact = row - horizon
        usual = REAR * contact
        top, bottom = int(row - 0.5 * usual), int(row - 0.08 * usual)
        if bottom - top < 2:
            continue
        counts[:] = 0.0
        least, most = width, 0
        for k in range(x.size):
            if row - 1.3 * usual < y[k] <= row + 1:
                counts[int(x[k]) + 1] += 1
                least = min(least, int(x[k] - 2.2 * usual))
                most = max(most, int(x[k] + 2.2 * usual))
        if least >= most:
            continue
        for j in range(width):
            counts[j + 1] += counts[j]
        least, most = max(least, 0), min(most, width)
        _strengths(sums, least, most, top, bottom, strength)
        floor = mean(sums, ACROSS, least, top, most, bottom) + 1.0
        number = 0
        apart = max(1, int(APART * usual))
        for j in range(least, most + 1):
            if 2 < j < width - 2:
                # The strongest edge of its neighbourhood.
                if strength[j] <= 0.7 * floor:
                    continue
                strongest = True
                for i in range(max(j - apart, least), min(j + apart, most) + 1):
                    if strength[i] > strength[j] or (strength[i] == strength[j] and i < j):
                        strongest = False
                        break
                if not strongest:
                    continue
            elif j == 0 or j == width:
                strength[j] = FRAME_SIDE * (floor + 1.0)
            else:
                continue
            places[number] = j
            number += 1
        share = LENGTH * contact / focal
        for a in range(number):
            left = places[a]
            for b in range(a + 1, number):
                right = places[b]
                wide = right - left
                if wide < 0.5 * usual:
                    continue
                if wide > 2.4 * usual or used == limit:
                    break
                points = counts[right] - counts[left]
                if points < 1:
                    continue
                rear = wide - share * (max(left - middle, 0.0) + max(middle - right, 0.0))
                off = math.log(max(rear / usual, 0.05)) / REAR_SPREAD
                if left == 0 or right == width:
                    # Cut off by the frame it may well be wider than it looks.
                    off = max(off, 0.0)
                if abs(off) > 3.5:
                    continue
                level = mean(sums, ACROSS, int(left - 0.5 * wide), top, int(right + 0.5 * wide), bottom) + 2.0
                one, other = min(strength[left] / level, 3.0), min(strength[right] / level, 3.0)
                promise = 0.2 + 0.35 * min(one, other) + 0.15 * max(one, other)
                promise *= math.exp(-0.25 * off * off) * (0.4 + 0.12 * min(points, 5.0))
                if promise < 0.12:
                    continue
                found[used, 0], found[used, 1], found[used, 2] = left, right, row
                found[used, 3], found[used, 4] = promise, number_of_row
                used += 1
    return found[:used]


@njit(cache=True)
def _with_feet(sums, pairs, horizon, middle, focal):  # type: ignore[no-untyped-def]
    """Put pairs (K, 5) on the feet next to their rows, and multiply in what these promise, in place."""
    width = sums.shape[2] - 1
    for k in range(len(pairs)):
        x0, x1, row = pairs[k, 0], pairs[k, 1], pairs[k, 2]
        contact = row - horizon
        a, b = rear_edges(x0, x1, contact, middle, focal)
        left, right = int(max(a, 0.0)), int(min(b, width))
        right = max(right, left + 4)
        level = mean(sums, DOWN, left, int(row - 0.5 * REAR * contact), right, int(row)) + 3.0
        play = max(1, int(0.5 * (ROW_STEP - 1.0) * contact + 0.5))
        best, least, total = foot(sums, left, right, row, play, level)
        pairs[k, 2] = best
        pairs[k, 3] *= min(max(0.5 + 0.3 * least + 0.25 * total, 0.3), 2.0)


def outlines(relief: Relief, likely: Floats, farthest: float) -> Floats:
    """Return the most promising outlines (K, 3) x0, x1, contact row.

    Args:
        relief: Of the picture.
        likely: (N, 2) points that move like a vehicle, below the horizon.
        farthest: Height of the horizon above the farthest contact row, px.
    """
    nearest = relief.shape[0] - 1.0 - relief.horizon
    heights = [farthest]
    while heights[-1] < nearest:
        heights.append(max(heights[-1] * ROW_STEP, heights[-1] + 1.0))
    x, y = np.ascontiguousarray(likely.T)
    scene = relief.horizon, relief.middle, relief.focal
    rows = np.round(relief.horizon + np.array(heights))
    pairs = _best(_pairs(relief.sums, x, y, *scene, rows, 40_000), PAIRS)
    _with_feet(relief.sums, pairs, *scene)
    found = _best(pairs, KEPT)[:, :3]
    # Neighbouring rows may come to the same foot.
    width = relief.shape[1]
    number = (found[:, 2] * (width + 1) + found[:, 0]) * (width + 1) + found[:, 1]
    _, first = np.unique(number, return_index=True)
    return np.ascontiguousarray(found[np.sort(first)])


@njit(cache=True)
def _best(pairs, most):  # type: ignore[no-untyped-def]
    """Return the most promising of (K, 5) in each row, best first: far vehicles promise less than near ones.

    The pairs come row by row.
    """
    kept = np.empty_like(pairs)
    first = used = 0
    for k in range(len(pairs)):
        if k > 0 and pairs[k, 4] != pairs[k - 1, 4]:
            first = used
        if used - first == most:
            if pairs[k, 3] <= kept[used - 1, 3]:
                continue
            used -= 1
        place = used
        while place > first and kept[place - 1, 3] < pairs[k, 3]:
            kept[place] = kept[place - 1]
            place -= 1
        kept[place] = pairs[k]
        used += 1
    return kept[:used]
