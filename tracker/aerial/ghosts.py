"""Ghosts: what differs from the background because a vehicle has left it, not because one has come.

A vehicle in the picture has its outline in the picture; that of one that stood where the background was
learnt is in the background.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.aerial.background import Background
from tracker.blobs import Blobs

Floats = NDArray[np.float64]

AROUND = 3
"""Px around a region that are looked at."""
RING = np.ones((3, 3), np.uint8)


def contrast(blobs: Blobs, background: Background) -> Floats:
    """Return (N,) how much sharper each region's outline is in the picture than in the background.

    Args:
        blobs: Regions of the foreground of the last picture, in its view.
        background: With the last picture laid on it.

    Returns:
        The log of the ratio of the mean gradients along the outline: below 0 are ghosts.
    """
    ratios = np.zeros(len(blobs))
    height, width = blobs.labels.shape
    for k, box in enumerate(blobs.boxes.astype(int).tolist()):
        part = np.s_[
            max(box[1] - AROUND, 0) : min(box[3] + AROUND, height),
            max(box[0] - AROUND, 0) : min(box[2] + AROUND, width),
        ]
        region = (blobs.labels[part] == k + 1).view(np.uint8)
        outline = cv2.morphologyEx(region, cv2.MORPH_GRADIENT, RING).view(np.bool_)
        now, before = (
            _gradient(picture)[outline].mean() for picture in (background.laid[part], background.mean(part))
        )
        ratios[k] = np.log((now + 1.0) / (before + 1.0))
    return ratios


def _gradient(picture: NDArray[np.generic]) -> Floats:
    """Return (H, W) the size of the gradient, grey levels a px."""
    grey = picture.astype(np.float32).mean(2)
    across, down = (cv2.Sobel(grey, cv2.CV_32F, *order, scale=0.125) for order in ((1, 0), (0, 1)))
    return np.asarray(np.hypot(across, down), np.float64)
