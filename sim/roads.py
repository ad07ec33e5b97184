"""The road: a reference line of straights and arcs, highway-env's lanes beside it, and the ground it lies on.

highway-env's plane has its y axis down: `from_plane` and `to_plane` are the only places that know.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.models import Ground
from sim.params import RoadParams

Floats = NDArray[np.float64]

LEAD_IN = 400.0
"""Metres of straight road before s = 0, so that traffic can come up from behind."""
MAX_TURN = np.radians(75.0)
"""Headings stay within this of east, so that the road never meets itself."""
MAX_ARC = np.radians(85.0)
"""highway-env's arcs must stay below half a turn; ours stay below a quarter (and see `MAX_TURN`)."""
STRAIGHTS = (110.0, 220.0)
"""Metres: shortest and longest straight between two arcs. Drivers look one lane ahead: not much shorter."""
SAGITTA = 0.015
"""Metres by which the ground's facets may miss an arc."""
LAND = 400.0
"""Metres of land that follow the road on either side; the horizon lies on a plain quad below."""
HORIZON = 1500.0
"""Metres of plain land around the road's bounding box."""
PLAIN_DROP = 0.05
"""Metres by which the plain lies below the road."""


def from_plane(position: ArrayLike, heading: float) -> tuple[float, float, float]:
    """Turn highway-env's (x, y) and heading into world x, y (metres) and yaw (radians)."""
    x, y = np.asarray(position, float)
    return float(x), float(-y), -float(heading)


def to_plane(x: float, y: float) -> Floats:
    """Turn world x, y into a position of highway-env."""
    return np.array([x, -y])


@dataclass(frozen=True, slots=True)
class Piece:
    """A straight or an arc of the reference line, in world axes.

    Attributes:
        start: s where it begins, metres.
        length: Metres.
        curvature: 1/m, positive turns left; 0 is a straight.
        x: Of its beginning, metres.
        y: Likewise.
        heading: There, radians.
    """

    start: float
    length: float
    curvature: float
    x: float
    y: float
    heading: float

    @property
    def end(self) -> float:
        """S where it ends, metres."""
        return self.start + self.length

    def after(self, length: float, curvature: float) -> Piece:
        """Return the piece that continues this one."""
        x, y, heading = _along(self, np.array(self.length))
        return Piece(self.end, length, curvature, float(x), float(y), float(heading))


def _along(piece: Piece, run: Floats) -> tuple[Floats, Floats, Floats]:
    """World x, y and heading on the reference line, ``run`` metres into a piece (any shape)."""
    heading = piece.heading + piece.curvature * run
    half = 0.5 * piece.curvature * run
    chord = run * np.sinc(half / np.pi)
    x = piece.x + chord * np.cos(piece.heading + half)
    y = piece.y + chord * np.sin(piece.heading + half)
    return np.asarray(x, float), np.asarray(y, float), np.asarray(heading, float)


class InCarRoad:
    """A carriageway each way along one reference line, keep right; the ego's way has d < 0.

    Attributes:
        params: What it was made of.
        pieces: Straights and arcs, in order, from s = -LEAD_IN to ``length``.
        length: The road's last s, metres.
        network: highway-env's `RoadNetwork`. Lanes are numbered from the left as their drivers see it.
            Forward lanes of piece k run from node "f<k>" to "f<k+1>", backward ones from "b<k+1>" to "b<k>".
        paved: Lowest and highest d of the asphalt.
    """

    def __init__(self, params: RoadParams, pieces: tuple[Piece, ...]) -> None:
        """Lay lanes along ``pieces``."""
        self.params = params
        self.pieces = pieces
        self.length = pieces[-1].end
        half = params.median / 2
        self.paved = (
            -half - params.lanes * params.lane_width - params.shoulder,
            half + params.oncoming_lanes * params.lane_width + params.shoulder,
        )
        self._starts = np.array([p.start for p in pieces])
        self._columns = {
            name: np.array([getattr(p, name) for p in pieces])
            for name in ("start", "length", "curvature", "x", "y", "heading")
        }
        self.network = self._make_network()

    def lane_offsets(self, same_way: bool) -> Floats:
        """Return the offsets d of the lanes' middles, from the left as their drivers see it."""
        count = self.params.lanes if same_way else self.params.oncoming_lanes
        away: Floats = (
            self.params.median / 2 + (np.arange(count, dtype=np.float64) + 0.5) * self.params.lane_width
        )
        return -away if same_way else away

    def to_world(self, s: ArrayLike, d: ArrayLike) -> tuple[Floats, Floats]:
        """Turn arc length s and offset d to the left (metres, broadcast) into world x, y."""
        s, d = np.broadcast_arrays(np.asarray(s, float), np.asarray(d, float))
        piece = self._piece_at(s)
        run = s - piece["start"]
        half = 0.5 * piece["curvature"] * run
        chord = run * np.sinc(half / np.pi)
        heading = piece["heading"] + 2 * half
        x = piece["x"] + chord * np.cos(piece["heading"] + half) - d * np.sin(heading)
        y = piece["y"] + chord * np.sin(piece["heading"] + half) + d * np.cos(heading)
        return np.asarray(x, float), np.asarray(y, float)

    def heading(self, s: ArrayLike) -> Floats:
        """Return the reference line's heading, radians counter-clockwise from east."""
        s = np.asarray(s, float)
        piece = self._piece_at(s)
        return np.asarray(piece["heading"] + piece["curvature"] * (s - piece["start"]))

    def curvature(self, s: ArrayLike) -> Floats:
        """Return the reference line's curvature, 1/m, positive to the left."""
        return np.asarray(self._piece_at(np.asarray(s, float))["curvature"])

    def locate(self, x: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
        """Turn world x, y into arc length s and offset d of the nearest point of the reference line."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        best = np.full(x.shape, np.inf)
        s_best, d_best = np.zeros(x.shape), np.zeros(x.shape)
        last = len(self.pieces) - 1
        for index, piece in enumerate(self.pieces):
            run, d = _project(piece, x, y)
            beyond = np.zeros_like(run)
            if index > 0:
                beyond = np.maximum(beyond, -run)
            if index < last:
                beyond = np.maximum(beyond, run - piece.length)
            away = np.abs(d) + beyond
            closer = away < best
            best = np.where(closer, away, best)
            s_best = np.where(closer, piece.start + run, s_best)
            d_best = np.where(closer, d, d_best)
        return s_best, d_best

    def ground(self) -> Ground:
        """Return the road band with its land, and the plain below it out to the horizon."""
        from sim.ground import make_ground  # scipy's tree is not needed by those who only drive

        return make_ground(self)

    def painted_lines(self) -> tuple[Floats, NDArray[np.uint8]]:
        """Return the painted lines' offsets, left to right, and styles (see `sim.models.Ground`)."""
        p, half = self.params, self.params.median / 2
        marks: list[tuple[float, int]] = []
        for i in range(p.oncoming_lanes, 0, -1):
            marks.append((half + i * p.lane_width, 1 if i == p.oncoming_lanes else 2))
        if p.oncoming_lanes and p.median < 0.6:
            marks.append((0.0, 4))
        elif p.oncoming_lanes:
            marks += [(half, 3), (-half, 3)]
        else:
            marks.append((-half, 3))
        for i in range(1, p.lanes + 1):
            marks.append((-half - i * p.lane_width, 1 if i == p.lanes else 2))
        return np.array([d for d, _ in marks]), np.array([style for _, style in marks], np.uint8)

    def _piece_at(self, s: Floats) -> dict[str, Floats]:
        index = np.clip(np.searchsorted(self._starts, s, side="right") - 1, 0, len(self.pieces) - 1)
        return {name: column[index] for name, column in self._columns.items()}

    def _make_network(self) -> Any:
        from highway_env.road.road import RoadNetwork

        network = RoadNetwork()
        for k, piece in enumerate(self.pieces):
            for d in self.lane_offsets(same_way=True):
                network.add_lane(f"f{k}", f"f{k + 1}", self._lane(piece, d, forward=True))
            for d in self.lane_offsets(same_way=False):
                network.add_lane(f"b{k + 1}", f"b{k}", self._lane(piece, d, forward=False))
        return network

    def _lane(self, piece: Piece, d: float, *, forward: bool) -> Any:
        """Make highway-env's lane ``d`` beside a piece."""
        from highway_env.road.lane import CircularLane, StraightLane

        common = {"width": self.params.lane_width, "speed_limit": None}
        if piece.curvature == 0.0:
            ends = []
            for run in (0.0, piece.length):
                x, y, heading = (float(a) for a in _along(piece, np.array(run)))
                ends.append(to_plane(x - d * np.sin(heading), y + d * np.cos(heading)))
            return StraightLane(*(ends if forward else ends[::-1]), **common)
        # A left turn in the world is a falling heading, hence a falling phase, in highway-env's plane.
        radius, left = 1 / abs(piece.curvature), piece.curvature > 0
        side = 1.0 if left else -1.0
        centre = to_plane(
            piece.x - side * radius * np.sin(piece.heading), piece.y + side * radius * np.cos(piece.heading)
        )
        first = -piece.heading + side * np.pi / 2
        last = first - side * piece.length * abs(piece.curvature)
        phases = (first, last) if forward else (last, first)
        return CircularLane(centre, radius - side * d, *phases, clockwise=left != forward, **common)


def _project(piece: Piece, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Metres into a piece, beyond its ends too, and offset d to the left, of world points."""
    dx, dy = x - piece.x, y - piece.y
    cos, sin = np.cos(piece.heading), np.sin(piece.heading)
    ahead, left = dx * cos + dy * sin, dy * cos - dx * sin
    if piece.curvature == 0.0:
        return ahead, left
    radius = 1 / piece.curvature  # signed: the centre lies at left = radius
    side = np.sign(radius)
    angle = np.arctan2(side * ahead, side * (radius - left))
    return angle * radius, side * (abs(radius) - np.hypot(ahead, radius - left))


def build_road(params: RoadParams, length: float, rng: np.random.Generator) -> InCarRoad:
    """Lay a road that starts at world (0, 0) heading east.

    Args:
        params: Lanes, widths and curves.
        length: Metres of road from s = 0 on; a curved one may come out a little longer.
        rng: Draws the curves.

    Returns:
        The road, with `LEAD_IN` metres of straight road before s = 0.

    Raises:
        ValueError: If ``length`` is not positive, or the radii are out of order or too tight for the road.
    """
    if not length > 0:
        raise ValueError(f"a road's length is more than 0 m, not {length}")
    if not params.curved:
        return InCarRoad(params, (Piece(-LEAD_IN, LEAD_IN + length, 0.0, -LEAD_IN, 0.0, 0.0),))
    widest = (
        params.median / 2 + max(params.lanes, params.oncoming_lanes) * params.lane_width + params.shoulder
    )
    if not widest + 5 < params.min_radius <= params.max_radius:
        raise ValueError(
            f"road.min_radius must lie between {widest + 5:.1f} m (the road's half width and 5 m) and "
            f"road.max_radius = {params.max_radius:g} m, not at {params.min_radius:g} m"
        )
    pieces = [Piece(-LEAD_IN, LEAD_IN + rng.uniform(*STRAIGHTS), 0.0, -LEAD_IN, 0.0, 0.0)]
    while pieces[-1].end < length:
        radius = np.exp(rng.uniform(np.log(params.min_radius), np.log(params.max_radius)))
        heading = pieces[-1].after(0.0, 0.0).heading
        # Turn back toward east when far from it, else to either side.
        left = rng.random() < 0.5 - 0.5 * heading / MAX_TURN
        room = MAX_TURN - heading if left else MAX_TURN + heading
        turn = min(max(rng.uniform(0.5, 1.0) * room, 100.0 / radius), room, MAX_ARC)
        pieces.append(pieces[-1].after(turn * radius, (1 if left else -1) / radius))
        pieces.append(pieces[-1].after(rng.uniform(*STRAIGHTS), 0.0))
    return InCarRoad(params, tuple(pieces))
