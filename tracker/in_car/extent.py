"""Where a vehicle begins and ends in the picture: its sides, roof and contact with the ground, from edges.

All sums over edges come from integral images, so that thousands of outlines can be weighed in a frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Rear of a vehicle: width over the height of the horizon above its contact row, i.e. metres over metres of
# camera height, and the standard deviation of its logarithm.
REAR, REAR_SPREAD = 1.5, 0.24
# The same bounds for the whole outline, which may show a side of the vehicle, too.
SLIMMEST, WIDEST = 0.85, 3.2
# Length of a vehicle over the camera's height: how much of its side is seen from another lane.
LENGTH = 3.5
# Height over width of a rear: a car's usual value and its spread; taller ones (vans, lorries) cost this much.
ASPECT, ASPECT_SPREAD, TALL = 0.77, 0.13, 2.0
# Greatest height over width.
TALLEST = 1.65
# What an edge of the frame counts in place of a vehicle's side.
FRAME_SIDE = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Relief:
    """Integral images (h + 1, w + 1) of a picture's edges, in half grey levels, and the scene's geometry.

    Attributes:
        across: Of the absolute steps from one column to the next.
        signed: Of the steps from one row to the next, positive where it gets brighter downward.
        down: Of their absolute values.
        horizon: Row, px.
        middle: Column of the focus of expansion, px.
        focal: Px.
    """

    across: NDArray[np.int32]
    signed: NDArray[np.int32]
    down: NDArray[np.int32]
    horizon: float
    middle: float
    focal: float


@njit(cache=True)
def _integrals(grey):  # type: ignore[no-untyped-def]
    """Sum up the edges in both directions (h + 1, w + 1, 3), the three sums of a place side by side."""
    height, width = grey.shape
    sums = np.empty((height + 1, width + 1, 3), np.int32)
    sums[0] = 0
    # Of each column down to the present row.
    across, signed, down = np.zeros(width, np.int32), np.zeros(width, np.int32), np.zeros(width, np.int32)
    inner = across[2 : width - 1]
    for i in range(height):
        here = grey[i]
        before, left, place, right = here[: width - 3], here[1 : width - 2], here[2 : width - 1], here[3:]
        for j in range(width - 3):
            inner[j] += abs(np.int32(place[j]) + np.int32(right[j]) - np.int32(left[j]) - np.int32(before[j]))
        if 2 <= i < height - 1:
            top, above, below = grey[i - 2], grey[i - 1], grey[i + 1]
            for j in range(width):
                step = np.int32(here[j]) + np.int32(below[j]) - np.int32(above[j]) - np.int32(top[j])
                signed[j] += step
                down[j] += abs(step)
        row = sums[i + 1]
        row[0] = 0
        a, s, d = np.int32(0), np.int32(0), np.int32(0)
        for j in range(width):
            a += across[j]
            s += signed[j]
            d += down[j]
            row[j + 1, 0] = a
            row[j + 1, 1] = s
            row[j + 1, 2] = d
    return sums


def make_relief(grey: NDArray[np.uint8], *, horizon: float, middle: float, focal: float) -> Relief:
    """Sum up the edges of a picture (h, w), which is at least four pixels wide."""
    across, signed, down = np.moveaxis(_integrals(grey), 2, 0)
    return Relief(across=across, signed=signed, down=down, horizon=horizon, middle=middle, focal=focal)


@njit(cache=True)
def _mean(sums, x0, y0, x1, y1):  # type: ignore[no-untyped-def]
    """Return the mean over columns [x0, x1) and rows [y0, y1), cut to the picture; 0 where that is empty.

    In grey levels: the sums count the halves of them.
    """
    height, width = sums.shape[0] - 1, sums.shape[1] - 1
    x0, x1 = min(max(x0, 0), width), min(max(x1, 0), width)
    y0, y1 = min(max(y0, 0), height), min(max(y1, 0), height)
    if x1 <= x0 or y1 <= y0:
        return 0.0
    total = sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0]
    return 0.5 * total / ((x1 - x0) * (y1 - y0))


@njit(cache=True)
def _side(across, column, top, bottom):  # type: ignore[no-untyped-def]
    """Return the strength of a vertical edge left of a column."""
    return _mean(across, column, top, column + 1, bottom)


@njit(cache=True)
def _best_side(across, place, top, bottom):  # type: ignore[no-untyped-def]
    """Return the strength of the strongest vertical edge within a pixel of a place."""
    best = 0.0
    for j in range(int(place + 0.5) - 1, int(place + 0.5) + 2):
        best = max(best, _side(across, j, top, bottom))
    return best


@njit(cache=True)
def _foot(signed, down, left, right, row, level):  # type: ignore[no-untyped-def]
    """Return how well a row is the lower end of a vehicle, about -1 to 3.

    The edge has to run from side to side: two vehicles and the road between them have none. Dark over bright
    (the shadow) is worth more than bright over dark.
    """
    wide = right - left
    least, total = 1e9, 0.0
    for part in range(4):
        first, last = left + (part * wide) // 4, left + ((part + 1) * wide) // 4
        step = _mean(signed, first, row, last, row + 1)
        value = min(max(step, -0.5 * step) / level, 4.0)
        least = min(least, value)
        total += 0.25 * value
    tall = max(2, int(0.18 * wide))
    gap = max(2, int(0.05 * wide))
    below = _mean(down, left, row + gap, right, row + gap + tall)
    above = _mean(down, left, row - gap - 2 * tall, right, row - gap)
    # The road below is smoother than the vehicle above.
    empty = min(below / (above + 0.5), 1.5)
    return 0.6 * least + 0.5 * total - 0.8 * empty


@njit(cache=True)
def rear_ratio(left, right, contact, middle, focal):  # type: ignore[no-untyped-def]
    """Return the width of the rear alone over the contact's height below the horizon.

    The side of a vehicle in another lane is seen between its rear and the middle of the picture: its front,
    LENGTH farther away, lies nearer to the focus of expansion.
    """
    inner = max(left - middle, 0.0) + max(middle - right, 0.0)
    return (right - left - inner * LENGTH * contact / focal) / contact


@njit(cache=True)
def _rear_columns(left, right, contact, middle, focal, width):  # type: ignore[no-untyped-def]
    """Return the columns between which the rear stands on its row: the side's foot rises from there."""
    share = min(LENGTH * contact / focal, 0.5)
    first = left + min(max(left - middle, 0.0) * share, 0.5 * (right - left))
    last = right - min(max(middle - right, 0.0) * share, 0.5 * (right - left))
    return int(max(first, 0.0)), int(min(last, width))


@njit(cache=True)
def _size_cost(left, right, contact, middle, focal, cut):  # type: ignore[no-untyped-def]
    """Cost of a width; a vehicle that is cut off by the frame may well be wider than it looks."""
    rear = rear_ratio(left, right, contact, middle, focal)
    if rear <= 0.2:
        return 12.0
    off = math.log(rear / REAR) / REAR_SPREAD
    if cut:
        off = max(off, 0.0)
    return min(0.5 * off * off, 12.0)


@njit(cache=True)
def clearness(across, signed, down, x0, x1, row, contact, middle, focal):  # type: ignore[no-untyped-def]
    """Return how clearly the picture shows an outline, 0 to 3.4, and the weaker of its sides."""
    width = across.shape[1] - 1
    wide = x1 - x0
    usual = REAR * contact
    top, bottom = int(row - 0.5 * usual), int(row - 0.08 * usual)
    level = _mean(across, int(x0 - 0.5 * wide), top, int(x1 + 0.5 * wide), bottom) + 2.0
    sides = np.zeros(2)
    for k in range(2):
        place = x0 if k == 0 else x1
        if place < 3.0 or place > width - 3.0:
            sides[k] = FRAME_SIDE
            continue
        sides[k] = min(_best_side(across, place, top, bottom) / level, 4.0)
    rows = _mean(down, int(x0), top, int(x1), int(row)) + 3.0
    foot = -1.0
    first, last = _rear_columns(x0, x1, contact, middle, focal, width)
    for i in range(int(row + 0.5) - 1, int(row + 0.5) + 2):
        foot = max(foot, _foot(signed, down, first, last, i, rows))
    weaker = min(sides[0], sides[1])
    # Without a foot there is no vehicle, but by night the ground is black and shows none.
    return (0.2 + 0.5 * min(weaker, 3.0)) * min(max(0.5 + 0.5 * foot, 0.3), 2.0), weaker


@njit(cache=True)
def outlines(across, signed, down, x, y, horizon, middle, focal, rows, limit):  # type: ignore[no-untyped-def]
    """Pair vertical edges a vehicle's width apart over every row where there is an edge to stand on.

    Args:
        across: See `Relief`.
        signed: Likewise.
        down: Likewise.
        x: (N,) px of the points that move like a vehicle.
        y: (N,).
        horizon: See `Relief`.
        middle: Likewise.
        focal: Likewise.
        rows: (R,) contact rows to try.
        limit: Outlines returned at most.

    Returns:
        (K, 4) x0, x1, row, clearness.
    """
    width = across.shape[1] - 1
    found = np.empty((limit, 4))
    used = 0
    sides = np.zeros(width + 1)
    counts = np.zeros(width + 1)
    places = np.zeros(width + 1, np.int64)
    for row in rows:
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
                least = min(least, int(x[k] - 1.8 * usual))
                most = max(most, int(x[k] + 1.8 * usual))
        if least >= most:
            continue
        for j in range(width):
            counts[j + 1] += counts[j]
        least, most = max(least, 0), min(most, width)
        for j in range(least, most + 1):
            sides[j] = _side(across, j, top, bottom)
        floor = _mean(across, least, top, most, bottom) + 1.0
        number = 0
        for j in range(least, most + 1):
            frame = j == 0 or j == width
            if frame or (
                2 < j < width - 2
                and j > least
                and j < most
                and sides[j] > floor
                and sides[j] >= sides[j - 1]
                and sides[j] > sides[j + 1]
            ):
                places[number] = j
                number += 1
        for a in range(number):
            left = places[a]
            for b in range(a + 1, number):
                right = places[b]
                wide = right - left
                if wide < 0.5 * usual:
                    continue
                if wide > 2.2 * usual or used == limit:
                    break
                if counts[right] - counts[left] < 2:
                    continue
                cut = left == 0 or right == width
                cost = _size_cost(left, right, contact, middle, focal, cut)
                if cost > 5.0:
                    continue
                clear, weaker = clearness(across, signed, down, left, right, row, contact, middle, focal)
                if clear < 0.35 or weaker < 0.5:
                    continue
                found[used, 0], found[used, 1], found[used, 2] = left, right, row
                found[used, 3] = clear * math.exp(-0.5 * cost)
                used += 1
    return found[:used]


@njit(cache=True)
def _beyond(share, free):  # type: ignore[no-untyped-def]
    """Cost of an edge that lies beyond the body's points by more than a free share of the width."""
    return min(max(share - free, 0.0) * 12.0, 4.0)


@njit(cache=True)
def _roof(across, signed, down, x0, x1, row, expected, play, body_top):  # type: ignore[no-untyped-def]
    """Return the row of the roof; ``expected`` above 0 pulls it there with the play ``play``."""
    width = signed.shape[1] - 1
    wide = x1 - x0
    left, right = int(max(x0 + 0.12 * wide, 0.0)), int(min(x1 - 0.12 * wide, width))
    first, last = int(max(row - TALLEST * wide, 2)), int(row - 0.5 * wide)
    level = _mean(down, left, first, right, int(row)) + 3.0
    best, roof = -1e9, row - ASPECT * wide
    for i in range(first, last):
        off = ((row - i) / wide - ASPECT) / ASPECT_SPREAD
        cost = 0.5 * off * off
        if off > 0.0:
            cost = min(cost, TALL)
        if play > 0.0:
            cost = 0.3 * cost + 0.5 * min(((i - expected) / play) ** 2, 9.0)
        least, total = 1e9, 0.0
        for part in range(3):
            a, b = left + (part * (right - left)) // 3, left + ((part + 1) * (right - left)) // 3
            value = min(abs(_mean(signed, a, i, b, i + 1)) / level, 4.0)
            least = min(least, value)
            total += value / 3.0
        # What moves with the vehicle lies under its roof.
        value = 0.5 * least + 0.7 * total - cost - _beyond((i - body_top) / wide, 0.04)
        if row - i > 0.9 * wide:
            # A tall one has tall sides, else the edge is a line of the background.
            bottom = int(row - 0.7 * wide)
            ground = _mean(across, int(x0 - 0.5 * wide), i, int(x1 + 0.5 * wide), bottom) + 2.0
            weaker = 3.0
            if x0 >= 3.0:
                weaker = min(weaker, _best_side(across, x0, i, bottom) / ground)
            if x1 <= width - 3.0:
                weaker = min(weaker, _best_side(across, x1, i, bottom) / ground)
            value += 1.0 * (weaker - 1.5)
        if value > best:
            best, roof = value, float(i)
    return roof


@njit(cache=True)
def _refine(across, signed, down, box, loose, body, horizon, middle, focal, log_width):  # type: ignore[no-untyped-def]
    height, width = across.shape[0] - 1, across.shape[1] - 1
    x0, y0, x1, y1 = box[0], box[1], box[2], box[3]
    wide = x1 - x0
    result = box.copy()
    play = loose * wide + 1.0
    contact = y1 - horizon
    usual = REAR * contact
    top, bottom = int(y1 - 0.5 * usual), int(y1 - 0.08 * usual)
    level = _mean(across, int(x0 - 0.5 * wide), top, int(x1 + 0.5 * wide), bottom) + 2.0
    reach = int(2.0 * play) + 1
    fixed_left, fixed_right = x0 < 3.0, x1 > width - 3.0
    best = -1e9
    for left in range(int(x0) - reach, int(x0) + reach + 2):
        if fixed_left and left != int(x0):
            continue
        strength_left = FRAME_SIDE
        if not fixed_left:
            if left < 2:
                continue
            strength_left = min(_side(across, left, top, bottom) / level, 4.0)
        for right in range(max(int(x1) - reach, left + 4), int(x1) + reach + 2):
            if fixed_right and right != int(x1):
                continue
            strength_right = FRAME_SIDE
            if not fixed_right:
                if right > width - 2:
                    continue
                strength_right = min(_side(across, right, top, bottom) / level, 4.0)
            size = (math.log((right - left) / contact) - log_width) / (loose + 0.02)
            # Both edges move: ends that shift are worth less than ends that stay.
            value = strength_left + strength_right
            value -= 0.25 * (((left - x0) / play) ** 2 + ((right - x1) / play) ** 2) + 0.4 * size * size
            value -= _beyond((left - body[0]) / wide, 0.03) + _beyond((body[2] - right) / wide, 0.03)
            if value > best:
                best = value
                if not fixed_left:
                    result[0] = float(left)
                if not fixed_right:
                    result[2] = float(right)
    first, last = _rear_columns(result[0], result[2], contact, middle, focal, width)
    rows = _mean(down, first, top, last, int(y1)) + 3.0
    best = -1e9
    for i in range(max(int(y1) - reach, int(horizon) + 3), min(int(y1) + reach + 2, height)):
        value = _foot(signed, down, first, last, i, rows) - 0.25 * ((i - y1) / play) ** 2
        value -= _beyond((body[3] - i) / wide, 0.03)
        size = (math.log((result[2] - result[0]) / (i - horizon)) - log_width) / (loose + 0.05)
        value -= 0.3 * size * size
        if value > best:
            best = value
            result[3] = float(i)
    if result[3] >= height - 3:
        result[3] = y1
    result[1] = _roof(across, signed, down, result[0], result[2], result[3], y0, 2.0 * play, body[1])
    return result


def refine(relief: Relief, box: Floats, *, loose: float, body: Floats, log_width: float) -> Floats:
    """Return the box (4,) that fits the edges around an expected one.

    Args:
        relief: Of the picture.
        box: (4,) where the vehicle is expected, px.
        loose: Play of the sides, as a share of the width.
        body: (4,) box of the points that are known to move with it.
        log_width: ln of the vehicle's width over the contact's height below the horizon.
    """
    found: Floats = _refine(
        relief.across,
        relief.signed,
        relief.down,
        box,
        loose,
        body,
        relief.horizon,
        relief.middle,
        relief.focal,
        log_width,
    )
    return found


def roof_row(relief: Relief, x0: float, x1: float, row: float, body_top: float) -> float:
    """Return the most likely row of the roof over an outline's sides and foot."""
    return float(_roof(relief.across, relief.signed, relief.down, x0, x1, row, 0.0, 0.0, body_top))


def clear(relief: Relief, box: Floats) -> float:
    """Return how clearly the picture shows a box (4,), as for the windows of `tracker.in_car.proposals`."""
    contact = max(float(box[3]) - relief.horizon, 1.0)
    value, _ = clearness(
        relief.across,
        relief.signed,
        relief.down,
        box[0],
        box[2],
        box[3],
        contact,
        relief.middle,
        relief.focal,
    )
    width = relief.across.shape[1] - 1
    cut = bool(box[0] < 3.0 or box[2] > width - 3.0)
    cost = _size_cost(box[0], box[2], contact, relief.middle, relief.focal, cut)
    return float(value * math.exp(-0.5 * cost))
