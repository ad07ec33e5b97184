"""Where measurements come to nothing: leaves that sway, lamps that flicker, and other clutter has its places.

The density of clutter is estimated from place to place, as it is in Musicki, Suvorova, Morelande, Moran,
Clutter map and target tracking, FUSION 2005: here as the share of all that was measured at a place that no
rider was found to have caused.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CELL = 8.0
"""Side of a place, px; what is measured in one tells of its neighbours, too."""
AT_FIRST = 1.0
"""So many measurements of riders are presumed at each place, and so many of nothing."""


class ClutterMap:
    """What was measured where, of riders and of nothing."""

    def __init__(self, width: int, height: int) -> None:
        self._limits = np.array([width, height], float) - 1.0
        cells = (self._limits // CELL).astype(int) + 3
        self._riders, self._nothing = np.full(cells, AT_FIRST), np.full(cells, AT_FIRST)

    def add_riders(self, boxes: Floats) -> None:
        """Take in the boxes (N, 4), px, of riders: where one is now, others may come."""
        lower, upper = self._cells(boxes[:, :2]), self._cells(boxes[:, 2:]) + 1
        for (x0, y0), (x1, y1) in zip(lower, upper, strict=True):
            self._riders[x0:x1, y0:y1] += 1.0

    def add_nothing(self, places: Floats, counts: Floats) -> None:
        """Take in places (N, 2), px, where so often (N,) something was measured that was no rider."""
        if not len(places):
            return
        cells = self._cells(places)
        for step in np.ndindex(3, 3):
            x, y = (cells + step - 1).T
            np.add.at(self._nothing, (x, y), counts)

    def share(self, places: Floats) -> Floats:
        """Return (N,) which share of what is measured at ``places`` (N, 2) is clutter."""
        x, y = self._cells(places).T
        nothing = self._nothing[x, y]
        return np.asarray(nothing / (nothing + self._riders[x, y]))

    def _cells(self, places: Floats) -> NDArray[np.int64]:
        return (np.clip(places, 0.0, self._limits) // CELL).astype(np.int64) + 1
