"""From the simulator to the tracker, and from truth to what traces are scored by: where the two meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.truth.types import FrameTruth
from sim.world import FIRST_VEHICLE_ID
from tracker.types import Frame, Info, Intrinsics, Odometry, Traces

if TYPE_CHECKING:
    from sim.camera import Camera
    from sim.simulation import Observation

NEAR_PX = 3.0
"""A point this near to a pixel of a vehicle is the vehicle's (scoring.md 7)."""
STRETCH = 0.1
"""A vehicle's box is stretched down by this share of its height: the contact shadow is the vehicle's."""

_STEP = np.array([(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1)])
_REACH = int(np.ceil(NEAR_PX)) + 1
_ROWS, _COLUMNS = (
    offsets.ravel() for offsets in np.mgrid[-_REACH : _REACH + 1, -_REACH : _REACH + 1].astype(np.int64)
)


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
    height, width = ids.shape
    x = np.clip(points[:, 0], 0.0, np.nextafter(width, 0))
    y = np.clip(points[:, 1], 0.0, np.nextafter(height, 0))
    column, row = x.astype(np.int64), y.astype(np.int64)
    owners = ids[row, column]

    open_points = np.flatnonzero(owners < FIRST_VEHICLE_ID)
    if len(open_points) and len(truth):
        near = _nearest_vehicle(x[open_points], y[open_points], ids)
        boxed = _boxed_vehicle(x[open_points], y[open_points], truth)
        found = np.where(near > 0, near, boxed)
        owners[open_points] = np.where(found > 0, found, owners[open_points])
    return owners


def votes(
    traces: Traces, ids: NDArray[np.uint32], depth: NDArray[np.float32], truth: FrameTruth
) -> Votes:
    """Count what the support points of each trace lie on, and how far away that is."""
    owners = point_owners(traces.points, ids, truth)
    pairs = np.stack([traces.point_traces, owners.astype(np.int64)], axis=1).reshape(-1, 2)
    unique, group, counts = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    depths = point_depths(traces.points, depth)
    order = np.lexsort((depths, group.reshape(-1)))
    middles = np.cumsum(counts) - counts + (counts - 1) // 2
    return Votes(
        ids=unique[:, 0],
        objects=unique[:, 1].astype(np.uint32),
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


def _nearest_vehicle(
    x: NDArray[np.float64], y: NDArray[np.float64], ids: NDArray[np.uint32]
) -> NDArray[np.uint32]:
    """Return the vehicle with the nearest pixel centre within `NEAR_PX`, or 0: (K,)."""
    height, width = ids.shape
    rows = y.astype(np.int64)[:, None] + _ROWS
    columns = x.astype(np.int64)[:, None] + _COLUMNS
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    candidates = ids[rows.clip(0, height - 1), columns.clip(0, width - 1)]
    squared = (rows + 0.5 - y[:, None]) ** 2 + (columns + 0.5 - x[:, None]) ** 2
    possible = inside & (candidates >= FIRST_VEHICLE_ID) & (squared <= NEAR_PX**2)
    best = np.argmin(np.where(possible, squared, np.inf), axis=1)
    k = np.arange(len(x))
    return np.where(possible[k, best], candidates[k, best], 0).astype(np.uint32)


def _boxed_vehicle(x: NDArray[np.float64], y: NDArray[np.float64], truth: FrameTruth) -> NDArray[np.uint32]:
    """Return the nearest vehicle in whose stretched visible box each point lies, or 0: (K,)."""
    x0, y0, x1, y1 = truth.box_visible.T[:, None, :]
    x, y = x[:, None], y[:, None]
    # Comparisons with the empty box of an invisible vehicle, not numbers, are false.
    inside = (x >= x0) & (x < x1) & (y >= y0) & (y < y1 + STRETCH * (y1 - y0))
    best = np.argmin(np.where(inside, truth.distances, np.inf), axis=1)
    return np.where(inside.any(axis=1), truth.ids[best], 0).astype(np.uint32)
