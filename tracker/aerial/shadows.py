"""Vehicles with the shadows they cast: all to one side, and most about as far.

Pixel by pixel a dark roof and a shadow are the same. But where a vehicle is bright its shadow can be told
from it (`tracker.aerial.darkening`), and all vehicles have one sun: the offset that is learnt from
bright ones is taken off the whole foreground.
"""

from __future__ import annotations

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.aerial.background import Background
from tracker.aerial.darkening import Shadows
from tracker.aerial.measuring import Labels
from tracker.motorcycle_lane.blobs import find_blobs

Floats = NDArray[np.float64]

EVERY = 5
"""Frames between two that are learnt from."""
BRIGHT = (0.3, 0.9)
"""Share of a region that is no shadow, where it tells of the offset."""
LEAST_AREA = 60
ENOUGH, MEMORY = 8, 120
LONGEST = 6.0
"""Px of the longest shadow that is taken off."""


class CastShadows:
    """Learns where the shadows of one scene fall.

    Attributes:
        offset: (2,) px of the mosaic from the edge of a vehicle to that of its shadow.
    """

    def __init__(self) -> None:
        self.offset: Floats = np.zeros(2)
        self._shadows = Shadows()
        self._offsets: deque[Floats] = deque(maxlen=MEMORY)
        self._frame = 0

    def learn(self, background: Background, mask: NDArray[np.bool_]) -> None:
        """Learn from the foreground (H, W) of the last picture on the background."""
        self._frame += 1
        if self._frame % EVERY:
            return
        blobs = find_blobs(mask, LEAST_AREA)
        labels, count = blobs.labels, len(blobs)
        lit = np.nonzero(self._shadows.remove(background.laid, background.picture(), labels > 0))
        everything = np.nonzero(labels)
        whole, bright = _sums(labels, everything, count), _sums(labels, lit, count)
        share = bright[:, 0] / np.maximum(whole[:, 0], 1.0)
        for k in np.flatnonzero((whole[:, 0] >= LEAST_AREA) & (share > BRIGHT[0]) & (share < BRIGHT[1])):
            self._offsets.append(2.0 * (whole[k, 1:] / whole[k, 0] - bright[k, 1:] / bright[k, 0]))
        if len(self._offsets) >= ENOUGH:
            offset = np.median(np.array(self._offsets), axis=0)
            self.offset = offset * min(1.0, LONGEST / max(float(np.hypot(*offset)), 1e-9))

    def take_off(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return a foreground (H, W) without the shadows: what is vehicle all along the offset from there."""
        reach = np.round(self.offset).astype(int)
        steps = int(np.abs(reach).max())
        if not steps:
            return mask
        ways = np.round(np.linspace(0.0, 1.0, steps + 1)[:, None] * reach).astype(int)
        kernel = np.zeros((2 * steps + 1, 2 * steps + 1), np.uint8)
        kernel[steps + ways[:, 1], steps + ways[:, 0]] = 1
        return np.asarray(cv2.erode(mask.view(np.uint8), kernel, borderValue=1).view(np.bool_))


def _sums(labels: Labels, at: tuple[NDArray[np.intp], ...], count: int) -> Floats:
    """Return (count, 3) pixels of each label, and the sums of their x and y."""
    numbers = labels[at]
    parts = [np.bincount(numbers, weight, count + 1)[1:] for weight in (None, at[1] + 0.5, at[0] + 0.5)]
    return np.column_stack(parts).astype(np.float64)
