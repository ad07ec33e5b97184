"""Each vehicle drawn alone: which pixels it would cover if nothing stood before it.

Every vehicle has a plot of its own in one buffer, as large as the box that holds it in the image, and its
fragments mark their pixels there: all vehicles are drawn at once and never hide each other. Inside the frame
the drawing goes through the same viewport and matrix as the picture's identities, so that the rasteriser
covers exactly the same pixels; what lies outside comes from a target three times as wide and high.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.render.instances import Library, Selection
from sim.render.types import Plots, Silhouettes
from sim.render.view import view_matrices
from sim.world import Bodies

Ints = NDArray[np.int64]

PLOT = np.dtype([("box", "<i4", 4), ("first", "<i4")])
"""Where an instance marks its pixels: x0, y0, x1, y1 px in the target, and the first place in the buffer."""

_EDGES = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b).bit_count() == 1])
"""The twelve edges of a box, as pairs of the corners that `Library.corners` gives."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """N vehicles that OpenGL was asked to draw.

    Attributes:
        ids: (N,) uint32.
        inside: (I,) which of them were drawn in the frame.
        outside: (O,) which of them were drawn in the extended frame.
        plots: (I + O,) `PLOT` records, one after another in the buffer.
        frame: Width and height.
    """

    ids: NDArray[np.uint32]
    inside: NDArray[np.intp]
    outside: NDArray[np.intp]
    plots: NDArray[np.void]
    frame: tuple[int, int]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def survey(covered: NDArray[np.uint32], plots: NDArray[np.void], hole: Ints) -> Ints:
    """Count the pixels that are marked in each plot and find the tightest box around them.

    Args:
        covered: The buffer: 1 where marked, else 0.
        plots: (N,) `PLOT` records.
        hole: (4,) x0, y0, x1, y1 in the target: what lies in it does not count, and is set to 0.

    Returns:
        (N, 5) count and x0, y0, x1, y1 in the target; all 0 if the count is 0.
    """
    out = np.zeros((len(plots), 5), np.int64)
    for k in range(len(plots)):
        x0, y0, x1, y1 = plots[k]["box"]
        count, left, top, right, bottom = 0, x1, y1, x0, y0
        for i in range(y0, y1):
            first = plots[k]["first"] + (i - y0) * (x1 - x0)
            row = covered[first : first + x1 - x0]
            if hole[1] <= i < hole[3]:
                for j in range(max(hole[0], x0), min(hole[2], x1)):
                    row[j - x0] = 0
            marked = 0
            for value in row:
                marked += value
            if marked:
                count += marked
                top, bottom = min(top, i), i + 1
                start, stop = 0, x1 - x0
                while not row[start]:
                    start += 1
                while not row[stop - 1]:
                    stop -= 1
                left, right = min(left, x0 + start), max(right, x0 + stop)
        if count:
            out[k, 0], out[k, 1], out[k, 2], out[k, 3], out[k, 4] = count, left, top, right, bottom
    return out


class SilhouettePass:
    """Draws vehicles alone and counts them.

    Args:
        ctx: The context, current.
        shader: The program that marks plots.
        array: Its vertex array.
        buffers: The array's instances and `PLOT` records, and draw commands.
        size: Width and height of the frame.
    """

    def __init__(
        self, ctx: Any, shader: Any, array: Any, buffers: tuple[Any, Any, Any], size: tuple[int, int]
    ) -> None:
        self._shader, self._array = shader, array
        self._instances, self._plots, self._commands = buffers
        self._frame, self._wide = (
            ctx.framebuffer([ctx.renderbuffer(edges, 1)]) for edges in (size, (3 * size[0], 3 * size[1]))
        )
        self._frame.color_mask = self._wide.color_mask = False, False, False, False
        self._covered = ctx.buffer(reserve=1 << 22, dynamic=True)

    def release(self) -> None:
        """Give the graphics memory back."""
        for target in (self._frame, self._wide):
            target.color_attachments[0].release()
            target.release()
        self._covered.release()

    def draw(self, ctx: Any, library: Library, vehicles: Bodies, camera: Camera, pose: Pose) -> Drawn:
        """Ask OpenGL to draw; `count` waits until it has.

        Args:
            ctx: The context, current.
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
        inner = np.clip(boxes, 0, [width, height, width, height])
        by_mesh = np.argsort(selection.meshes, kind="stable")  # equal ones in a row are one draw
        inside = by_mesh[((inner[:, 0] < inner[:, 2]) & (inner[:, 1] < inner[:, 3]))[by_mesh]]
        outside = by_mesh[(boxes != inner).any(axis=1)[by_mesh]]
        wide = replace(
            camera, width=3 * width, height=3 * height, cx=camera.cx + width, cy=camera.cy + height
        )
        plots = laid_out(np.concatenate([inner[inside], boxes[outside] + [width, height, width, height]]))
        self._instances.write(library.instances(vehicles, selection, pose)[np.concatenate([inside, outside])])
        self._plots.write(plots)
        self._clear(ctx, 4 * _room(plots))
        ctx.enable_only(ctx.CULL_FACE)
        ctx.front_face = "cw"
        for target, view, first, rows in (
            (self._frame, camera, 0, inside),
            (self._wide, wide, len(inside), outside),
        ):
            commands = library.commands(selection.meshes[rows])
            commands["base_instance"] += first
            self._commands.write(commands)
            target.use()
            self._shader["u_clip"].write(view_matrices(view, pose)["u_clip"])
            self._array.render_indirect(self._commands, count=len(commands))
        return Drawn(
            ids=vehicles.ids[selection.rows],
            inside=inside,
            outside=outside,
            plots=plots,
            frame=(width, height),
        )

    def count(self, ctx: Any, drawn: Drawn) -> Silhouettes:
        """Count what `draw` has drawn last."""
        covered = np.empty(_room(drawn.plots), np.uint32)
        ctx.memory_barrier()
        self._covered.read_into(covered, covered.nbytes)
        count, (width, height) = len(drawn.inside), drawn.frame
        within, beyond = np.zeros((2, len(drawn.ids), 5), np.int64)
        within[drawn.inside] = survey(covered, drawn.plots[:count], np.zeros(4, np.int64))
        frame = np.array([width, height, 2 * width, 2 * height])
        beyond[drawn.outside] = survey(covered, drawn.plots[count:], frame)
        beyond[:, 1:] -= [width, height, width, height]
        own = np.zeros(len(drawn.ids), PLOT)
        own[drawn.inside] = drawn.plots[:count]
        return _joined(drawn.ids, within, beyond, Plots(own["box"], own["first"], covered))

    def _clear(self, ctx: Any, size: int) -> None:
        """Make room for ``size`` bytes of plots, all 0, and let the shader mark them."""
        if size > self._covered.size:
            self._covered.release()
            self._covered = ctx.buffer(reserve=2 * size, dynamic=True)
        self._covered.clear(size)
        self._covered.bind_to_storage_buffer(0)


def laid_out(boxes: Ints) -> NDArray[np.void]:
    """Return (N,) `PLOT` records that lay (N, 4) boxes one after another in the buffer."""
    out = np.zeros(len(boxes), PLOT)
    out["box"] = boxes
    sizes = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    out["first"] = np.cumsum(sizes) - sizes
    return out


def _room(plots: NDArray[np.void]) -> int:
    """Places that plots take in the buffer."""
    if not len(plots):
        return 1
    x0, y0, x1, y1 = plots["box"][-1]
    return int(plots["first"][-1] + (x1 - x0) * (y1 - y0))


def _joined(ids: NDArray[np.uint32], within: Ints, beyond: Ints, plots: Plots) -> Silhouettes:
    """Put together what was counted inside the frame and beyond it, (N, 5) each as `survey` gives it."""
    both = np.stack([within, beyond])
    empty = both[..., :1] == 0
    low = np.where(empty, np.inf, both[..., 1:3]).min(axis=0)
    high = np.where(empty, -np.inf, both[..., 3:]).max(axis=0)
    boxes = np.concatenate([low, high], axis=1)
    boxes[np.isinf(low[:, 0])] = np.nan
    return Silhouettes(
        ids=ids, pixels=within[:, 0], pixels_full=both[..., 0].sum(axis=0), boxes=boxes, plots=plots
    )
