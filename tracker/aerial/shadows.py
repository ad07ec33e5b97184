"""Vehicles with the shadows they cast: all to one side, and most about as far.

Pixel by pixel a dark roof and a shadow are the same. But where a vehicle is bright or coloured its shadow can
be told from it (`tracker.aerial.darkening`), and all have one sun (`tracker.aerial.sun`): the offset that is
learnt from those is taken off the others. A vehicle of the road's colour shows little but its shadow, its
windows and its ends: what lies between them is its own, since both it and its shadow are convex.
"""

from __future__ import annotations

from collections import deque

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.aerial.background import Background
from tracker.aerial.darkening import Shadows
from tracker.aerial.sun import Sun
from tracker.blobs import find_blobs

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

EVERY = 5
"""Frames between two that are learnt from."""
SHORTEST = 0.5
"""Px of an offset from which on shadows are taken off."""
OWN = 0.3
"""Share of a region that is a vehicle's for sure, from which on its shadow is measured, not presumed ..."""
BOUNDS = (0.6, 2.5)
"""... between these usual ones."""
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
    """Takes the shadows of one scene off its vehicles."""

    def __init__(self) -> None:
        self._shadows, self._sun = Shadows(), Sun()
        self._areas: deque[int] = deque(maxlen=AREAS)
        self._frame = 0

    @property
    def offset(self) -> Floats:
        """(2,) px of the mosaic from the edge of a usual vehicle to that of its shadow."""
        return self._sun.offset

    def take_off(self, background: Background, mask: Mask) -> Mask:
        """Return the foreground (H, W) of the last picture without the shadows, and learn where they fall.

        What is no darkened road is a vehicle's; so is what is foreground all along the offset from there. Of
        what is too large for one vehicle the lit parts are left, if they are much of it: shadows joined them.
        What stands in the shade of a bridge or a building casts none.

        Args:
            background: With the last picture laid on it.
            mask: (H, W) foreground of its view.
        """
        self._frame += 1
        bounds = background.low, background.high
        lit, own = self._shadows.remove(background.laid, background.ground, mask, bounds)
        lit = lit | (mask & background.shade)
        lit, own = (_as_mask(cv2.morphologyEx(m.view(np.uint8), cv2.MORPH_OPEN, GRAIN)) for m in (lit, own))
        whole, dark = filled(mask), mask & ~lit
        usual = float(np.median(self._areas or [np.inf]))
        if self._frame % EVERY == 0:
            self._sun.learn(whole, dark, own, background.valid, usual)
        vehicles = self._sunny_side(whole, dark, own) | lit
        blobs = find_blobs(vehicles, SMALLEST)
        self._areas.extend(blobs.areas.tolist())
        lit = _as_mask(cv2.morphologyEx(lit.view(np.uint8), cv2.MORPH_CLOSE, GRAIN))
        light = np.bincount(blobs.labels[lit], minlength=len(blobs) + 1)[1:]
        joined = np.append(False, (blobs.areas > LARGE * usual) & (light > LIT * blobs.areas))
        if not joined.any():
            return vehicles
        return np.where(joined[blobs.labels], filled(lit), vehicles)

    def _sunny_side(self, whole: Mask, dark: Mask, own: Mask) -> Mask:
        """Return (H, W) the regions without what lies on their far side, seen from the sun."""
        usual = float(np.hypot(*self.offset))
        if usual < SHORTEST:
            return whole
        blobs = find_blobs(whole, SMALLEST)
        lengths = np.full(len(blobs) + 1, usual)
        for k, box in enumerate(blobs.boxes.astype(int).tolist()):
            part = np.s_[box[1] : box[3], box[0] : box[2]]
            region = blobs.labels[part] == k + 1
            if np.count_nonzero(region & own[part]) > OWN * blobs.areas[k]:
                low, high = BOUNDS
                lengths[k + 1] = np.clip(
                    self._sun.reach(region, dark[part], own[part]), low * usual, high * usual
                )
        return np.asarray(goes_on(blobs.labels, self.offset / usual, np.round(lengths).astype(np.int64)))


@njit(cache=True)
def goes_on(labels, direction, lengths):  # type: ignore[no-untyped-def]
    """Tell where regions go on to one side.

    Args:
        labels: (H, W) of regions 1 ... R.
        direction: (2,) unit vector.
        lengths: (R + 1,) px.

    Returns:
        (H, W) whether the pixels from there on are the same region's for its length. Beyond the picture they
        are.
    """
    height, width = labels.shape
    left = np.zeros((height, width), np.bool_)
    for i in range(height):
        for j in range(width):
            label = labels[i, j]
            if label == 0:
                continue
            left[i, j] = True
            for step in range(1, lengths[label] + 1):
                x = int(np.floor(j + 0.5 + step * direction[0]))
                y = int(np.floor(i + 0.5 + step * direction[1]))
                if 0 <= x < width and 0 <= y < height and labels[y, x] != label:
                    left[i, j] = False
                    break
    return left


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


def _as_mask(image: NDArray[np.generic]) -> Mask:
    return np.ascontiguousarray(image, np.uint8).view(np.bool_)
