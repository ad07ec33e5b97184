"""All that is true of one frame, as one object that can be compared, copied and sent to another process."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass

import numpy as np
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.truth.types import FrameTruth
from sim.world import WorldState


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Snapshot:
    """The world behind a picture. Equal snapshots agree in every number of every array.

    Attributes:
        tick: The frame's number.
        time: Seconds.
        vehicles: What is true of the vehicles in the picture.
        ids: (H, W) uint32 id map.
        depth: (H, W) float32 metres along the optical axis.
        state: The world.
        camera: The intrinsics.
        pose: Of the camera.
        speed: m/s that the camera car's odometer reads; None where the camera is on no car.
        yaw_rate: rad/s that it reads, positive to the right; None likewise.
    """

    tick: int
    time: float
    vehicles: FrameTruth
    ids: NDArray[np.uint32]
    depth: NDArray[np.float32]
    state: WorldState
    camera: Camera
    pose: Pose
    speed: float | None = None
    yaw_rate: float | None = None

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        return _alike(self, other) if isinstance(other, Snapshot) else NotImplemented


def _alike(one: object, other: object) -> bool:
    """Tell whether two values are of one type and agree, in dataclasses field by field."""
    if type(one) is not type(other):
        return False
    if is_dataclass(one):
        return all(_alike(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        inexact = np.issubdtype(one.dtype, np.inexact)
        return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=bool(inexact))
    return one == other
