"""One drive, frame by frame: world, render, sensor, truth."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.render.types import Stage
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
    """A populated world with a camera in it, made of parameters and a seed (`sim.scenes`)."""

    rate: int
    camera: Camera
    stage: Stage

    def step(self, action: NDArray[np.float32] | None = None) -> WorldState:
        """Return the state of the next tick; the first call gives tick 0."""

    def pose(self, state: WorldState) -> Pose:
        """Return the camera's pose in a state."""

    def odometer(self, state: WorldState) -> Odometer | None:
        """Return what the car measures in a state."""
