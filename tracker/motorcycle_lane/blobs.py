"""Connected regions of a foreground mask (paper 3, section II.D.3, its "oil spreading")."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray


def clean(mask: NDArray[np.bool_], *, window: int = 3, largest_hole: int = 400) -> NDArray[np.bool_]:
    """Remove specks and fill holes; the same for every background model that is compared.

    Args:
        mask: (H, W) raw foreground.
        window: Side of the median filter, px, odd. Raising it removes larger specks, and thin objects.
        largest_hole: Enclosed background up to so many px is foreground. Raising it fills large pale parts,
            and gaps between neighbours that touch in two places.
    """
    filtered = cv2.medianBlur(mask.astype(np.uint8), window)
    count, labels, statistics, _ = cv2.connectedComponentsWithStats(1 - filtered, connectivity=4)
    left, top, width, height, area = statistics.T
    inside = (left > 0) & (top > 0) & (left + width < mask.shape[1]) & (top + height < mask.shape[0])
    holes = inside & (area <= largest_hole)
    # Label 0 is the foreground itself.
    holes[0] = False
    if count == 1 or not holes.any():
        return np.asarray(filtered > 0)
    return np.asarray((filtered > 0) | holes[labels])


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
    _, labels, statistics, centres = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    kept = statistics[:, cv2.CC_STAT_AREA] >= least_area
    kept[0] = False
    numbers = np.zeros(len(kept), np.int32)
    numbers[kept] = np.arange(1, kept.sum() + 1)
    left, top, width, height, area = statistics[kept].T
    return Blobs(
        labels=numbers[labels],
        boxes=np.stack([left, top, left + width, top + height], 1).astype(np.float64),
        areas=area.astype(np.int64),
        centres=centres[kept] + 0.5,
    )
