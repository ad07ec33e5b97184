"""Where a vehicle begins and ends in the picture: its sides, roof and contact with the ground, from edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Height over width of a vehicle's rear: a car's usual value and its spread; taller ones (vans, lorries)
# cost this much.
ASPECT, ASPECT_SPREAD, TALL = 0.82, 0.16, 1.2
# Greatest height over width.
TALLEST = 1.65


@dataclass(frozen=True, slots=True)
class Extent:
    """A box and how clearly the picture shows it.

    Attributes:
        box: (4,) x0, y0, x1, y1, px.
        sides: Edge strength at the two sides over the mean inside, the weaker of the two.
        foot: The same for the contact with the ground.
    """

    box: Floats
    sides: float
    foot: float


@njit(cache=True)
def _beyond(share, free):  # type: ignore[no-untyped-def]
    """Cost of an edge that lies beyond the body's points by more than a free share of the width."""
    return min(max(share - free, 0.0) * 12.0, 5.0)


@njit(cache=True)
def _fit(grey, x0, y0, x1, y1, loose, body):  # type: ignore[no-untyped-def]
    """Search sides, foot and roof around a predicted box.

    ``loose`` is the play as a share of the width, ``body`` the box of the points that move with the vehicle.
    """
    height, width = grey.shape
    wide, tall = x1 - x0, y1 - y0
    step = max(1, int(wide / 40))
    play = loose * wide + 1.5
    left_from, right_to = int(max(x0 - play - 1, 1)), int(min(x1 + play + 1, width - 2))
    rows_from, rows_to = int(max(y1 - 0.75 * tall, 1)), int(min(y1 - 0.06 * tall, height - 2))
    result = np.empty(6)
    result[0], result[1], result[2], result[3], result[4], result[5] = x0, y0, x1, y1, 0.0, 0.0
    if right_to - left_from < 5 or rows_to - rows_from < 3:
        return result
    count = right_to - left_from + 1
    column = np.zeros(count)
    for j in range(left_from, right_to + 1):
        total = 0.0
        for i in range(rows_from, rows_to, step):
            total += abs(float(grey[i, j + 1]) - float(grey[i, j - 1]))
        column[j - left_from] = total
    mean = column.mean() + 2.0 * (rows_to - rows_from) / step
    best, best_l, best_r = -1e9, -1.0, -1.0
    for left in range(max(int(x0 - play), left_from), min(int(x0 + play) + 1, right_to)):
        for right in range(max(int(x1 - play), left + 4), min(int(x1 + play) + 1, right_to)):
            size = np.log((right - left + 1.0) / wide) / (0.6 * loose + 0.03)
            shift = (0.5 * (left + right + 1) - 0.5 * (x0 + x1)) / (0.7 * play)
            value = (
                min(column[left - left_from] / mean, 4.0)
                + min(column[right - left_from] / mean, 4.0)
                - 0.5 * size * size
                - 0.5 * shift * shift
                - _beyond((body[0] - left) / wide, 0.25)
                - _beyond((right - body[2]) / wide, 0.25)
                - _beyond((left - body[0]) / wide, 0.03)
                - _beyond((body[2] - right) / wide, 0.03)
            )
            if value > best:
                best, best_l, best_r = value, left, right
    left_edge, right_edge = x0, x1
    if best_l >= 0:
        a, b = int(best_l), int(best_r)
        left_edge, right_edge = a + 0.5, b + 0.5
        result[4] = min(column[a - left_from], column[b - left_from]) / mean
    result[0], result[2] = left_edge, right_edge
    wide = right_edge - left_edge
    # Rows: mean derivative over the inner columns.
    inner_from = int(max(left_edge + 0.12 * wide, 1))
    inner_to = int(min(right_edge - 0.12 * wide, width - 2))
    if inner_to - inner_from < 3:
        return result
    top = int(max(y1 - TALLEST * wide - play, 1))
    bottom = int(min(y1 + play + 1, height - 2))
    if bottom - top < 4:
        return result
    rows = np.zeros(bottom - top + 1)
    for i in range(top, bottom + 1):
        total = 0.0
        number = 0
        for j in range(inner_from, inner_to + 1, step):
            total += float(grey[i + 1, j]) - float(grey[i - 1, j])
            number += 1
        rows[i - top] = total / number
    level = 3.0
    for value in rows:
        level += abs(value) / rows.size
    best, foot = -1e9, -1
    for i in range(max(int(y1 - play), top), bottom + 1):
        shift = (i + 0.5 - y1) / (0.7 * play)
        # The ground is brighter than the shadow on it; at the contact any edge is better than none.
        edge = rows[i - top]
        value = min(max(edge, -0.4 * edge) / level, 4.0) - 0.5 * shift * shift
        value -= _beyond((body[3] - i) / wide, 0.03) + _beyond((i - body[3]) / wide, 0.4)
        if value > best:
            best, foot = value, i
    if foot >= 0:
        result[3] = foot + 0.5
        result[5] = rows[foot - top] / level
    foot_row = result[3]
    best, crown = -1e9, -1
    for i in range(top, int(max(foot_row - 0.5 * wide, top + 1))):
        aspect = (foot_row - i - 0.5) / wide
        off = (aspect - ASPECT) / ASPECT_SPREAD
        cost = min(0.5 * off * off, TALL) if off > 0 else 0.5 * off * off
        moved = (i + 0.5 - y0) / (0.7 * play)
        cost += 0.25 * min(moved * moved, 9.0)
        cost += _beyond((i - body[1]) / wide, 0.03) + _beyond((body[1] - i) / wide, 0.25)
        value = min(abs(rows[i - top]) / level, 4.0) - cost
        if value > best:
            best, crown = value, i
    if crown >= 0:
        result[1] = crown + 0.5
    return result


def fit_extent(grey: NDArray[np.uint8], box: Floats, *, loose: float, body: Floats) -> Extent:
    """Fit a box to the edges around it.

    Args:
        grey: (h, w).
        box: (4,) where the vehicle is expected, px.
        loose: How far an edge may lie from there, as a share of the width.
        body: (4,) box of the points that are known to move with it.

    Returns:
        The best box, with its clearness.
    """
    found = _fit(grey, box[0], box[1], box[2], box[3], loose, body)
    return Extent(box=found[:4], sides=float(found[4]), foot=float(found[5]))
