"""Smooths the stairs along edges of a picture that has one sample a pixel.

Software OpenGL pays for four samples a pixel with twice the time of the whole frame; stairs are few pixels,
and found by their contrast. The method follows T. Lottes, FXAA (NVIDIA, 2009): walk along an edge to both
its ends, and shift the picture across it by how far the true edge must lie off the pixel's middle.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

_LEAST_CONTRAST = 14
_RELATIVE_CONTRAST = 0.12
_LONGEST = 14

_LIMIT = np.maximum((np.arange(256) * _RELATIVE_CONTRAST).astype(np.uint8), np.uint8(_LEAST_CONTRAST))
"""By the brightest of a pixel and its four neighbours: the contrast beyond which it lies on an edge."""


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _walk(
    luma: NDArray[np.uint8], place: int, along: int, across: int, most: int, level: int, step: int
) -> tuple[int, int]:
    """Follow an edge one way.

    Args:
        luma: (H * W,).
        place: The pixel to start from, one beside the edge.
        along: What takes a place one pixel on.
        across: What takes a place to the other side of the edge.
        most: How many pixels to go at most.
        level: Sum of the two sides' brightness at the start.
        step: Their difference there: the edge ends where the sum differs by half of it.

    Returns:
        How many pixels it goes on, one more than ``most`` if it does not end; what the sum differs by there.
    """
    change = 0
    for length in range(1, most + 1):
        place += along
        change = int(np.int64(luma[place]) + np.int64(luma[place + across])) - level
        if 2 * abs(change) >= step:
            return length, change
    return most + 1, change


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _smooth(
    image: NDArray[np.uint8],
    luma: NDArray[np.uint8],
    where: NDArray[np.intp],
    columns: int,
    longest: int,
    out: NDArray[np.uint8],
) -> None:
    """Mix pixels with a neighbour each, into ``out``; ``where`` says which: places in the flat pictures."""
    rows = luma.size // columns
    for place in where:
        i = place // columns
        j = place - i * columns
        if i == 0 or j == 0 or i == rows - 1 or j == columns - 1:
            continue
        # Signed: differences of unsigned numbers wrap around.
        m, n, s = np.int64(luma[place]), np.int64(luma[place - columns]), np.int64(luma[place + columns])
        w, e = np.int64(luma[place - 1]), np.int64(luma[place + 1])
        nw, ne = np.int64(luma[place - columns - 1]), np.int64(luma[place - columns + 1])
        sw, se = np.int64(luma[place + columns - 1]), np.int64(luma[place + columns + 1])
        across_rows = 2 * abs(n + s - 2 * m) + abs(nw + sw - 2 * w) + abs(ne + se - 2 * e)
        across_columns = 2 * abs(w + e - 2 * m) + abs(nw + ne - 2 * n) + abs(sw + se - 2 * s)
        if across_rows >= across_columns:
            along, across, before, after = 1, columns, n, s
            room_back, room_on = j, columns - 1 - j
        else:
            along, across, before, after = columns, 1, w, e
            room_back, room_on = i, rows - 1 - i
        step, other = abs(after - m), after
        if abs(before - m) >= step:
            step, other, across = abs(before - m), before, -across
        back, back_change = _walk(luma, place, -along, across, min(room_back, longest), m + other, step)
        on, on_change = _walk(luma, place, along, across, min(room_on, longest), m + other, step)
        near, change = (on, on_change) if on <= back else (back, back_change)
        shift = 0.0
        # Only the side on which the edge bends away from this pixel lies on the wrong side of the true edge,
        # and an edge without an end in reach is level.
        if 2 * abs(change) >= step and (change < 0) != (m < other):
            shift = 0.5 - (near - 0.5) / max(back + on - 1, 1)
        # What differs from all around is thinner than a pixel; straight edges stay below a third.
        around = (2 * (n + s + w + e) + nw + ne + sw + se) / 12.0
        contrast = max(m, n, s, w, e) - min(m, n, s, w, e)
        lone = min(max(abs(around - m) / contrast - 0.35, 0.0) / 0.65, 1.0)
        shift = min(max(shift, 0.6 * lone), 0.5)
        for c in range(3):
            own = np.float64(image[place, c])
            out[place, c] = np.uint8(own + shift * (image[place + across, c] - own) + 0.5)


def smooth_edges(rgba: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the colours of (H, W, 4) ``rgba``, (H, W, 3), with their stairs smoothed."""
    import cv2

    out = np.asarray(cv2.cvtColor(rgba, cv2.COLOR_RGBA2RGB))
    luma = np.asarray(cv2.cvtColor(rgba, cv2.COLOR_RGBA2GRAY))
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    top = cv2.dilate(luma, cross)
    contrast = np.asarray(cv2.subtract(top, cv2.erode(luma, cross)))
    where = np.flatnonzero(contrast > np.asarray(cv2.LUT(top, _LIMIT)))
    _smooth(rgba.reshape(-1, 4), luma.ravel(), where, luma.shape[1], _LONGEST, out.reshape(-1, 3))
    return out
