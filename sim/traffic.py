"""The traffic around the camera car: who is there, who enters and leaves, and what they look like."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim import ego as ego_car
from sim.drivers import Driver
from sim.fleet import Draw, Fleet
from sim.indexed_road import IndexedRoad
from sim.models import Model
from sim.pace import Pace
from sim.params import EgoParams, TrafficParams
from sim.parked import park
from sim.rng import stream
from sim.roads import InCarRoad, from_plane
from sim.world import FIRST_VEHICLE_ID, Bodies, Ego, Lamps, Role

__all__ = ["IndexedRoad", "Traffic"]

EGO_START = 60.0
"""S of the camera car at tick 0, metres, as near as the warm-up lets it."""
AHEAD, BEHIND, BEHIND_ONCOMING = 650.0, 250.0, 150.0
"""Metres of road around the camera car that are populated."""
FRINGE = 50.0
"""Metres beyond these within which a vehicle is kept if it came from inside."""
WARM_UP = 8.0
"""Seconds of traffic before tick 0, in which gaps and lanes settle."""
ROAD_END = 30.0
"""Metres before either end of the road where vehicles neither enter nor stay."""
BRAKE_ON, BRAKE_OFF = -0.8, -0.3
"""M/s^2 below which the brake lamps light up, and above which they go out."""
BRAKE_HOLD = 0.4
"""Seconds that they stay on at least."""


@dataclass(slots=True, eq=False)
class _Actor:
    """A vehicle in the traffic: its driver, and what does not change about it."""

    number: int
    draw: Draw
    driver: Driver
    same_way: bool
    s: float = 0.0
    brake_ticks: int = 0


class Traffic:
    """IDM and MOBIL traffic on a road, in a window that goes along with the camera car.

    Vehicles enter and leave the window far from the camera car: ahead beyond 600 m, behind out of its view.
    """

    def __init__(
        self,
        road: InCarRoad,
        params: TrafficParams,
        ego: EgoParams,
        catalogue: Sequence[Model],
        *,
        seed: int,
        rate: int,
        lights_on: bool = False,
    ) -> None:
        """Populate the road and let the traffic settle.

        Args:
            road: The road.
            params: Who drives, how densely and how fast.
            ego: The camera car.
            catalogue: The scene's models; vehicles' ``models`` point into it.
            seed: The episode's seed.
            rate: Ticks a second.
            lights_on: Whether head and tail lamps are on.

        Raises:
            ValueError: If the ego's lane does not exist, or the catalogue holds no car.
        """
        if ego.lane >= road.params.lanes:
            raise ValueError(f"ego.lane is {ego.lane}, but the road's lanes are 0 to {road.params.lanes - 1}")
        self._road, self._params, self._ego_params = road, params, ego
        self._seed, self._rate, self._lights_on = seed, rate, lights_on
        self._fleet = Fleet(params, catalogue)
        self._parked, self._parked_s = park(
            road, self._fleet, params.parked, FIRST_VEHICLE_ID, stream(seed, "traffic", "parked")
        )
        self._pace = Pace(road, stream(seed, "traffic", "pace"), waves=params.stop_and_go)
        self._world = IndexedRoad(
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
        self._actors: list[_Actor] = []
        self._number = 0
        warm_up = round(WARM_UP * rate)
        self._tick = -warm_up
        self._profile = ego_car.Profile(ego, stream(seed, "ego", "profile"))
        self._body = ego_car.Body(ego, rate, stream(seed, "ego", "body"))
        self._ego_driver = self._place_ego()
        self._ego_s = self._s_of(self._ego_driver)
        self._populate()
        self._yaw = self._last_yaw = -self._ego_driver.heading
        self._tilt = self._body.step(self._ego_driver.speed, 0.0)
        for _ in range(warm_up):
            self.step(None)

    @property
    def collided(self) -> bool:
        """Whether any vehicle has touched another: the drive is then invalid."""
        return any(v.crashed for v in self._world.vehicles)

    def step(self, action: NDArray[np.floating[Any]] | None = None) -> None:
        """Advance one tick.

        Args:
            action: (2,) in [-1, 1], acceleration and yaw rate, where the ego is driven by actions.
        """
        dt, me = 1 / self._rate, self._ego_driver
        before = me.speed
        if isinstance(me, ego_car.ActionDriver) and self._tick >= 0:
            me.told(action)
        self._set_speeds()
        self._world.act()
        self._world.step(dt)
        self._tick += 1
        for actor in self._actors:
            actor.s = self._s_of(actor.driver)
            self._set_brake(actor)
        self._ego_s = self._s_of(me)
        self._leave()
        self._enter()
        self._last_yaw, self._yaw = self._yaw, -me.heading
        self._tilt = self._body.step(me.speed, (me.speed - before) / dt)

    def ego(self) -> Ego:
        """Return the camera car."""
        me = self._ego_driver
        x, y, yaw = from_plane(me.position, me.heading)
        pitch, heave = self._tilt
        turn = math.remainder(self._yaw - self._last_yaw, 2 * math.pi)
        return Ego(
            position=np.array([x, y, 0.0]),
            yaw=yaw,
            speed=float(me.speed),
            yaw_rate=-turn * self._rate,
            pitch=pitch,
            heave=heave,
        )

    def vehicles(self) -> Bodies:
        """Return all vehicles of the window but the camera car: those that drive, then those parked."""
        low = bisect_left(self._parked_s, self._ego_s - BEHIND)
        high = bisect_left(self._parked_s, self._ego_s + AHEAD)
        parked = self._parked.take(np.arange(low, high))
        actors = self._actors
        if not actors:
            return parked
        drivers = [a.driver for a in actors]
        plane = np.array([d.position for d in drivers])
        headings = np.array([d.heading for d in drivers])
        speeds = np.array([d.speed for d in drivers])
        count, still = len(actors), np.zeros(len(actors))
        driving = Bodies(
            ids=np.array([FIRST_VEHICLE_ID + len(self._parked) + a.number for a in actors], np.uint32),
            kinds=np.array([a.draw.kind for a in actors], np.uint8),
            roles=np.array([Role.SAME_WAY if a.same_way else Role.ONCOMING for a in actors], np.uint8),
            models=np.array([a.draw.model for a in actors], np.int32),
            positions=np.column_stack([plane[:, 0], -plane[:, 1], still]),
            yaws=-headings,
            velocities=np.column_stack([speeds * np.cos(headings), -speeds * np.sin(headings), still]),
            sizes=np.array([a.draw.size for a in actors], float).reshape(count, 3),
            colours=np.array([a.draw.colour for a in actors], np.float32).reshape(count, 3),
            lamps=np.array([self._lamps(a) for a in actors], np.uint8),
        )
        return Bodies.concatenate(driving, parked)

    def _lamps(self, actor: _Actor) -> int:
        lit = Lamps.TAIL | Lamps.HEAD if self._lights_on else Lamps.OFF
        return int(lit | Lamps.BRAKE if actor.brake_ticks > 0 else lit)

    def _set_brake(self, actor: _Actor) -> None:
        acceleration = actor.driver.action["acceleration"]
        standing = actor.driver.speed < 0.3
        if acceleration < BRAKE_ON or (actor.brake_ticks > 0 and (acceleration < BRAKE_OFF or standing)):
            actor.brake_ticks = round(BRAKE_HOLD * self._rate)
        else:
            actor.brake_ticks = max(actor.brake_ticks - 1, 0)

    def _set_speeds(self) -> None:
        """Tell every driver what the place and the time allow."""
        t = self._tick / self._rate
        for actor in self._actors:
            allowed = self._pace.allowed(actor.s, t, same_way=actor.same_way)
            actor.driver.target_speed = min(actor.driver.desired_speed, allowed)
        me = self._ego_driver
        wish = self._ego_params.speed
        if self._ego_params.driver == "profile":
            wish, *weave = self._profile.at(t)
            me.weave = (weave[0], weave[1])
        me.target_speed = min(wish, self._pace.allowed(self._ego_s, t, same_way=True))

    def _s_of(self, driver: Driver) -> float:
        """Arc length of a driver along the reference line, metres."""
        origin, target, _ = driver.lane_index
        forward = origin[0] == "f"
        piece = self._road.pieces[int((origin if forward else target)[1:])]
        along = driver.place_on(driver.lane)[0] * piece.length / driver.lane.length
        return float(piece.start + along if forward else piece.end - along)

    def _make_driver(self, lane: int, same_way: bool, s: float, speed: float, kind: type[Driver]) -> Driver:
        """Put a driver in the middle of a lane."""
        pieces = self._road.pieces
        k = max(bisect_left([p.start for p in pieces], s) - 1, 0)
        piece = pieces[k]
        index = (f"f{k}", f"f{k + 1}", lane) if same_way else (f"b{k + 1}", f"b{k}", lane)
        on = self._road.network.get_lane(index)
        part = (s - piece.start if same_way else piece.end - s) / piece.length
        along = part * on.length
        driver = kind(
            self._world,
            on.position(along, 0),
            heading=on.heading_at(along),
            speed=speed,
            target_lane_index=index,
        )
        driver.set_lateral(1.2, 0.3)
        driver.LANE_CHANGE_DELAY = 2.0
        driver.LANE_CHANGE_MIN_ACC_GAIN = 0.3
        driver.LANE_CHANGE_MAX_BRAKING_IMPOSED = 1.5
        driver.ACC_MAX = 7.0
        self._world.vehicles.append(driver)
        return driver

    def _add(self, draw: Draw, lane: int, same_way: bool, s: float, speed: float) -> _Actor:
        driver = self._make_driver(lane, same_way, s, speed, Driver)
        length, width, _ = draw.size
        driver.resize(length, width)
        driver.desired_speed = draw.speed
        driver.jam_gap = draw.jam_gap
        driver.TIME_WANTED = draw.headway
        driver.COMFORT_ACC_MAX, driver.COMFORT_ACC_MIN = draw.acceleration, -draw.braking
        driver.POLITENESS = draw.politeness
        driver.enable_lane_change = not draw.heavy
        actor = _Actor(self._number, draw, driver, same_way, s)
        self._number += 1
        self._actors.append(actor)
        return actor

    def _draw(self, lane: int, same_way: bool) -> Draw:
        """Draw the next vehicle; lorries and buses keep to the right lane."""
        rightmost = len(self._road.lane_offsets(same_way)) - 1
        return self._fleet.draw(
            stream(self._seed, "traffic", "vehicle", self._number), light=lane < rightmost
        )

    def _draw_gap(self, rng: np.random.Generator, same_way: bool, speed: float) -> float:
        """Draw the free road between two vehicles, bumper to bumper, metres."""
        density = self._params.density if same_way else self._params.oncoming_density
        shortest = 3.0 + 1.1 * speed
        return shortest + float(rng.exponential(max(1000 / density - 5.0 - shortest, 1.0)))

    def _settled_speed(self, same_way: bool, speed: float) -> float:
        """What the density lets one drive, m/s, at most ``speed``."""
        density = self._params.density if same_way else self._params.oncoming_density
        return min(speed, max((1000 / density - 8.0) / 1.3, 0.0))

    def _place_ego(self) -> Driver:
        """Put the camera car on the road, first of all vehicles."""
        p = self._ego_params
        rng = stream(self._seed, "ego", "start")
        drawn = int(rng.integers(self._road.params.lanes))
        s = max(EGO_START - p.speed * WARM_UP, self._road.pieces[0].start + BEHIND)
        speed = min(p.speed, self._pace.allowed(s, self._tick / self._rate, same_way=True))
        if self._params.density > 0:
            speed = self._settled_speed(True, speed)
        kind = ego_car.ActionDriver if p.driver == "actions" else Driver
        me = self._make_driver(drawn if p.lane < 0 else p.lane, True, s, speed, kind)
        me.resize(ego_car.LENGTH, ego_car.WIDTH)
        me.desired_speed = p.speed
        me.TIME_WANTED, me.COMFORT_ACC_MAX, me.COMFORT_ACC_MIN = 1.2, 1.6, -2.0
        me.POLITENESS = 0.3
        me.enable_lane_change = p.driver == "traffic"
        return me

    def _populate(self) -> None:
        """Fill the window, with neighbours of the camera car's speed close ahead."""
        me = self._ego_driver
        if self._params.density > 0:
            rng = stream(self._seed, "traffic", "neighbours")
            for lane in range(self._road.params.lanes):
                mine = lane == me.lane_index[2]
                first = float(rng.uniform(14.0, 32.0) if mine else rng.uniform(8.0, 45.0))
                pace = float(rng.uniform(0.88, 1.02) if mine else rng.uniform(0.85, 1.15))
                self._fill(lane, True, self._ego_s + first, first_speed=pace * self._ego_params.speed)
                self._fill_behind(lane, self._ego_s if mine else self._ego_s + first - 5.0)
        if self._params.oncoming_density > 0:
            for lane, rng in enumerate(self._entries[False]):
                low = self._ego_s - BEHIND_ONCOMING
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
        """Place vehicles of the ego's way from ``s`` back to the window's near end."""
        rng = self._entries[True][lane]
        while True:
            draw = self._draw(lane, True)
            speed = self._entry_speed(draw, s, True)
            s -= draw.size[0] + self._draw_gap(rng, True, speed)
            if s < max(self._ego_s - BEHIND, self._near_end):
                return
            self._add(draw, lane, True, s, speed)

    def _entry_speed(self, draw: Draw, s: float, same_way: bool) -> float:
        allowed = self._pace.allowed(s, self._tick / self._rate, same_way=same_way)
        return self._settled_speed(same_way, min(draw.speed, allowed))

    @property
    def _far_end(self) -> float:
        return min(self._ego_s + AHEAD, self._road.length - ROAD_END)

    @property
    def _near_end(self) -> float:
        return self._road.pieces[0].start + ROAD_END

    def _leave(self) -> None:
        """Take away who has left the window or the road."""
        low = {
            True: max(self._ego_s - BEHIND - FRINGE, self._near_end),
            False: max(self._ego_s - BEHIND_ONCOMING, self._near_end),
        }
        high = min(self._ego_s + AHEAD + FRINGE, self._road.length - ROAD_END / 2)
        gone = [a.driver for a in self._actors if not low[a.same_way] <= a.s <= high]
        if gone:
            self._actors = [a for a in self._actors if low[a.same_way] <= a.s <= high]
            self._world.vehicles = [v for v in self._world.vehicles if not any(v is g for g in gone)]

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

    def _enter_ahead(self, lane: int, same_way: bool, neighbour: _Actor | None) -> None:
        """Let a vehicle enter at the far end: behind all others if it comes toward us, else before them."""
        s = self._ego_s + AHEAD
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

    def _enter_behind(self, lane: int, neighbour: _Actor | None) -> None:
        """Let a vehicle that is faster than the camera car come up from behind."""
        s = max(self._ego_s - BEHIND, self._near_end)
        leader = neighbour.driver if neighbour is not None else self._ego_driver
        room = (neighbour.s if neighbour is not None else self._ego_s) - s - leader.LENGTH / 2
        if room < self._wanted_room(lane, True, ahead=False):
            return
        draw = self._draw(lane, True)
        speed = self._entry_speed(draw, s, True)
        if room < draw.size[0] / 2 + _safe_gap(leader.speed, speed):
            return
        if speed < self._ego_driver.speed:
            self._number += 1  # drawn in vain: whoever is slower would fall back at once
            self._spacing[True, False, lane] = room + 1000 / self._params.density
            return
        self._add(draw, lane, True, s, speed)
        self._forget_room(lane, True, ahead=False)

    def _wanted_room(self, lane: int, same_way: bool, *, ahead: bool) -> float:
        """The free road that the next vehicle of a lane waits for, metres."""
        key = (same_way, ahead, lane)
        if key not in self._spacing:
            mean = self._settled_speed(same_way, self._params.speed)
            self._spacing[key] = self._draw_gap(self._entries[same_way][lane], same_way, mean)
        return self._spacing[key]

    def _forget_room(self, lane: int, same_way: bool, *, ahead: bool) -> None:
        self._spacing.pop((same_way, ahead, lane), None)

    def _ends(self) -> dict[tuple[bool, int], tuple[_Actor, _Actor]]:
        """The nearest and the farthest vehicle along s of each lane; who changes lanes is on both."""
        ends: dict[tuple[bool, int], tuple[_Actor, _Actor]] = {}
        for actor in self._actors:
            lanes = {actor.driver.lane_index[2]: None, actor.driver.target_lane_index[2]: None}
            for lane in lanes:
                nearest, farthest = ends.get((actor.same_way, lane), (actor, actor))
                ends[actor.same_way, lane] = (
                    actor if actor.s < nearest.s else nearest,
                    actor if actor.s > farthest.s else farthest,
                )
        return ends


def _safe_gap(leading: float, following: float) -> float:
    """Bumper to bumper metres at which a follower needs no more than comfortable braking, speeds in m/s."""
    return 4.0 + 1.3 * following + max(following**2 - leading**2, 0.0) / 3.0
