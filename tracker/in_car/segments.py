"""Horizontal line segments: chains of edge pixels that run from left to right (paper 1, section III).

Bumpers, windows, plates, roof edges and the shadow beneath a vehicle give horizontal edges at every distance.
A general line detector takes longer than a frame may; here the vertical derivative is thinned along the
columns and its maxima are chained from column to column, one pass over the picture.
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
    # The median, by counting.
    counts = np.cumsum(np.bincount(np.abs(derivative[::5, ::5]).ravel()))
    half = counts[-1] / 2
    restless = 0.5 * (np.searchsorted(counts, half) + np.searchsorted(counts, half, side="right"))
    return float(np.clip(spread * restless, STEP * floor, STEP * ceiling))


# Columns of the table of chains while they grow: two rows and columns, and sums.
_START, _FIRST, _LAST, _LAST_ROW, _SIGN, _COUNT, _ROWS, _SIZES = range(8)


@njit(cache=True)
def _continues(chains, label, sign, column, row, slope):  # type: ignore[no-untyped-def]
    """Tell whether an edge maximum carries on a chain; label -1 is none."""
    return (
        label >= 0
        and chains[label, _SIGN] == sign
        and chains[label, _LAST] != column
        and abs(row - chains[label, _FIRST]) <= 1.0 + slope * (column - chains[label, _START])
    )


@njit(cache=True)
def _chain(columns, least, slope, shortest, limit):  # type: ignore[no-untyped-def]
    """Chain edge maxima; ``columns`` is the derivative transposed, (W, H)."""
    width, height = columns.shape
    # Marks are looked through eight at a time.
    marks = np.zeros((height + 7) // 8 * 8, np.uint8)
    eights, inner = marks.view(np.uint64), marks[1 : height - 1]
    maxima = np.empty(marks.size + 1, np.int64)
    chains = np.empty((limit, 8), np.int32)
    # Of the last three columns, with a row to spare above and below.
    labels = np.full((3, height + 2), -1, np.int32)
    used = 0
    for column in range(width):
        values = columns[column]
        above, here, below = values[: height - 2], values[1 : height - 1], values[2:]
        for i in range(height - 2):
            brighter = (here[i] >= least) & (here[i] >= above[i]) & (here[i] > below[i])
            darker = (here[i] <= -least) & (here[i] <= above[i]) & (here[i] < below[i])
            inner[i] = np.uint8(brighter | darker)
        number = 0
        for k in range(eights.size):
            if eights[k] != 0:
                # Without a branch, which would be guessed wrongly as often as not.
                for row in range(8 * k, 8 * k + 8):
                    maxima[number] = row
                    number += marks[row]
        now, before, earlier = column % 3, (column + 2) % 3, (column + 1) % 3
        labels[now] = -1
        for k in range(number):
            row = maxima[k]
            sign = 1 if values[row] > 0 else -1
            found = labels[before, row + 1]
            if not _continues(chains, found, sign, column, row, slope):
                found = -1
                for other in (
                    labels[before, row],
                    labels[before, row + 2],
                    labels[earlier, row + 1],
                    labels[earlier, row],
                    labels[earlier, row + 2],
                ):
                    if _continues(chains, other, sign, column, row, slope):
                        found = other
                        break
            if found < 0:
                if used == limit:
                    continue
                found = used
                used += 1
                chains[found] = 0
                chains[found, _START] = column
                chains[found, _FIRST] = row
                chains[found, _SIGN] = sign
            labels[now, row + 1] = found
            chains[found, _LAST] = column
            chains[found, _LAST_ROW] = row
            chains[found, _COUNT] += 1
            chains[found, _ROWS] += row
            chains[found, _SIZES] += abs(np.int32(values[row]))
    table = np.empty((used, 6), np.float64)
    kept = 0
    for label in range(used):
        one = chains[label]
        if one[_LAST] + 1 - one[_START] >= shortest:
            table[kept, X0] = one[_START]
            table[kept, X1] = one[_LAST] + 1
            table[kept, Y] = one[_ROWS] / one[_COUNT] + 0.5
            table[kept, STRENGTH] = one[_SIZES] / one[_COUNT]
            table[kept, SIGN] = one[_SIGN]
            table[kept, RISE] = one[_LAST_ROW] - one[_FIRST]
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
        (M, 6): x0, x1 (half-open, px), mean y (px), mean magnitude of the derivative, its sign (1:
        brighter below, like the lower edge of a shadow), and the rise in rows from end to end.
    """
    columns = np.ascontiguousarray(cv2.transpose(derivative))
    found: Floats = _chain(columns, np.int16(np.ceil(threshold)), slope, shortest, limit)
    return found
