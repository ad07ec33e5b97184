"""Connected regions of a foreground mask (paper 3, section II.D.3, its "oil spreading")."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def regions(mask, value, corners):  # type: ignore[no-untyped-def]
    """Find the connected regions of pixels of one value, by runs: masks have few, whatever their pixels.

    Runs that touch are joined in a forest (He, Chao, Suzuki, A run-based two-scan labeling algorithm, IEEE
    T-IP 17(5), 2008).

    Args:
        mask: (H, W) bool.
        value: Of the pixels.
        corners: 1 if pixels touch at corners, too, else 0.

    Returns:
        (R, 4) int32 row, first column, end, and region of each run, and (N, 7) float64 of the regions in the
        order of their first pixels: left, top, right, bottom, area, sums of columns and of rows, px.
    """
    height, width = mask.shape
    runs = np.empty((height * (width // 2 + 1), 4), np.int32)
    count, above, begin = 0, 0, 0
    for y in range(height):
        above, begin = begin, count
        other, x = above, 0
        while x < width:
            if mask[y, x] != value:
                x += 1
                continue
            first = x
            while x < width and mask[y, x] == value:
                x += 1
            runs[count] = y, first, x, count
            while other < begin and runs[other, 2] + corners <= first:
                other += 1
            touching = other
            while touching < begin and runs[touching, 1] < x + corners:
                one, two = touching, count
                while runs[one, 3] != one:
                    one = runs[one, 3]
                while runs[two, 3] != two:
                    two = runs[two, 3]
                # The earlier run is the root, so that roots come before what hangs on them.
                runs[max(one, two), 3] = min(one, two)
                touching += 1
            count += 1
    found, numbers = np.empty((count, 7)), np.empty(count, np.int32)
    many = 0
    for k in range(count):
        y, first, end, parent = runs[k]
        size = end - first
        if parent == k:
            found[many, 0], found[many, 1], found[many, 2] = first, y, end
            found[many, 4:] = 0.0
            numbers[k] = many
            many += 1
        else:
            numbers[k] = numbers[parent]
        region = numbers[k]
        found[region, 0] = min(found[region, 0], first)
        found[region, 2] = max(found[region, 2], end)
        found[region, 3] = y + 1
        found[region, 4] += size
        found[region, 5] += 0.5 * size * (first + end - 1)
        found[region, 6] += size * y
        runs[k, 3] = region
    return runs[:count], found[:many]


@njit(cache=True)
def paint(picture, runs, values):  # type: ignore[no-untyped-def]
    """Write the value (N,) of each region into a picture (H, W), in place; 0 leaves it as it is."""
    for k in range(runs.shape[0]):
        y, first, end, region = runs[k]
        if values[region] != 0:
            picture[y, first:end] = values[region]


def clean(mask: NDArray[np.bool_], *, window: int = 3, largest_hole: int = 400) -> NDArray[np.bool_]:
    """Remove specks and fill holes; the same for every background model that is compared.

    Args:
        mask: (H, W) raw foreground.
        window: Side of the median filter, px, odd. Raising it removes larger specks, and thin objects.
        largest_hole: Enclosed background up to so many px is foreground. Raising it fills large pale parts,
            and gaps between neighbours that touch in two places.
    """
    filtered = cv2.medianBlur(mask.view(np.uint8), window).view(np.bool_)
    runs, found = regions(filtered, False, 0)
    left, top, right, bottom, area = found[:, :5].T
    inside = (left > 0) & (top > 0) & (right < mask.shape[1]) & (bottom < mask.shape[0])
    paint(filtered, runs, inside & (area <= largest_hole))
    return np.asarray(filtered)


@dataclass(frozen=True, slots=True, kw_only=True)
class Blobs:
    """The N connected regions of a mask.

    Attributes:
        labels: (H, W) int32, region k has k + 1; 0 is background, and what was too small.
        boxes: (N, 4) float64 x0, y0, x1, y1, px, half-open.
        areas: (N,) int64, px.
        centres: (N, 2) float64 x, y of the centre of area, px; pixel centres lie at +0.5.
    """

    labels: NDArray[np.int32]
    boxes: NDArray[np.float64]
    areas: NDArray[np.int64]
    centres: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.areas)


def find_blobs(mask: NDArray[np.bool_], least_area: int = 15) -> Blobs:
    """Find the regions of a mask that touch at sides or corners.

    Args:
        mask: (H, W) foreground, as from `clean`.
        least_area: Smaller regions are dropped, px. Raising it loses distant objects.
    """
    runs, found = regions(mask, True, 1)
    kept = found[:, 4] >= least_area
    labels = np.zeros(mask.shape, np.int32)
    paint(labels, runs, np.where(kept, np.cumsum(kept), 0))
    return Blobs(
        labels=labels,
        boxes=found[kept, :4],
        areas=found[kept, 4].astype(np.int64),
        centres=found[kept, 5:] / found[kept, 4:5] + 0.5,
    )
