"""Scattered scenery: across the road by paper 1's eq. (12), along it at random."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.params import SceneryParams
from sim.roads import InCarRoad
from sim.scenery.settings import MODELS, NEEDLES, SETTINGS, SIGNS, WALLS
from sim.scenery.yard import MARGIN, Yard

Floats = NDArray[np.float64]

X_MAX = 50.0
"""Eq. (12) is cut off here, metres to either side of the ego's way: it has no finite integral otherwise."""

CLEARING = 9.0
"""Metres before and behind a bridge that stay free of scattered things."""

_STEP = 0.02


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


def species_density(road: InCarRoad, params: SceneryParams, species: str, d: ArrayLike) -> Floats:
    """Return the density of a species' offsets d, not normalised.

    The sum over all species is eq. (12) about the middle of the ego's way, cut to what is not asphalt.
    """
    d = np.asarray(d, float)
    weights = SETTINGS[params.setting].weights
    low, high = road.paved
    away = np.maximum(low - d, d - high)
    each = {name: np.interp(away, *np.array(knots).T) for name, knots in weights.items()}
    free = (away >= MARGIN).astype(float)
    middle = float(np.mean(road.lane_offsets(True)))
    return np.asarray(offset_density(d - middle, params.corridor) * free * each[species] / sum(each.values()))


def place_bridges(yard: Yard) -> Floats:
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


def scatter(yard: Yard, species: str, bridges: Floats) -> None:
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
    names = MODELS[params.setting][species]
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
        yard.add(name, float(s), float(d), turn=turn, size=size, colour=_colour(yard, name, roll))


def _choose(
    yard: Yard, species: str, names: tuple[str, ...], room: float, d: float, roll: Floats
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


def _colour(yard: Yard, name: str, roll: Floats) -> ArrayLike:
    """Pick the paint of a piece."""
    if name in SIGNS:
        base = np.array(SIGNS[name])
        if name in ("sign-direction", "sign-motorway") and roll[6] < 0.4:
            base = np.array([0.05, 0.18, 0.45])
        return base
    if name.startswith("conifer"):
        return np.asarray(np.array(NEEDLES) * (0.88 + 0.24 * roll[7]))
    if name.startswith(("broadleaf", "bush")):
        return yard.leaves(float(roll[6]), float(roll[7]))
    return np.asarray(WALLS[int(roll[6] * len(WALLS))] * (0.85 + 0.3 * roll[7])).clip(0, 1)
