"""Who is on the road: a window of traffic that goes along with the camera car.

Vehicles enter and leave far from the camera car: ahead beyond 600 m, behind out of its view. So a tick costs
the same on a road of any length.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, replace

import numpy as np

from sim.drivers import Driver
from sim.fleet import Draw, Fleet
from sim.indexed_road import IndexedRoad
from sim.pace import Pace
from sim.params import TrafficParams
from sim.rng import stream
from sim.roads import InCarRoad

AHEAD, BEHIND, BEHIND_ONCOMING = 650.0, 250.0, 150.0
"""Metres of road around the camera car that are populated."""
FRINGE = 50.0
"""Metres beyond these within which a vehicle is kept if it came from inside."""
ROAD_END = 30.0
"""Metres before either end of the road where vehicles neither enter nor stay."""


@dataclass(slots=True, eq=False)
class Actor:
    """A vehicle in the traffic.

    Attributes:
        number: Its number among all that were ever drawn.
        draw: What does not change about it.
        driver: Its driver.
        same_way: Whether it drives the camera car's way.
        s: Where it is along the reference line, metres.
        brake_ticks: How long its brake lamps stay on.
    """

    number: int
    draw: Draw
    driver: Driver
    same_way: bool
    s: float = 0.0
    brake_ticks: int = 0


class Population:
    """Places the vehicles, lets others enter, and takes away those that have left.

    Attributes:
        world: highway-env's road with all its vehicles, the camera car among them.
        actors: All but the camera car.
        ego: The camera car, once it is placed.
        ego_s: Where it is, metres.
        time: Seconds since tick 0, negative while the traffic settles.
    """

    ego: Driver
    ego_s: float

    def __init__(
        self, road: InCarRoad, params: TrafficParams, fleet: Fleet, pace: Pace, *, seed: int
    ) -> None:
        """Get an empty road ready.

        Args:
            road: The road.
            params: How dense the traffic is.
            fleet: Draws the vehicles.
            pace: How fast they may enter.
            seed: The episode's seed.
        """
        self._road, self._params, self._fleet, self._pace, self._seed = road, params, fleet, pace, seed
        self.world = IndexedRoad(
            road.network,
            np_random=stream(seed, "traffic", "highway"),
            neighbour_vehicles_connected_lanes=True,
        )
        self._entries = {
            same_way: [
                stream(seed, "traffic", "entries", int(same_way), lane)
                for lane in range(len(road.lane_offsets(same_way)))
            ]
            for same_way in (True, False)
        }
        self._spacing: dict[tuple[bool, bool, int], float] = {}
        self._number = 0
        self.actors: list[Actor] = []
        self.time = 0.0

    def track(self) -> None:
        """Note where everybody is."""
        for actor in self.actors:
            actor.s = self.s_of(actor.driver)
        self.ego_s = self.s_of(self.ego)

    def exchange(self) -> None:
        """Take away who has left the window, and let others enter it."""
        self._leave()
        self._enter()

    def s_of(self, driver: Driver) -> float:
        """Arc length of a driver along the reference line, metres."""
        origin, target, _ = driver.lane_index
        forward = origin[0] == "f"
        piece = self._road.pieces[int((origin if forward else target)[1:])]
        along = driver.place_on(driver.lane)[0] * piece.length / driver.lane.length
        return float(piece.start + along if forward else piece.end - along)

    def place(self, lane: int, same_way: bool, s: float, speed: float, kind: type[Driver]) -> Driver:
        """Put a driver in the middle of a lane."""
        pieces = self._road.pieces
        k = max(bisect_left([p.start for p in pieces], s) - 1, 0)
        piece = pieces[k]
        index = (f"f{k}", f"f{k + 1}", lane) if same_way else (f"b{k + 1}", f"b{k}", lane)
        on = self._road.network.get_lane(index)
        part = (s - piece.start if same_way else piece.end - s) / piece.length
        along = part * on.length
        driver = kind(
            self.world,
            on.position(along, 0),
            heading=on.heading_at(along),
            speed=speed,
            target_lane_index=index,
        )
        driver.set_lateral(1.2, 0.3)
        driver.LANE_CHANGE_DELAY = 2.0
        driver.LANE_CHANGE_MIN_ACC_GAIN = 0.15
        driver.LANE_CHANGE_MAX_BRAKING_IMPOSED = driver.LANE_CHANGE_MAX_BRAKING
        driver.ACC_MAX = 7.0
        self.world.vehicles.append(driver)
        return driver

    def _add(self, draw: Draw, lane: int, same_way: bool, s: float, speed: float) -> Actor:
        driver = self.place(lane, same_way, s, speed, Driver)
        length, width, _ = draw.size
        driver.resize(length, width)
        driver.desired_speed = draw.speed
        driver.jam_gap = draw.jam_gap
        driver.TIME_WANTED = draw.headway
        driver.COMFORT_ACC_MAX, driver.COMFORT_ACC_MIN = draw.acceleration, -draw.braking
        driver.POLITENESS = draw.politeness
        driver.enable_lane_change = not draw.heavy
        actor = Actor(self._number, draw, driver, same_way, s)
        self._number += 1
        self.actors.append(actor)
        return actor

    def _draw(self, lane: int, same_way: bool) -> Draw:
        """Draw the next vehicle; the faster ones to the left, lorries and buses on the right lane only."""
        lanes = len(self._entries[same_way])
        return self._fleet.draw(
            stream(self._seed, "traffic", "vehicle", self._number),
            pace=self._fleet.lane_pace(lane, lanes),
            light=lane < lanes - 1,
        )

    def _draw_gap(self, rng: np.random.Generator, same_way: bool, speed: float) -> float:
        """Draw the free road between two vehicles, bumper to bumper, metres."""
        density = self._params.density if same_way else self._params.oncoming_density
        shortest = 2.5 + 0.7 * speed
        return shortest + float(rng.exponential(max(1000 / density - 5.0 - shortest, 1.0)))

    def settled_speed(self, same_way: bool, speed: float) -> float:
        """What the density lets one drive, m/s, at most ``speed``."""
        density = self._params.density if same_way else self._params.oncoming_density
        return min(speed, max((1000 / density - 8.0) / 1.3, 0.0))

    def populate(self, ego_speed: float) -> None:
        """Fill the window, close ahead with one a little slower than ``ego_speed``, m/s."""
        me = self.ego
        if self._params.density > 0:
            rng = stream(self._seed, "traffic", "neighbours")
            for lane in range(self._road.params.lanes):
                mine = lane == me.lane_index[2]
                first = float(rng.uniform(14.0, 32.0) if mine else rng.uniform(8.0, 45.0))
                slower = float(rng.uniform(0.86, 1.0)) * ego_speed
                self._fill(lane, True, self.ego_s + first, first_speed=slower if mine else None)
                self._fill_behind(lane, self.ego_s - me.LENGTH / 2 if mine else self.ego_s + first)
        if self._params.oncoming_density > 0:
            for lane, rng in enumerate(self._entries[False]):
                low = self.ego_s - BEHIND_ONCOMING
                self._fill(lane, False, low + float(rng.exponential(1000 / self._params.oncoming_density)))

    def _fill(self, lane: int, same_way: bool, s: float, first_speed: float | None = None) -> None:
        """Place vehicles from ``s`` on to the window's far end."""
        while s < self._far_end:
            draw = self._draw(lane, same_way)
            if first_speed is not None:
                draw, first_speed = replace(draw, speed=min(first_speed, draw.limit)), None
            s += draw.size[0] / 2
            speed = self._entry_speed(draw, s, same_way)
            self._add(draw, lane, same_way, s, speed)
            s += draw.size[0] / 2 + self._draw_gap(self._entries[same_way][lane], same_way, speed)

    def _fill_behind(self, lane: int, s: float) -> None:
        """Place vehicles of the ego's way from ``s``, a rear bumper, back to the window's near end."""
        rng = self._entries[True][lane]
        while True:
            draw = self._draw(lane, True)
            speed = self._entry_speed(draw, s, True)
            s -= self._draw_gap(rng, True, speed) + draw.size[0] / 2
            if s < max(self.ego_s - BEHIND, self._near_end):
                return
            self._add(draw, lane, True, s, speed)
            s -= draw.size[0] / 2

    def _entry_speed(self, draw: Draw, s: float, same_way: bool) -> float:
        allowed = self._pace.allowed(s, self.time, same_way=same_way)
        return self.settled_speed(same_way, min(draw.speed, allowed))

    @property
    def _far_end(self) -> float:
        return min(self.ego_s + AHEAD, self._road.length - ROAD_END)

    @property
    def _near_end(self) -> float:
        return self._road.pieces[0].start + ROAD_END

    def _leave(self) -> None:
        """Take away who has left the window or the road."""
        low = {
            True: max(self.ego_s - BEHIND - FRINGE, self._near_end),
            False: max(self.ego_s - BEHIND_ONCOMING, self._near_end),
        }
        high = min(self.ego_s + AHEAD + FRINGE, self._road.length - ROAD_END / 2)
        gone = [a.driver for a in self.actors if not low[a.same_way] <= a.s <= high]
        if gone:
            self.actors = [a for a in self.actors if low[a.same_way] <= a.s <= high]
            self.world.vehicles = [v for v in self.world.vehicles if not any(v is g for g in gone)]

    def _enter(self) -> None:
        """Let vehicles enter at the window's ends where there is room."""
        ends = self._ends()
        for same_way in (True, False):
            density = self._params.density if same_way else self._params.oncoming_density
            if density > 0:
                for lane in range(len(self._entries[same_way])):
                    nearest, farthest = ends.get((same_way, lane), (None, None))
                    self._enter_ahead(lane, same_way, farthest)
                    if same_way:
                        self._enter_behind(lane, nearest)

    def _enter_ahead(self, lane: int, same_way: bool, neighbour: Actor | None) -> None:
        """Let a vehicle enter at the far end: behind all others if it comes toward us, else before them."""
        s = self.ego_s + AHEAD
        if s > self._road.length - ROAD_END:
            return
        room = math.inf
        if neighbour is not None:
            room = s - neighbour.s - neighbour.driver.LENGTH / 2
        if room < self._wanted_room(lane, same_way, ahead=True):
            return
        draw = self._draw(lane, same_way)
        speed = self._entry_speed(draw, s, same_way)
        if neighbour is not None:
            leading, following = speed, neighbour.driver.speed
            if not same_way:
                leading, following = following, speed
            if room < draw.size[0] / 2 + _safe_gap(leading, following):
                return
        self._add(draw, lane, same_way, s, speed)
        self._forget_room(lane, same_way, ahead=True)

    def _enter_behind(self, lane: int, neighbour: Actor | None) -> None:
        """Let a vehicle that is faster than the camera car come up from behind."""
        s = max(self.ego_s - BEHIND, self._near_end)
        leader = neighbour.driver if neighbour is not None else self.ego
        room = (neighbour.s if neighbour is not None else self.ego_s) - s - leader.LENGTH / 2
        if room < self._wanted_room(lane, True, ahead=False):
            return
        draw = self._draw(lane, True)
        speed = self._entry_speed(draw, s, True)
        if room < draw.size[0] / 2 + _safe_gap(leader.speed, speed):
            return
        if speed < self.ego.speed:
            self._number += 1  # drawn in vain: whoever is slower would fall back at once
            self._spacing[True, False, lane] = room + 1000 / self._params.density
            return
        self._add(draw, lane, True, s, speed)
        self._forget_room(lane, True, ahead=False)

    def _wanted_room(self, lane: int, same_way: bool, *, ahead: bool) -> float:
        """The free road that the next vehicle of a lane waits for, metres."""
        key = (same_way, ahead, lane)
        if key not in self._spacing:
            mean = self.settled_speed(same_way, self._params.speed)
            self._spacing[key] = self._draw_gap(self._entries[same_way][lane], same_way, mean)
        return self._spacing[key]

    def _forget_room(self, lane: int, same_way: bool, *, ahead: bool) -> None:
        self._spacing.pop((same_way, ahead, lane), None)

    def _ends(self) -> dict[tuple[bool, int], tuple[Actor, Actor]]:
        """The nearest and the farthest vehicle along s of each lane; who changes lanes is on both.

        So nobody enters beside a vehicle that has yet to clear the lane.
        """
        ends: dict[tuple[bool, int], tuple[Actor, Actor]] = {}
        for actor in self.actors:
            for lane in actor.driver.lanes:
                nearest, farthest = ends.get((actor.same_way, lane), (actor, actor))
                ends[actor.same_way, lane] = (
                    actor if actor.s < nearest.s else nearest,
                    actor if actor.s > farthest.s else farthest,
                )
        return ends


def _safe_gap(leading: float, following: float) -> float:
    """Bumper to bumper metres at which a follower needs no more than comfortable braking, speeds in m/s."""
    return 4.0 + 1.1 * following + max(following**2 - leading**2, 0.0) / 3.0
