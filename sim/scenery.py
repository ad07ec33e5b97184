"""What stands beside the road: scattered by paper 1's eq. (12), lined up along the edge, or far on the horizon."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.models import Model
from sim.params import SceneryParams
from sim.rng import stream
from sim.world import FIRST_SCENERY_ID, Bodies, Lamps, Role

Floats = NDArray[np.float64]

X_MAX = 50.0
"""Eq. (12) is cut off here, metres to either side of the ego's way: it has no finite integral otherwise."""

MARGIN = 0.6
"""Free space beside the asphalt, metres."""

SEGMENT = 16.0
"""Length of a piece of rail, wall or fence as it is placed, metres."""

CLEARING = 9.0
"""Metres before and behind a bridge that stay free of scattered things."""

MEDIAN_BARRIER = 2.0
"""Medians wider than this carry a barrier, metres."""

_STEP = 0.02


class Road(Protocol):
    """What scenery asks of a road (`sim.roads.InCarRoad`)."""

    length: float
    paved: tuple[float, float]

    def lane_offsets(self, same_way: bool) -> Floats:
        """Offsets d of the lanes' middles."""

    def to_world(self, s: ArrayLike, d: ArrayLike) -> tuple[Floats, Floats]:
        """World x, y of a place along and beside the road."""

    def heading(self, s: ArrayLike) -> Floats:
        """Heading of the reference line."""

    def locate(self, x: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
        """Arc length and offset of a world point."""


Knots = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Setting:
    """Which things stand how far from the asphalt.

    Attributes:
        per_km: Scattered things a kilometre, all species together.
        weights: For each species, (distance from the asphalt's edge in metres, weight) knots, joined by lines. Only
            the ratio between the species matters: together they always follow eq. (12).
    """

    per_km: float
    weights: Mapping[str, Knots]


SETTINGS = {
    "motorway": Setting(
        per_km=110.0,
        weights={
            "tree": ((0, 0.0), (5, 0.0), (9, 3.0), (50, 5.0)),
            "bush": ((0, 0.0), (1, 1.0), (6, 4.0), (14, 2.0), (50, 1.0)),
            "sign": ((0, 1.0), (2, 1.6), (4, 0.4), (6, 0.0), (50, 0.0)),
            "pole": ((0, 0.6), (5, 0.6), (9, 0.2), (50, 0.05)),
            "building": ((0, 0.0), (18, 0.0), (25, 0.25), (50, 0.6)),
        },
    ),
    "rural": Setting(
        per_km=150.0,
        weights={
            "tree": ((0, 0.0), (2, 0.0), (4, 2.5), (50, 5.0)),
            "bush": ((0, 0.2), (1, 2.0), (5, 3.0), (12, 2.0), (50, 1.0)),
            "sign": ((0, 1.0), (2, 1.0), (3.5, 0.0), (50, 0.0)),
            "pole": ((0, 0.8), (3, 0.8), (7, 0.3), (10, 0.05), (50, 0.05)),
            "building": ((0, 0.0), (12, 0.0), (16, 0.25), (50, 0.35)),
        },
    ),
    "urban": Setting(
        per_km=150.0,
        weights={
            "tree": ((0, 0.0), (2, 0.6), (4, 2.0), (8, 1.2), (50, 1.0)),
            "bush": ((0, 0.2), (3, 0.6), (7, 0.8), (10, 0.2), (50, 0.2)),
            "sign": ((0, 1.5), (2, 1.5), (4, 0.2), (5, 0.0), (50, 0.0)),
            "pole": ((0, 1.0), (2, 1.0), (5, 0.1), (50, 0.0)),
            "building": ((0, 0.0), (8, 0.0), (9, 2.5), (50, 4.0)),
        },
    ),
}

SPECIES = ("tree", "bush", "sign", "pole", "building")

_MODELS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "motorway": {
        "tree": (
            "broadleaf-a",
            "broadleaf-b",
            "broadleaf-c",
            "broadleaf-d",
            "broadleaf-e",
            "conifer-a",
            "conifer-b",
        ),
        "bush": ("bush-a", "bush-b", "bush-c"),
        "sign": ("sign-motorway", "sign-direction", "sign-speed", "sign-diamond"),
        "pole": ("pole-a", "delineator"),
        "building": ("hall", "barn", "house-b"),
    },
    "rural": {
        "tree": ("broadleaf-a", "broadleaf-b", "broadleaf-c", "broadleaf-e", "broadleaf-d", "conifer-a"),
        "bush": ("bush-a", "bush-b", "bush-c"),
        "sign": ("sign-direction", "sign-speed", "sign-warning", "sign-diamond"),
        "pole": ("pole-b", "delineator"),
        "building": ("house-a", "house-b", "house-c", "barn"),
    },
    "urban": {
        "tree": ("broadleaf-a", "broadleaf-c", "broadleaf-e", "broadleaf-d"),
        "bush": ("bush-a", "bush-c"),
        "sign": ("sign-direction", "sign-speed", "sign-warning", "sign-diamond"),
        "pole": ("pole-b", "delineator"),
        "building": ("block-a", "block-b", "block-c", "house-a", "house-b", "house-c"),
    },
}

_WALLS = np.array(
    [(0.86, 0.82, 0.72), (0.80, 0.74, 0.66), (0.72, 0.55, 0.45), (0.85, 0.85, 0.83), (0.62, 0.60, 0.57)]
)
_SIGNS = {
    "sign-speed": (0.93, 0.93, 0.91),
    "sign-warning": (0.90, 0.90, 0.86),
    "sign-diamond": (0.93, 0.70, 0.10),
    "sign-direction": (0.06, 0.33, 0.20),
    "sign-motorway": (0.05, 0.30, 0.18),
    "gantry": (0.05, 0.30, 0.18),
    "delineator": (0.90, 0.90, 0.88),
}


def offset_density(offset: ArrayLike, corridor: float) -> Floats:
    """Paper 1's eq. (12): how likely a static thing stands ``offset`` metres beside the camera's way.

    Args:
        offset: X, metres, any shape.
        corridor: D, metres: raising it empties a wider corridor; the peak lies at about 1.7 D.

    Returns:
        (1 - exp(-X^2 / 2 D^2)) / (1 + |X|) within `X_MAX`, 0 beyond; not normalised.
    """
    x = np.asarray(offset, float)
    density = (1 - np.exp(-(x**2) / (2 * corridor**2))) / (1 + np.abs(x))
    return np.asarray(np.where(np.abs(x) <= X_MAX, density, 0.0))


def species_density(road: Road, params: SceneryParams, species: str, d: ArrayLike) -> Floats:
    """Return the density of a species' offsets d, not normalised.

    The sum over all species is eq. (12) about the middle of the ego's way, cut to what lies outside the asphalt.
    """
    d = np.asarray(d, float)
    weights = SETTINGS[params.setting].weights
    low, high = road.paved
    away = np.maximum(low - d, d - high)
    each = {name: np.interp(away, *np.array(knots).T) for name, knots in weights.items()}
    free = (away >= MARGIN).astype(float)
    middle = float(np.mean(road.lane_offsets(True)))
    return np.asarray(offset_density(d - middle, params.corridor) * free * each[species] / sum(each.values()))


def place_scenery(
    road: Road, params: SceneryParams, night: bool, catalogue: Sequence[Model], seed: int
) -> Bodies:
    """Place everything that stands beside a road.

    Trees, bushes, signs, poles and buildings are scattered: along the road as Poisson processes (trees in clumps,
    buildings evenly), across it by eq. (12). Rails, walls, lamp posts and delineators stand in lines at fixed
    offsets and woods and hills beyond `X_MAX`: they are no part of eq. (12). Each species has random streams of its
    own, so that more of one moves none of another; only a bridge clears what would stick out of it.

    Args:
        road: Where.
        params: What and how much.
        night: Whether motorways too are lined with lamp posts in stretches.
        catalogue: Models to choose from, by name.
        seed: Of the episode.

    Returns:
        The pieces, ids from `FIRST_SCENERY_ID` on.
    """
    yard = _Yard(road, params, catalogue, seed)
    bridges = _bridges(yard)
    for species in SPECIES:
        _scatter(yard, species, bridges)
    _lines(yard, night)
    _horizon(yard)
    return yard.bodies()


class _Yard:
    """Collects pieces on their way to `Bodies`."""

    def __init__(self, road: Road, params: SceneryParams, catalogue: Sequence[Model], seed: int) -> None:
        self.road = road
        self.params = params
        self.seed = seed
        self.catalogue = catalogue
        self.index = {model.name: i for i, model in enumerate(catalogue)}
        self._rows: list[tuple[int, float, float, float, Floats, Floats]] = []

    def stream(self, *names: str) -> np.random.Generator:
        """Return the stream of one purpose."""
        return stream(self.seed, "scenery", *names)

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
        colour: ArrayLike = (0.8, 0.8, 0.8),
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
        colour: ArrayLike = (0.8, 0.8, 0.8),
    ) -> None:
        """Add a piece at a world point."""
        extent = self.size(name) if size is None else size
        self._rows.append((self.index[name], x, y, yaw, extent, np.asarray(colour, float)))

    def bodies(self) -> Bodies:
        """Return all pieces but those that a bend has brought onto another stretch of the asphalt."""
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
        )

    def clear_of_road(self, s: float, d: float, reach: float) -> bool:
        """Whether a piece that reaches ``reach`` metres stays off the asphalt of every stretch."""
        _, near = self.road.locate(*self.road.to_world(s, d))
        low, high = self.road.paved
        return bool(near < low - reach - MARGIN / 2 or near > high + reach + MARGIN / 2)


def _bridges(yard: _Yard) -> Floats:
    """Place overhead bridges; return where they cross, s in metres."""
    rng = yard.stream("bridge")
    low, high = yard.road.paved
    count = rng.poisson(yard.params.bridges * yard.road.length / 1000)
    places = np.sort(rng.uniform(120, max(121.0, yard.road.length - 60), count))
    places = places[np.diff(places, prepend=-1e9) > 150]
    for s in places:
        name = ("bridge-a", "bridge-b")[rng.integers(2)]
        size = yard.size(name)
        # The piers stand at 70 % of the width, outside the asphalt.
        size[1] = (high - low + 2 * 1.6) / 0.70 + 4
        yard.add(name, float(s), (low + high) / 2, turn=rng.uniform(-0.06, 0.06), size=size)
    return np.asarray(places)


def _scatter(yard: _Yard, species: str, bridges: Floats) -> None:
    """Place one species by its own density and from its own streams."""
    road, params = yard.road, yard.params
    low, high = road.paved
    middle = float(np.mean(road.lane_offsets(True)))
    grid = np.arange(middle - X_MAX, middle + X_MAX, _STEP) + _STEP / 2
    density = species_density(road, params, species, grid)
    away = np.maximum(low - grid, grid - high)
    everything = float((offset_density(grid - middle, params.corridor) * (away >= MARGIN)).sum())
    share = float(density.sum()) / everything
    expected = SETTINGS[params.setting].per_km * params.density * share * road.length / 1000
    count = int(yard.stream(species, "count").poisson(expected))
    if count == 0:
        return
    rolls = yard.stream(species, "pieces").random((count, 8))
    cumulative = np.cumsum(density) / density.sum()
    offsets = grid[np.minimum(np.searchsorted(cumulative, rolls[:, 0]), len(grid) - 1)]
    if species == "building":
        along = road.length * (np.arange(count) + 0.2 + 0.6 * rolls[:, 1]) / count
    elif species == "tree":
        clump = np.arange(count) // 4
        centres = yard.stream(species, "clumps").random(count // 4 + 1) * road.length
        along = (centres[clump] + 26 * (rolls[:, 1] - 0.5)) % road.length
    else:
        along = road.length * rolls[:, 1]
    names = _MODELS[params.setting][species]
    built: list[tuple[float, float, float, float]] = []
    for s, d, roll in zip(along, offsets, rolls, strict=True):
        if len(bridges) and np.abs(bridges - s).min() < CLEARING:
            continue
        room = max(low - d, d - high) - MARGIN / 2
        name, size, turn = _choose(yard, species, names, room, d, roll)
        reach = size[1] / 2
        if not yard.clear_of_road(float(s), float(d), reach):
            continue
        if species == "building":
            if any(
                abs(s - s1) < (size[0] + l1) / 2 + 1 and abs(d - d1) < (size[1] + w1) / 2 + 1
                for s1, d1, l1, w1 in built
            ):
                continue
            built.append((float(s), float(d), float(size[0]), float(size[1])))
        yard.add(name, float(s), float(d), turn=turn, size=size, colour=_colour(name, roll))


def _choose(
    yard: _Yard, species: str, names: tuple[str, ...], room: float, d: float, roll: Floats
) -> tuple[str, Floats, float]:
    """Pick a model that fits into ``room`` metres to the asphalt: its name, size and turn."""
    start = int(roll[2] * len(names))
    order = [*names[start:], *names[:start]]
    fitting = [name for name in order if yard.size(name)[1] / 2 <= room]
    name = fitting[0] if fitting else min(names, key=lambda n: float(yard.size(n)[1]))
    size = yard.size(name)
    # Signs face those who drive on their side.
    facing = 0.0 if d < 0 else np.pi
    if species in ("tree", "bush"):
        size = size * (0.75 + 0.5 * roll[3]) * np.array([1, 1, 0.9 + 0.25 * roll[4]])
        size[:2] *= min(1.0, room / (size[:2].max() / 2))
        return name, size, 2 * np.pi * roll[5]
    if species == "sign":
        return name, size, facing + 0.12 * (roll[5] - 0.5)
    if species == "building":
        return name, size, facing
    return name, size, facing


def _colour(name: str, roll: Floats) -> ArrayLike:
    """Pick the paint of a piece."""
    if name in _SIGNS:
        base = np.array(_SIGNS[name])
        if name in ("sign-direction", "sign-motorway") and roll[6] < 0.4:
            base = np.array([0.05, 0.18, 0.45])
        return base
    return np.asarray(_WALLS[int(roll[6] * len(_WALLS))] * (0.85 + 0.3 * roll[7])).clip(0, 1)


def _stretches(rng: np.random.Generator, count: int, share: float, run: float) -> NDArray[np.bool_]:
    """Return (count,) flags in runs of about ``run`` segments, ``share`` of them set."""
    flags = np.zeros(count, bool)
    place = 0
    on = bool(rng.random() < share)
    while place < count:
        mean = run if on else run * (1 - share) / max(share, 1e-3)
        length = 1 + int(rng.exponential(mean))
        flags[place : place + length] = on
        place += length
        on = share >= 1 or (share > 0 and not on)
    return flags


def _line(yard: _Yard, name: str, d: float, flags: NDArray[np.bool_], *, segment: float = SEGMENT) -> None:
    """Place pieces end to end at offset ``d`` where ``flags`` is set."""
    size = yard.size(name)
    size[0] = segment
    reach = size[1] / 2
    for i in np.flatnonzero(flags):
        s = (float(i) + 0.5) * segment
        if d != 0 and not yard.clear_of_road(s, d, reach):
            continue
        # On the outer side of a bend the pieces lie further apart than on the reference line.
        (x0, x1), (y0, y1) = yard.road.to_world(np.array([s - segment / 2, s + segment / 2]), d)
        fitted = size.copy()
        fitted[0] = float(np.hypot(x1 - x0, y1 - y0)) + 0.02
        yard.add_at(name, float(x0 + x1) / 2, float(y0 + y1) / 2, float(np.arctan2(y1 - y0, x1 - x0)), fitted)


def _posts(yard: _Yard, name: str, d: float, every: float, *, turn: float = 0.0, first: float = 0.5) -> None:
    """Place posts at even distances at offset ``d``."""
    for s in np.arange(first * every, yard.road.length, every):
        if yard.clear_of_road(float(s), d, float(yard.size(name)[1]) / 2):
            yard.add(name, float(s), d, turn=turn, colour=_SIGNS.get(name, (0.8, 0.8, 0.8)))


def _lines(yard: _Yard, night: bool) -> None:
    """Place rails, walls, fences, lamp posts, delineators and gantries."""
    road, params = yard.road, yard.params
    low, high = road.paved
    count = int(road.length / SEGMENT)
    lanes = road.lane_offsets(True)
    inner_right, inner_left = float(lanes.max()), road.lane_offsets(False)
    gap = float(inner_left.min() - inner_right) if len(inner_left) else 0.0
    lane_width = float(abs(np.diff(lanes)[0])) if len(lanes) > 1 else 3.6
    if gap - lane_width > MEDIAN_BARRIER:
        kind = ("barrier", "rail")[yard.stream("median").integers(2)]
        _line(yard, kind, (inner_right + float(inner_left.min())) / 2, np.full(count, params.density > 0))
    for side, edge in (("right", low), ("left", high)):
        out = -1.0 if side == "right" else 1.0
        inward = 0.0 if side == "right" else np.pi
        share = min(1.0, {"motorway": 0.55, "rural": 0.12, "urban": 0.0}[params.setting] * params.density)
        rails = _stretches(yard.stream("rail", side), count, share, 14)
        _line(yard, "rail", edge + out * 0.85, rails)
        walls = _stretches(
            yard.stream("wall", side), count, min(1.0, {"motorway": 0.14, "rural": 0.0, "urban": 0.10}[params.setting] * params.density), 12
        )  # fmt: skip
        _line(
            yard,
            "noise-wall" if params.setting == "motorway" else "wall",
            edge + out * (4.0 if params.setting == "motorway" else 3.2),
            walls,
        )
        fences = _stretches(
            yard.stream("fence", side),
            count,
            min(1.0, {"motorway": 0.25, "rural": 0.25, "urban": 0.2}[params.setting] * params.density),
            9,
        )
        _line(
            yard,
            "fence",
            edge + out * {"motorway": 11.0, "rural": 6.0, "urban": 5.2}[params.setting],
            fences & ~walls,
        )
        if params.density == 0:
            continue
        if params.setting == "urban" or (params.setting == "motorway" and night):
            name = "lamp-post-a" if params.setting == "motorway" else "lamp-post-b"
            _posts(
                yard,
                name,
                edge + out * (yard.size(name)[1] / 2 + 0.4),
                38.0,
                turn=inward,
                first=0.3 if side == "right" else 0.8,
            )
        if params.setting == "motorway":
            _posts(yard, "delineator", edge + out * 0.45, 50.0, turn=inward)
        elif params.setting == "rural":
            _posts(yard, "delineator", edge + out * 0.55, 50.0, turn=inward)
            if side == ("right", "left")[yard.stream("wires").integers(2)]:
                _posts(yard, "pole-b", edge + out * 7.0, 45.0)
    if params.setting == "motorway":
        rng = yard.stream("gantry")
        for s in rng.uniform(60, road.length, rng.poisson(0.7 * params.density * road.length / 1000)):
            size = yard.size("gantry")
            size[1] = high - low + 2 * 1.3
            yard.add("gantry", float(s), (low + high) / 2, size=size, colour=_SIGNS["gantry"])


def _horizon(yard: _Yard) -> None:
    """Place woods from 65 to 260 m and hills from 450 to 1000 m beside and beyond the road."""
    road = yard.road
    rng = yard.stream("woods")
    for side in (-1.0, 1.0):
        for s in np.arange(-40.0, road.length + 900, 110.0):
            roll = rng.random(6)
            d = side * (65 + 195 * roll[0] ** 1.5)
            if roll[1] > 0.75:
                continue
            size = yard.size("woods-a") * (0.8 + 0.5 * roll[2], 1.0, 0.7 + 0.6 * roll[3])
            _far(
                yard,
                f"woods-{'abc'[int(roll[4] * 3)]}",
                s + 60 * roll[5],
                d,
                0.25 * (roll[5] - 0.5),
                size,
                45.0,
            )
    rng = yard.stream("hills")
    for side in (-1.0, 1.0):
        for s in np.arange(0.0, road.length + 2000, 520.0):
            roll = rng.random(6)
            size = yard.size("hill-a") * (0.8 + 0.6 * roll[0], 1.0, 0.5 + 0.9 * roll[1])
            d = side * (450 + 550 * roll[2])
            _far(
                yard,
                f"hill-{'abc'[int(roll[3] * 3)]}",
                s + 300 * roll[4],
                d,
                0.5 * (roll[5] - 0.5),
                size,
                300.0,
            )
    for i in range(3):
        roll = rng.random(3)
        size = yard.size("hill-a") * (1.2, 1.0, 0.5 + 0.6 * roll[0])
        _far(
            yard,
            f"hill-{'abc'[i]}",
            road.length + 900 + 250 * i,
            400 * (roll[1] - 0.5),
            np.pi / 2 + 0.3 * (roll[2] - 0.5),
            size,
            0.0,
        )


def _far(yard: _Yard, name: str, s: float, d: float, turn: float, size: Floats, keep: float) -> None:
    """Place a far thing, unless a bend brings the asphalt within ``keep`` metres of its middle."""
    end = yard.road.length
    on = min(s, end)
    x, y = (float(a) for a in yard.road.to_world(on, d))
    heading = float(yard.road.heading(on))
    x, y = x + (s - on) * np.cos(heading), y + (s - on) * np.sin(heading)
    along = np.linspace(0, end, max(2, int(end / 25)))
    xs, ys = yard.road.to_world(along, 0.0)
    if float(np.hypot(xs - x, ys - y).min()) < keep:
        return
    yard.add_at(name, x, y, heading + turn, size)
