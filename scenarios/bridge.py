"""From the simulator to the tracker, and from truth to what traces are scored by: where the two meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.truth.types import FrameTruth
from sim.world import FIRST_VEHICLE_ID
from tracker.types import Frame, Info, Intrinsics, Odometry, Traces

if TYPE_CHECKING:
    from sim.camera import Camera
    from sim.simulation import Observation
    from sim.world import Lighting

NEAR_PX = 3.0
"""A point this near to a pixel of a vehicle is the vehicle's (scoring.md 7)."""
STRETCH = 0.1
"""A vehicle's box is stretched down by this share of its height: the contact shadow is the vehicle's."""

_STEP = np.array([(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1)])


@dataclass(frozen=True, slots=True, kw_only=True)
class Votes:
    """What the support points of each trace lie on: one row a trace and object, ordered by both.

    Attributes:
        ids: (K,) int64, the trace.
        objects: (K,) uint32, id of the object.
        counts: (K,) int64, points.
        depths: (K,) float64, their median depth, metres along the axis, infinite in the sky.
    """

    ids: NDArray[np.int64]
    objects: NDArray[np.uint32]
    counts: NDArray[np.int64]
    depths: NDArray[np.float64]


def tracker_info(camera: Camera, rate: float) -> Info:
    """Return what a tracker is told before the first frame: the focal length, but no scenario's name."""
    return Info(
        width=camera.width,
        height=camera.height,
        rate=rate,
        intrinsics=Intrinsics(focal=camera.focal, cx=camera.cx, cy=camera.cy),
    )


def tracker_frame(observation: Observation, *, odometry: bool) -> Frame:
    """Return what a tracker sees of an observation: a picture of its own to write into, and never truth.

    Args:
        observation: A simulated frame.
        odometry: Whether the car's noisy measurements of its own motion go with it.
    """
    measured = observation.odometer if odometry else None
    return Frame(
        image=observation.image.copy(),
        tick=observation.tick,
        time=observation.time,
        odometry=Odometry(speed=measured.speed, yaw_rate=measured.yaw_rate) if measured else None,
    )


def light_level(lighting: Lighting) -> float:
    """Return how much light of sun and sky there is, 1 where it is the scene's own."""
    return (sum(lighting.sun) + sum(lighting.sky)) / 6


def point_owners(
    points: NDArray[np.float64], ids: NDArray[np.uint32], truth: FrameTruth
) -> NDArray[np.uint32]:
    """Say what each image point lies on (scoring.md 7).

    The vehicle whose pixel holds the point; else the vehicle with the nearest pixel centre within
    `NEAR_PX`; else the nearest vehicle (by distance from the camera) in whose visible box, stretched down
    by `STRETCH`, the point lies; else the id map's value. A point outside the image counts as moved to the
    image's border.

    Args:
        points: (K, 2) x, y, px.
        ids: (H, W) the id map.
        truth: Of the same frame.

    Returns:
        (K,) object ids.
    """
    owners: NDArray[np.uint32] = _owners(
        np.ascontiguousarray(points, np.float64), ids, truth.ids, truth.box_visible, truth.distances
    )
    return owners


def votes(traces: Traces, ids: NDArray[np.uint32], depth: NDArray[np.float32], truth: FrameTruth) -> Votes:
    """Count what the support points of each trace lie on, and how far away that is."""
    owners = point_owners(traces.points, ids, truth)
    pairs = (traces.point_traces.astype(np.int64) << 32) | owners  # traces are few: one word holds both
    unique, group, counts = np.unique(pairs, return_inverse=True, return_counts=True)
    depths = point_depths(traces.points, depth)
    order = np.lexsort((depths, group.reshape(-1)))
    middles = np.cumsum(counts) - counts + (counts - 1) // 2
    return Votes(
        ids=unique >> 32,
        objects=unique.astype(np.uint32),
        counts=counts.astype(np.int64),
        depths=depths[order][middles],
    )


def point_depths(points: NDArray[np.float64], depth: NDArray[np.float32]) -> NDArray[np.float64]:
    """Give the least depth (K,) within a pixel of image points (K, 2): an edge is the nearer thing's."""
    height, width = depth.shape
    columns = points[:, 0, None].astype(np.int64) + _STEP[:, 1]
    rows = points[:, 1, None].astype(np.int64) + _STEP[:, 0]
    near = depth[rows.clip(0, height - 1), columns.clip(0, width - 1)]
    return np.asarray(near.min(axis=1, initial=np.inf), np.float64)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _owners(
    points: NDArray[np.float64],
    ids: NDArray[np.uint32],
    vehicles: NDArray[np.uint32],
    boxes: NDArray[np.float64],
    distances: NDArray[np.float64],
) -> NDArray[np.uint32]:
    """As `point_owners`, with the vehicles' (N,) ids, (N, 4) visible boxes and (N,) distances."""
    height, width = ids.shape
    reach = int(np.ceil(NEAR_PX))
    owners = np.zeros(len(points), np.uint32)
    for k in range(len(points)):
        x = min(max(points[k, 0], 0.0), np.nextafter(width, 0))
        y = min(max(points[k, 1], 0.0), np.nextafter(height, 0))
        column, row = int(x), int(y)
        owners[k] = ids[row, column]
        if owners[k] >= FIRST_VEHICLE_ID:
            continue
        nearest = NEAR_PX * NEAR_PX
        found = False
        for i in range(max(row - reach, 0), min(row + reach + 1, height)):
            for j in range(max(column - reach, 0), min(column + reach + 1, width)):
                squared = (i + 0.5 - y) ** 2 + (j + 0.5 - x) ** 2
                if ids[i, j] >= FIRST_VEHICLE_ID and (
                    squared < nearest or (squared == nearest and not found)
                ):
                    nearest, found = squared, True
                    owners[k] = ids[i, j]
        if found:
            continue
        closest = np.inf
        for n in range(len(vehicles)):
            x0, y0, x1, y1 = boxes[n]
            # Comparisons with the box of an invisible vehicle, not numbers, are false.
            inside = x0 <= x < x1 and y0 <= y < y1 + STRETCH * (y1 - y0)
            if inside and distances[n] < closest:
                closest = distances[n]
                owners[k] = vehicles[n]
    return owners
