"""Horizontal line segments: chains of edge pixels that run from left to right (paper 1, section III).

Bumpers, windows, plates, roof edges and the shadow beneath a vehicle give horizontal edges at every
distance. A general line
detector takes longer than a frame may; here the vertical derivative is thinned along the columns and its
maxima are chained from column to column, one pass over the picture.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Columns of the table of segments.
X0, X1, Y, STRENGTH, SIGN, RISE = range(6)

# Response of the 3 x 3 derivative to a step of one grey level.
STEP = 4.0


def vertical_derivative(grey: NDArray[np.uint8]) -> NDArray[np.int16]:
    """Return dI/dy (H, W) of a picture: positive where it gets brighter downward, `STEP` a grey level."""
    return np.asarray(cv2.Sobel(grey, cv2.CV_16S, 0, 1, ksize=3), np.int16)


def edge_threshold(
    derivative: NDArray[np.int16], *, floor: float = 5.0, spread: float = 3.0, ceiling: float = 16.0
) -> float:
    """Choose the least edge that counts, from how restless the picture is.

    Args:
        derivative: (H, W) vertical derivative.
        floor: Grey levels below which nothing counts, however calm (dark) the picture.
        spread: Multiple of the median magnitude: texture and noise stay below it.
        ceiling: Grey levels that always count.

    Returns:
        Threshold on the derivative's magnitude.
    """
    restless = float(np.median(np.abs(derivative[::5, ::5])))
    return float(np.clip(spread * restless, STEP * floor, STEP * ceiling))


@njit(cache=True)
def _chain(columns, threshold, slope, shortest, limit):  # type: ignore[no-untyped-def]
    """Chain edge maxima; ``columns`` is the derivative transposed, (W, H)."""
    width, height = columns.shape
    table = np.empty((limit, 6), np.float64)
    first_row = np.empty(limit, np.int32)
    count = np.zeros(limit, np.int32)
    total_rows = np.zeros(limit, np.float64)
    total_strength = np.zeros(limit, np.float64)
    last_column = np.zeros(limit, np.int32)
    last_row = np.zeros(limit, np.int32)
    start_column = np.zeros(limit, np.int32)
    sign = np.zeros(limit, np.int8)
    labels = np.full((3, height), -1, np.int32)
    used = 0
    for column in range(width):
        now, before, earlier = column % 3, (column + 2) % 3, (column + 1) % 3
        labels[now, :] = -1
        for row in range(1, height - 1):
            value = columns[column, row]
            size = abs(value)
            if size < threshold:
                continue
            rising = 1 if value > 0 else -1
            if size < rising * columns[column, row - 1] or size <= rising * columns[column, row + 1]:
                continue
            found = -1
            for back in (before, earlier):
                for offset in (0, -1, 1):
                    candidate = row + offset
                    if candidate < 0 or candidate >= height:
                        continue
                    label = labels[back, candidate]
                    if label < 0 or sign[label] != rising or last_column[label] == column:
                        continue
                    reach = 1.0 + slope * (column - start_column[label])
                    if abs(row - first_row[label]) <= reach:
                        found = label
                        break
                if found >= 0:
                    break
            if found < 0:
                if used == limit:
                    continue
                found = used
                used += 1
                start_column[found] = column
                first_row[found] = row
                sign[found] = rising
                count[found] = 0
                total_rows[found] = 0.0
                total_strength[found] = 0.0
            labels[now, row] = found
            last_column[found] = column
            last_row[found] = row
            count[found] += 1
            total_rows[found] += row
            total_strength[found] += size
    kept = 0
    for label in range(used):
        if last_column[label] + 1 - start_column[label] < shortest:
            continue
        table[kept, 0] = start_column[label]
        table[kept, 1] = last_column[label] + 1
        table[kept, 2] = total_rows[label] / count[label] + 0.5
        table[kept, 3] = total_strength[label] / count[label]
        table[kept, 4] = sign[label]
        table[kept, 5] = last_row[label] - first_row[label]
        kept += 1
    return table[:kept]


def find_segments(
    derivative: NDArray[np.int16],
    threshold: float,
    *,
    slope: float = 0.2,
    shortest: int = 8,
    limit: int = 6000,
) -> Floats:
    """Find near-horizontal segments.

    Args:
        derivative: (H, W) vertical derivative.
        threshold: Least magnitude of an edge pixel (`edge_threshold`).
        slope: Greatest rise over run, beside one pixel of play.
        shortest: Least length, px.
        limit: Chains that are followed at most; further ones are left out.

    Returns:
        (M, 6): x0, x1 (half-open, px), mean y (px), mean magnitude of the derivative, its sign (1: brighter
        below, like
        the lower edge of a shadow), and the rise in rows from end to end.
    """
    columns = np.ascontiguousarray(cv2.transpose(derivative))
    found: Floats = _chain(columns, threshold, slope, shortest, limit)
    return found
