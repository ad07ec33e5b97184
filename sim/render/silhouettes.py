"""Each vehicle drawn alone: how many pixels it would show if nothing stood before it.

Vehicles whose boxes in the image do not overlap share one drawing; each of them is then counted within its
own box. Inside the frame the drawing goes through the same viewport and matrix as the picture's identities,
so that the rasteriser covers exactly the same pixels; what lies outside the frame comes from a target three
times as wide and high.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.render.instances import Library, Selection
from sim.render.types import Silhouettes
from sim.render.view import view_matrices
from sim.world import Bodies

Ints = NDArray[np.int64]
Mask = tuple[int, int, NDArray[np.bool_]]

_EDGES = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b).bit_count() == 1])
"""The twelve edges of a box, as pairs of the corners that `Library.corners` gives."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """Some of N vehicles, drawn together.

    Attributes:
        rows: (M,) which of the vehicles.
        area: x0, y0, x1, y1 px: the part of the target that holds them all.
    """

    rows: NDArray[np.intp]
    area: tuple[int, int, int, int]


def image_boxes(library: Library, bodies: Bodies, selection: Selection, camera: Camera, pose: Pose) -> Ints:
    """Return (M, 4) x0, y0, x1, y1 px that surely hold the selected bodies, cut at the extended frame."""
    corners = library.corners(bodies, selection)
    local = (corners - pose.position) @ pose.rotation.T
    width, height = camera.width, camera.height
    # What lies wholly to one side enters the extended frame only from some depth on: cut it there.
    aside = np.where(np.ptp(np.sign(local[..., 0]), axis=1) == 0, np.abs(local[..., 0]).min(axis=1), 0.0)
    slope = (width + max(camera.cx, width - camera.cx)) / camera.focal
    nearest = np.maximum(camera.near, aside / slope)[:, None]
    start, end = local[:, _EDGES[:, 0]], local[:, _EDGES[:, 1]]
    crossing = (start[..., 2] < nearest) != (end[..., 2] < nearest)
    span = np.where(crossing, end[..., 2] - start[..., 2], 1.0)
    met = start + ((nearest - start[..., 2]) / span)[..., None] * (end - start)
    points = np.concatenate([local, met], axis=1)
    used = np.concatenate([local[..., 2] >= nearest, crossing], axis=1)
    depth = np.where(used, points[..., 2], 1.0)
    x = np.where(used, camera.focal * points[..., 0] / depth + camera.cx, np.nan)
    y = np.where(used, camera.focal * points[..., 1] / depth + camera.cy, np.nan)
    kept = used.any(axis=1)
    box = np.zeros((len(local), 4))
    low_x, low_y, high_x, high_y = (
        edge(side[kept], axis=1) for edge in (np.nanmin, np.nanmax) for side in (x, y)
    )
    box[kept] = np.stack([low_x - 1, low_y - 1, high_x + 2, high_y + 2], axis=1)
    low, high = np.array([-width, -height] * 2), np.array([2 * width, 2 * height] * 2)
    return np.asarray(np.floor(np.clip(box, low, high)), np.int64)


def layered(boxes: Ints, rows: NDArray[np.intp]) -> list[Drawing]:
    """Spread boxes over as few drawings as a greedy choice finds, none overlapping within one.

    Args:
        boxes: (N, 4) x0, y0, x1, y1.
        rows: (M,) those to draw.
    """
    layers = _layers(boxes, rows)
    drawings = []
    for layer in range(int(layers.max(initial=-1)) + 1):
        members = rows[layers == layer]
        held = boxes[members]
        area = (*held[:, :2].min(axis=0).tolist(), *held[:, 2:].max(axis=0).tolist())
        drawings.append(Drawing(rows=members, area=area))
    return drawings


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _layers(boxes: Ints, rows: NDArray[np.intp]) -> Ints:
    """Return (M,) the first layer in which each of the rows overlaps none of those before it."""
    layers = np.zeros(rows.size, np.int64)
    meets = np.zeros(rows.size, np.bool_)
    for k in range(rows.size):
        meets[: k + 1] = False
        x0, y0, x1, y1 = boxes[rows[k]]
        for other in range(k):
            a, b, c, d = boxes[rows[other]]
            if x0 < c and a < x1 and y0 < d and b < y1:
                meets[layers[other]] = True
        while meets[layers[k]]:
            layers[k] += 1
    return layers


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _measure(
    picture: NDArray[np.uint16], x: int, y: int, boxes: Ints, rows: NDArray[np.intp], hole: Ints, out: Ints
) -> None:
    """Count each row's pixels within its box and find the tightest box around them.

    Args:
        picture: Part of the target, each pixel the row that covers it plus one.
        x: Where the part's upper left corner lies in the target.
        y: The same, downward.
        boxes: (N, 4) x0, y0, x1, y1 in the target.
        rows: (M,) those drawn.
        hole: (4,) x0, y0, x1, y1 in the target: what lies in it does not count.
        out: (N, 5) takes the count and x0, y0, x1, y1 in the target; no change if the count is 0.
    """
    for row in rows:
        x0, y0, x1, y1 = boxes[row]
        count, left, top, right, bottom = 0, x1, y1, x0, y0
        for i in range(y0, y1):
            in_hole = hole[1] <= i < hole[3]
            for j in range(x0, x1):
                if picture[i - y, j - x] == row + 1 and not (in_hole and hole[0] <= j < hole[2]):
                    count += 1
                    left, right = min(left, j), max(right, j + 1)
                    top, bottom = min(top, i), max(bottom, i + 1)
        if count:
            out[row, 0], out[row, 1], out[row, 2], out[row, 3], out[row, 4] = count, left, top, right, bottom


class SilhouettePass:
    """Draws vehicles alone and counts them.

    Args:
        ctx: The context, current.
        array: Vertex array of the body shader that writes `INSTANCE` ids.
        instances: Its buffer of instances.
        commands: Buffer of draw commands.
        size: Width and height of the frame.
    """

    def __init__(self, ctx: Any, array: Any, instances: Any, commands: Any, size: tuple[int, int]) -> None:
        self._array, self._instances, self._commands = array, instances, commands
        self._frame = ctx.framebuffer([ctx.renderbuffer(size, 1, dtype="u2")])
        self._wide = ctx.framebuffer([ctx.renderbuffer((3 * size[0], 3 * size[1]), 1, dtype="u2")])

    def release(self) -> None:
        """Give the graphics memory back."""
        for target in (self._frame, self._wide):
            target.color_attachments[0].release()
            target.release()

    def draw(
        self, ctx: Any, shader: Any, library: Library, vehicles: Bodies, camera: Camera, pose: Pose
    ) -> Silhouettes:
        """Draw and count.

        Args:
            ctx: The context, current.
            shader: The program of the array.
            library: The meshes.
            vehicles: Those to count.
            camera: The intrinsics.
            pose: The camera's pose.
        """
        width, height = camera.width, camera.height
        selection = library.select(vehicles, camera, pose, widen=3.0)
        boxes = image_boxes(library, vehicles, selection, camera, pose)
        kept = (boxes[:, 0] < boxes[:, 2]) & (boxes[:, 1] < boxes[:, 3])
        selection = Selection(rows=selection.rows[kept], meshes=selection.meshes[kept])
        boxes = boxes[kept]
        count = len(selection)
        instances = library.instances(vehicles, selection, pose)
        instances["id"] = np.arange(1, count + 1)
        low, high = np.array([0, 0, 0, 0]), np.array([width, height, width, height])
        inner = np.clip(boxes, low, high)
        inside = np.flatnonzero((inner[:, 0] < inner[:, 2]) & (inner[:, 1] < inner[:, 3]))
        outside = np.flatnonzero((boxes != inner).any(axis=1))
        shift = np.array([width, height, width, height])
        jobs = [(self._frame, camera, inner, drawing) for drawing in layered(inner, inside)]
        wide = replace(
            camera, width=3 * width, height=3 * height, cx=camera.cx + width, cy=camera.cy + height
        )
        # To the left and to the right apart: between them lies the frame, which nobody asks for here.
        left = boxes[outside, 0] + boxes[outside, 2] < width
        for side in (outside[left], outside[~left]):
            jobs += [(self._wide, wide, boxes + shift, drawing) for drawing in layered(boxes + shift, side)]
        within, beyond = np.zeros((count, 5), np.int64), np.zeros((count, 5), np.int64)
        if not jobs:
            return _counted(vehicles.ids[selection.rows], within, beyond, {})
        order = np.concatenate([drawing.rows for *_, drawing in jobs])
        self._instances.write(instances[order])
        self._commands.write(library.single_commands(selection.meshes[order]))
        first = 0
        masks: dict[int, Mask] = {}
        ctx.enable_only(ctx.CULL_FACE)
        ctx.front_face = "cw"
        current = None
        for target, view, held, drawing in jobs:
            if target is not current:
                target.use()
                shader["u_clip"].write(view_matrices(view, pose)["u_clip"])
                current = target
            x0, y0, x1, y1 = drawing.area
            area = (x0, y0, x1 - x0, y1 - y0)
            target.clear(viewport=area)
            ctx.scissor = area
            self._array.render_indirect(self._commands, count=len(drawing.rows), first=first)
            first += len(drawing.rows)
            ctx.scissor = None
            raw = target.read(viewport=area, components=1, dtype="u2", alignment=1)
            picture = np.frombuffer(raw, np.uint16).reshape(y1 - y0, x1 - x0)
            if target is not self._frame:
                hole = np.array([width, height, 2 * width, 2 * height])
                _measure(picture, x0, y0, held, drawing.rows, hole, beyond)
                continue
            _measure(picture, x0, y0, held, drawing.rows, np.zeros(4, np.int64), within)
            for row, (pixels, a, b, c, d) in zip(
                drawing.rows.tolist(), within[drawing.rows].tolist(), strict=True
            ):
                if pixels:
                    masks[row] = (b, a, picture[b - y0 : d - y0, a - x0 : c - x0] == row + 1)
        beyond[:, 1:] -= shift[[0, 1, 0, 1]]
        return _counted(vehicles.ids[selection.rows], within, beyond, masks)


def _counted(ids: NDArray[np.uint32], within: Ints, beyond: Ints, masks: dict[int, Mask]) -> Silhouettes:
    """Put together what was counted inside the frame and beyond it, (N, 5) each as `_measure` gives it."""
    nothing: Mask = (0, 0, np.zeros((0, 0), bool))
    both = np.stack([within, beyond])
    empty = both[..., :1] == 0
    low = np.where(empty, np.inf, both[..., 1:3]).min(axis=0)
    high = np.where(empty, -np.inf, both[..., 3:]).max(axis=0)
    boxes = np.concatenate([low, high], axis=1)
    boxes[np.isinf(low[:, 0])] = np.nan
    return Silhouettes(
        ids=ids,
        pixels=within[:, 0],
        pixels_full=both[..., 0].sum(axis=0),
        boxes=boxes,
        masks=tuple(masks.get(row, nothing) for row in range(len(ids))),
    )
