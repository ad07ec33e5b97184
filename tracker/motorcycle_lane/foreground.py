"""What near the foreground is a vehicle, and what is its shadow, or nothing: pixel by pixel.

What a shadow falls on keeps its pattern, only darker; a vehicle has its own edges and colours; below a
machine the one passes into the other. No single cue tells them apart, as dark clothes look like a shadow, but
those of a pixel and its surroundings do together, weighed by boosted trees (`tracker.boosting`). The
surroundings are looked at where they are on a vehicle of any size (as in Shotton et al., Real-time human pose
recognition in parts from single depth images, CVPR 2011). That gives back, too, what the background model
missed within a vehicle.

The trees (foreground.npz) were learnt from simulated lanes by ``python -m tests.training.foreground``: of
motorcycles, cars and heavier vehicles, before cameras, lights and roads of many kinds.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.boosting import Trees, log_odds

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

NEAR, DENSE = 5, 0.2
"""A pixel is looked at if such a share of the square around it, so wide, px, is foreground."""
BLOCK = 15.0
"""Height of a vehicle, px, for each pixel of the width of the squares that are decided as one."""
OFFSETS = np.array(
    [
        (x, y)
        for y in (-0.3, -0.12, 0.0, 0.12, 0.3)
        for x in (-0.25, -0.1, 0.0, 0.1, 0.25)
        if abs(x) + abs(y) < 0.45
    ]
)
"""Where around a pixel its surroundings are looked at, in heights of a vehicle, to the right and down."""
WINDOW = 0.06
"""Half the width of what is averaged there, in heights of a vehicle."""
SETTLED = -1.0, 1.0
"""Log odds after the first trees beyond which the others hardly ever change the sign."""
OWN = 9
"""Cues of the pixel itself."""
COUNT = OWN + 2 * len(OFFSETS)
"""Cues of a pixel with its surroundings."""
BRIGHTEST = 3.0
"""Ratio to the background above which it does not matter how bright a pixel is."""
DIM = 10.0
"""Grey levels that are added where brightness divides."""
UNIT = 256
"""Whole numbers that make 1 where averages are taken."""


@njit(cache=True, error_model="numpy")
def differences(now, then):  # type: ignore[no-untyped-def]
    """Compare a picture with the background.

    Args:
        now: (3, H, W) uint8, the channels of the picture, averaged over 3 x 3 pixels.
        then: (3, H, W) uint8, those of the background image, likewise.

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
def reaches(mask):  # type: ignore[no-untyped-def]
    """Return (H, W, 4) int16, how far foreground reaches from a pixel, with it: up, down, left and right."""
    height, width = mask.shape
    found = np.zeros((height, width, 4), np.int16)
    for y in range(height):
        for x in range(width):
            if mask[y, x]:
                found[y, x, 0] = 1 + (found[y - 1, x, 0] if y else 0)
                found[y, x, 2] = 1 + (found[y, x - 1, 2] if x else 0)
    for y in range(height - 1, -1, -1):
        for x in range(width - 1, -1, -1):
            if mask[y, x]:
                found[y, x, 1] = 1 + (found[y + 1, x, 1] if y + 1 < height else 0)
                found[y, x, 3] = 1 + (found[y, x + 1, 3] if x + 1 < width else 0)
    return found


@njit(cache=True)
def _bounds(middle, half, limit):  # type: ignore[no-untyped-def]
    """Return where a window begins and ends on an axis; beyond the picture it is its outermost pixel."""
    low = min(max(middle - half, 0), limit - 1)
    return low, max(min(middle + half + 1, limit), low + 1)


@njit(cache=True, error_model="numpy")
def _gather(now, then, sums, reached, heights, rows, columns, offsets):  # type: ignore[no-untyped-def]
    """Return (N, COUNT) the cues of pixels; ``sums`` (2, H + 1, W + 1) are `integrals` of `differences`."""
    _, height, width = now.shape
    found = np.empty((rows.size, OWN + 2 * offsets.shape[0]), np.float32)
    across, down = np.empty(offsets.shape[0], np.int64), np.empty(offsets.shape[0], np.int64)
    last, half, tall = -1, 0, 0.0
    for n in range(rows.size):
        y, x = rows[n], columns[n]
        if y != last:
            last, tall = y, heights[y]
            half = int(WINDOW * tall + 0.3)
            for k in range(offsets.shape[0]):
                across[k] = int(np.floor(offsets[k, 0] * tall + 0.5))
                down[k] = int(np.floor(offsets[k, 1] * tall + 0.5))
        r, g, b = float(now[0, y, x]), float(now[1, y, x]), float(now[2, y, x])
        red, green = (r + 1.0) / (then[0, y, x] + 1.0), (g + 1.0) / (then[1, y, x] + 1.0)
        blue = (b + 1.0) / (then[2, y, x] + 1.0)
        ratio = (red + green + blue) / 3.0
        most = max(r, g, b)
        found[n, 0] = ratio
        found[n, 1] = (blue - red) / ratio
        found[n, 2] = (green - 0.5 * (red + blue)) / ratio
        found[n, 3] = (most - min(r, g, b)) / (most + DIM)
        found[n, 4] = r + g + b
        for k in range(4):
            found[n, 5 + k] = reached[y, x, k] / tall
        for k in range(offsets.shape[0]):
            left, right = _bounds(x + across[k], half, width)
            top, bottom = _bounds(y + down[k], half, height)
            scale = 1.0 / (UNIT * ((right - left) * (bottom - top)))
            for c in range(2):
                total = np.int32(sums[c, bottom, right] - sums[c, top, right])
                total = np.int32(np.int32(total - sums[c, bottom, left]) + sums[c, top, left])
                found[n, OWN + 2 * k + c] = total * scale
    return found


def cues(
    image: Image,
    background: Image,
    raw: Mask,
    heights: Floats,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
) -> NDArray[np.float32]:
    """Return (N, COUNT) what tells of pixels whether they are a vehicle's.

    Args:
        image: (H, W, 3) RGB.
        background: (H, W, 3) RGB, the background image.
        raw: (H, W) raw foreground.
        heights: (H,) of a vehicle whose middle is in a row, px.
        rows: (N,) of the pixels.
        columns: (N,) of them.
    """
    now, then = (np.stack(cv2.split(cv2.blur(picture, (3, 3)))) for picture in (image, background))
    sums = integrals(differences(now, then))
    found: NDArray[np.float32] = _gather(now, then, sums, reaches(raw), heights, rows, columns, OFFSETS)
    return found


def candidates(raw: Mask) -> Mask:
    """Return (H, W) the pixels that may be a vehicle's: those in or near dense raw foreground."""
    share = cv2.blur(raw.astype(np.float32), (NEAR, NEAR), borderType=cv2.BORDER_CONSTANT)
    return np.asarray(share > DENSE - 0.5 / NEAR**2)


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


def blocks(mask: Mask, heights: Floats) -> Blocks:
    """Divide pixels (H, W) into squares, the larger the larger vehicles are in their row (H,)."""
    return Blocks(*_blocks(mask, np.maximum(heights // BLOCK, 1.0).astype(np.int64)))


class Weighed(NamedTuple):
    """What the pixels near the raw foreground are.

    Attributes:
        squares: (N) that are decided as one.
        cues: (N, COUNT) what was asked of each.
        odds: (N,) log odds that it is a vehicle's.
    """

    squares: Blocks
    cues: NDArray[np.float32]
    odds: Floats

    @property
    def vehicles(self) -> Mask:
        """(H, W) what is a vehicle."""
        # The last entry is that of pixels in no square.
        return np.append(self.odds > 0.0, False)[self.squares.numbers]


def weigh(image: Image, background: Image, raw: Mask, heights: Floats, trees: Trees) -> Weighed:
    """Tell what near the raw foreground is a vehicle.

    Args:
        image: (H, W, 3) RGB.
        background: (H, W, 3) RGB, what is there without vehicles.
        raw: (H, W) raw foreground.
        heights: (H,) of a vehicle whose middle is in a row, px.
        trees: That weigh the cues.
    """
    squares = blocks(candidates(raw), heights)
    found = cues(image, background, raw, heights, squares.rows, squares.columns)
    return Weighed(squares, found, log_odds(found, trees, settled=SETTLED))
