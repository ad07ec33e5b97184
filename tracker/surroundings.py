"""Pixels compared with the background, and what is around them: what both foregrounds are weighed by."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Mask = NDArray[np.bool_]

NEAR = 5
"""Side, px, of the square around a pixel of which enough must be foreground for it to be looked at."""
BRIGHTEST = 3.0
"""Ratio to the background above which it does not matter how bright a pixel is."""
DIM = 10.0
"""Grey levels that are added where brightness divides."""
UNIT = 256
"""Whole numbers that make 1 where averages are taken."""


def smoothed(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return (3, H, W) the channels of a picture (H, W, 3), averaged over 3 x 3 pixels."""
    found = np.empty((3, *picture.shape[:2]), np.uint8)
    cv2.split(cv2.blur(picture, (3, 3)), list(found))
    return found


@njit(cache=True, error_model="numpy")
def differences(now, then):  # type: ignore[no-untyped-def]
    """Compare a picture with the background.

    Args:
        now: (3, H, W) uint8, the picture, `smoothed`.
        then: (3, H, W) uint8, the background image, likewise.

    Returns:
        (2, H, W) int32, in parts of `UNIT`: how many times as bright it is, the mean of the channels; and how
        steep its brightness is, less what the background's pattern accounts for, as a share of it, 1 at most.
    """
    _, height, width = now.shape
    ratios = np.empty((height, width), np.float32)
    grey, ground = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    found = np.zeros((2, height, width), np.int32)
    one, three, unit = np.float32(1.0), np.float32(3.0), np.float32(UNIT)
    for y in range(height):
        for x in range(width):
            r, g, b = np.float32(now[0, y, x]), np.float32(now[1, y, x]), np.float32(now[2, y, x])
            s, h, c = np.float32(then[0, y, x]), np.float32(then[1, y, x]), np.float32(then[2, y, x])
            ratio = ((r + one) / (s + one) + (g + one) / (h + one) + (b + one) / (c + one)) / three
            ratios[y, x] = min(ratio, np.float32(BRIGHTEST))
            grey[y, x], ground[y, x] = (r + g + b) / three, (s + h + c) / three
        for x in range(width):
            found[0, y, x] = np.int32(unit * ratios[y, x])
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            ratio = ratios[y, x]
            across = grey[y, x + 1] - grey[y, x - 1] - ratio * (ground[y, x + 1] - ground[y, x - 1])
            down = grey[y + 1, x] - grey[y - 1, x] - ratio * (ground[y + 1, x] - ground[y - 1, x])
            edge = np.sqrt(across * across + down * down) / (grey[y, x] + np.float32(DIM))
            found[1, y, x] = np.int32(unit * min(edge, one))
    return found


@njit(cache=True)
def integrals(maps):  # type: ignore[no-untyped-def]
    """Return (C, H + 1, W + 1) int32, the sums of what is above and left of each corner in maps (C, H, W).

    They may overflow; sums over windows, which are differences of four, do not (two's complement).
    """
    count, height, width = maps.shape
    found = np.zeros((count, height + 1, width + 1), np.int32)
    for c in range(count):
        for y in range(height):
            total = np.int32(0)
            for x in range(width):
                total = np.int32(total + maps[c, y, x])
                found[c, y + 1, x + 1] = total
            for x in range(width):
                found[c, y + 1, x + 1] += found[c, y, x + 1]
    return found


@njit(cache=True)
def reaches(mask, rows, columns):  # type: ignore[no-untyped-def]
    """Return (N, 4) int64, how far foreground reaches from pixels, with them: up, down, left and right."""
    height, width = mask.shape
    found = np.zeros((rows.size, 4), np.int64)
    for n in range(rows.size):
        y, x = rows[n], columns[n]
        if not mask[y, x]:
            continue
        up, down, left, right = y, y, x, x
        while up >= 0 and mask[up, x]:
            up -= 1
        while down < height and mask[down, x]:
            down += 1
        while left >= 0 and mask[y, left]:
            left -= 1
        while right < width and mask[y, right]:
            right += 1
        found[n] = y - up, down - y, x - left, right - x
    return found


@njit(cache=True)
def bounds(middle, half, limit):  # type: ignore[no-untyped-def]
    """Return where a window begins and ends on an axis; beyond the picture it is its outermost pixel."""
    low = min(max(middle - half, 0), limit - 1)
    return low, max(min(middle + half + 1, limit), low + 1)


@njit(cache=True, error_model="numpy")
def average(sums, y, x, half):  # type: ignore[no-untyped-def]
    """Return the mean over the square around a pixel, given `integrals` (H + 1, W + 1) in parts of `UNIT`."""
    left, right = bounds(x, half, sums.shape[1] - 1)
    top, bottom = bounds(y, half, sums.shape[0] - 1)
    total = np.int32(sums[bottom, right] - sums[top, right])
    total = np.int32(np.int32(total - sums[bottom, left]) + sums[top, left])
    return total / (UNIT * (right - left) * (bottom - top))


def candidates(raw: Mask, dense: float) -> Mask:
    """Return (H, W) the pixels that may be a vehicle's: those with such a share of raw foreground around."""
    around = cv2.boxFilter(
        raw.view(np.uint8), cv2.CV_8U, (NEAR, NEAR), normalize=False, borderType=cv2.BORDER_CONSTANT
    )
    return np.asarray(around > dense * NEAR**2 - 0.5)


class Blocks(NamedTuple):
    """Squares of pixels that are decided as one.

    Attributes:
        rows: (N,) int64 of the middle, which speaks for the square.
        columns: (N,) int64 of it.
        numbers: (H, W) int32 the square that a candidate belongs to, -1 elsewhere.
    """

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    numbers: NDArray[np.int32]

    def pixels(self, chosen: Mask) -> Mask:
        """Return (H, W) the pixels of chosen squares (N,)."""
        found: Mask = _pixels(self.numbers, chosen)
        return found


@njit(cache=True)
def _pixels(numbers, chosen):  # type: ignore[no-untyped-def]
    found = np.empty(numbers.shape, np.bool_)
    for y in range(numbers.shape[0]):
        for x in range(numbers.shape[1]):
            found[y, x] = numbers[y, x] >= 0 and chosen[numbers[y, x]]
    return found


@njit(cache=True)
def _blocks(mask, widths):  # type: ignore[no-untyped-def]
    height, width = mask.shape
    numbers = np.full((height, width), -1, np.int32)
    rows, columns = np.empty(mask.sum(), np.int64), np.empty(mask.sum(), np.int64)
    of_column = np.empty(width, np.int32)
    count, y = 0, 0
    while y < height:
        size = widths[y]
        end = min(y + size, height)
        of_column[:] = -1
        for v in range(y, end):
            for x in range(width):
                if mask[v, x]:
                    left = x - x % size
                    if of_column[left] < 0:
                        rows[count] = min(y + size // 2, height - 1)
                        columns[count] = min(left + size // 2, width - 1)
                        of_column[left] = count
                        count += 1
                    numbers[v, x] = of_column[left]
        y = end
    return rows[:count], columns[:count], numbers


def blocks(mask: Mask, widths: NDArray[np.int64]) -> Blocks:
    """Divide pixels (H, W) into squares as wide, px, as it says for their rows (H,)."""
    return Blocks(*_blocks(mask, widths))
