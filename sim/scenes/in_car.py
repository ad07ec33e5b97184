"""Paper 1's scene: a forward camera on a car in traffic."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim import meshes
from sim.camera import Camera, Pose
from sim.ego import odometer
from sim.light import make_light
from sim.params import InCarParams
from sim.render.types import Stage
from sim.rng import stream
from sim.roads import LEAD_IN, build_road
from sim.scenery import place_scenery
from sim.simulation import Odometer
from sim.traffic import Traffic
from sim.world import Ego, WorldState

VIEW_AHEAD = 700.0
"""Metres of road beyond the farthest point that the camera car can reach."""


class InCarScene:
    """A drive: road, scenery, light and traffic, all from one seed.

    Attributes:
        rate: Ticks a second.
        camera: The intrinsics.
        stage: What stands still.
        road: The road.
    """

    def __init__(self, params: InCarParams, *, seed: int, rate: int, seconds: float) -> None:
        """Populate the world.

        Args:
            params: What to build.
            seed: Picks one drive among all that the parameters allow.
            rate: Ticks a second.
            seconds: How long the drive may last; the road is made long enough.
        """
        night = params.light.time == "night"
        lights_on = night or params.light.rain > 0.3
        catalogue = meshes.catalogue()
        reach = 1.5 * max(params.ego.speed, params.traffic.speed) * seconds
        self._params = params
        self._seed = seed
        self._tick = -1
        self.rate = rate
        self.road = build_road(params.road, reach + VIEW_AHEAD, stream(seed, "road"))
        self._traffic = Traffic(
            self.road, params.traffic, params.ego, catalogue, seed=seed, rate=rate, lights_on=lights_on
        )
        self.camera = Camera(
            width=params.camera.width,
            height=params.camera.height,
            focal=params.camera.focal,
            cx=params.camera.width / 2,
            cy=params.camera.height / 2,
        )
        self.stage = Stage(
            models=catalogue,
            scenery=place_scenery(self.road, params.scenery, params.light.street_lamps, catalogue, seed),
            ground=self.road.ground(),
            light=make_light(params.light, seed),
        )

    @property
    def collided(self) -> bool:
        """Whether vehicles have touched each other: the drive is then invalid."""
        return self._traffic.collided

    @property
    def over(self) -> bool:
        """Whether vehicles have touched each other, or the camera car has left the paved road or its end."""
        x, y, _ = self._traffic.ego().position
        s, d = (float(value) for value in self.road.locate(x, y))
        right, left = self.road.paved
        return self.collided or not (right <= d <= left and -LEAD_IN <= s <= self.road.length)

    def step(self, action: NDArray[np.float32] | None = None) -> WorldState:
        """Advance one tick; the first call gives tick 0.

        Args:
            action: (2,) in [-1, 1], acceleration and yaw rate, where ``ego.driver`` is "actions".
        """
        if self._tick >= 0:
            self._traffic.step(action)
        self._tick += 1
        return WorldState(
            tick=self._tick, rate=self.rate, vehicles=self._traffic.vehicles(), ego=self._traffic.ego()
        )

    def pose(self, state: WorldState) -> Pose:
        """Return the camera's pose: on the ego's mount, pitched and heaved with its body."""
        ego = _ego(state)
        mount = self._params.camera
        ahead = np.array([np.cos(ego.yaw), np.sin(ego.yaw), 0.0])
        up = np.array([0.0, 0.0, mount.mount_height + ego.heave])
        return Pose.looking(
            ego.position + mount.mount_forward * ahead + up, yaw=ego.yaw, pitch=mount.pitch + ego.pitch
        )

    def odometer(self, state: WorldState) -> Odometer:
        """Return speed and yaw rate as the car measures them, with noise."""
        rng = stream(self._seed, "odometer", state.tick)
        speed, yaw_rate = odometer(_ego(state), self._params.ego, rng)
        return Odometer(speed=speed, yaw_rate=yaw_rate)


def _ego(state: WorldState) -> Ego:
    if state.ego is None:
        raise ValueError("a state of the in-car scene has a camera car; this one has none")
    return state.ego
