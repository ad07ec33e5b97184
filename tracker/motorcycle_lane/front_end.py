"""From a picture to its foreground and the regions of it: what the three trackers share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.blobs import Blobs, clean, find_blobs

LEAST_AREA = 25 / (360 * 240)
"""Smallest region, as a share of the picture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """What stands out in a picture.

    Attributes:
        image: (H, W, 3) RGB.
        mask: (H, W) foreground, cleaned.
        doubtful: (H, W) what was foreground, too, but was told to be no vehicle.
        blobs: Its regions.
    """

    image: NDArray[np.uint8]
    mask: NDArray[np.bool_]
    doubtful: NDArray[np.bool_]
    blobs: Blobs


def look(image: NDArray[np.uint8], raw: NDArray[np.bool_], chosen: NDArray[np.bool_] | None = None) -> Sight:
    """Clean the foreground of a picture and find its regions.

    Args:
        image: (H, W, 3) RGB.
        raw: (H, W) raw foreground.
        chosen: (H, W) what is a vehicle in or near it, if that was looked for.
    """
    mask = clean(raw if chosen is None else chosen)
    blobs = find_blobs(mask, max(15, round(LEAST_AREA * mask.size)))
    doubtful = np.zeros_like(mask) if chosen is None else raw & ~mask
    return Sight(image=image, mask=mask, doubtful=doubtful, blobs=blobs)
