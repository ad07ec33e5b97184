"""What near the foreground is a vehicle, and what is its shadow, or nothing: pixel by pixel.

What a shadow falls on keeps its pattern, only darker; a vehicle has its own edges and colours; below a
machine the one passes into the other. No single cue tells them apart, as dark clothes look like a shadow, but
those of a pixel and its surroundings do together, weighed by boosted trees (`tracker.boosting`). The
surroundings are looked at where they are on a vehicle of any size (as in Shotton et al., Real-time human pose
recognition in parts from single depth images, CVPR 2011). That gives back, too, what the background model
missed within a vehicle.

The trees (foreground.npz) were learnt from simulated lanes by ``python -m tests.training.lane_foreground``:
of motorcycles, cars and heavier vehicles, before cameras, lights and roads of many kinds.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.boosting import Trees, log_odds
from tracker.surroundings import (
    DIM,
    UNIT,
    Blocks,
    blocks,
    bounds,
    candidates,
    differences,
    integrals,
    reaches,
    smoothed,
)

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

DENSE = 0.2
"""A pixel is looked at if such a share of what is around it is foreground."""
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
            found[n, 5 + k] = reached[n, k] / tall
        for k in range(offsets.shape[0]):
            left, right = bounds(x + across[k], half, width)
            top, bottom = bounds(y + down[k], half, height)
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
    now, then = smoothed(image), smoothed(background)
    sums = integrals(differences(now, then))
    reached = reaches(raw, rows, columns)
    found: NDArray[np.float32] = _gather(now, then, sums, reached, heights, rows, columns, OFFSETS)
    return found


def widths(heights: Floats) -> NDArray[np.int64]:
    """Return (H,) how wide, px, squares are that are decided as one: the wider the larger vehicles are."""
    return np.maximum(heights // BLOCK, 1.0).astype(np.int64)


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
        return self.squares.pixels(self.odds > 0.0)


def weigh(image: Image, background: Image, raw: Mask, heights: Floats, trees: Trees) -> Weighed:
    """Tell what near the raw foreground is a vehicle.

    Args:
        image: (H, W, 3) RGB.
        background: (H, W, 3) RGB, what is there without vehicles.
        raw: (H, W) raw foreground.
        heights: (H,) of a vehicle whose middle is in a row, px.
        trees: That weigh the cues.
    """
    squares = blocks(candidates(raw, DENSE), widths(heights))
    found = cues(image, background, raw, heights, squares.rows, squares.columns)
    return Weighed(squares, found, log_odds(found, trees, settled=SETTLED))
