"""What a dataset says about an episode, whatever its format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from scenarios.export import rle
from scenarios.export.frames import FrameFiles
from sim.camera import Camera, Pose
from sim.truth.types import FrameTruth
from sim.world import FIRST_VEHICLE_ID, Bodies, Ego

if TYPE_CHECKING:
    from pathlib import PurePosixPath

    from sim.simulation import Observation, Odometer


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameRecord:
    """A frame of N vehicles without its picture.

    Attributes:
        tick: From 0.
        time: Seconds.
        truth: Of the vehicles.
        bodies: The same vehicles in the world, in the same order.
        masks: N visible masks, `rle.encode`.
        pose: Of the camera.
        ego: The camera car, None where there is none.
        odometer: What it measured.
    """

    tick: int
    time: float
    truth: FrameTruth
    bodies: Bodies
    masks: tuple[str, ...]
    pose: Pose
    ego: Ego | None
    odometer: Odometer | None

    @property
    def track_ids(self) -> NDArray[np.int64]:
        """(N,) ids from 1, the same vehicle's in all frames of the episode."""
        return self.truth.ids.astype(np.int64) - FIRST_VEHICLE_ID + 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """All frames of an episode without their pictures.

    Attributes:
        name: Its sequence's.
        index: Its place in the dataset, from 0.
        camera: The intrinsics.
        rate: Frames a second.
        images: Where its pictures are.
        frames: In order.
    """

    name: str
    index: int
    camera: Camera
    rate: int
    images: FrameFiles
    frames: tuple[FrameRecord, ...]


class Layout(Protocol):
    """A format: where things stand, and how they are written."""

    first: ClassVar[int]
    """Number of the first picture."""

    def folder(self, name: str) -> PurePosixPath:
        """Return where the pictures of a sequence stand in the dataset."""

    def write_episode(self, root: Path, episode: Episode) -> None:
        """Write what the format says about an episode, but for pictures.

        Every file or folder that is the episode's alone has its name, with or without an ending.
        """

    def write_index(self, root: Path, names: Sequence[str], frames: int) -> None:
        """Write the files that name all episodes.

        Args:
            root: Of the dataset, which holds all of them.
            names: Of the sequences, in order.
            frames: Of each.
        """


def record(observation: Observation) -> FrameRecord:
    """Keep what a dataset says about a frame."""
    state, truth = observation.state, observation.truth
    rows = {vehicle: row for row, vehicle in enumerate(state.vehicles.ids.tolist())}
    return FrameRecord(
        tick=observation.tick,
        time=observation.time,
        truth=truth,
        bodies=state.vehicles.take(np.array([rows[vehicle] for vehicle in truth.ids.tolist()], np.intp)),
        masks=visible_masks(observation.ids, truth),
        pose=observation.pose,
        ego=state.ego,
        odometer=observation.odometer,
    )


def visible_masks(ids: NDArray[np.uint32], truth: FrameTruth) -> tuple[str, ...]:
    """Encode what is visible of each vehicle in an id map."""
    masks = []
    for vehicle, box in zip(truth.ids, truth.box_visible, strict=True):
        x0, y0, x1, y1 = np.nan_to_num(box).astype(int).tolist()
        masks.append(rle.encode(ids[y0:y1, x0:x1] == vehicle, at=(y0, x0), size=(len(ids), ids.shape[1])))
    return tuple(masks)
