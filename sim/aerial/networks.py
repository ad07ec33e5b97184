"""The road networks below the platform: highway-env's lanes, the ways through them, and their asphalt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.params import AerialRoadParams, RoadParams
from sim.roads import InCarRoad, Piece

Floats = NDArray[np.float64]
LaneIndex = tuple[str, str, int]

GRIP = 2.6
"""M/s^2 sideways that drivers accept on an arc."""
APPROACH = 1.3
"""M/s^2 of the braking before it."""
STEP = 2.0
"""Metres between the places of a path's table of speeds."""


@dataclass(frozen=True, slots=True)
class Path:
    """A way through a network.

    Attributes:
        lanes: highway-env's indices, in the order in which they are driven.
        starts: Metres along the path where each begins.
        length: Metres.
        pace: Allowed speed, m/s, every `STEP` metres.
    """

    lanes: tuple[LaneIndex, ...]
    starts: tuple[float, ...]
    length: float
    pace: tuple[float, ...]

    @classmethod
    def along(cls, network: Any, lanes: Sequence[LaneIndex]) -> Path:
        """Join lanes; speeds on arcs, and before them, follow from what drivers accept sideways."""
        parts = [network.get_lane(index) for index in lanes]
        ends = np.cumsum([part.length for part in parts])
        places = np.arange(0.0, ends[-1] + STEP, STEP)
        which = np.minimum(np.searchsorted(ends, places, side="right"), len(parts) - 1)
        square = np.array([GRIP * getattr(part, "radius", np.inf) for part in parts])[which]
        slack = 2 * APPROACH * places
        square = np.minimum.accumulate((square + slack)[::-1])[::-1] - slack
        starts = (0.0, *ends[:-1].tolist())
        return cls(tuple(lanes), starts, float(ends[-1]), tuple(np.sqrt(square).tolist()))

    def allowed(self, s: float) -> float:
        """Return the allowed speed ``s`` metres along, m/s."""
        return self.pace[min(max(int(s / STEP), 0), len(self.pace) - 1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """Where vehicles come into a network.

    Attributes:
        paths: Ways that they take from here; all begin on the same lane.
        shares: How many take each; they add up to 1.
        density: Vehicles per kilometre in the mean.
        rank: The lane's number from the left, and how many there are: fast ones to the left.
        stream: Which of the streams of traffic it feeds; each has waves of its own.
        filled: Metres of each path that are populated when the run begins.
    """

    paths: tuple[Path, ...]
    shares: tuple[float, ...]
    density: float
    rank: tuple[int, int]
    stream: int
    filled: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Strip:
    """A band of asphalt along a line, for those who paint it and keep clear of it.

    Attributes:
        line: (P, 2) points of its reference line, metres.
        headings: (P,) radians.
        s: (P,) metres along it.
        paved: (lowest d, highest d), metres to the left of the line.
        edges: (E,) offsets d of the painted lines.
        styles: (E,) as `sim.models.Ground.line_styles`.
    """

    line: Floats
    headings: Floats
    s: Floats
    paved: tuple[float, float]
    edges: Floats
    styles: NDArray[np.uint8]

    def beside(self, d: ArrayLike) -> Floats:
        """Return (P, 2) the line moved by ``d`` metres, one or (P,), to its left."""
        left = np.column_stack([-np.sin(self.headings), np.cos(self.headings)])
        return np.asarray(self.line + np.asarray(d, float).reshape(-1, 1) * left)


@dataclass(frozen=True, slots=True, kw_only=True)
class Signals:
    """The traffic lights of an intersection.

    Attributes:
        phases: Lanes that are green together, phase after phase.
        greens: Seconds of green of each phase.
        clearance: Seconds from the end of one green to the next.
        lines: Metres along each signalled lane at which one stops.
    """

    phases: tuple[tuple[LaneIndex, ...], ...]
    greens: tuple[float, ...]
    clearance: float
    lines: dict[LaneIndex, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Network:
    """Lanes on one level, which their vehicles never leave.

    Attributes:
        lanes: highway-env's `RoadNetwork`.
        entries: Where vehicles come in.
        strips: The asphalt.
        stop_lines: (K, 2, 2) metres, ends of painted stop lines.
        crossings: (C, 2, 2) metres, middle lines of zebra crossings.
        signals: Of an intersection.
    """

    lanes: Any
    entries: tuple[Entry, ...]
    strips: tuple[Strip, ...]
    stop_lines: Floats
    crossings: Floats
    signals: Signals | None = None


def strip_of(road: InCarRoad) -> Strip:
    """Return the asphalt of a road."""
    s = np.linspace(0.0, road.length, 2 + int(road.length / STEP))
    edges, styles = road.painted_lines()
    return Strip(
        line=np.column_stack(road.to_world(s, 0.0)),
        headings=road.heading(s),
        s=s,
        paved=road.paved,
        edges=edges,
        styles=styles,
    )


def along_road(road: InCarRoad, density: float, oncoming_density: float) -> Network:
    """Return the network of a road: a path for each of its lanes."""
    entries = []
    count = len(road.pieces)
    for same_way, per_km in ((True, density), (False, oncoming_density)):
        lanes = len(road.lane_offsets(same_way))
        for lane in range(lanes):
            ahead = [(f"f{k}", f"f{k + 1}", lane) for k in range(count)]
            back = [(f"b{k + 1}", f"b{k}", lane) for k in reversed(range(count))]
            path = Path.along(road.network, ahead if same_way else back)
            entries.append(
                Entry(
                    paths=(path,),
                    shares=(1.0,),
                    density=per_km,
                    rank=(lane, lanes),
                    stream=0 if same_way else 1,
                    filled=path.length,
                )
            )
    nothing = np.zeros((0, 2, 2))
    return Network(
        lanes=road.network,
        entries=tuple(entries),
        strips=(strip_of(road),),
        stop_lines=nothing,
        crossings=nothing,
    )


def lay_road(params: AerialRoadParams, reach: float, rng: np.random.Generator) -> InCarRoad:
    """Lay the main road of a network without crossings; it begins at the origin and heads east.

    Args:
        params: Which network, and how wide.
        reach: Metres of road that the camera may come to see.
        rng: Draws its course.
    """
    if params.network == "motorway":
        course = _bends(rng, reach, straights=(150.0, 240.0), radii=(700.0, 1600.0), turns=(0.10, 0.25))
        section = RoadParams(
            lanes=params.lanes,
            oncoming_lanes=params.lanes,
            lane_width=params.lane_width,
            median=3.4,
            shoulder=2.6,
        )
    elif params.network == "winding":
        course = _bends(rng, reach, straights=(38.0, 70.0), radii=(55.0, 120.0), turns=(0.7, 1.25))
        section = RoadParams(
            lanes=params.lanes,
            oncoming_lanes=params.lanes,
            lane_width=params.lane_width,
            median=0.4,
            shoulder=1.0,
        )
    else:
        radius = float(rng.uniform(27.0, 33.0))
        left = 1.0 if rng.random() < 0.5 else -1.0
        run = 0.5 * (reach - np.pi * radius)
        bend = (np.pi / 2 * radius, left / radius)
        course = [(run, 0.0), bend, bend, (run, 0.0)]
        section = RoadParams(
            lanes=params.lanes,
            oncoming_lanes=params.lanes,
            lane_width=params.lane_width,
            median=1.6,
            shoulder=1.4,
        )
    (length, curvature), *rest = course
    pieces = [Piece(0.0, length, 0.0, 0.0, 0.0, curvature)]
    for length, curvature in rest:
        pieces.append(pieces[-1].after(length, curvature))
    return InCarRoad(section, tuple(pieces))


def _bends(
    rng: np.random.Generator,
    reach: float,
    *,
    straights: tuple[float, float],
    radii: tuple[float, float],
    turns: tuple[float, float],
) -> list[tuple[float, float]]:
    """Draw (length, curvature) of straights and arcs, bending now left and now right."""
    course = [(float(rng.uniform(*straights)), 0.0)]
    side = 1.0 if rng.random() < 0.5 else -1.0
    first = True
    while sum(length for length, _ in course) < reach:
        radius, turn = float(rng.uniform(*radii)), float(rng.uniform(*turns))
        turn *= 0.5 if first else 1.0
        course.append((radius * turn, side / radius))
        course.append((float(rng.uniform(*straights)), 0.0))
        side, first = -side, False
    return course
