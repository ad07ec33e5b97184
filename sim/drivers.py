"""A driver with the manners of real traffic."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from highway_env.road.road import LaneIndex
from highway_env.utils import wrap_to_pi
from numpy.typing import NDArray

from sim.quick_vehicle import QuickVehicle, clip

Floats = NDArray[np.float64]

COOLNESS = 0.99
"""How far drivers trust that the one ahead does nothing abrupt: cut in on, they fall back without haste."""


class Driver(QuickVehicle):
    """A vehicle of true size whose driver is gentler than highway-env's.

    Gaps are measured between bumpers and not between middles. A driver who is too fast for what lies ahead
    brakes comfortably (the improved IDM: Treiber and Kesting, Traffic Flow Dynamics, 2013, section 11.3.7).
    One whose gap was shortened by somebody who cut in widens it calmly (the ACC model, section 11.3.8). A
    change of lane takes seconds and follows a polynomial with continuous acceleration. On arcs the driver
    allows for the body's slip.
    """

    LANE_CHANGE_SECONDS = 4.5
    ROOM_SECONDS = 0.45
    """Least time gap before and behind, between bumpers, to change into."""
    LANE_CHANGE_MAX_BRAKING = 1.8
    """M/s^2 that the driver accepts to brake after a change of lane, or to make others brake."""
    CLEAR = 0.7
    """Metres from its lane's middle within which a vehicle has left the other lane."""
    MOVING = 4.0
    """M/s: below this the lateral control slackens, so that creeping cars do not swerve."""

    def __init__(self, road: Any, position: Floats, **options: Any) -> None:
        """Take the arguments of `IDMVehicle`."""
        super().__init__(road, position, **options)
        self.jam_gap = 2.0
        """Metres between bumpers at standstill."""
        self.desired_speed = self.target_speed
        """M/s, on an open straight; ``target_speed`` is what the place and the time allow of it."""
        self.weave = (0.0, 0.0)
        """Wanted offset to the right of the lane's middle, metres, and its rate, m/s."""
        self.dt = 0.0
        self._aim = self.target_lane_index
        self._blend = _Blend(0.0, 0.0, self.LANE_CHANGE_SECONDS)
        self._since = math.inf
        self._left = self._aim[2]
        self._leaving: Driver | None = None

    @property
    def lanes(self) -> tuple[int, ...]:
        """Numbers of the lanes that it is on or aims at: who changes lanes is on the old one to the end."""
        near = {self.lane_index[2]: None, self.target_lane_index[2]: None}
        if self._changing():
            near[self._left] = None
        return tuple(near)

    def _changing(self) -> bool:
        """Whether a change of lane is under way: at a crawl it takes longer than it is meant to."""
        _, across = self.place_on(self.road.network.get_lane(self._aim))
        return self._since < self.LANE_CHANGE_SECONDS or abs(across) > self.CLEAR

    def resize(self, length: float, width: float) -> None:
        """Set the footprint, metres."""
        self.LENGTH, self.WIDTH = length, width
        self.diagonal = math.hypot(length, width)

    def set_lateral(self, tau_lateral: float, tau_heading: float) -> None:
        """Set the time constants of the lateral control, seconds, on this vehicle alone."""
        self.KP_LATERAL, self.KP_HEADING = 1 / tau_lateral, 1 / tau_heading
        self.TAU_PURSUIT = tau_heading

    def steering_control(self, target_lane_index: LaneIndex) -> float:
        """Return the steering angle that follows a lane, or changes to it smoothly, rad."""
        lane = self.road.network.get_lane(target_lane_index)
        along, across = self.place_on(lane)
        speed = max(self.speed, self.MOVING)
        if target_lane_index[2] != self._aim[2]:
            drift = self.speed * math.sin(self.heading - lane.heading_at(along))
            self._blend = _Blend(across, drift, self.LANE_CHANGE_SECONDS)
            self._since = 0.0
            self._left = self._aim[2]
        self._aim = target_lane_index
        wanted, rate = self._blend.at(self._since)
        wanted, rate = wanted + self.weave[0], rate + self.weave[1]
        sideways = rate - self.KP_LATERAL * (across - wanted)
        later = along + self.speed * self.TAU_PURSUIT
        # The body turns into an arc with its nose behind its course by the slip of its middle.
        turn = wrap_to_pi(lane.heading_at(later + 1.0) - lane.heading_at(later))
        slip = math.asin(clip(self.LENGTH / 2 * turn, -0.5, 0.5))
        heading_ref = lane.heading_at(later) + math.asin(clip(sideways / speed, -0.25, 0.25)) - slip
        return self.steer(self.KP_HEADING * wrap_to_pi(heading_ref - self.heading))

    def act(self, action: Any = None) -> None:
        """Decide, and have who comes behind on the lane that is being left follow until it is clear."""
        super().act(action)
        self._leaving = None
        if self._changing() and self.lane_index[2] != self._left:
            _, behind = self.road.neighbour_vehicles(self, (*self.lane_index[:2], self._left))
            if isinstance(behind, Driver):
                behind._leaving = self

    def _follow(self, lane_index: LaneIndex) -> float:
        wish = super()._follow(lane_index)
        return wish if self._leaving is None else min(wish, self.acceleration(self, self._leaving))

    def change_lane_policy(self) -> None:
        """Decide now and then whether to change lanes; a change that has begun is finished."""
        if self.lane_index == self.target_lane_index and not self._changing():
            super().change_lane_policy()

    def mobil(self, lane_index: LaneIndex) -> bool:
        """Whether a change of lane pays (MOBIL), and leaves room enough to all who are concerned."""
        front, rear = self.road.neighbour_vehicles(self, lane_index)
        if rear and not self._room(rear, self, rear.acceleration(rear, self)):
            return False
        if front and not self._room(self, front, self.acceleration(self, front)):
            return False
        return not self._contested(lane_index) and bool(super().mobil(lane_index))

    def _room(self, follower: Any, leader: Any, acceleration: float) -> bool:
        between = (follower.LENGTH + leader.LENGTH) / 2
        gap = follower.lane_distance_to(leader) - between
        return bool(
            acceleration > -self.LANE_CHANGE_MAX_BRAKING
            and gap > self.jam_gap + self.ROOM_SECONDS * follower.speed
        )

    def _contested(self, lane_index: LaneIndex) -> bool:
        """Whether somebody near, or coming fast, is changing into a lane already; few are at any time.

        The road counts who changes lanes on the old one, until the middle is crossed.
        """
        for other in self.road.vehicles:
            if other.target_lane_index[2] != lane_index[2] or other.lane_index[2] == lane_index[2]:
                continue
            if other is self or other.direction.dot(self.direction) < 0:
                continue
            reach = (self.LENGTH + other.LENGTH) / 2 + self.jam_gap
            reach += self.TIME_WANTED * max(self.speed, other.speed)
            away = self.lane_distance_to(other)
            follower, leader = (self, other) if away > 0 else (other, self)
            if abs(away) < reach or not self._room(follower, leader, follower.acceleration(follower, leader)):
                return True
        return False

    def acceleration(
        self,
        ego_vehicle: Any,
        front_vehicle: Any = None,
        rear_vehicle: Any = None,  # noqa: ARG002
    ) -> float:
        """Return the enhanced IDM's acceleration, m/s^2."""
        if not ego_vehicle:
            return 0.0
        speed, target = max(ego_vehicle.speed, 0.0), ego_vehicle.target_speed
        most, comfort = self.COMFORT_ACC_MAX, -self.COMFORT_ACC_MIN
        if speed <= target:
            free = most * (1 - (speed / max(target, 1e-3)) ** self.DELTA)
        else:
            free = -comfort * (1 - (max(target, 0.0) / speed) ** (most * self.DELTA / comfort))
        if not front_vehicle:
            return float(free)
        between = (ego_vehicle.LENGTH + front_vehicle.LENGTH) / 2
        gap = max(ego_vehicle.lane_distance_to(front_vehicle) - between, 0.1)
        ratio = max(self.desired_gap(ego_vehicle, front_vehicle), self.jam_gap) / gap
        if speed > target:
            wish = free if ratio < 1 else free + most * (1 - ratio**2)
        elif ratio >= 1 or free <= 0:
            wish = most * (1 - ratio**2)
        else:
            wish = free * (1 - ratio ** min(2 * most / free, 60.0))
        needed = _constant_acceleration(speed, gap, front_vehicle, most)
        if wish < needed:
            calm = needed + comfort * math.tanh((wish - needed) / comfort)
            wish += COOLNESS * (calm - wish)
        return float(wish)

    def desired_gap(self, ego_vehicle: Any, front_vehicle: Any = None, projected: bool = True) -> float:
        """Return the desired gap between bumpers, metres."""
        del projected  # along the lane both are the same to the cosine of a few degrees
        speed = max(ego_vehicle.speed, 0.0)
        closing = speed - front_vehicle.speed
        root = 2 * math.sqrt(-self.COMFORT_ACC_MAX * self.COMFORT_ACC_MIN)
        return float(self.jam_gap + speed * self.TIME_WANTED + speed * closing / root)

    def step(self, dt: float) -> None:
        """Move for ``dt`` seconds, never backward."""
        if self.action["acceleration"] * dt < -self.speed:
            self.action["acceleration"] = -self.speed / dt
        self._since += dt
        super().step(dt)
        self.speed = max(self.speed, 0.0)


def _constant_acceleration(speed: float, gap: float, leader: Any, most: float) -> float:
    """Acceleration that just avoids a crash if the leader accelerates on as now, m/s^2.

    It is at most ``most`` (Kesting, Treiber and Helbing, Phil. Trans. R. Soc. A 368, 2010, eq. 2.5).
    """
    leading, push = max(leader.speed, 0.0), min(leader.action["acceleration"], most)
    closing = speed - leading
    if leading * closing < -2 * gap * push:  # the leader stops first, or runs away
        return float(speed**2 * push / max(leading**2 - 2 * gap * push, 1e-9))
    return float(push - max(closing, 0.0) ** 2 / (2 * gap))


class _Blend:
    """A quintic that brings a sideways offset and its rate to rest in a given time."""

    __slots__ = ("_powers", "_seconds")

    def __init__(self, offset: float, rate: float, seconds: float) -> None:
        t = seconds
        self._seconds = seconds
        self._powers = (
            offset,
            rate,
            (-10 * offset - 6 * rate * t) / t**3,
            (15 * offset + 8 * rate * t) / t**4,
            (-6 * offset - 3 * rate * t) / t**5,
        )

    def at(self, t: float) -> tuple[float, float]:
        """Offset, metres, and rate, m/s, ``t`` seconds after the start."""
        if t >= self._seconds:
            return 0.0, 0.0
        a, b, c, d, e = self._powers
        return (
            a + b * t + c * t**3 + d * t**4 + e * t**5,
            b + 3 * c * t**2 + 4 * d * t**3 + 5 * e * t**4,
        )
