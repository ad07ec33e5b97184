"""Paper 2's scene: a camera on a moving platform looks down on traffic that bridges hide.

The traffic is highway-env's, level by level: who drives over a bridge never meets who drives below it. In its
place may stand recorded traffic. The platform looks at a place that moves along the road, or at a convoy;
where that swings to and fro, vehicles leave the picture and come back. Or actions steer it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sim import meshes
from sim.aerial.platform import Platform
from sim.aerial.replay import RecordedTraffic
from sim.aerial.site import Area, furnish, lay_out
from sim.aerial.steering import Steering
from sim.aerial.traffic import AerialTraffic
from sim.camera import Camera, Pose
from sim.light import make_light
from sim.meshes.motorcycles import rider_models
from sim.params import AerialParams
from sim.recorded import read
from sim.render.types import Stage
from sim.weather import ChangingLight, Wind
from sim.world import Aloft, WorldState

Floats = NDArray[np.float64]

NEAR, SPAN = 0.25, 6.0
"""What is drawn, in mean altitudes."""
FOLLOW = 1.6
"""Seconds that the aim lags behind a convoy."""
LEEWAY = 60.0
"""Metres by which actions may aim beside the way that the scene is made for."""


class AerialScene:
    """Roads below a platform, all from one seed.

    Attributes:
        rate: Ticks a second.
        camera: The intrinsics, as they were last zoomed.
        stage: What stands still, or sways.
    """

    def __init__(self, params: AerialParams, *, seed: int, rate: int, seconds: float) -> None:
        """Populate the world.

        Args:
            params: What to build.
            seed: Picks one layout, traffic, flight and light among all that the parameters allow.
            rate: Ticks a second.
            seconds: How long the platform may fly.

        Raises:
            RecordingError: If there is to be recorded traffic, and the recording is missing or too short.
        """
        self._params, self.rate, self._tick = params, rate, -1
        mount = params.camera
        self.camera = Camera(
            width=mount.width,
            height=mount.height,
            focal=mount.focal,
            cx=mount.width / 2,
            cy=mount.height / 2,
            near=NEAR * params.platform.altitude,
            far=SPAN * params.platform.altitude,
        )
        models = meshes.catalogue()
        recording = read(params.recording.path) if params.recording.path else None
        if recording is not None:
            models += rider_models()
        self._steered = params.platform.driver == "actions"
        reach = view_reach(self.camera, params) + (LEEWAY if self._steered else 0.0)
        self._layout = lay_out(params, seconds, seed, reach, recording)
        self._platform = Platform(params.platform, mount, across=self._layout.across + np.pi / 2, seed=seed)
        site = furnish(params, self._layout, self._area(seconds, reach), models, seed)
        self._traffic: AerialTraffic | RecordedTraffic
        if recording is None:
            self._traffic = AerialTraffic(params.traffic, self._layout, site.models, seed=seed, rate=rate)
        else:
            self._traffic = RecordedTraffic(
                recording,
                params.traffic,
                site.models,
                start=params.recording.start,
                seconds=seconds,
                seed=seed,
                rate=rate,
            )
        self.stage = Stage(
            models=site.models,
            scenery=site.scenery,
            ground=site.ground,
            light=make_light(params.light, seed),
        )
        self._light = ChangingLight(params.light, seed)
        self._wind = Wind(site.scenery, 0.01 * params.scenery.wind, seed)
        self._aim = self._followed()
        low, high = self._way(seconds)
        self._bounds = low - LEEWAY, high + LEEWAY
        self._steering = Steering(place=self._layout.aim(self._aim))

    @property
    def collided(self) -> bool:
        """Whether vehicles have touched each other: the run is then invalid."""
        return self._traffic.collided

    @property
    def over(self) -> bool:
        """Whether vehicles have touched each other: a platform itself flies on for ever."""
        return self.collided

    def step(self, action: NDArray[np.float32] | None = None) -> WorldState:
        """Advance one tick; the first call gives tick 0.

        Args:
            action: (4,) as `sim.aerial.steering.Steering` takes it, where ``platform.driver`` is "actions".
        """
        if self._tick >= 0:
            self._traffic.step()
            if self._steered and action is not None:
                self._steer(action)
        self._tick += 1
        time, dt = self._tick / self.rate, 1 / self.rate
        self._aim += (self._followed() - self._aim) * -np.expm1(-dt / FOLLOW)
        pose, later = (self._pose_at(t) for t in (time, time + dt))
        return WorldState(
            tick=self._tick,
            rate=self.rate,
            vehicles=self._traffic.vehicles(),
            ego=None,
            lighting=self._light.at(time),
            sway=self._wind.at(time),
            aloft=Aloft(
                position=pose.position,
                rotation=pose.rotation,
                velocity=(later.position - pose.position) / dt,
            ),
        )

    def pose(self, state: WorldState) -> Pose:
        """Return the camera's pose."""
        if state.aloft is None:
            raise ValueError("a state of the aerial scene has a camera in the air; this one has none")
        return Pose(state.aloft.position, state.aloft.rotation)

    def odometer(self, state: WorldState) -> None:
        """Return nothing: the camera is on no car."""

    def _steer(self, action: NDArray[np.float32]) -> None:
        heading = self._platform.heading(self._tick / self.rate) + self._steering.turn
        self._steering = self._steering.after(action, heading, 1 / self.rate, self._bounds)
        focal = self._params.camera.focal * self._steering.zoom
        self.camera = replace(self.camera, focal=focal)

    def _pose_at(self, time: float) -> Pose:
        if self._steered:
            steering = self._steering
            ahead = time - self._tick / self.rate
            return self._platform.pose(time, steering.place + ahead * steering.velocity, steering.turn)
        along = self._aim + self._params.platform.speed * time + self._platform.sway(time)
        return self._platform.pose(time, self._layout.aim(along))

    def _followed(self) -> float:
        """Where along the course the aim is drawn to, before it moves on its own."""
        place = self._traffic.convoy_at()
        return self._layout.start if place is None else place

    def _way(self, seconds: float) -> tuple[Floats, Floats]:
        """Give the lowest and the highest place, (2,) each, that is aimed at, before it roams."""
        p = self._params
        if p.traffic.convoy:
            seen = self._layout.course
        else:
            way = self._layout.start + np.array([0.0, p.platform.speed * seconds])
            places = np.linspace(way.min() - p.platform.sway, way.max() + p.platform.sway, 50)
            seen = np.array([self._layout.aim(float(s)) for s in places])
        return seen.min(axis=0), seen.max(axis=0)

    def _area(self, seconds: float, reach: float) -> Area:
        """West, south, east and north of what the camera may come to see, ``reach`` metres from its aims."""
        far = reach + self._params.platform.roam
        low, high = self._way(seconds)
        low, high = low - far, high + far
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def view_reach(camera: Camera, params: AerialParams) -> float:
    """Return how many metres from its aim the camera may see the ground."""
    height = params.platform.altitude * (1 + params.platform.climb)
    tilt = params.camera.tilt + 0.035
    pose = Pose.looking((0.0, 0.0, height), yaw=0.0, pitch=-np.pi / 2 + tilt)
    corners = np.array([[x, y] for x in (0.0, camera.width) for y in (0.0, camera.height)])
    rays = np.column_stack([(corners - [camera.cx, camera.cy]) / camera.focal, np.ones(4)]) @ pose.rotation
    ground = pose.position[:2] - rays[:, :2] * (height / rays[:, 2:])
    aim = np.array([height * np.tan(tilt), 0.0])
    return float(np.hypot(*(ground - aim).T).max()) + 6.0
