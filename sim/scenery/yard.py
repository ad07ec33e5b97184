"""Collects pieces of scenery on their way to `Bodies`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.models import Model
from sim.params import SceneryParams
from sim.rng import stream
from sim.roads import InCarRoad
from sim.scenery.settings import LEAVES
from sim.world import FIRST_SCENERY_ID, Bodies, Lamps, Role

Floats = NDArray[np.float64]

MARGIN = 0.6
"""Free space beside the asphalt, metres."""

GREY = (0.8, 0.8, 0.8)


class Yard:
    """The pieces placed so far, and the road that they stay clear of."""

    def __init__(self, road: InCarRoad, params: SceneryParams, catalogue: Sequence[Model], seed: int) -> None:
        self.road = road
        self.params = params
        self.seed = seed
        self.catalogue = catalogue
        self.index = {model.name: i for i, model in enumerate(catalogue)}
        # A drive shows a few hues of leaves only, and all of them moister or drier.
        rng = self.stream("leaves")
        self._hues = LEAVES[rng.permutation(len(LEAVES))[:3]] * rng.uniform(
            (0.90, 0.92, 0.85), (1.12, 1.05, 1.1)
        )
        self._rows: list[tuple[int, float, float, float, Floats, Floats]] = []

    def stream(self, *names: str | int) -> np.random.Generator:
        """Return the stream of one purpose."""
        return stream(self.seed, "scenery", *names)

    def leaves(self, pick: float, shade: float) -> Floats:
        """Return the colour of a plant's leaves by two numbers in [0, 1)."""
        # The first hue is the commonest.
        hue = self._hues[int(len(self._hues) * pick**1.5)]
        return np.asarray(hue * (0.86 + 0.28 * shade)).clip(0, 1)

    def size(self, name: str) -> Floats:
        """Return a model's own size."""
        return np.array(self.catalogue[self.index[name]].size)

    def add(
        self,
        name: str,
        s: float,
        d: float,
        *,
        turn: float = 0.0,
        size: Floats | None = None,
        colour: ArrayLike = GREY,
    ) -> None:
        """Add a piece at (s, d), turned against the road's heading."""
        x, y = self.road.to_world(s, d)
        self.add_at(name, float(x), float(y), float(self.road.heading(s)) + turn, size, colour)

    def add_at(
        self,
        name: str,
        x: float,
        y: float,
        yaw: float,
        size: Floats | None,
        colour: ArrayLike = GREY,
    ) -> None:
        """Add a piece at a world point."""
        extent = self.size(name) if size is None else size
        self._rows.append((self.index[name], x, y, yaw, extent, np.asarray(colour, float)))

    def bodies(self) -> Bodies:
        """Return all pieces, numbered from `FIRST_SCENERY_ID`."""
        count = len(self._rows)
        if count == 0:
            return Bodies.empty()
        models = np.array([row[0] for row in self._rows], np.int32)
        positions = np.array([(row[1], row[2], 0.0) for row in self._rows])
        return Bodies(
            ids=np.arange(FIRST_SCENERY_ID, FIRST_SCENERY_ID + count, dtype=np.uint32),
            kinds=np.array([self.catalogue[i].kind for i in models], np.uint8),
            roles=np.full(count, Role.NONE, np.uint8),
            models=models,
            positions=positions,
            yaws=np.array([row[3] for row in self._rows]),
            velocities=np.zeros((count, 3)),
            sizes=np.array([row[4] for row in self._rows]),
            colours=np.array([row[5] for row in self._rows], np.float32),
            lamps=np.full(count, Lamps.OFF, np.uint8),
            leans=np.zeros((count, 2)),
        )

    def clear_of_road(self, s: float, d: float, reach: float) -> bool:
        """Whether a piece that reaches ``reach`` metres stays off the asphalt of every stretch."""
        _, near = self.road.locate(*self.road.to_world(s, d))
        low, high = self.road.paved
        return bool(near < low - reach - MARGIN / 2 or near > high + reach + MARGIN / 2)
