"""Lays out what the platform flies over: the roads, the bridges across them, and the land around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim.aerial.crossing import BOX, crossing_roads
from sim.aerial.land import Land
from sim.aerial.networks import Network, Strip, along_road, lay_road
from sim.aerial.overpass import Overpass
from sim.aerial.parcels import Free, divide
from sim.aerial.photo import photograph
from sim.aerial.replay import decks, middle_and_heading, surroundings
from sim.models import Ground, Model, Photo
from sim.params import AerialParams, AerialRoadParams
from sim.recorded import Recording
from sim.rng import stream
from sim.roads import PLAIN_DROP, InCarRoad
from sim.world import Bodies

Floats = NDArray[np.float64]
Area = tuple[float, float, float, float]

UNSEEN = 70.0
"""Metres of road beyond what the camera may see: vehicles come and go there."""
HAIRPIN = 380.0
"""Metres of a road with a U-turn, without what lies out of sight at its ends."""
SPACING = 82.0
"""Metres between the bridges over a road."""
ABUTMENT = 5.0
"""Metres from the asphalt to a bridge's abutments."""
STRETCH = 70.0
"""Metres of road on either side of a bridge that its embankments need not keep clear of."""
HORIZON = 900.0
"""Metres of plain land around the photographed area."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Roads and bridges, before any land.

    Attributes:
        network: The lanes on the ground.
        road: The main road, where there is one.
        course: (A, 2) points along which the camera's aim moves, metres apart by `Layout.step`.
        step: Metres between two of them.
        beyond: Metres of road before and behind the places that the camera aims at.
        start: Metres along the course at which the aim begins.
        across: Heading with which the road runs, radians.
        overpasses: The bridges.
    """

    network: Network
    road: InCarRoad | None
    course: Floats
    step: float
    beyond: float
    start: float
    across: float
    overpasses: tuple[Overpass, ...]

    def aim(self, s: float) -> Floats:
        """Return the point ``s`` metres along the course, (2,)."""
        places = np.arange(len(self.course)) * self.step
        return np.array([np.interp(s, places, self.course[:, k]) for k in (0, 1)])


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """All that stands still.

    Attributes:
        models: The catalogue, and the bridges.
        scenery: On the land.
        ground: Photographed from above.
    """

    models: tuple[Model, ...]
    scenery: Bodies
    ground: Ground


def lay_out(
    params: AerialParams, seconds: float, seed: int, view: float, recording: Recording | None = None
) -> Layout:
    """Draw roads and bridges.

    Args:
        params: Of the scene.
        seconds: How long the platform flies.
        seed: The episode's.
        view: Metres from its aim that the camera may see.
        recording: Traffic whose roads are taken, in place of a network of ours.
    """
    rng = stream(seed, "aerial", "roads")
    if recording is not None:
        return _around(params, seconds, recording, view, rng)
    traffic, beyond = params.traffic, view + UNSEEN
    if params.road.network == "intersection":
        network = crossing_roads(params.road, traffic, beyond)
        return _with_arms(params.road, network, beyond, rng)
    flown = abs(params.platform.speed) * seconds
    reach = 2 * beyond + max(flown, (params.road.bridges - 1) * SPACING) + 2 * params.platform.sway
    if params.road.network == "u-turn":
        reach = HAIRPIN + 2 * view
    road = lay_road(params.road, reach, rng)
    network = along_road(road, traffic.density, traffic.oncoming_density)
    step = 2.0
    places = np.arange(0.0, road.length, step)
    middle = (road.paved[0] + road.paved[1]) / 2
    course = np.column_stack(road.to_world(places, middle))
    if params.road.network == "u-turn":
        start = 0.0
        sites = road.pieces[0].end * np.array([0.55, 1.0, 0.3])[: params.road.bridges]
    else:
        start = 0.5 * (road.length - flown)
        offsets = (np.arange(params.road.bridges) - 0.5 * (params.road.bridges - 1)) * SPACING
        sites = 0.5 * road.length + offsets + rng.uniform(-8.0, 8.0, params.road.bridges)
    overpasses = _bridge_over(road, network.strips[0], sites.tolist(), params.road.bridge_width, rng)
    return Layout(
        network=network,
        road=road,
        course=course,
        step=step,
        beyond=beyond,
        start=start,
        across=float(road.heading(0.5 * road.length)) if params.road.network != "u-turn" else 0.0,
        overpasses=overpasses,
    )


def _around(
    params: AerialParams, seconds: float, recording: Recording, view: float, rng: np.random.Generator
) -> Layout:
    """Lay out what is around recorded traffic; the camera looks at the middle of it."""
    middle, heading = middle_and_heading(recording)
    ahead = np.array([np.cos(heading), np.sin(heading)])
    reach = abs(params.platform.speed) * seconds + params.platform.sway + 1.0
    places = np.arange(-reach, reach + 1.0)
    return Layout(
        network=surroundings(recording),
        road=None,
        course=middle + places[:, None] * ahead,
        step=1.0,
        beyond=view + UNSEEN,
        start=reach - 0.5 * params.platform.speed * seconds,
        across=heading,
        overpasses=decks(params.road, middle, heading, rng),
    )


def _with_arms(params: AerialRoadParams, network: Network, beyond: float, rng: np.random.Generator) -> Layout:
    """Put a viaduct over an arm, or two, of an intersection; the camera sees both it and the lights."""
    overpasses = []
    for k in range(params.bridges):
        away = BOX + 0.5 * params.bridge_width + float(rng.uniform(7.0, 16.0))
        side = 1.0 if k == 0 else -1.0
        overpasses.append(
            Overpass(
                name=f"overpass-{k}",
                x=side * away,
                y=0.0,
                heading=np.pi / 2 + float(rng.uniform(-0.12, 0.12)),
                span=2 * beyond,
                width=params.bridge_width * float(rng.uniform(0.92, 1.08)),
                carries="road",
                ramps=False,
            )
        )
    middle = 0.55 * overpasses[0].x if len(overpasses) == 1 else 0.0
    course = np.array([[middle, 0.0], [middle + 1.0, 0.0]])
    return Layout(
        network=network,
        road=None,
        course=course,
        step=1.0,
        beyond=beyond,
        start=0.0,
        across=0.0,
        overpasses=tuple(overpasses),
    )


def _bridge_over(
    road: InCarRoad, strip: Strip, sites: Sequence[float], width: float, rng: np.random.Generator
) -> tuple[Overpass, ...]:
    """Put bridges across a road near the given places along it; those without room are left out."""
    found: list[Overpass] = []
    for wanted in sites:
        for attempt in range(24):
            s = wanted + (rng.uniform(-6, 6) if attempt < 8 else rng.uniform(-40, 40))
            skew = float(rng.uniform(-0.35, 0.35))
            across = width * float(rng.uniform(0.9, 1.1))
            low, high = road.paved
            x, y = (float(v) for v in road.to_world(s, (low + high) / 2))
            span = (high - low) / np.cos(skew) + across * abs(np.tan(skew)) + 2 * ABUTMENT
            kinds = ("road",) if across > 18.0 else ("road", "road", "rail")
            overpass = Overpass(
                name=f"overpass-{len(found)}",
                x=x,
                y=y,
                heading=float(road.heading(s)) + np.pi / 2 + skew,
                span=float(span),
                width=across,
                carries=kinds[int(rng.integers(len(kinds)))],
            )
            if _has_room(overpass, s, strip, found):
                found.append(overpass)
                break
    return tuple(found)


def _has_room(overpass: Overpass, s: float, strip: Strip, others: Sequence[Overpass]) -> bool:
    """Whether a bridge over a road at ``s`` stays off other stretches of it, and off other bridges."""
    base = overpass.footprint()
    reach = base.paved[1]
    half = max(abs(strip.paved[0]), abs(strip.paved[1]))
    elsewhere = strip.line[np.abs(strip.s - s) > STRETCH]
    clear = len(elsewhere) == 0 or _gap(base.line, elsewhere) > half + reach
    return clear and all(
        _gap(base.line, other.footprint().line) > reach + other.footprint().paved[1] - 4.0 for other in others
    )


def _gap(one: Floats, other: Floats) -> float:
    """Shortest distance between (P, 2) and (Q, 2) points, metres."""
    return float(np.hypot(*(one[:, None] - other[None]).transpose(2, 0, 1)).min())


def furnish(
    params: AerialParams,
    layout: Layout,
    area: Area,
    catalogue: Sequence[Model],
    seed: int,
) -> Site:
    """Put land around the roads, and paint the ground.

    Args:
        params: Of the scene.
        layout: Roads and bridges.
        area: West, south, east, north, metres, of what may be seen.
        catalogue: Models to choose from.
        seed: The episode's.
    """
    models = (*catalogue, *(overpass.model() for overpass in layout.overpasses))
    approaches = tuple(strip for o in layout.overpasses for strip in o.approaches(layout.beyond))
    covered = tuple(overpass.footprint() for overpass in layout.overpasses)
    setting = params.scenery.setting
    rng = stream(seed, "aerial", "parcels")
    turn = layout.across + (float(rng.uniform(-0.2, 0.2)) if setting == "open" else 0.0)
    parcels = divide(area, setting, turn, rng)
    nothing = np.zeros((0, 2, 2))
    upper = replace(layout.network, strips=approaches, stop_lines=nothing, crossings=nothing)
    photo = photograph(
        area,
        parcels,
        (upper, layout.network),
        kerbs=setting != "open",
        rng=stream(seed, "aerial", "photo"),
    )
    free = Free((*layout.network.strips, *approaches, *covered))
    land = Land(models, params.scenery, area, free, seed)
    for k, overpass in enumerate(layout.overpasses):
        land.bridge(overpass, len(catalogue) + k)
    land.furnish(parcels)
    land.line((*layout.network.strips, *approaches))
    return Site(models=models, scenery=land.bodies(), ground=make_ground(photo))


def make_ground(photo: Photo) -> Ground:
    """Lay a photo flat, and a plain below it out to where nothing is seen."""
    south = photo.low[1]
    width, depth = photo.extent
    inner = np.array([[0, 0], [width, 0], [width, depth], [0, depth]]) + photo.low
    outer = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * HORIZON + inner
    vertices = np.zeros((8, 3))
    vertices[:4, :2], vertices[4:, :2], vertices[4:, 2] = inner, outer, -PLAIN_DROP
    # Offsets of the plain lie beyond those of the photo: nothing is painted there.
    off = np.array([0.0, 3 * (depth + HORIZON)])
    square = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    return Ground(
        vertices=vertices.astype(np.float32),
        coordinates=np.concatenate([inner, outer + off]).astype(np.float32),
        faces=np.concatenate([square, square + 4]),
        lane_edges=np.zeros(0),
        line_styles=np.zeros(0, np.uint8),
        paved=(south, south + depth),
        photo=photo,
    )
