"""What stands on the land: houses and halls on their plots, parked cars, woods, trees over the road."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.aerial.networks import Strip
from sim.aerial.overpass import Overpass
from sim.aerial.parcels import Free, Parcel, Use
from sim.aerial.photo import car_rows
from sim.fleet import PAINTS
from sim.models import Model
from sim.params import AerialSceneryParams
from sim.rng import stream
from sim.scenery.settings import LEAVES, WALLS
from sim.world import FIRST_SCENERY_ID, Bodies, Kind, Lamps, Role

Floats = NDArray[np.float64]

_TREES = ("broadleaf-a", "broadleaf-b", "broadleaf-c", "broadleaf-d", "broadleaf-e")
_HOUSES = ("house-a", "house-b", "house-c", "house-b")
_HALLS = ("hall", "block-b", "shops-a", "flats-a", "block-a", "offices", "hall", "flats-b")
_ROOFS = np.array([(0.80, 0.80, 0.80), (0.95, 0.93, 0.88), (0.72, 0.66, 0.62), (0.62, 0.66, 0.70)])
_WOOD_SPACING = 6.2
"""Metres between the trees of a wood, in the mean."""


class Land:
    """Collects what stands on the land."""

    def __init__(
        self,
        models: Sequence[Model],
        params: AerialSceneryParams,
        area: tuple[float, float, float, float],
        free: Free,
        seed: int,
    ) -> None:
        """Begin with empty land.

        Args:
            models: Of the scene, by whose names things are chosen.
            params: How much of what.
            area: West, south, east, north, metres: beyond it nothing is put.
            free: Says what is clear of the roads.
            seed: The episode's.
        """
        self._models, self._params, self._area, self._free, self._seed = models, params, area, free, seed
        self._index = {model.name: k for k, model in enumerate(models)}
        self._cars = [k for k, model in enumerate(models) if model.kind == Kind.CAR]
        rng = self._stream("leaves")
        self._hues = LEAVES[rng.permutation(len(LEAVES))[:4]] * rng.uniform(
            (0.80, 0.84, 0.74), (1.0, 0.98, 0.95)
        )
        self._rows: list[tuple[int, float, float, float, Floats, Floats]] = []

    def furnish(self, parcels: Sequence[Parcel]) -> None:
        """Put on each parcel what its use asks for."""
        for k, parcel in enumerate(parcels):
            rng = self._stream("parcel", k)
            if parcel.use is Use.WOOD:
                self._wood(parcel, rng)
            elif parcel.use is Use.GARDEN:
                self._garden(parcel, rng)
            elif parcel.use is Use.YARD:
                self._yard(parcel, rng)
            elif parcel.use is Use.STREET:
                self._street(parcel, rng)
            elif rng.random() < 0.7:
                self._hedge(parcel, rng)

    def line(self, strips: Sequence[Strip]) -> None:
        """Plant along the roads: bushes and trees on the verge, and some whose crowns hang over a lane."""
        for k, strip in enumerate(strips):
            if strip.s[-1] < 80.0 and len(strip.edges) == 0:
                continue
            rng = self._stream("verge", k)
            kilometres = float(strip.s[-1]) / 1000
            for side, edge in ((1, strip.paved[1]), (-1, strip.paved[0])):
                for _ in range(rng.poisson(self._params.overhang * kilometres)):
                    place = int(rng.integers(len(strip.line)))
                    for step in range(int(rng.integers(1, 4))):
                        at = min(place + 4 * step, len(strip.line) - 1)
                        away = float(rng.uniform(0.6, 1.8))
                        x, y = strip.beside(edge + side * away)[at].tolist()
                        self._tree(x, y, rng, wide=1.25, keep=0.3)
                for _ in range(rng.poisson(34.0 * self._params.trees * kilometres)):
                    place = int(rng.integers(len(strip.line)))
                    away = float(rng.gamma(2.0, 4.0)) + 3.0
                    x, y = strip.beside(edge + side * away)[place].tolist()
                    if rng.random() < 0.5:
                        self._tree(x, y, rng)
                    else:
                        self._bush(x, y, rng)

    def bridge(self, overpass: Overpass, model: int) -> None:
        """Add a bridge, and plants on one that carries earth."""
        concrete = np.array([0.86, 0.85, 0.82])
        size = np.array(self._models[model].size)
        self._rows.append((model, overpass.x, overpass.y, overpass.heading, size, concrete))

    def bodies(self) -> Bodies:
        """Return all pieces, numbered from `FIRST_SCENERY_ID`."""
        count = len(self._rows)
        if count == 0:
            return Bodies.empty()
        models = np.array([row[0] for row in self._rows], np.int32)
        return Bodies(
            ids=np.arange(FIRST_SCENERY_ID, FIRST_SCENERY_ID + count, dtype=np.uint32),
            kinds=np.array([self._models[k].kind for k in models], np.uint8),
            roles=np.full(count, Role.NONE, np.uint8),
            models=models,
            positions=np.array([(row[1], row[2], 0.0) for row in self._rows]),
            yaws=np.array([row[3] for row in self._rows]),
            velocities=np.zeros((count, 3)),
            sizes=np.array([row[4] for row in self._rows]),
            colours=np.array([row[5] for row in self._rows], np.float32),
            lamps=np.full(count, Lamps.OFF, np.uint8),
            leans=np.zeros((count, 2)),
        )

    def _add(self, name: str, x: float, y: float, yaw: float, size: Floats, colour: ArrayLike) -> None:
        west, south, east, north = self._area
        if west < x < east and south < y < north:
            self._rows.append((self._index[name], x, y, yaw, size, np.asarray(colour, float)))

    def _size(self, name: str) -> Floats:
        return np.array(self._models[self._index[name]].size)

    def _tree(
        self, x: float, y: float, rng: np.random.Generator, *, wide: float = 1.0, keep: float = 3.2
    ) -> None:
        """Plant a tree whose trunk stands ``keep`` metres from any asphalt at least."""
        name = _TREES[int(rng.integers(len(_TREES)))]
        size = self._size(name) * wide * rng.uniform(0.75, 1.15) * np.array([1, 1, rng.uniform(0.85, 1.1)])
        if self._free.room(x, y) < keep:
            return
        hue = self._hues[int(len(self._hues) * rng.random() ** 1.4)]
        self._add(name, x, y, float(rng.uniform(0, 6.28)), size, (hue * rng.uniform(0.78, 1.08)).clip(0, 1))

    def _bush(self, x: float, y: float, rng: np.random.Generator) -> None:
        name = ("bush-a", "bush-b", "bush-c")[int(rng.integers(3))]
        if self._free.room(x, y) < 1.8:
            return
        hue = self._hues[int(rng.integers(len(self._hues)))] * rng.uniform(0.8, 1.05)
        self._add(
            name, x, y, float(rng.uniform(0, 6.28)), self._size(name) * rng.uniform(0.8, 1.5), hue.clip(0, 1)
        )

    def _wood(self, parcel: Parcel, rng: np.random.Generator) -> None:
        count = int(parcel.length * parcel.width / _WOOD_SPACING**2 * min(self._params.trees, 1.5))
        for a, b in rng.uniform(-0.5, 0.5, (count, 2)):
            self._tree(*parcel.at(a * parcel.length, b * parcel.width), rng, keep=4.5)

    def _hedge(self, parcel: Parcel, rng: np.random.Generator) -> None:
        """Plant a row of bushes and trees along one side of a field."""
        side = float(rng.choice([-0.5, 0.5])) * parcel.width
        for a in np.arange(-parcel.length / 2, parcel.length / 2, 5.0):
            roll = rng.random()
            place = parcel.at(a + rng.uniform(-2, 2), side + rng.uniform(-0.8, 0.8))
            if roll < 0.30 * self._params.trees:
                self._tree(*place, rng)
            elif roll < 0.75:
                self._bush(*place, rng)

    def _garden(self, parcel: Parcel, rng: np.random.Generator) -> None:
        """Build a house with its back to the garden; trees and bushes behind it, often a car on the drive."""
        name = _HOUSES[int(rng.integers(len(_HOUSES)))]
        size = self._size(name) * np.array([rng.uniform(1.0, 1.35), rng.uniform(0.95, 1.15), 1.0])
        x, y = parcel.at(0.08 * parcel.length * (parcel.roll[5] - 0.5), -0.04 * parcel.width)
        reach = float(np.hypot(*size[:2])) / 2
        if self._params.buildings and self._free.room(x, y) > reach + 2.0:
            turn = parcel.heading + (np.pi / 2 if size[1] > size[0] else 0.0)
            self._add(name, x, y, turn, size, WALLS[int(rng.integers(len(WALLS)))])
            if rng.random() < 0.5:
                a = (parcel.roll[2] - 0.5) * 0.6 * parcel.length
                self._car(*parcel.at(a, -0.38 * parcel.width), parcel.heading + np.pi / 2, rng)
        for _ in range(rng.poisson(3.2 * self._params.trees)):
            a = rng.uniform(-0.46, 0.46) * parcel.length
            b = float(rng.choice([rng.uniform(0.24, 0.48), rng.uniform(-0.48, -0.34)])) * parcel.width
            place = parcel.at(a, b)
            if rng.random() < 0.55:
                self._tree(*place, rng, wide=0.7)
            else:
                self._bush(*place, rng)

    def _yard(self, parcel: Parcel, rng: np.random.Generator) -> None:
        """Build on the far side of a yard and park cars on the near one."""
        name = _HALLS[int(rng.integers(len(_HALLS)))]
        size = self._size(name) * np.array([1.0, 1.0, rng.uniform(0.8, 1.2)])
        size[:2] *= min(0.86 * parcel.length / size[0], 0.46 * parcel.width / size[1], 1.5)
        x, y = parcel.at(0.0, -0.46 * parcel.width + size[1] / 2)
        reach = float(np.hypot(*size[:2])) / 2
        if self._params.buildings and self._free.room(x, y) > reach + 2.0:
            self._add(name, x, y, parcel.heading, size, _ROOFS[int(rng.integers(len(_ROOFS)))])
        full = rng.uniform(0.2, 0.8)
        for across in car_rows(parcel):
            for along in np.arange(-parcel.length / 2 + 5.3, parcel.length / 2 - 4.0, 2.6):
                if rng.random() < full:
                    turn = parcel.heading + np.pi / 2 + (np.pi if rng.random() < 0.4 else 0.0)
                    self._car(*parcel.at(float(along), across + rng.normal(0, 0.15)), turn, rng)
        for _ in range(rng.poisson(2.0 * self._params.trees)):
            a = rng.uniform(-0.48, 0.48) * parcel.length
            self._tree(*parcel.at(a, 0.49 * parcel.width), rng, wide=0.75)

    def _street(self, parcel: Parcel, rng: np.random.Generator) -> None:
        """Park cars and plant trees along a street."""
        for side in (-1, 1):
            for a in np.arange(-parcel.length / 2, parcel.length / 2, 8.5):
                roll = rng.random()
                if roll < 0.16:
                    turn = parcel.heading + (np.pi if side > 0 else 0.0)
                    self._car(*parcel.at(float(a), side * (parcel.width / 2 - 2.2)), turn, rng)
                elif roll < 0.16 + 0.16 * self._params.trees:
                    self._tree(*parcel.at(float(a), side * (parcel.width / 2 + 0.6)), rng, wide=0.75)

    def _car(self, x: float, y: float, yaw: float, rng: np.random.Generator) -> None:
        if self._free.room(x, y) < 3.5:
            return
        model = self._models[self._cars[int(rng.integers(len(self._cars)))]]
        shares = np.cumsum([share for share, _, _ in PAINTS])
        _, paint, _ = PAINTS[min(int(np.searchsorted(shares, rng.random())), len(PAINTS) - 1)]
        self._add(model.name, x, y, yaw + rng.normal(0, 0.02), np.array(model.size), paint)

    def _stream(self, *names: str | int) -> np.random.Generator:
        return stream(self._seed, "aerial", "land", *names)
