"""What is true of the vehicles in one frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameTruth:
    """The N vehicles of which any part lies in the extended frame (its width and height more on every side).

    Nothing is left out for being small or hidden: that is decided when scoring.

    Attributes:
        tick: The frame.
        ids: (N,) uint32.
        kinds: (N,) uint8, a `sim.world.Kind`.
        roles: (N,) uint8, a `sim.world.Role`.
        visible_px: (N,) int64.
        amodal_px: (N,) int64, as if alone, inside the frame.
        amodal_px_full: (N,) int64, as if alone, inside the extended frame.
        box_visible: (N, 4) float64 x0, y0, x1, y1, not a number if nothing is visible.
        box_amodal: (N, 4) float64, of the extended silhouette: it may reach out of the frame.
        occluder_ids: (N,) uint32, who hides most of it inside the frame, 0 for none.
        distances: (N,) float64, metres along the axis to its nearest corner.
        positions: (N, 3) float64, middle of the box in camera coordinates, metres.
        velocities: (N, 3) float64, relative to the camera's translation, on the camera's axes, m/s.
    """

    tick: int
    ids: NDArray[np.uint32]
    kinds: NDArray[np.uint8]
    roles: NDArray[np.uint8]
    visible_px: NDArray[np.int64]
    amodal_px: NDArray[np.int64]
    amodal_px_full: NDArray[np.int64]
    box_visible: NDArray[np.float64]
    box_amodal: NDArray[np.float64]
    occluder_ids: NDArray[np.uint32]
    distances: NDArray[np.float64]
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def visibility_in_frame(self) -> NDArray[np.float64]:
        """(N,) visible / amodal, 0 where nothing of it lies in the frame."""
        return _share(self.visible_px, self.amodal_px)

    @property
    def in_frame(self) -> NDArray[np.float64]:
        """(N,) amodal / amodal_full."""
        return _share(self.amodal_px, self.amodal_px_full)

    @property
    def visible(self) -> NDArray[np.float64]:
        """(N,) visible / amodal_full."""
        return _share(self.visible_px, self.amodal_px_full)


@dataclass(frozen=True, slots=True, kw_only=True)
class AerialTruth(FrameTruth):
    """The truth of a frame that a camera in the air took: where the vehicles are on the ground, too.

    Attributes:
        world_positions: (N, 3) float64, metres: the middle of the footprint.
        world_velocities: (N, 3) float64, m/s, over the ground.
        sizes: (N, 3) float64, length, width, height, metres.
        colours: (N, 3) float32, sRGB paint in [0, 1]: with the sizes they tell who looks like whom.
        ground_to_image: (3, 3) float64, the homography from the ground plane, metres east and north, to
            pixels; its last row gives the depth, metres.
    """

    world_positions: NDArray[np.float64]
    world_velocities: NDArray[np.float64]
    sizes: NDArray[np.float64]
    colours: NDArray[np.float32]
    ground_to_image: NDArray[np.float64]


def _share(part: NDArray[np.int64], whole: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.divide(part, whole, out=np.zeros(len(part)), where=whole > 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class OcclusionEvent:
    """One vehicle hidden, and back again.

    Attributes:
        hidden: Id of the hidden vehicle.
        occluder: Id of what hid most of it over the event; 0 where it was out of view.
        first: First hidden frame.
        last: Last hidden frame.
        deepest: Least share of it that could be seen, [0, 1].
        returned: (x, y) px where it came back (middle of its box), or None where it did not.
    """

    hidden: int
    occluder: int
    first: int
    last: int
    deepest: float
    returned: tuple[float, float] | None
