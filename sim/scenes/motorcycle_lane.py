"""Paper 3's scene: a camera that stands still above a lane of motorcycles, seen from behind.

The riders are this project's own model (`sim.riders`), not highway-env's vehicles on narrow sublanes: those
keep to the middle of a lane and change lanes whole, while motorcycles ride at any offset, squeeze through
gaps and weave. The lane runs east from s = 0, beneath the camera's mast; it and what stands beside it are
made as the in-car scene's road and scenery are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim import meshes
from sim.camera import Camera, Pose
from sim.light import make_light
from sim.meshes.motorcycles import rider_models
from sim.params import MotorcycleLaneParams, RoadParams
from sim.render.types import Stage
from sim.riders import RiderTraffic
from sim.rng import stream
from sim.roads import build_road
from sim.scenery import place_scenery
from sim.weather import ChangingLight, Wind
from sim.world import Handling, WorldState

LENGTH = 260.0
"""Metres of road."""
FAR = 250.0
"""Metres: what lies farther is not drawn; the camera looks down."""
PAN_RATE, PAN_MOST = 0.5, 0.4
"""Rad/s of a full action, and how far the camera can be turned from where it was mounted to look, rad."""
STOPS = 2.0
"""Stops of light of a full action."""


class MotorcycleLaneScene:
    """A lane, its riders, light and weather, all from one seed.

    Attributes:
        rate: Ticks a second.
        camera: The intrinsics.
        stage: What stands still, or sways.
    """

    def __init__(self, params: MotorcycleLaneParams, *, seed: int, rate: int) -> None:
        """Populate the world.

        Args:
            params: What to build.
            seed: Picks one traffic, weather and scenery among all that the parameters allow.
            rate: Ticks a second.
        """
        lane, mount = params.lane, params.camera
        models = meshes.catalogue() + rider_models()
        road = build_road(
            RoadParams(
                lanes=2, oncoming_lanes=0, lane_width=lane.width / 2, median=0.0, shoulder=lane.shoulder
            ),
            LENGTH,
            stream(seed, "road"),
        )
        self._tick = -1
        self._handling = Handling()
        self.rate = rate
        self.camera = Camera(
            width=mount.width,
            height=mount.height,
            focal=mount.focal,
            cx=mount.width / 2,
            cy=mount.height / 2,
            far=FAR,
        )
        self.stage = Stage(
            models=models,
            scenery=place_scenery(road, params.scenery, params.light.street_lamps, models, seed),
            ground=road.ground(),
            light=make_light(params.light, seed),
        )
        self._mount = mount
        self._place = 0.0, mount.mount_offset - lane.width / 2, mount.mount_height
        self._light = ChangingLight(params.light, seed)
        self._wind = Wind(self.stage.scenery, 0.01 * params.scenery.wind, seed)
        self._riders = RiderTraffic(
            params.riders,
            lane=(-lane.width, 0.0),
            far=view_end(self.camera, self._looking(0.0)),
            models=models,
            seed=seed,
            rate=rate,
        )

    @property
    def over(self) -> bool:
        """False: the camera stands, and riders give way to each other."""
        return False

    def step(self, action: NDArray[np.float32] | None = None) -> WorldState:
        """Advance one tick; the first call gives tick 0.

        Args:
            action: (2,) in [-1, 1]: how fast the camera pans, positive to the right, and by how much it is
                exposed more or less; None leaves it alone, and so does zero.
        """
        if self._tick >= 0:
            self._riders.step()
            if action is not None:
                pan, stops = (float(a) for a in np.clip(action, -1, 1))
                turned = self._handling.pan + PAN_RATE / self.rate * pan
                self._handling = Handling(pan=min(max(turned, -PAN_MOST), PAN_MOST), stops=STOPS * stops)
        self._tick += 1
        time = self._tick / self.rate
        return WorldState(
            tick=self._tick,
            rate=self.rate,
            vehicles=self._riders.bodies(),
            ego=None,
            lighting=self._light.at(time),
            sway=self._wind.at(time),
            handling=self._handling,
        )

    def pose(self, state: WorldState) -> Pose:
        """Return the camera's pose: it stands where it is mounted, and pans."""
        return self._looking(state.handling.pan)

    def odometer(self, state: WorldState) -> None:
        """Return nothing: the camera is on no car."""

    def _looking(self, pan: float) -> Pose:
        return Pose.looking(self._place, yaw=self._mount.yaw - pan, pitch=self._mount.pitch)


def view_end(camera: Camera, pose: Pose) -> float:
    """Return how many metres ahead the ground leaves the image, 80 at most."""
    upper = pose.rotation[2] - pose.rotation[1] * camera.cy / camera.focal
    fall = -upper[2] / np.hypot(upper[0], upper[1])
    return min(80.0, float(pose.position[2] / fall)) if fall > 0 else 80.0
