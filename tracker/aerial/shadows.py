"""Vehicles with the shadows they cast: all to one side, and most about as far.

Pixel by pixel a dark roof and a shadow are the same. But where a vehicle is bright its shadow can be told
from it (`tracker.motorcycle_lane.shadows`), and all vehicles have one sun: the offset that is learnt from
bright ones is taken off every outline.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from tracker.aerial.background import Background
from tracker.aerial.measuring import Labels, Outlines
from tracker.motorcycle_lane.shadows import Shadows

Floats = NDArray[np.float64]

EVERY = 5
"""Frames between two that are learnt from."""
BRIGHT = (0.3, 0.9)
"""Share of a region that is no shadow, where it tells of the offset."""
LEAST_AREA = 60
ENOUGH, MEMORY = 8, 120
MOST = 0.45
"""Share of an outline that a shadow takes at most."""


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

    def learn(self, background: Background, labels: Labels, count: int) -> None:
        """Learn from the regions 1 to ``count`` (H, W) of the last picture on the background."""
        self._frame += 1
        if self._frame % EVERY or not count:
            return
        lit = np.nonzero(self._shadows.remove(background.laid, background.picture(), labels > 0))
        everything = np.nonzero(labels)
        whole, bright = _sums(labels, everything, count), _sums(labels, lit, count)
        share = bright[:, 0] / np.maximum(whole[:, 0], 1.0)
        for k in np.flatnonzero((whole[:, 0] >= LEAST_AREA) & (share > BRIGHT[0]) & (share < BRIGHT[1])):
            self._offsets.append(2.0 * (whole[k, 1:] / whole[k, 0] - bright[k, 1:] / bright[k, 0]))
        if len(self._offsets) >= ENOUGH:
            self.offset = np.median(np.array(self._offsets), axis=0)

    def cast(self, centres: Floats, headings: Floats, sizes: Floats) -> tuple[Floats, Floats]:
        """Return centres and sizes (N, 2) of vehicles together with their shadows."""
        return centres + 0.5 * self.offset, sizes + self._lengths(headings)

    def lift(self, outlines: Outlines) -> Outlines:
        """Return outlines without the shadows."""
        sizes = np.maximum(outlines.sizes - self._lengths(outlines.headings), (1.0 - MOST) * outlines.sizes)
        return Outlines(
            centres=outlines.centres - 0.5 * self.offset,
            headings=outlines.headings,
            sizes=sizes,
            pixels=outlines.pixels,
        )

    def _lengths(self, headings: Floats) -> Floats:
        """Return (N, 2) how far a shadow reaches along and across headings, px."""
        across = headings[:, ::-1] * np.array([-1.0, 1.0])
        return np.asarray(np.abs(np.column_stack([headings @ self.offset, across @ self.offset])))


def _sums(labels: Labels, at: tuple[NDArray[np.intp], ...], count: int) -> Floats:
    """Return (count, 3) pixels of each label, and the sums of their x and y."""
    numbers = labels[at]
    parts = [np.bincount(numbers, weight, count + 1)[1:] for weight in (None, at[1] + 0.5, at[0] + 0.5)]
    return np.column_stack(parts).astype(np.float64)
