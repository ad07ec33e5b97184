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
from sim.render.silhouettes import Drawn
from sim.render.types import Picture, Silhouettes, Stage
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Asked:
    """A tick that is being drawn; fields as in `Observation`."""

    state: WorldState
    camera: Camera
    pose: Pose
    odometer: Odometer | None
    drawn: Drawn
    timing_ms: dict[str, float]


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
        asked = self._ask(action)
        return self._record(asked, *self._see(asked))

    def run(self, frames: int) -> Iterator[Observation]:
        """Yield that many observations, one tick each; the next frame is drawn while one is worked on."""
        if frames < 1:
            return
        asked = self._ask()
        for _ in range(frames - 1):
            seen, following = self._see(asked), self._ask()
            yield self._record(asked, *seen)
            asked = following
        yield self._record(asked, *self._see(asked))

    def _ask(self, action: NDArray[np.float32] | None = None) -> _Asked:
        """Advance one tick and have it drawn."""
        clock = _Stopwatch()
        state = self.scene.step(action)
        camera, pose, odometer = self.scene.camera, self.scene.pose(state), self.scene.odometer(state)
        clock.lap("world")
        drawn = self._renderer.begin(state, camera, pose)
        clock.lap("render")
        return _Asked(
            state=state, camera=camera, pose=pose, odometer=odometer, drawn=drawn, timing_ms=clock.laps
        )

    def _see(self, asked: _Asked) -> tuple[Picture, Silhouettes]:
        """Wait for what is being drawn."""
        clock = _Stopwatch()
        seen = self._renderer.finish(asked.drawn)
        clock.lap("render")
        asked.timing_ms["render"] += clock.laps["render"]
        return seen

    def _record(self, asked: _Asked, picture: Picture, silhouettes: Silhouettes) -> Observation:
        """Pass what was drawn through the sensor, and tell what is true of it."""
        clock = _Stopwatch()
        state = asked.state
        speed = state.ego.speed if state.ego is not None else 0.0
        image = self._sensor.expose(picture, state.tick, speed, stops=state.handling.stops)
        clock.lap("sensor")
        truth = frame_truth(state, picture, silhouettes, asked.camera, asked.pose)
        clock.lap("truth")
        return Observation(
            tick=state.tick,
            time=state.time,
            image=image,
            ids=picture.ids,
            depth=picture.depth,
            state=state,
            pose=asked.pose,
            odometer=asked.odometer,
            truth=truth,
            timing_ms=asked.timing_ms | clock.laps,
        )


class _Stopwatch:
    """Milliseconds between laps."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.laps[name] = 1e3 * (now - self._last)
        self._last = now
