"""Which bodies are drawn, at which level of detail, and how they stand in the instance buffer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.models import Mesh, Model
from sim.world import Bodies

INSTANCE = np.dtype(
    [
        ("position", "<f4", 3),  # relative to the camera's position, on the world's axes, metres
        ("turn", "<f4", 2),  # cosine and sine of the yaw
        ("scale", "<f4", 3),
        ("colour", "u1", 4),  # sRGB, and the lamps
        ("id", "<u4"),
        ("lean", "<f4", 2),  # metres aside for each metre of height
    ]
)
"""One instance, as the shaders read it. Positions are relative: far from the origin float32 is coarse."""

COMMAND = np.dtype(
    [
        ("count", "<u4"),
        ("instances", "<u4"),
        ("first", "<u4"),
        ("base_vertex", "<i4"),
        ("base_instance", "<u4"),
    ]
)
"""One indirect draw of OpenGL."""

CONTACT = np.dtype([("position", "<f4", 3), ("turn", "<f4", 2), ("half", "<f4", 2)])
"""What a vehicle hides of the sky: its footprint on the ground, relative to the camera."""

SWITCH_FOCAL = 800.0
"""Pixels: the focal length for which models say at what distance a coarser mesh takes over."""

ROOM = 8192
"""Instances and draws in a frame."""

_CONTACT_REACH = 90.0  # metres along the axis, for a camera near the ground
_CONTACT_ALOFT = 2.2  # camera heights, for one in the air
_NARROWEST_PX = 0.35
_BANDS_PER_OCTAVE = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """What is to be drawn of some bodies, nearest first.

    Attributes:
        rows: (M,) which of the bodies.
        meshes: (M,) index into the library's meshes (a model at a level of detail).
    """

    rows: NDArray[np.intp]
    meshes: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.rows)

    def within(self, bodies: Bodies, pose: Pose, reach: float) -> Selection:
        """Keep what stands within ``reach`` metres, and no hills or woods as long as that."""
        offset = bodies.positions[self.rows] - pose.position
        kept = (offset * offset).sum(axis=1) < reach * reach
        kept &= bodies.sizes[self.rows].max(axis=1) < reach
        return Selection(rows=self.rows[kept], meshes=self.meshes[kept])


class Library:
    """All meshes of all models in one vertex and one index array, and the rules that pick among them.

    Attributes:
        vertices: (V, 9) float32: position, normal, texture coordinates, surface.
        faces: (F, 3) int32, indices into ``vertices`` from each mesh's ``base_vertex``.
        first: (K,) first index of each mesh, counted in indices.
        count: (K,) indices of each mesh.
        base_vertex: (K,).
        sizes: (M, 3) metres, of the models as they were made.
    """

    def __init__(self, models: Sequence[Model]) -> None:
        meshes = [mesh for model in models for mesh in model.lods]
        self._meshes = meshes
        self.vertices = np.concatenate(
            [
                np.column_stack([mesh.vertices, mesh.normals, mesh.uvs, mesh.surfaces]).astype(np.float32)
                for mesh in meshes
            ]
        )
        self.faces = np.concatenate([mesh.faces for mesh in meshes]).astype(np.int32)
        self.count = np.array([3 * len(mesh.faces) for mesh in meshes], np.uint32)
        self.first = np.concatenate([[0], np.cumsum(self.count)[:-1]]).astype(np.uint32)
        vertex_counts = np.array([len(mesh.vertices) for mesh in meshes])
        self.base_vertex = np.concatenate([[0], np.cumsum(vertex_counts)[:-1]]).astype(np.int32)
        self.sizes = np.array([model.size for model in models], float)
        levels = np.array([len(model.lods) for model in models])
        self._first_mesh = np.concatenate([[0], np.cumsum(levels)[:-1]]).astype(np.int32)
        self._levels = levels
        self._switch = np.full((len(models), max(levels) - 1 if len(models) else 0), np.inf)
        for row, model in zip(self._switch, models, strict=True):
            row[: len(model.switch)] = model.switch
        self._reach = np.array([_reach(model) for model in models])
        self._bounds = np.array(
            [
                [
                    np.min([mesh.vertices.min(axis=0) for mesh in model.lods], axis=0),
                    np.max([mesh.vertices.max(axis=0) for mesh in model.lods], axis=0),
                ]
                for model in models
            ]
        )

    def mesh(self, index: int) -> Mesh:
        """Return a mesh by the index that `Selection` uses."""
        return self._meshes[index]

    def select(
        self, bodies: Bodies, camera: Camera, pose: Pose, *, widen: float = 1.0, coarsest: bool = False
    ) -> Selection:
        """Pick the bodies of which something may be seen, and their level of detail.

        Args:
            bodies: N bodies.
            camera: The intrinsics.
            pose: The camera's pose.
            widen: Multiplies the half-widths of the frame: 3 for the extended frame.
            coarsest: Take each model's coarsest mesh.
        """
        if not len(bodies):
            return Selection(rows=np.zeros(0, np.intp), meshes=np.zeros(0, np.int32))
        scale = bodies.sizes / self.sizes[bodies.models]
        reach = self._reach[bodies.models] * scale.max(axis=1)
        reach += bodies.sizes[:, 2] * np.hypot(*bodies.leans.T)
        centre = bodies.positions - pose.position
        centre[:, 2] += 0.5 * bodies.sizes[:, 2]
        right, down, ahead = pose.rotation @ centre.T
        seen = (ahead > camera.near - reach) & (ahead < camera.far + reach)
        for across, centre_px, size_px in (
            (right, camera.cx, camera.width),
            (down, camera.cy, camera.height),
        ):
            middle = 0.5 * size_px
            for sign, edge in (
                (1.0, middle * (1 + widen) - centre_px),
                (-1.0, centre_px - middle * (1 - widen)),
            ):
                slope = edge / camera.focal
                seen &= sign * across - slope * ahead < reach * np.hypot(1.0, slope)
        distance = np.sqrt((centre * centre).sum(axis=1))
        width = np.sort(bodies.sizes, axis=1)[:, 1]
        seen &= width * camera.focal > _NARROWEST_PX * distance
        rows = np.flatnonzero(seen)
        rows = rows[np.argsort(distance[rows], kind="stable")]
        models = bodies.models[rows]
        if coarsest:
            level = self._levels[models] - 1
        else:
            apparent = distance[rows, None] * (SWITCH_FOCAL / camera.focal)
            level = (apparent >= self._switch[models]).sum(axis=1)
        return Selection(rows=rows, meshes=(self._first_mesh[models] + level).astype(np.int32))

    def instances(self, bodies: Bodies, selection: Selection, pose: Pose) -> NDArray[np.void]:
        """Return (M,) `INSTANCE` records of the selected bodies."""
        chosen = bodies.take(selection.rows)
        out = np.zeros(len(chosen), INSTANCE)
        out["position"] = chosen.positions - pose.position
        out["turn"] = np.column_stack([np.cos(chosen.yaws), np.sin(chosen.yaws)])
        out["scale"] = chosen.sizes / self.sizes[chosen.models]
        out["colour"][:, :3] = np.clip(chosen.colours * 255 + 0.5, 0, 255)
        out["colour"][:, 3] = chosen.lamps
        out["id"] = chosen.ids
        out["lean"] = chosen.leans
        return out

    def corners(self, bodies: Bodies, selection: Selection) -> NDArray[np.float64]:
        """Return (M, 8, 3) world metres: corners of the boxes around the selected bodies."""
        chosen = bodies.take(selection.rows)
        bounds = self._bounds[chosen.models] * (chosen.sizes / self.sizes[chosen.models])[:, None, :]
        picks = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
        local = np.stack([bounds[:, picks[:, axis], axis] for axis in range(3)], axis=-1)
        cos, sin = np.cos(chosen.yaws)[:, None], np.sin(chosen.yaws)[:, None]
        x, y = cos * local[..., 0] - sin * local[..., 1], sin * local[..., 0] + cos * local[..., 1]
        aside = chosen.leans[:, None, :] * local[..., 2:]
        return (
            np.stack([x + aside[..., 0], y + aside[..., 1], local[..., 2]], axis=-1)
            + chosen.positions[:, None]
        )

    def commands(self, meshes: NDArray[np.int32]) -> NDArray[np.void]:
        """Return one `COMMAND` for each run of equal meshes in (M,) ``meshes``."""
        starts = np.flatnonzero(np.diff(meshes, prepend=-1))
        out = np.zeros(len(starts), COMMAND)
        which = meshes[starts]
        out["count"] = self.count[which]
        out["instances"] = np.diff(starts, append=len(meshes))
        out["first"] = self.first[which]
        out["base_vertex"] = self.base_vertex[which]
        out["base_instance"] = starts
        return out


def in_bands(bodies: Bodies, selection: Selection, pose: Pose) -> Selection:
    """Reorder by mesh within bands of distance: few draws, and still near before far."""
    offset = bodies.positions[selection.rows] - pose.position
    distance = np.maximum(np.sqrt((offset * offset).sum(axis=1)), 1.0)
    band = np.floor(np.log2(distance) * _BANDS_PER_OCTAVE).astype(np.int64)
    order = np.lexsort((selection.meshes, band))
    return Selection(rows=selection.rows[order], meshes=selection.meshes[order])


def _reach(model: Model) -> float:
    """Largest distance of a vertex from half the model's height above its origin."""
    middle = np.array([0.0, 0.0, 0.5 * model.size[2]])
    return max(float(np.sqrt(((mesh.vertices - middle) ** 2).sum(axis=1)).max()) for mesh in model.lods)


def contacts(vehicles: Bodies, pose: Pose) -> NDArray[np.void]:
    """Return (M,) `CONTACT` records of the vehicles that are near and ahead."""
    offset = vehicles.positions - pose.position
    ahead = offset @ pose.rotation[2]
    reach = max(_CONTACT_REACH, _CONTACT_ALOFT * float(pose.position[2]))
    rows = np.flatnonzero((ahead > -vehicles.sizes[:, 0]) & (ahead < reach))
    out = np.zeros(len(rows), CONTACT)
    out["position"] = offset[rows]
    out["turn"] = np.column_stack([np.cos(vehicles.yaws[rows]), np.sin(vehicles.yaws[rows])])
    out["half"] = 0.5 * vehicles.sizes[rows, :2]
    return out
