"""A picture's edges and brightness as integral images, so that thousands of outlines can be weighed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Layers of the sums: absolute steps from one column to the next, steps from one row to the next (positive
# where it gets brighter downward), their absolute values, the brightness itself, and how red it is.
ACROSS, SIGNED, DOWN, BRIGHT, RED = 0, 1, 2, 3, 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Relief:
    """A picture's integral images, and what is known of the scene.

    Attributes:
        sums: (5, h + 1, w + 1) int32, in half grey levels, by layer.
        horizon: Row, px.
        middle: Column of the focus of expansion, px.
        focal: Px.
    """

    sums: NDArray[np.int32]
    horizon: float
    middle: float
    focal: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the picture, px."""
        return self.sums.shape[1] - 1, self.sums.shape[2] - 1


@njit(cache=True)
def _integrals(grey, redness):  # type: ignore[no-untyped-def]
    height, width = grey.shape
    sums = np.empty((5, height + 1, width + 1), np.int32)
    sums[:, 0] = 0
    sums[:, :, 0] = 0
    # Of each column down to the present row.
    across, bright = np.zeros(width, np.int32), np.zeros(width, np.int32)
    signed, down = np.zeros(width, np.int32), np.zeros(width, np.int32)
    red = np.zeros(width, np.int32)
    inner = across[2 : width - 1]
    for i in range(height):
        here = grey[i]
        before, left, place, right = here[: width - 3], here[1 : width - 2], here[2 : width - 1], here[3:]
        for j in range(width - 3):
            inner[j] += abs(np.int32(place[j]) + np.int32(right[j]) - np.int32(left[j]) - np.int32(before[j]))
        for j in range(width):
            bright[j] += np.int32(2) * np.int32(here[j])
            red[j] += np.int32(2) * np.int32(redness[i, j])
        if 2 <= i < height - 1:
            top, above, below = grey[i - 2], grey[i - 1], grey[i + 1]
            for j in range(width):
                step = np.int32(here[j]) + np.int32(below[j]) - np.int32(above[j]) - np.int32(top[j])
                signed[j] += step
                down[j] += abs(step)
        a, s, d, b, r = np.int32(0), np.int32(0), np.int32(0), np.int32(0), np.int32(0)
        for j in range(width):
            a += across[j]
            s += signed[j]
            d += down[j]
            b += bright[j]
            r += red[j]
            sums[ACROSS, i + 1, j + 1] = a
            sums[SIGNED, i + 1, j + 1] = s
            sums[DOWN, i + 1, j + 1] = d
            sums[BRIGHT, i + 1, j + 1] = b
            sums[RED, i + 1, j + 1] = r
    return sums


def make_relief(
    grey: NDArray[np.uint8], red: NDArray[np.uint8], *, horizon: float, middle: float, focal: float
) -> Relief:
    """Sum up a picture (h, w), which is at least four pixels wide, and how red it is (h, w)."""
    return Relief(sums=_integrals(grey, red), horizon=horizon, middle=middle, focal=focal)


@njit(cache=True)
def mean(sums, layer, x0, y0, x1, y1):  # type: ignore[no-untyped-def]
    """Return a layer's mean over columns [x0, x1) and rows [y0, y1), in grey levels.

    Cut to the picture; 0 where that is empty. The sums count half levels.
    """
    height, width = sums.shape[1] - 1, sums.shape[2] - 1
    x0, x1 = min(max(x0, 0), width), min(max(x1, 0), width)
    y0, y1 = min(max(y0, 0), height), min(max(y1, 0), height)
    if x1 <= x0 or y1 <= y0:
        return 0.0
    plane = sums[layer]
    total = plane[y1, x1] - plane[y0, x1] - plane[y1, x0] + plane[y0, x0]
    return 0.5 * total / ((x1 - x0) * (y1 - y0))
