"""The traffic around the camera car: who is there, who enters and leaves, and what they look like."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim import ego as ego_car
from sim.drivers import Driver
from sim.fleet import Fleet, Surge
from sim.indexed_road import IndexedRoad
from sim.models import Model
from sim.pace import Pace
from sim.params import EgoParams, TrafficParams
from sim.parked import park
from sim.population import AHEAD, BEHIND, Actor, Population
from sim.rng import stream
from sim.roads import InCarRoad, from_plane
from sim.world import FIRST_VEHICLE_ID, Bodies, Ego, Lamps, Role

__all__ = ["IndexedRoad", "Traffic"]

EGO_START = 60.0
"""S of the camera car at tick 0, metres, as near as the warm-up lets it."""
WARM_UP = 8.0
"""Seconds of traffic before tick 0, in which gaps and lanes settle."""
BRAKE_ON, BRAKE_OFF = -0.8, -0.3
"""M/s^2 below which the brake lamps light up, and above which they go out."""
EGO_SURGE = 0.1
"""Amplitude of the swing of the camera car's wanted speed, as a part of it."""
BRAKE_HOLD = 0.4
"""Seconds that they stay on at least."""


class Traffic:
    """IDM and MOBIL traffic on a road, in a window that goes along with the camera car."""

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
        self._population = Population(road, params, self._fleet, self._pace, seed=seed)
        warm_up = round(WARM_UP * rate)
        self._tick = -warm_up
        self._collided = False
        self._profile = ego_car.Profile(ego, stream(seed, "ego", "profile"))
        self._surge = Surge.draw(
            stream(seed, "ego", "surge"),
            strength=EGO_SURGE if ego.driver == "traffic" else 0.0,
            periods=(14.0, 26.0),
        )
        self._body = ego_car.Body(ego, rate, stream(seed, "ego", "body"))
        self._population.time = -warm_up / rate
        self._ego_driver = self._population.ego = self._place_ego()
        self._population.track()
        self._population.populate(ego.speed)
        self._yaw = self._last_yaw = -self._ego_driver.heading
        self._tilt = self._body.step(self._ego_driver.speed, 0.0)
        for _ in range(warm_up):
            self.step(None)

    @property
    def collided(self) -> bool:
        """Whether any vehicle has ever touched another: the drive is then invalid."""
        return self._collided

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
        self._population.world.act()
        self._population.world.step(dt)
        self._collided |= any(v.crashed for v in self._population.world.vehicles)
        self._tick += 1
        self._population.time = self._tick / self._rate
        self._population.track()
        for actor in self._population.actors:
            self._set_brake(actor)
        self._population.exchange()
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
        low = bisect_left(self._parked_s, self._population.ego_s - BEHIND)
        high = bisect_left(self._parked_s, self._population.ego_s + AHEAD)
        parked = self._parked.take(np.arange(low, high))
        actors = self._population.actors
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
            leans=np.zeros((len(actors), 2)),
        )
        return Bodies.concatenate(driving, parked)

    def _lamps(self, actor: Actor) -> int:
        lit = Lamps.TAIL | Lamps.HEAD if self._lights_on else Lamps.OFF
        return int(lit | Lamps.BRAKE if actor.brake_ticks > 0 else lit)

    def _set_brake(self, actor: Actor) -> None:
        acceleration = actor.driver.action["acceleration"]
        standing = actor.driver.speed < 0.3
        if acceleration < BRAKE_ON or (actor.brake_ticks > 0 and (acceleration < BRAKE_OFF or standing)):
            actor.brake_ticks = round(BRAKE_HOLD * self._rate)
        else:
            actor.brake_ticks = max(actor.brake_ticks - 1, 0)

    def _set_speeds(self) -> None:
        """Tell every driver what the place and the time allow."""
        t = self._tick / self._rate
        for actor in self._population.actors:
            allowed = self._pace.allowed(actor.s, t, same_way=actor.same_way)
            wish = actor.driver.desired_speed * actor.draw.surge.at(t)
            actor.driver.target_speed = min(wish, allowed)
        me = self._ego_driver
        wish = self._ego_params.speed * self._surge.at(t)
        if self._ego_params.driver == "profile":
            wish, *weave = self._profile.at(t)
            me.weave = (weave[0], weave[1])
        me.target_speed = min(wish, self._pace.allowed(self._population.ego_s, t, same_way=True))

    def _place_ego(self) -> Driver:
        """Put the camera car on the road, first of all vehicles."""
        p = self._ego_params
        rng = stream(self._seed, "ego", "start")
        drawn = int(rng.integers(self._road.params.lanes))
        s = max(EGO_START - p.speed * WARM_UP, self._road.pieces[0].start + BEHIND)
        speed = min(p.speed, self._pace.allowed(s, self._tick / self._rate, same_way=True))
        if self._params.density > 0:
            speed = self._population.settled_speed(True, speed)
        kind = ego_car.ActionDriver if p.driver == "actions" else Driver
        me = self._population.place(drawn if p.lane < 0 else p.lane, True, s, speed, kind)
        me.resize(ego_car.LENGTH, ego_car.WIDTH)
        me.desired_speed = p.speed
        me.TIME_WANTED, me.COMFORT_ACC_MAX, me.COMFORT_ACC_MIN = 1.0, 1.6, -2.0
        me.POLITENESS = 0.1
        me.enable_lane_change = p.driver == "traffic"
        return me
