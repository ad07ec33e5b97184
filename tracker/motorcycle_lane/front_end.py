"""From a picture to its foreground and the regions of it: what the three trackers share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.motorcycle_lane.blobs import Blobs, clean, find_blobs

LEAST_AREA = 25 / (360 * 240)
"""Smallest region, as a share of the picture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """What stands out in a picture.

    Attributes:
        image: (H, W, 3) RGB.
        mask: (H, W) foreground, cleaned.
        blobs: Its regions.
    """

    image: NDArray[np.uint8]
    mask: NDArray[np.bool_]
    blobs: Blobs


def look(image: NDArray[np.uint8], raw: NDArray[np.bool_]) -> Sight:
    """Clean the raw foreground (H, W) of a picture (H, W, 3) and find its regions."""
    mask = clean(raw)
    return Sight(image=image, mask=mask, blobs=find_blobs(mask, max(15, round(LEAST_AREA * mask.size))))
