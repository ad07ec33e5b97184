"""Where vehicles cannot be seen: learnt in the mosaic from where they are seen, and where they vanish."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tracker.filtering.assignment import Indices

Floats = NDArray[np.float64]

CELL = 8.0
"""Side of a cell, px."""
SEEN, HIDDEN = 2.0, 0.5
"""Frames with a vehicle in view, and with one that is not, that a new cell is taken to have had."""
MEMORY = 200.0
"""Frames after which what a cell has shown begins to fade: bridges shift as the camera moves."""


class Occluders:
    """The chance, cell by cell, that a vehicle there can be seen."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], Floats] = {}

    def see(self, points: ArrayLike) -> None:
        """Take in where vehicles were seen, (K, 2)."""
        self._count(points, 0)

    def miss(self, points: ArrayLike) -> None:
        """Take in where vehicles were, (K, 2), that could not be seen: on the way that joins two sights."""
        self._count(points, 1)

    def visible(self, points: ArrayLike) -> Floats:
        """Return (K,) the chance that a vehicle at each of (K, 2) can be seen, as far as objects go."""
        unknown = np.array([0.0, 0.0])
        seen = np.array([self._cells.get(cell, unknown) for cell in _cells(points)]).reshape(-1, 2)
        return np.asarray((SEEN + seen[:, 0]) / (SEEN + HIDDEN + seen.sum(1)))

    def _count(self, points: ArrayLike, kind: int) -> None:
        for cell in dict.fromkeys(_cells(points)):
            counts = self._cells.setdefault(cell, np.zeros(2))
            counts[kind] += 1.0
            if counts.sum() > MEMORY:
                counts *= 0.5


def _cells(points: ArrayLike) -> list[tuple[int, int]]:
    at: Indices = np.floor(np.asarray(points, float).reshape(-1, 2) / CELL).astype(np.int64)
    return [(x, y) for x, y in at.tolist()]
