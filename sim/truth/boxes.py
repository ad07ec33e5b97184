"""Boxes, visibility and occluders of the vehicles in one frame, from the id map and the silhouettes."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.camera import Camera, Pose, ground_homography
from sim.render.types import Picture, Silhouettes
from sim.truth.types import AerialTruth, FrameTruth
from sim.world import SKY_ID, Bodies, WorldState

_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)])
"""(8, 3) corners of a unit box that stands on the ground, x along the heading."""


def frame_truth(
    state: WorldState, picture: Picture, silhouettes: Silhouettes, camera: Camera, pose: Pose
) -> FrameTruth:
    """Say what is true of the vehicles in one frame.

    Args:
        state: The world.
        picture: Its id map tells what is visible.
        silhouettes: Each vehicle drawn alone. Their order is the order of the result.
        camera: The intrinsics; the id map has its size.
        pose: The pose that both were drawn with.

    Returns:
        The truth, an `AerialTruth` where the camera flies.

    Raises:
        ValueError: If a silhouette is of no vehicle of the state, or the id map has another size.
    """
    if picture.ids.shape != (camera.height, camera.width):
        raise ValueError(f"the id map is {picture.ids.shape}, the camera {(camera.height, camera.width)}")
    bodies = state.vehicles.take(_rows(state.vehicles.ids, silhouettes.ids))
    visible_px, box_visible = visible_parts(picture.ids, silhouettes.ids)
    plots = silhouettes.plots
    corners = pose.to_camera(_box_corners(bodies))
    own_velocity = np.zeros(3)
    if state.ego is not None:
        own_velocity[:2] = state.ego.speed * np.array([np.cos(state.ego.yaw), np.sin(state.ego.yaw)])
    if state.aloft is not None:
        own_velocity = state.aloft.velocity
    truth = FrameTruth(
        tick=state.tick,
        ids=silhouettes.ids,
        kinds=bodies.kinds,
        roles=bodies.roles,
        visible_px=visible_px,
        amodal_px=silhouettes.pixels,
        amodal_px_full=silhouettes.pixels_full,
        box_visible=box_visible,
        box_amodal=silhouettes.boxes,
        occluder_ids=_occluders(
            picture.ids,
            silhouettes.ids,
            visible_px < silhouettes.pixels,
            plots.boxes,
            plots.first,
            plots.covered,
        ),
        distances=corners[..., 2].min(axis=1),
        positions=corners.mean(axis=1),
        velocities=(bodies.velocities - own_velocity) @ pose.rotation.T,
    )
    if state.aloft is None:
        return truth
    return AerialTruth(
        **{f.name: getattr(truth, f.name) for f in fields(truth)},
        world_positions=bodies.positions,
        world_velocities=bodies.velocities,
        sizes=bodies.sizes,
        colours=bodies.colours,
        ground_to_image=ground_homography(camera, pose),
    )


def visible_parts(
    id_map: NDArray[np.uint32], ids: NDArray[np.uint32]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Count the pixels of objects in an id map and box them, in one pass.

    Args:
        id_map: (H, W).
        ids: (N,), unique, in any order.

    Returns:
        (N,) pixels and (N, 4) half-open boxes x0, y0, x1, y1, not a number where there is none.
    """
    order = np.argsort(ids)
    counts = np.zeros(len(ids), np.int64)
    boxes = np.full((len(ids), 4), np.nan)
    if len(ids):
        counts[order], boxes[order] = _scan(np.ascontiguousarray(id_map), ids[order])
    return counts, boxes


@njit(cache=True)  # type: ignore[untyped-decorator]
def _scan(
    id_map: NDArray[np.uint32], ids: NDArray[np.uint32]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """As `visible_parts`, for sorted ids: one binary search a run of equal pixels."""
    height, width = id_map.shape
    counts = np.zeros(len(ids), np.int64)
    boxes = np.full((len(ids), 4), np.nan)
    for row in range(height):
        start = 0
        while start < width:
            value = id_map[row, start]
            end = start + 1
            while end < width and id_map[row, end] == value:
                end += 1
            if ids[0] <= value <= ids[-1]:
                k = np.searchsorted(ids, value)
                if ids[k] == value:
                    if counts[k] == 0:
                        boxes[k, 0], boxes[k, 1], boxes[k, 2] = start, row, end
                    counts[k] += end - start
                    boxes[k, 0] = min(boxes[k, 0], start)
                    boxes[k, 2] = max(boxes[k, 2], end)
                    boxes[k, 3] = row + 1
            start = end
    return counts, boxes


@njit(cache=True)  # type: ignore[untyped-decorator]
def _occluders(
    id_map: NDArray[np.uint32],
    ids: NDArray[np.uint32],
    hidden: NDArray[np.bool_],
    boxes: NDArray[np.int32],
    first: NDArray[np.int32],
    covered: NDArray[np.uint32],
) -> NDArray[np.uint32]:
    """Find the id most frequent under each silhouette but its own and the sky; of equals the lowest; or 0.

    Args:
        id_map: (H, W).
        ids: (N,).
        hidden: (N,) whether anything of it is hidden: the others are not looked at.
        boxes: (N, 4), as in `Plots`.
        first: (N,) likewise.
        covered: (P,) likewise.
    """
    out = np.zeros(len(ids), np.uint32)
    found = np.zeros(16, np.uint32)
    counts = np.zeros(16, np.int64)
    for k in np.flatnonzero(hidden):
        x0, y0, x1, y1 = boxes[k]
        own, size, last = ids[k], 0, 0
        for row in range(y0, y1):
            start = first[k] + (row - y0) * (x1 - x0)
            for value, inside in zip(id_map[row, x0:x1], covered[start : start + x1 - x0]):  # noqa: B905
                if not inside or value == own or value == SKY_ID:  # noqa: SIM109 (numba takes no tuple of two types)
                    continue
                # Few things hide one vehicle, and neighbours are mostly of the same one.
                if size == 0 or found[last] != value:
                    last = 0
                    while last < size and found[last] != value:
                        last += 1
                    if last == size:
                        if size == len(found):
                            found = np.concatenate((found, np.zeros_like(found)))
                            counts = np.concatenate((counts, np.zeros_like(counts)))
                        found[size], counts[size] = value, 0
                        size += 1
                counts[last] += 1
        best = 0
        for n in range(1, size):
            if counts[n] > counts[best] or (counts[n] == counts[best] and found[n] < found[best]):
                best = n
        if size:
            out[k] = found[best]
    return out


def _rows(ids: NDArray[np.uint32], wanted: NDArray[np.uint32]) -> NDArray[np.intp]:
    order = np.argsort(ids)
    places = np.searchsorted(ids, wanted, sorter=order)
    if not np.isin(wanted, ids).all():
        raise ValueError(f"silhouettes of {np.setdiff1d(wanted, ids).tolist()}, which are no vehicles here")
    return np.asarray(order[places], np.intp)


def _box_corners(bodies: Bodies) -> NDArray[np.float64]:
    """Give (N, 8, 3) world corners of the bodies' boxes."""
    local = _CORNERS * bodies.sizes[:, None, :]
    cos, sin = np.cos(bodies.yaws)[:, None], np.sin(bodies.yaws)[:, None]
    turned = np.stack(
        [
            cos * local[..., 0] - sin * local[..., 1],
            sin * local[..., 0] + cos * local[..., 1],
            local[..., 2],
        ],
        axis=-1,
    )
    return np.asarray(turned + bodies.positions[:, None, :])
