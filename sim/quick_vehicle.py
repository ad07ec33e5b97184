"""highway-env's IDM/MOBIL vehicle, bit for bit, in a fraction of its time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from highway_env.road.road import LaneIndex
from highway_env.utils import not_zero, wrap_to_pi
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import RoadObject
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class QuickVehicle(IDMVehicle):  # type: ignore[misc]
    """highway-env's `IDMVehicle`, bit for bit, in a fraction of the time.

    What depends on the position and the heading alone is worked out once a tick. Sums and products are done
    on plain floats; dot products and elementary functions by the same NumPy calls as in highway-env, because
    others may round differently. Whoever moves the vehicle other than by `step` calls `moved`.
    """

    position: Floats
    heading: float
    speed: float
    crashed: bool
    impact: Floats | None
    action: dict[str, float]
    target_lane_index: LaneIndex
    timer: float

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        """Take the arguments of `IDMVehicle`."""
        self._places: dict[Any, tuple[float, float]] = {}
        self._course: tuple[Floats, Floats] | None = None
        super().__init__(*args, **kwargs)

    def moved(self) -> None:
        """Forget what was worked out from the old position, heading and speed."""
        self._places = {}
        self._course = None

    def place_on(self, lane: Any) -> tuple[float, float]:
        """Return the local coordinates on a lane, metres along and across."""
        place = self._places.get(lane)
        if place is None:
            place = self._places[lane] = lane.local_coordinates(self.position)
        return place

    @property
    def direction(self) -> Floats:
        """(2,) unit vector of the heading."""
        return self._heading_and_velocity()[0]

    @property
    def velocity(self) -> Floats:
        """(2,) m/s."""
        return self._heading_and_velocity()[1]

    def lane_distance_to(self, other: RoadObject | None, lane: Any = None) -> float:
        """Return the distance to another object along a lane, by default the own one, metres."""
        if not other:
            return math.nan
        lane = lane or self.lane
        return float(_place_on(other, lane)[0] - self.place_on(lane)[0])

    def follow_road(self) -> None:
        """Aim at the next lane at the end of a lane."""
        lane = self.road.network.get_lane(self.target_lane_index)
        along = self.place_on(lane)[0]
        if along > lane.length - lane.VEHICLE_LENGTH / 2:
            super().follow_road()

    def steering_control(self, target_lane_index: LaneIndex) -> float:
        """Return the steering angle that follows the middle of a lane, rad."""
        lane = self.road.network.get_lane(target_lane_index)
        along, across = self.place_on(lane)
        ahead = lane.heading_at(along + self.speed * self.TAU_PURSUIT)
        speed = not_zero(self.speed)
        sideways = clip(-self.KP_LATERAL * across / speed, -1, 1)
        heading_ref = ahead + clip(np.arcsin(sideways), -np.pi / 4, np.pi / 4)
        return self.steer(self.KP_HEADING * wrap_to_pi(heading_ref - self.heading))

    def steer(self, heading_rate: float) -> float:
        """Return the steering angle that turns the heading at a rate, rad/s."""
        slip = np.arcsin(clip(self.LENGTH / 2 / not_zero(self.speed) * heading_rate, -1, 1))
        limit = self.MAX_STEERING_ANGLE
        return float(clip(np.arctan(2 * np.tan(slip)), -limit, limit))

    def acceleration(
        self,
        ego_vehicle: Any,
        front_vehicle: Any = None,
        rear_vehicle: Any = None,  # noqa: ARG002
    ) -> float:
        """Return IDM's acceleration of ``ego_vehicle`` behind ``front_vehicle``, m/s^2."""
        if not ego_vehicle or not isinstance(ego_vehicle, Vehicle):
            return 0.0
        target = getattr(ego_vehicle, "target_speed", 0)
        if ego_vehicle.lane and ego_vehicle.lane.speed_limit is not None:
            target = clip(target, 0, ego_vehicle.lane.speed_limit)
        wish = self.COMFORT_ACC_MAX * (
            1 - np.power(max(ego_vehicle.speed, 0) / abs(not_zero(target)), self.DELTA)
        )
        if front_vehicle:
            gap = ego_vehicle.lane_distance_to(front_vehicle)
            wish -= self.COMFORT_ACC_MAX * np.power(
                self.desired_gap(ego_vehicle, front_vehicle) / not_zero(gap), 2
            )
        return wish  # type: ignore[no-any-return]

    def desired_gap(self, ego_vehicle: Any, front_vehicle: Any = None, projected: bool = True) -> float:
        """Return IDM's desired distance to the vehicle ahead, metres between middles."""
        ab = -self.COMFORT_ACC_MAX * self.COMFORT_ACC_MIN
        closing = (
            (ego_vehicle.velocity - front_vehicle.velocity).dot(ego_vehicle.direction)
            if projected
            else ego_vehicle.speed - front_vehicle.speed
        )
        speed = ego_vehicle.speed
        return float(self.DISTANCE_WANTED + speed * self.TIME_WANTED + speed * closing / (2 * math.sqrt(ab)))

    def act(self, action: Any = None) -> None:  # noqa: ARG002
        """Decide on lane, steering and acceleration (see `IDMVehicle.act`)."""
        if self.crashed:
            return
        self.follow_road()
        if self.enable_lane_change:
            self.change_lane_policy()
        limit = self.MAX_STEERING_ANGLE
        steering = clip(self.steering_control(self.target_lane_index), -limit, limit)
        acceleration = self._follow(self.lane_index)
        if self.lane_index != self.target_lane_index:
            acceleration = min(acceleration, self._follow(self.target_lane_index))
        self.action = {
            "steering": steering,
            "acceleration": clip(acceleration, -self.ACC_MAX, self.ACC_MAX),
        }

    def step(self, dt: float) -> None:
        """Move for ``dt`` seconds (see `Vehicle.step`)."""
        self.timer += dt
        self.clip_actions()
        slip = np.arctan(1 / 2 * np.tan(self.action["steering"]))
        speed, course = self.speed, self.heading + slip
        x, y = self.position
        x, y = x + speed * np.cos(course) * dt, y + speed * np.sin(course) * dt
        if self.impact is not None:
            x, y = x + self.impact[0], y + self.impact[1]
            self.crashed = True
            self.impact = None
        self.position[:] = x, y
        self.heading += speed * np.sin(slip) / (self.LENGTH / 2) * dt
        self.speed += self.action["acceleration"] * dt
        self.moved()
        self.on_state_update()

    def on_state_update(self) -> None:
        """Look for the own lane, unless the road is about to do it for all at once."""
        if not getattr(self.road, "moving", False):
            super().on_state_update()

    def _follow(self, lane_index: LaneIndex) -> float:
        front, rear = self.road.neighbour_vehicles(self, lane_index)
        return self.acceleration(ego_vehicle=self, front_vehicle=front, rear_vehicle=rear)

    def _heading_and_velocity(self) -> tuple[Floats, Floats]:
        if self._course is None:
            direction = np.array([np.cos(self.heading), np.sin(self.heading)])
            self._course = direction, self.speed * direction
        return self._course


def _place_on(body: RoadObject, lane: Any) -> tuple[float, float]:
    """Local coordinates of any body on a lane."""
    if isinstance(body, QuickVehicle):
        return body.place_on(lane)
    place: tuple[float, float] = lane.local_coordinates(body.position)
    return place


def clip(value: Any, low: float, high: float) -> Any:
    """`numpy.clip` of one number, without its price."""
    return low if value < low else high if value > high else value
