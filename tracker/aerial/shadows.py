"""Vehicles with the shadows they cast: all to one side, and most about as far.

Pixel by pixel a dark roof and a shadow are the same. But where a vehicle is bright its shadow can be told
from it (`tracker.aerial.darkening`), and all vehicles have one sun: the offset that is learnt from
bright ones is taken off the others. A vehicle of the road's colour shows little but its shadow, its windows
and its ends: what lies between them is its own, since both it and its shadow are convex.
"""

from __future__ import annotations

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.aerial.background import Background
from tracker.aerial.darkening import Shadows
from tracker.motorcycle_lane.blobs import find_blobs

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

EVERY = 5
"""Frames between two that are learnt from."""
BRIGHT = (0.3, 0.8)
"""Share of a region that is no shadow, where it tells of the offset."""
LEAST_AREA = 60
ENOUGH, MEMORY = 8, 120
AREAS = 1000
"""Regions whose median area is the usual one."""
SOLID = 0.55
"""Share of its convex hull that is foreground, where a region is one vehicle with its shadow."""
LARGE, LIT = 1.5, 0.3
"""Usual areas above which a region may be several vehicles, and share of it that must be lit to tell."""
SMALLEST = 30
"""Px of a region that is filled."""
GRAIN = np.ones((3, 3), np.uint8)


class CastShadows:
    """Learns where the shadows of one scene fall, and takes them off.

    Attributes:
        offset: (2,) px of the mosaic from the edge of a vehicle to that of its shadow.
    """

    def __init__(self) -> None:
        self.offset: Floats = np.zeros(2)
        self._shadows = Shadows()
        self._offsets: deque[Floats] = deque(maxlen=MEMORY)
        self._areas: deque[int] = deque(maxlen=AREAS)
        self._frame = 0

    def take_off(self, background: Background, mask: Mask) -> Mask:
        """Return the foreground (H, W) of the last picture without the shadows, and learn where they fall.

        What is no darkened road is a vehicle's; so is what is foreground all along the offset from there. Of
        what is too large for one vehicle the lit parts are left, if they are much of it: shadows joined them.

        Args:
            background: With the last picture laid on it.
            mask: (H, W) foreground of its view.
        """
        self._frame += 1
        lit = self._shadows.remove(background.laid, background.picture(), mask)
        lit = _as_mask(cv2.morphologyEx(lit.view(np.uint8), cv2.MORPH_OPEN, GRAIN))
        if self._frame % EVERY == 0:
            self._learn(mask, lit)
        vehicles = along(filled(mask), self.offset) | lit
        lit = _as_mask(cv2.morphologyEx(lit.view(np.uint8), cv2.MORPH_CLOSE, GRAIN))
        blobs = find_blobs(vehicles, SMALLEST)
        self._areas.extend(blobs.areas.tolist())
        large = blobs.areas > LARGE * np.median(self._areas or [np.inf])
        light = np.bincount(blobs.labels[lit], minlength=len(blobs) + 1)[1:]
        joined = np.append(False, large & (light > LIT * blobs.areas))
        if not joined.any():
            return vehicles
        return np.where(joined[blobs.labels], filled(lit), vehicles)

    def _learn(self, mask: Mask, lit: Mask) -> None:
        """Learn from regions of which a part is lit: how much farther the whole reaches to each side."""
        blobs = find_blobs(mask, LEAST_AREA)
        for k, box in enumerate(blobs.boxes.astype(int).tolist()):
            part = np.s_[box[1] : box[3], box[0] : box[2]]
            region = blobs.labels[part] == k + 1
            rows, columns = np.nonzero(region & lit[part])
            if BRIGHT[0] < len(rows) / np.count_nonzero(region) < BRIGHT[1]:
                high, wide = region.shape
                right = wide - 1 - columns.max() - columns.min()
                self._offsets.append(np.array([right, high - 1 - rows.max() - rows.min()], float))
        if len(self._offsets) >= ENOUGH:
            self.offset = np.median(np.array(self._offsets), axis=0)


def filled(mask: Mask) -> Mask:
    """Return a mask (H, W) with its solid regions made convex."""
    blobs = find_blobs(mask, SMALLEST)
    whole = mask.view(np.uint8).copy()
    for k, box in enumerate(blobs.boxes.astype(int).tolist()):
        region = (blobs.labels[box[1] : box[3], box[0] : box[2]] == k + 1).view(np.uint8)
        hull = np.zeros_like(region)
        cv2.fillConvexPoly(hull, cv2.convexHull(cv2.findNonZero(region)), 1)
        if np.count_nonzero(region) >= SOLID * np.count_nonzero(hull):
            whole[box[1] : box[3], box[0] : box[2]] |= hull
    return _as_mask(whole)


def along(mask: Mask, offset: Floats) -> Mask:
    """Return (H, W) where a mask is set all along an offset (2,) from there."""
    reach = np.round(offset).astype(int)
    steps = int(np.abs(reach).max())
    if not steps:
        return mask
    ways = np.round(np.linspace(0.0, 1.0, steps + 1)[:, None] * reach).astype(int)
    kernel = np.zeros((2 * steps + 1, 2 * steps + 1), np.uint8)
    kernel[steps + ways[:, 1], steps + ways[:, 0]] = 1
    return _as_mask(cv2.erode(mask.view(np.uint8), kernel, borderValue=1))


def _as_mask(image: NDArray[np.generic]) -> Mask:
    return np.ascontiguousarray(image, np.uint8).view(np.bool_)
