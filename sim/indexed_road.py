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

from sim.charts import CHART, NEAR, TOLERANCE, Floats, Ints, chart, closest, local, on_charts

LaneIndex = tuple[str, str, int]

CELL = 32.0
"""Metres: side of a cell of the lanes' index. Smaller cells hold fewer lanes and are more."""


class IndexedNetwork(RoadNetwork):  # type: ignore[misc]
    """A network that finds the closest lane among those of one cell of a grid.

    Lanes must not be added once it is built. A network with other lanes than straights and arcs is not
    indexed: it answers as highway-env does, and as slowly.

    Attributes:
        numbers: Number of each lane's chart, or None where they are not indexed.
        charts: (L,) `CHART` records.
        sources: For each node the nodes from which roads lead to it, in the graph's order.
    """

    def __init__(self, network: RoadNetwork) -> None:
        """Index the lanes of ``network``, whose graph is shared."""
        super().__init__()
        self.graph = network.graph
        self.numbers: dict[LaneIndex, int] | None = None
        self.sources: dict[str, list[str]] = {}
        for source, roads in self.graph.items():
            for target, road_lanes in roads.items():
                if road_lanes:
                    self.sources.setdefault(target, []).append(source)
        lanes = self.lanes_dict()
        if all(_is_plain(lane) for lane in lanes.values()):
            self._lanes = list(lanes.items())
            self.numbers = {index: number for number, index in enumerate(lanes)}
            self.charts = np.array([chart(lane) for lane in lanes.values()], CHART)
            self._frames = [row[:6] for row in self.charts.tolist()]
            cells: dict[tuple[int, int], list[int]] = {}
            for number, lane in enumerate(lanes.values()):
                for cell in sorted(_cells_near(lane)):
                    cells.setdefault(cell, []).append(number)
            self._near = np.array([number for cell in cells.values() for number in cell], np.int64)
            ends = np.cumsum([len(cell) for cell in cells.values()]).tolist()
            self._spans = dict(zip(cells, zip([0, *ends[:-1]], ends, strict=True), strict=True))

    def along(self, number: int, position: Floats) -> float:
        """Return how far along the chart of that number a position is, metres."""
        return float(local.py_func(*self._frames[number], *position.tolist())[0])

    def on_charts(self, places: Floats) -> tuple[Ints, Ints, Floats, NDArray[np.bool_]]:
        """Find on which charts each of (N, 3) places is; see `sim.charts.on_charts`."""
        finds: tuple[Ints, Ints, Floats, NDArray[np.bool_]] = on_charts(
            self.charts, self._near, self._spans_of(places), places
        )
        return finds

    def closest_lanes(self, places: Floats) -> list[tuple[LaneIndex, AbstractLane]]:
        """Return index and lane of the one closest to each of (N, 3) places: x, y and heading."""
        if self.numbers is None:
            found = [-1] * len(places)
        else:
            found = closest(self.charts, self._near, self._spans_of(places), places).tolist()
        return [
            self._lanes[number] if number >= 0 else self._searched(place)
            for number, place in zip(found, places, strict=True)
        ]

    def get_closest_lane_index(self, position: Floats, heading: float | None = None) -> LaneIndex:
        """Return the index of the lane closest to a position and heading (see `RoadNetwork`)."""
        if heading is None:
            index: LaneIndex = super().get_closest_lane_index(position)
            return index
        return self.closest_lanes(np.array([[*position, heading]], float))[0][0]

    def _searched(self, place: Floats) -> tuple[LaneIndex, AbstractLane]:
        """What highway-env finds, among all lanes."""
        index = super().get_closest_lane_index(place[:2], place[2])
        return index, self.get_lane(index)

    def _spans_of(self, places: Floats) -> Ints:
        """Give (N, 2) where the numbers of the charts around each place begin and end."""
        cells = np.floor(places[:, :2] / CELL).astype(int).tolist()
        spans = self._spans
        return np.array([spans.get((i, j), (0, 0)) for i, j in cells], np.int64).reshape(-1, 2)


def _is_plain(lane: AbstractLane) -> bool:
    """Whether a lane can be charted, and lies with its margins within `NEAR`."""
    return type(lane) in (StraightLane, CircularLane) and lane.width / 2 + 1 + lane.VEHICLE_LENGTH < NEAR


def _cells_near(lane: AbstractLane) -> set[tuple[int, int]]:
    """Cells that hold every point within `NEAR` of a lane."""
    steps = 1 + math.ceil(lane.length / CELL)
    pad = NEAR + CELL
    cells = set()
    for s in np.linspace(0, lane.length, steps + 1):
        x, y = lane.position(s, 0)
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
        self.moving = False
        """Whether vehicles need not look for their lanes: the road does when all have moved."""
        self._acting = False
        self._bodies: list[RoadObject] = []
        self._rolls: dict[int, _Roll] = {}
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
        self.moving = not self.record_history  # what is recorded has its lane
        try:
            for vehicle in self.vehicles:
                vehicle.step(dt)
        finally:
            self.moving = False
        if self.vehicles:
            found = self.network.closest_lanes(_places(self.vehicles))
            for vehicle, (index, lane) in zip(self.vehicles, found, strict=True):
                vehicle.lane_index, vehicle.lane = index, lane
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
        numbers = self.network.numbers
        found = None
        if numbers is not None and (number := numbers.get(lane_index)) is not None:
            if not self._acting:
                self._index()
            queue = self._queues.get(lane_index)
            if queue is None:
                queue = self._queues[lane_index] = _Queue(self._search_lanes(lane_index), self._bodies)
            found = queue.around(vehicle, self.network.along(number, vehicle.position))
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
        if self.network.numbers is None or not self._bodies:
            return
        finds = self.network.on_charts(_places(self._bodies))
        for body, number, s, doubt in zip(*(part.tolist() for part in finds), strict=True):
            roll = self._rolls.get(number)
            if roll is None:
                roll = self._rolls[number] = _Roll()
            roll.entries.append((body, s))
            roll.uncertain |= doubt

    def _search_lanes(self, lane_index: LaneIndex) -> list[tuple[_Roll, float]]:
        """Lanes that `Road.neighbour_vehicles` searches, in its order, with their offsets."""
        numbers: dict[LaneIndex, int] = self.network.numbers
        lengths = self.network.charts["length"]
        graph = self.network.graph
        origin, target, lane_id = lane_index
        own = numbers[lane_index]
        pieces = [(own, 0.0)]
        if self.neighbour_vehicles_connected_lanes:
            for onward, lanes in graph.get(target, {}).items():
                if lanes:
                    after = numbers[target, onward, _same_or_first(lane_id, lanes)]
                    pieces.append((after, float(lengths[own])))
            for source in self.network.sources.get(origin, ()):
                before = numbers[source, origin, _same_or_first(lane_id, graph[source][origin])]
                pieces.append((before, -float(lengths[before])))
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


def _places(bodies: Sequence[RoadObject]) -> Floats:
    """Give (N, 3) x, y and heading of at least one body."""
    return np.array([(*body.position.tolist(), body.heading) for body in bodies], float)


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
