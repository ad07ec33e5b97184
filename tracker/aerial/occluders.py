"""Where vehicles cannot be seen: learnt in the mosaic from where they are seen, and where they vanish."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tracker.filtering.assignment import Indices

Floats = NDArray[np.float64]

CELL = 8.0
"""Side of a cell, px."""
DOUBT = 1.0
"""Frames with a vehicle that is not in view that a new cell is taken to have had."""
MEMORY = 200.0
"""Frames after which what a cell has shown begins to fade: bridges shift as the camera moves."""


Cell = tuple[int, int, int]


class Occluders:
    """The chance, cell by cell and way by way, that a vehicle there can be seen.

    Ways are kept apart, since vehicles on a bridge are seen where those below are not.
    """

    def __init__(self) -> None:
        self._cells: dict[Cell, Floats] = {}

    def see(self, points: ArrayLike, headings: ArrayLike) -> None:
        """Take in where vehicles were seen, (K, 2), and where they headed, (K, 2) or (2,)."""
        self._count(points, headings, 0)

    def miss(self, points: ArrayLike, headings: ArrayLike) -> None:
        """Take in where vehicles were that could not be seen: on the way that joins two sights."""
        self._count(points, headings, 1)

    def visible(self, points: ArrayLike, headings: ArrayLike) -> Floats:
        """Return (K,) the chance that a vehicle at each of (K, 2) can be seen, 0 where nothing is known."""
        unknown = np.array([0.0, 0.0])
        seen = np.array([self._cells.get(cell, unknown) for cell in _cells(points, headings)]).reshape(-1, 2)
        return np.asarray(seen[:, 0] / (DOUBT + seen.sum(1)))

    def _count(self, points: ArrayLike, headings: ArrayLike, kind: int) -> None:
        for cell in dict.fromkeys(_cells(points, headings)):
            counts = self._cells.setdefault(cell, np.zeros(2))
            counts[kind] += 1.0
            if counts.sum() > MEMORY:
                counts *= 0.5


def _cells(points: ArrayLike, headings: ArrayLike) -> list[Cell]:
    at: Indices = np.floor(np.asarray(points, float).reshape(-1, 2) / CELL).astype(np.int64)
    x, y = np.broadcast_to(np.asarray(headings, float), at.shape).T
    ways = np.round(np.arctan2(y, x) / (np.pi / 2)).astype(np.int64) % 4
    return [(i, j, way) for (i, j), way in zip(at.tolist(), ways.tolist(), strict=True)]
