"""Drivers who follow a path through a network, and the stop lines that they obey."""

from __future__ import annotations

from typing import Any

from highway_env.road.road import LaneIndex
from highway_env.vehicle.objects import Obstacle

from sim.aerial.networks import Path
from sim.drivers import Driver


class StopLine(Obstacle):  # type: ignore[misc]
    """What a red light is to traffic: something that stands in the lane, and that cannot be hit."""

    LENGTH, WIDTH = 0.2, 2.0

    def __init__(self, road: Any, lane_index: LaneIndex, along: float) -> None:
        """Put it ``along`` metres into a lane."""
        lane = road.network.get_lane(lane_index)
        super().__init__(road, lane.position(along, 0.0), heading=lane.heading_at(along))
        self.collidable = self.check_collisions = False
        self.action = {"acceleration": 0.0}


class RoutedDriver(Driver):
    """A driver on a path. To pass from one lane to the next along it is no change of lane."""

    path: Path
    step_of: dict[tuple[str, str], int]
    running: StopLine | None = None
    """The stop line that it is too near to heed."""

    def follow(self, path: Path, first: int) -> None:
        """Take a path, from its lane number ``first`` on."""
        self.path = path
        self.step_of = {index[:2]: k for k, index in enumerate(path.lanes)}
        self.route = list(path.lanes[first:])

    @property
    def s(self) -> float:
        """Metres along the path."""
        step = self.step_of.get(self.target_lane_index[:2], 0)
        lane = self.road.network.get_lane(self.target_lane_index)
        own = self.path.lanes[step]
        scale = self.road.network.get_lane(own).length / lane.length
        return float(self.path.starts[step] + self.place_on(lane)[0] * scale)

    def steering_control(self, target_lane_index: LaneIndex) -> float:
        """Return the steering angle, rad (see `Driver.steering_control`)."""
        if target_lane_index[:2] != self._aim[:2]:
            self._aim = target_lane_index
            if self._since >= self.LANE_CHANGE_SECONDS:
                self._left = target_lane_index[2]
        return super().steering_control(target_lane_index)

    def _follow(self, lane_index: LaneIndex) -> float:
        front, _ = self.road.neighbour_vehicles(self, lane_index)
        if self.running is None or front is not self.running:
            return super()._follow(lane_index)
        beyond, _ = self.road.neighbour_vehicles(front, lane_index)
        return self.acceleration(self, beyond)
