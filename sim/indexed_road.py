"""highway-env's road behind an index, so that a tick no longer costs the square of the number of vehicles.

Every answer is the one that highway-env itself gives, to the last bit. Two ideas make that cheap. Its queries
return vehicles and lanes, not numbers: they can be decided with any arithmetic whose error is known, and only a
decision closer than `TOLERANCE` is left to highway-env's own code. And vehicles move in `IndexedRoad.step`
alone, so that what was sorted when they began to decide (`IndexedRoad.act`) holds until all have decided.
"""

from __future__ import annotations

import math
from bisect import bisect_left
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
"""Metres around a cell within which its lanes lie. A vehicle farther than this from all lanes costs a full search."""
TWO_PI = 2 * math.pi


class _Chart:
    """A lane as plain numbers: local coordinates to within `TOLERANCE`."""

    __slots__ = ("exact", "half_width", "lane", "length", "margin", "numbers", "straight")

    def __init__(self, lane: AbstractLane) -> None:
        self.lane = lane
        self.length = float(lane.length)
        self.margin = float(lane.VEHICLE_LENGTH)
        self.straight = type(lane) is StraightLane
        self.exact = not self.straight and type(lane) is not CircularLane
        if self.straight:
            self.numbers = (*lane.start.tolist(), *lane.direction.tolist(), float(lane.heading))
        elif not self.exact:
            self.numbers = (
                *lane.center.tolist(),
                float(lane.radius),
                float(lane.start_phase),
                float(lane.direction),
            )

    def distance(self, x: float, y: float, heading: float) -> float:
        """`AbstractLane.distance_with_heading` of a straight or an arc."""
        if self.straight:
            x0, y0, ux, uy, along = self.numbers
            dx, dy = x - x0, y - y0
            s, r = dx * ux + dy * uy, dy * ux - dx * uy
        else:
            x0, y0, radius, start, sense = self.numbers
            dx, dy = x - x0, y - y0
            turn = (math.atan2(dy, dx) - start + math.pi) % TWO_PI - math.pi
            s, r = sense * turn * radius, radius - math.hypot(dx, dy)
            along = start + turn + math.pi / 2 * sense
        angle = (heading - along + math.pi) % TWO_PI - math.pi
        return abs(r) + max(s - self.length, 0.0) + max(-s, 0.0) + abs(angle)

    def coordinates(self, positions: Floats) -> tuple[Floats, Floats]:
        """Local coordinates of (N, 2) positions: along and across, (N,) each."""
        if self.exact:
            pairs = np.array([self.lane.local_coordinates(p) for p in positions], float).reshape(-1, 2)
            return pairs[:, 0], pairs[:, 1]
        dx, dy = positions[:, 0] - self.numbers[0], positions[:, 1] - self.numbers[1]
        if self.straight:
            _, _, ux, uy, _ = self.numbers
            return dx * ux + dy * uy, dy * ux - dx * uy
        _, _, radius, start, sense = self.numbers
        turn = (np.arctan2(dy, dx) - start + np.pi) % TWO_PI - np.pi
        return sense * turn * radius, sense * (radius - np.hypot(dx, dy))

    def on_lane(self, s: Floats, r: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Who is on the lane as `Road.neighbour_vehicles` sees it, and of whom that is not certain."""
        if self.exact:
            width = np.array([self.lane.width_at(one) for one in s])
        else:
            width = np.full(len(s), float(self.lane.width))
        slack = np.minimum(
            width / 2 + 1 - np.abs(r), np.minimum(s + self.margin, self.length + self.margin - s)
        )
        doubtful = np.abs(slack) <= TOLERANCE
        if not (
            self.exact or self.straight
        ):  # half a turn away, s jumps from one end of its range to the other
            doubtful |= np.abs(np.abs(s) - np.pi * self.numbers[2]) <= TOLERANCE
        return slack > 0, doubtful


class IndexedNetwork(RoadNetwork):
    """A network that finds the closest lane among those of one cell of a grid.

    Lanes must not be added once it is built.
    """

    def __init__(self, network: RoadNetwork) -> None:
        """Index the lanes of ``network``, whose graph is shared."""
        super().__init__()
        self.graph = network.graph
        self.charts: dict[LaneIndex, _Chart] = {i: _Chart(lane) for i, lane in self.lanes_dict().items()}
        self._known = not any(chart.exact for chart in self.charts.values())
        self._cells: dict[tuple[int, int], list[tuple[LaneIndex, _Chart]]] = {}
        if self._known:
            for index, chart in self.charts.items():
                for cell in sorted(_cells_near(chart)):
                    self._cells.setdefault(cell, []).append((index, chart))

    def get_closest_lane_index(self, position: Floats, heading: float | None = None) -> LaneIndex:
        """Return the index of the lane closest to a position and heading (see `RoadNetwork`)."""
        if heading is not None and self._known:
            x, y = float(position[0]), float(position[1])
            angle = float(heading)
            found, best, second = None, NEAR, math.inf
            for index, chart in self._cells.get((math.floor(x / CELL), math.floor(y / CELL)), ()):
                away = chart.distance(x, y, angle)
                if away < best:
                    found, best, second = index, away, best
                elif away < second:
                    second = away
            if found is not None and second - best > TOLERANCE:
                return found
        index: LaneIndex = super().get_closest_lane_index(position, heading)
        return index


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


class _Queue:
    """The vehicles on one lane and on those it is connected with, sorted along it."""

    __slots__ = ("order", "places", "uncertain", "vehicles")

    def __init__(
        self, pieces: list[tuple[_Chart, float]], vehicles: list[RoadObject], positions: Floats
    ) -> None:
        free = np.ones(len(vehicles), bool)
        s_all = np.zeros(len(vehicles))
        self.uncertain = False
        for chart, offset in pieces:
            s, r = chart.coordinates(positions)
            on, doubtful = chart.on_lane(s, r)
            self.uncertain |= bool(np.any(doubtful & free))
            taken = on & free
            s_all[taken] = s[taken] + offset
            free &= ~on
        chosen = np.flatnonzero(~free)
        chosen = chosen[np.argsort(s_all[chosen], kind="stable")]
        self.places = s_all[chosen].tolist()
        self.vehicles = [vehicles[i] for i in chosen.tolist()]

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


class IndexedRoad(Road):
    """highway-env's `Road` with the same answers, found through indices.

    During `act` the positions are taken to stand still, as they do for every vehicle of highway-env. A query
    at any other time indexes the vehicles anew.
    """

    def __init__(self, network: RoadNetwork, **options: Any) -> None:
        """Index ``network``; ``options`` are those of `Road`."""
        super().__init__(network=IndexedNetwork(network), **options)
        self._acting = False
        self._bodies: list[RoadObject] = []
        self._positions: Floats = np.zeros((0, 2))
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
        if not self._acting:
            self._index()
        queue = self._queues.get(lane_index)
        if queue is None:
            queue = self._queues[lane_index] = _Queue(
                self._search_lanes(lane_index), self._bodies, self._positions
            )
        s = self.network.get_lane(lane_index).local_coordinates(vehicle.position)[0]
        found = queue.around(vehicle, float(s))
        if found is None:
            exact: tuple[RoadObject | None, RoadObject | None] = super().neighbour_vehicles(
                vehicle, lane_index
            )
            return exact
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
        self._bodies = [b for b in [*self.vehicles, *self.objects] if not isinstance(b, Landmark)]
        self._positions = np.array([b.position for b in self._bodies], float).reshape(-1, 2)
        self._queues = {}

    def _search_lanes(self, lane_index: LaneIndex) -> list[tuple[_Chart, float]]:
        """Lanes that `Road.neighbour_vehicles` searches, in its order, with their offsets."""
        charts: dict[LaneIndex, _Chart] = self.network.charts
        graph = self.network.graph
        origin, target, lane_id = lane_index
        if lane_id is None:
            lane_id = 0
        chart = charts[origin, target, lane_id]
        pieces = [(chart, 0.0)]
        if self.neighbour_vehicles_connected_lanes:
            for onward, lanes in graph.get(target, {}).items():
                if lanes:
                    pieces.append((charts[target, onward, _same_or_first(lane_id, lanes)], chart.length))
            for source, onward_lanes in graph.items():
                if onward_lanes.get(origin):
                    before = charts[source, origin, _same_or_first(lane_id, onward_lanes[origin])]
                    pieces.append((before, -before.length))
        return pieces

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
