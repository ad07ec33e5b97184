"""One drive, frame by frame: world, render, sensor, truth."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.params import SensorParams
from sim.render.types import Stage
from sim.sensor import Sensor
from sim.truth.boxes import frame_truth
from sim.truth.types import FrameTruth
from sim.world import WorldState


@dataclass(frozen=True, slots=True, kw_only=True)
class Odometer:
    """What the camera car measured: speed, m/s, and yaw rate, rad/s, positive to the right."""

    speed: float
    yaw_rate: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """A frame and all that is true of it.

    Attributes:
        tick: The frame's number.
        time: Seconds.
        image: (H, W, 3) uint8, RGB, as the camera recorded it.
        ids: (H, W) uint32 id map.
        depth: (H, W) float32 metres.
        state: The world.
        pose: Of the camera, vibration included.
        odometer: None where the camera is on no car.
        truth: Of the vehicles.
        timing_ms: Milliseconds by stage: world, render, sensor, truth. No part of what is compared.
    """

    tick: int
    time: float
    image: NDArray[np.uint8]
    ids: NDArray[np.uint32]
    depth: NDArray[np.float32]
    state: WorldState
    pose: Pose
    odometer: Odometer | None
    truth: FrameTruth
    timing_ms: dict[str, float] = field(compare=False)


class Scene(Protocol):
    """A populated world with a camera in it, made of parameters and a seed (`sim.scenes`).

    The camera is that of the last state: a step may zoom it.
    """

    rate: int
    camera: Camera
    stage: Stage

    @property
    def over(self) -> bool:
        """Whether it has come to an end of its own, so that what follows would mean nothing."""

    def step(self, action: NDArray[np.float32] | None = None) -> WorldState:
        """Return the state of the next tick; the first call gives tick 0."""

    def pose(self, state: WorldState) -> Pose:
        """Return the camera's pose in a state."""

    def odometer(self, state: WorldState) -> Odometer | None:
        """Return what the car measures in a state."""


class Simulation:
    """Steps a scene and records what its camera sees.

    Owns the renderer: use it as a context manager, or call `close`.
    """

    def __init__(self, scene: Scene, sensor: SensorParams, *, seed: int) -> None:
        """Get ready to draw.

        Args:
            scene: The populated world.
            sensor: What the camera does to the picture.
            seed: The episode's seed, for the sensor's own streams.

        Raises:
            RenderUnavailableError: If there is no off-screen OpenGL here.
        """
        from sim.render.gl import GlRenderer  # GL is loaded only where something is drawn

        self.scene = scene
        self._renderer = GlRenderer(scene.stage, scene.camera)
        self._sensor = Sensor(sensor, scene.stage.light, scene.camera, scene.rate, seed)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back what the renderer holds."""
        self._renderer.close()

    def step(self, action: NDArray[np.float32] | None = None) -> Observation:
        """Advance one tick and observe it."""
        clock = _Stopwatch()
        state = self.scene.step(action)
        camera, pose = self.scene.camera, self.scene.pose(state)
        clock.lap("world")
        picture, silhouettes = self._renderer.observe(state, camera, pose)
        clock.lap("render")
        speed = state.ego.speed if state.ego is not None else 0.0
        image = self._sensor.expose(picture, state.tick, speed, stops=state.handling.stops)
        clock.lap("sensor")
        truth = frame_truth(state, picture, silhouettes, camera, pose)
        clock.lap("truth")
        return Observation(
            tick=state.tick,
            time=state.time,
            image=image,
            ids=picture.ids,
            depth=picture.depth,
            state=state,
            pose=pose,
            odometer=self.scene.odometer(state),
            truth=truth,
            timing_ms=clock.laps,
        )

    def run(self, frames: int) -> Iterator[Observation]:
        """Yield that many observations, one tick each."""
        for _ in range(frames):
            yield self.step()


class _Stopwatch:
    """Milliseconds between laps."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.laps[name] = 1e3 * (now - self._last)
        self._last = now
