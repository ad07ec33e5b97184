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


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _walk(
    luma: NDArray[np.uint8],
    i: int,
    j: int,
    oi: int,
    oj: int,
    di: int,
    dj: int,
    middle: float,
    limit: float,
    longest: int,
) -> tuple[int, float]:
    """Follow an edge one way: return how many pixels it goes on, and what differs at its end."""
    rows, columns = luma.shape
    end = 0.0
    for length in range(1, longest + 1):
        i, j, oi, oj = i + di, j + dj, oi + di, oj + dj
        if i < 0 or j < 0 or i >= rows or j >= columns:
            return length, end
        end = 0.5 * (int(luma[i, j]) + int(luma[oi, oj])) - middle
        if abs(end) >= limit:
            return length, end
    return longest + 1, end


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _smooth(
    image: NDArray[np.uint8],
    luma: NDArray[np.uint8],
    where: NDArray[np.intp],
    out: NDArray[np.uint8],
    longest: int,
) -> None:
    rows, columns = luma.shape
    for place in where:
        i, j = place // columns, place % columns
        if i == 0 or j == 0 or i == rows - 1 or j == columns - 1:
            continue
        m, n, s = int(luma[i, j]), int(luma[i - 1, j]), int(luma[i + 1, j])
        w, e = int(luma[i, j - 1]), int(luma[i, j + 1])
        contrast = max(m, n, s, w, e) - min(m, n, s, w, e)
        nw, ne = int(luma[i - 1, j - 1]), int(luma[i - 1, j + 1])
        sw, se = int(luma[i + 1, j - 1]), int(luma[i + 1, j + 1])
        across_rows = 2 * abs(n + s - 2 * m) + abs(nw + sw - 2 * w) + abs(ne + se - 2 * e)
        across_columns = 2 * abs(w + e - 2 * m) + abs(nw + ne - 2 * n) + abs(sw + se - 2 * s)
        level = across_rows >= across_columns
        di, dj = (1, 0) if level else (0, 1)
        before, after = int(luma[i - di, j - dj]), int(luma[i + di, j + dj])
        side = -1 if abs(before - m) >= abs(after - m) else 1
        step = max(abs(before - m), abs(after - m))
        oi, oj = i + side * di, j + side * dj
        middle = 0.5 * (m + int(luma[oi, oj]))
        ai, aj = (0, 1) if level else (1, 0)
        before_length, before_end = _walk(luma, i, j, oi, oj, -ai, -aj, middle, 0.25 * step, longest)
        after_length, after_end = _walk(luma, i, j, oi, oj, ai, aj, middle, 0.25 * step, longest)
        near_length, near_end = before_length, before_end
        if after_length <= before_length:
            near_length, near_end = after_length, after_end
        shift = 0.0
        # Only the side on which the edge bends away from this pixel lies on the wrong side of the true edge,
        # and an edge without an end in reach is level.
        if abs(near_end) >= 0.25 * step and (near_end < 0) != (m < middle):
            shift = 0.5 - (near_length - 0.5) / max(before_length + after_length - 1, 1)
        # What differs from all around is thinner than a pixel; straight edges stay below a third.
        around = (2 * (n + s + w + e) + nw + ne + sw + se) / 12.0
        lone = min(max(abs(around - m) / contrast - 0.35, 0.0) / 0.65, 1.0)
        shift = min(max(shift, 0.6 * lone), 0.5)
        for c in range(3):
            out[i, j, c] = np.uint8(image[i, j, c] + shift * (float(image[oi, oj, c]) - image[i, j, c]) + 0.5)


def smooth_edges(rgba: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the colours of (H, W, 4) ``rgba``, (H, W, 3), with their stairs smoothed."""
    import cv2

    out = cv2.cvtColor(rgba, cv2.COLOR_RGBA2RGB)
    luma = cv2.cvtColor(rgba, cv2.COLOR_RGBA2GRAY)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    top = cv2.dilate(luma, cross)
    contrast = cv2.subtract(top, cv2.erode(luma, cross))
    limit = np.maximum((top * _RELATIVE_CONTRAST).astype(np.uint8), np.uint8(_LEAST_CONTRAST))
    _smooth(rgba, luma, np.flatnonzero(contrast > limit), out, _LONGEST)
    return np.asarray(out)
