"""highway-env's road behind an index, so that a tick no longer costs the square of the number of vehicles.

Every answer is the one that highway-env itself gives, to the last bit. Two ideas make that cheap. Its queries
return vehicles and lanes, not numbers: they can be decided with any arithmetic whose error is known, and only
a decision closer than `TOLERANCE` is left to highway-env's own code. And vehicles move in `IndexedRoad.step`
alone, so that what was sorted when they began to decide (`IndexedRoad.act`) holds until all have decided.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from typing import Any

import numpy as np
from highway_env.road.lane import AbstractLane, CircularLane, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.objects import Landmark, RoadObject
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LaneIndex = tuple[str, str, int]

TOLERANCE = 1e-6
"""Metres. Decisions closer than this are left to highway-env; rounding errors are a million times smaller."""
CELL = 32.0
"""Metres: side of a cell of the lanes' index. Smaller cells hold fewer lanes and are more."""
NEAR = 12.0
"""Metres around a lane within which cells know of it. Farther from all lanes, every lane is searched."""
TWO_PI = 2 * math.pi


class _Chart:
    """A straight or circular lane as plain numbers: local coordinates to within `TOLERANCE`."""

    __slots__ = ("half_turn", "half_width", "lane", "length", "margin", "numbers", "straight")

    def __init__(self, lane: AbstractLane) -> None:
        self.lane = lane
        self.length = float(lane.length)
        self.margin = float(lane.VEHICLE_LENGTH)
        self.half_width = float(lane.width) / 2 + 1  # the margin of Road.neighbour_vehicles
        self.straight = type(lane) is StraightLane
        self.numbers: tuple[float, float, float, float, float]
        if self.straight:
            self.numbers = (*lane.start.tolist(), *lane.direction.tolist(), float(lane.heading))
            self.half_turn = math.inf
        else:
            bend = float(lane.radius), float(lane.start_phase), float(lane.direction)
            self.numbers = (*lane.center.tolist(), *bend)
            self.half_turn = math.pi * bend[0]

    def local(self, x: float, y: float) -> tuple[float, float]:
        """Local coordinates of a position: along and across, metres."""
        x0, y0, a, b, c = self.numbers
        dx, dy = x - x0, y - y0
        if self.straight:
            return dx * a + dy * b, dy * a - dx * b
        turn = (math.atan2(dy, dx) - b + math.pi) % TWO_PI - math.pi
        return c * turn * a, c * (a - math.hypot(dx, dy))

    def distance(self, x: float, y: float, heading: float) -> float:
        """`AbstractLane.distance_with_heading`, metres."""
        s, r = self.local(x, y)
        _, _, radius, start, along = self.numbers
        if not self.straight:
            along = start + along * (s / radius + math.pi / 2)
        angle = (heading - along + math.pi) % TWO_PI - math.pi
        away = abs(r) + abs(angle)
        if s < 0:
            return away - s
        return away + s - self.length if s > self.length else away

    def slack(self, s: float, r: float) -> float:
        """How far inside the lane `Road.neighbour_vehicles` sees a place; 0 where that is in doubt."""
        slack = min(self.half_width - abs(r), s + self.margin, self.length + self.margin - s)
        # Half a turn away, s jumps from one end of its range to the other.
        return 0.0 if abs(slack) <= TOLERANCE or abs(abs(s) - self.half_turn) <= TOLERANCE else slack


class IndexedNetwork(RoadNetwork):  # type: ignore[misc]
    """A network that finds the closest lane among those of one cell of a grid.

    Lanes must not be added once it is built. A network with other lanes than straights and arcs is not
    indexed: it answers as highway-env does, and as slowly.

    Attributes:
        charts: The lanes as numbers, or None where they are not indexed.
        sources: For each node the nodes from which roads lead to it, in the graph's order.
    """

    def __init__(self, network: RoadNetwork) -> None:
        """Index the lanes of ``network``, whose graph is shared."""
        super().__init__()
        self.graph = network.graph
        self.charts: dict[LaneIndex, _Chart] | None = None
        self._cells: dict[tuple[int, int], list[tuple[LaneIndex, _Chart]]] = {}
        self.sources: dict[str, list[str]] = {}
        for source, roads in self.graph.items():
            for target, road_lanes in roads.items():
                if road_lanes:
                    self.sources.setdefault(target, []).append(source)
        lanes = self.lanes_dict()
        if all(_is_plain(lane) for lane in lanes.values()):
            self.charts = {index: _Chart(lane) for index, lane in lanes.items()}
            for index, chart in self.charts.items():
                for cell in sorted(_cells_near(chart)):
                    self._cells.setdefault(cell, []).append((index, chart))

    def lanes_near(self, x: float, y: float) -> Sequence[tuple[LaneIndex, _Chart]]:
        """Return all lanes within `NEAR` of a place, and some more."""
        return self._cells.get((math.floor(x / CELL), math.floor(y / CELL)), ())

    def get_closest_lane_index(self, position: Floats, heading: float | None = None) -> LaneIndex:
        """Return the index of the lane closest to a position and heading (see `RoadNetwork`)."""
        if heading is not None:
            x, y = position.tolist()
            angle = float(heading)
            found, best, second = None, NEAR, math.inf
            for index, chart in self.lanes_near(x, y):
                away = chart.distance(x, y, angle)
                if away < best:
                    found, best, second = index, away, best
                elif away < second:
                    second = away
            if found is not None and second - best > TOLERANCE:
                return found
        closest: LaneIndex = super().get_closest_lane_index(position, heading)
        return closest


def _is_plain(lane: AbstractLane) -> bool:
    """Whether a lane is one that `_Chart` knows, and lies with its margins within `NEAR`."""
    return type(lane) in (StraightLane, CircularLane) and lane.width / 2 + 1 + lane.VEHICLE_LENGTH < NEAR


def _cells_near(chart: _Chart) -> set[tuple[int, int]]:
    """Cells that hold every point within `NEAR` of a lane."""
    steps = 1 + math.ceil(chart.length / CELL)
    pad = NEAR + CELL
    cells = set()
    for s in np.linspace(0, chart.length, steps + 1):
        x, y = chart.lane.position(s, 0)
        for i in range(math.floor((x - pad) / CELL), math.floor((x + pad) / CELL) + 1):
            for j in range(math.floor((y - pad) / CELL), math.floor((y + pad) / CELL) + 1):
                cells.add((i, j))
    return cells


class _Roll:
    """Who is on one lane: numbers of bodies, and how far along they are."""

    __slots__ = ("entries", "uncertain")

    def __init__(self) -> None:
        self.entries: list[tuple[int, float]] = []
        self.uncertain = False


class _Queue:
    """The vehicles on one lane and on those it is connected with, sorted along it."""

    __slots__ = ("places", "uncertain", "vehicles")

    def __init__(self, pieces: list[tuple[_Roll, float]], bodies: list[RoadObject]) -> None:
        self.uncertain = any(roll.uncertain for roll, _ in pieces)
        places: dict[int, float] = {}
        for roll, offset in pieces:
            for number, s in roll.entries:
                if number not in places:
                    places[number] = s + offset
        order = sorted(places, key=places.__getitem__)
        self.places = [places[number] for number in order]
        self.vehicles = [bodies[number] for number in order]

    def around(self, vehicle: RoadObject, s: float) -> tuple[Any, Any] | None:
        """Who precedes and who follows ``vehicle`` at ``s``; None where that is too close to call."""
        if self.uncertain:
            return None
        places, vehicles = self.places, self.vehicles
        split = bisect_left(places, s)
        ahead = split
        while ahead < len(places) and vehicles[ahead] is vehicle:
            ahead += 1
        behind = split - 1
        while behind >= 0 and vehicles[behind] is vehicle:
            behind -= 1
        front = rear = None
        if ahead < len(places):
            front = vehicles[ahead]
            beyond = ahead + 1
            if beyond < len(places) and vehicles[beyond] is vehicle:
                beyond += 1
            if places[ahead] - s <= TOLERANCE:
                return None
            if beyond < len(places) and places[beyond] - places[ahead] <= TOLERANCE:
                return None
        if behind >= 0:
            rear = vehicles[behind]
            beyond = behind - 1
            if beyond >= 0 and vehicles[beyond] is vehicle:
                beyond -= 1
            if s - places[behind] <= TOLERANCE:
                return None
            if beyond >= 0 and places[behind] - places[beyond] <= TOLERANCE:
                return None
        return front, rear


class IndexedRoad(Road):  # type: ignore[misc]
    """highway-env's `Road` with the same answers, found through indices.

    During `act` the positions are taken to stand still, as they do for every vehicle of highway-env. A query
    at any other time indexes the vehicles anew.
    """

    vehicles: list[Any]
    objects: list[RoadObject]

    def __init__(self, network: RoadNetwork, **options: Any) -> None:
        """Index ``network``; ``options`` are those of `Road`."""
        super().__init__(network=IndexedNetwork(network), **options)
        self._acting = False
        self._bodies: list[RoadObject] = []
        self._rolls: dict[_Chart, _Roll] = {}
        self._queues: dict[LaneIndex, _Queue] = {}

    def act(self) -> None:
        """Let every vehicle decide."""
        self._index()
        self._acting = True
        try:
            super().act()
        finally:
            self._acting = False

    def step(self, dt: float) -> None:
        """Move every vehicle, then look for collisions among those that are close.

        Args:
            dt: Seconds.
        """
        for vehicle in self.vehicles:
            vehicle.step(dt)
        bodies = [*self.vehicles, *self.objects]
        if len(bodies) > 1:
            self._collide(bodies, dt)

    def neighbour_vehicles(
        self, vehicle: RoadObject, lane_index: LaneIndex | None = None
    ) -> tuple[RoadObject | None, RoadObject | None]:
        """Return who precedes and who follows ``vehicle`` on a lane (see `Road.neighbour_vehicles`)."""
        lane_index = lane_index or vehicle.lane_index
        if not lane_index:
            return None, None
        charts = self.network.charts
        found = None
        if charts is not None and (chart := charts.get(lane_index)) is not None:
            if not self._acting:
                self._index()
            queue = self._queues.get(lane_index)
            if queue is None:
                queue = self._queues[lane_index] = _Queue(self._search_lanes(lane_index), self._bodies)
            found = queue.around(vehicle, chart.local(*vehicle.position.tolist())[0])
        if found is None:
            found = super().neighbour_vehicles(vehicle, lane_index)
        return found

    def close_objects_to(
        self,
        vehicle: RoadObject,
        distance: float,
        count: int | None = None,
        see_behind: bool = True,
        sort: bool = True,
        vehicles_only: bool = False,
    ) -> Any:
        """Return what lies within a distance (see `Road.close_objects_to`)."""
        whole = self.vehicles, self.objects
        self.vehicles, self.objects = (_within(vehicle, distance, group) for group in whole)
        try:
            return super().close_objects_to(vehicle, distance, count, see_behind, sort, vehicles_only)
        finally:
            self.vehicles, self.objects = whole

    def _index(self) -> None:
        """Note who is on which lane."""
        self._bodies = [b for b in [*self.vehicles, *self.objects] if not isinstance(b, Landmark)]
        self._rolls, self._queues = {}, {}
        for number, body in enumerate(self._bodies):
            x, y = body.position.tolist()
            for _, chart in self.network.lanes_near(x, y):
                s, r = chart.local(x, y)
                slack = chart.slack(s, r)
                if slack >= 0.0:
                    roll = self._rolls.get(chart)
                    if roll is None:
                        roll = self._rolls[chart] = _Roll()
                    roll.entries.append((number, s))
                    roll.uncertain |= slack == 0.0

    def _search_lanes(self, lane_index: LaneIndex) -> list[tuple[_Roll, float]]:
        """Lanes that `Road.neighbour_vehicles` searches, in its order, with their offsets."""
        charts: dict[LaneIndex, _Chart] = self.network.charts
        graph = self.network.graph
        origin, target, lane_id = lane_index
        chart = charts[lane_index]
        pieces = [(chart, 0.0)]
        if self.neighbour_vehicles_connected_lanes:
            for onward, lanes in graph.get(target, {}).items():
                if lanes:
                    pieces.append((charts[target, onward, _same_or_first(lane_id, lanes)], chart.length))
            for source in self.network.sources.get(origin, ()):
                before = charts[source, origin, _same_or_first(lane_id, graph[source][origin])]
                pieces.append((before, -before.length))
        nobody = _Roll()
        return [(self._rolls.get(piece, nobody), offset) for piece, offset in pieces]

    def _collide(self, bodies: list[RoadObject], dt: float) -> None:
        """Run highway-env's collision check on every pair that it could find touching, in its order."""
        positions = np.array([b.position for b in bodies], float)
        radii = np.array([b.diagonal for b in bodies]) / 2
        reach = np.array([b.speed for b in bodies]) * dt + radii
        x, y = positions[:, 0], positions[:, 1]
        order = np.argsort(x, kind="stable")
        sorted_x = x[order]
        widest = float(np.max(np.abs(reach)) + np.max(radii)) + TOLERANCE
        stops = np.searchsorted(sorted_x, sorted_x + widest, side="right")
        pairs = []
        for rank, stop in enumerate(stops.tolist()):
            if stop > rank + 1:
                others = order[rank + 1 : stop]
                one = order[rank]
                for other in others[np.abs(y[others] - y[one]) <= widest].tolist():
                    pairs.append((min(int(one), other), max(int(one), other)))
        moving = len(self.vehicles)
        for i, j in sorted(pairs):
            if i >= moving or math.hypot(x[i] - x[j], y[i] - y[j]) > reach[i] + radii[j] + TOLERANCE:
                continue
            if not _apart(bodies[i], bodies[j], dt):
                bodies[i].handle_collisions(bodies[j], dt)


def _same_or_first(lane_id: int, lanes: list[AbstractLane]) -> int:
    return lane_id if lane_id < len(lanes) else 0


def _within(vehicle: RoadObject, distance: float, group: list[RoadObject]) -> list[RoadObject]:
    """Those of ``group`` that may be closer than ``distance``."""
    x, y = vehicle.position.tolist()
    limit = distance + TOLERANCE
    return [b for b in group if math.hypot(b.position[0] - x, b.position[1] - y) <= limit]


def _apart(a: RoadObject, b: RoadObject, dt: float) -> bool:
    """Whether an edge of either rectangle separates the two for the whole of ``dt``.

    highway-env's polygon test then finds them apart on the same edge, now and later, and changes nothing.
    """
    dx, dy = (b.position - a.position).tolist()
    frames = []
    for body in (a, b):
        frames.append((math.cos(body.heading), math.sin(body.heading), body.LENGTH / 2, body.WIDTH / 2))
    (ca, sa, la, wa), (cb, sb, lb, wb) = frames
    vx = (a.speed * ca - b.speed * cb) * dt
    vy = (a.speed * sa - b.speed * sb) * dt
    cos, sin = abs(ca * cb + sa * sb), abs(sa * cb - ca * sb)
    for ux, uy, extent in (
        (-sa, ca, wa + lb * sin + wb * cos),
        (-sb, cb, wb + la * sin + wa * cos),
        (ca, sa, la + lb * cos + wb * sin),
        (cb, sb, lb + la * cos + wa * sin),
    ):
        if abs(dx * ux + dy * uy) - abs(vx * ux + vy * uy) > extent + TOLERANCE:
            return True
    return False
