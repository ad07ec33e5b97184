"""Collects polygons and turns them into a `Mesh` with smooth normals and texture coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.models import Mesh, Surface

Floats = NDArray[np.float64]

CREASE = np.radians(38.0)
"""Faces that meet at a sharper angle keep an edge between them."""

METRES_PER_REPEAT = {
    Surface.FOLIAGE: 3.2,
    Surface.BARK: 1.2,
    Surface.CONCRETE: 4.0,
    Surface.FACADE: 12.8,
    Surface.ROOF: 3.0,
    Surface.GRASS: 6.0,
    Surface.CARGO: 4.0,
    Surface.HILL: 60.0,
    Surface.ASPHALT: 4.0,
}
"""How much of a surface one repeat of its texture covers; the others repeat every metre."""


SHOWN_ONCE = (Surface.TAIL_LAMP, Surface.HEAD_LAMP)
"""Surfaces whose texture covers each cell of a `MeshBuilder.grid` exactly once."""


class MeshBuilder:
    """A soup of textured triangles in a model's frame: x ahead, y to the left, z up."""

    def __init__(self) -> None:
        self._polygons: dict[int, list[_Polygons]] = {}

    def polygon(
        self,
        points: ArrayLike,
        surface: Surface,
        *,
        facing: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        normals: ArrayLike | None = None,
    ) -> None:
        """Add a convex polygon as a fan.

        Args:
            points: (N, 3) metres, counter-clockwise from outside; in either order if ``facing`` is given.
            surface: What it is made of.
            facing: (3,) a direction on its outer side.
            uv: (N, 2) texture coordinates; by default the polygon is laid flat on the texture.
            normals: (N, 3) unit normals; by default those of the faces, smoothed when the mesh is built.
        """
        self.polygons(
            np.asarray(points, float)[None],
            surface,
            facing=None if facing is None else np.asarray(facing, float)[None],
            uv=None if uv is None else np.asarray(uv, float)[None],
            normals=None if normals is None else np.asarray(normals, float)[None],
        )

    def polygons(
        self,
        points: Floats,
        surface: Surface | NDArray[np.uint8],
        *,
        facing: Floats | None = None,
        uv: Floats | None = None,
        normals: Floats | None = None,
    ) -> None:
        """Add P polygons of N corners at once, as `polygon` adds one.

        Args:
            points: (P, N, 3).
            surface: One for all, or (P,).
            facing: (P, 3).
            uv: (P, N, 2).
            normals: (P, N, 3).
        """
        count, corners = points.shape[:2]
        blank = np.full((count, corners, 3), np.nan)
        batch = _Polygons(
            points=points,
            surfaces=np.broadcast_to(np.asarray(surface, np.uint8), count),
            facing=blank[:, 0] if facing is None else facing,
            uvs=blank[..., :2] if uv is None else uv,
            normals=blank if normals is None else normals,
        )
        self._polygons.setdefault(corners, []).append(batch)

    def decal(self, points: ArrayLike, surface: Surface, *, facing: ArrayLike, lift: float = 0.012) -> None:
        """Add a quadrilateral that lies ``lift`` metres above a surface and shows its texture once.

        Args:
            points: (4, 3) lower left, lower right, upper right, upper left as seen from outside.
            surface: What it is made of.
            facing: (3,) direction in which it looks.
            lift: Metres along its normal.
        """
        corners = np.asarray(points, float)
        normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
        normal *= np.sign(normal @ np.asarray(facing, float)) / np.linalg.norm(normal)
        self.polygon(corners + lift * normal, surface, facing=facing, uv=[(0, 0), (1, 0), (1, 1), (0, 1)])

    def box(
        self,
        lower: Sequence[float],
        upper: Sequence[float],
        surface: Surface,
        *,
        without: str = "",
        unit_uv: bool = False,
    ) -> None:
        """Add an axis-aligned box.

        Args:
            lower: (3,) its smallest corner.
            upper: (3,) its largest corner.
            surface: What it is made of.
            without: Sides to leave out, two characters each, such as ``"-z+x"``.
            unit_uv: Whether each side shows the texture once.
        """
        ends = np.array([lower, upper], float)
        skipped = {without[i : i + 2] for i in range(0, len(without), 2)}
        for axis in range(3):
            for side, sign in ((0, "-"), (1, "+")):
                if sign + "xyz"[axis] in skipped:
                    continue
                first, second = (axis + 1) % 3, (axis + 2) % 3
                corners = np.empty((4, 3))
                corners[:, axis] = ends[side, axis]
                corners[:, first] = ends[[0, 1, 1, 0], first]
                corners[:, second] = ends[[0, 0, 1, 1], second]
                facing = np.zeros(3)
                facing[axis] = 2 * side - 1
                uv = [(0, 0), (1, 0), (1, 1), (0, 1)] if unit_uv else None
                self.polygon(corners, surface, facing=facing, uv=uv)

    def grid(self, points: ArrayLike, surface: Surface | NDArray[np.uint8], *, inside: ArrayLike) -> None:
        """Add a patch of quadrilaterals over a lattice of points.

        Args:
            points: (M, N, 3) metres.
            surface: One for all, or (M - 1, N - 1), one a cell.
            inside: (3,) or (M - 1, N - 1, 3) a point on the patch's inner side.
        """
        lattice = np.asarray(points, float)
        rows, columns = lattice.shape[0] - 1, lattice.shape[1] - 1
        kinds = np.broadcast_to(np.asarray(surface, np.uint8), (rows, columns)).ravel()
        within = np.broadcast_to(np.asarray(inside, float), (rows, columns, 3)).reshape(-1, 3)
        quads = np.stack([lattice[:-1, :-1], lattice[1:, :-1], lattice[1:, 1:], lattice[:-1, 1:]], axis=2)
        quads = quads.reshape(-1, 4, 3)
        uvs = np.full((len(quads), 4, 2), np.nan)
        uvs[np.isin(kinds, SHOWN_ONCE)] = [(0, 0), (1, 0), (1, 1), (0, 1)]
        self.polygons(quads, kinds, facing=quads.mean(axis=1) - within, uv=uvs)

    def prism(
        self,
        start: Sequence[float],
        end: Sequence[float],
        radii: tuple[float, float],
        surface: Surface,
        *,
        sides: int = 6,
        caps: bool = False,
    ) -> None:
        """Add a round bar, tapering from ``radii[0]`` at ``start`` to ``radii[1]`` at ``end``."""
        foot, head = np.asarray(start, float), np.asarray(end, float)
        axis = (head - foot) / np.linalg.norm(head - foot)
        across = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
        across /= np.linalg.norm(across)
        other = np.cross(axis, across)
        turn = 2 * np.pi * np.arange(sides + 1) / sides
        ring = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * other
        low, high = foot + radii[0] * ring, head + radii[1] * ring
        self.grid(np.stack([low, high]), surface, inside=(foot + head) / 2)
        if caps:
            self.polygon(low[:-1], surface, facing=-axis)
            self.polygon(high[:-1], surface, facing=axis)

    def wheel(self, centre: Sequence[float], radius: float, width: float, *, sides: int, outer: int) -> None:
        """Add a wheel across y whose outer face looks toward ``outer`` (+1 left, -1 right)."""
        turn = 2 * np.pi * (np.arange(sides) + 0.5) / sides
        # The flats of the polygon stand on the ground.
        ring = np.stack([np.sin(turn), -np.cos(turn)], axis=1) / np.cos(np.pi / sides)
        rim = np.zeros((sides, 3))
        rim[:, [0, 2]] = np.asarray(centre, float)[[0, 2]] + radius * ring
        faces = {side: rim + np.array([0.0, centre[1] + side * width / 2, 0.0]) for side in (-1, 1)}
        disc = 0.5 + 0.5 * ring / np.abs(ring).max()
        self.polygon(faces[outer], Surface.RUBBER, facing=(0, outer, 0), uv=disc)
        self.polygon(faces[-outer], Surface.RUBBER, facing=(0, -outer, 0), uv=np.full((sides, 2), 0.02))
        nearer, farther = faces[-1], faces[1]
        quads = np.stack([nearer, farther, np.roll(farther, -1, axis=0), np.roll(nearer, -1, axis=0)], axis=1)
        out = quads.mean(axis=1) - np.asarray(centre, float)
        self.polygons(quads, Surface.RUBBER, facing=out, uv=np.full((sides, 4, 2), 0.02))

    def build(self) -> Mesh:
        """Return the mesh: creased normals, equal corners merged."""
        fans = [_fans(batches) for _, batches in sorted(self._polygons.items())]
        triangles, surfaces, uvs, given = (np.concatenate(column) for column in zip(*fans, strict=True))
        normals = _creased_normals(triangles, surfaces)
        normals = np.where(np.isnan(given), normals, given)
        corners = np.concatenate(
            [
                triangles.reshape(-1, 3),
                normals.reshape(-1, 3),
                uvs.reshape(-1, 2),
                np.repeat(surfaces, 3)[:, None],
            ],
            axis=1,
        )
        unique, inverse = np.unique(np.round(corners, 5), axis=0, return_inverse=True)
        direction = unique[:, 3:6]
        return Mesh(
            vertices=unique[:, :3].astype(np.float32),
            normals=(direction / np.linalg.norm(direction, axis=1, keepdims=True)).astype(np.float32),
            uvs=unique[:, 6:8].astype(np.float32),
            surfaces=unique[:, 8].astype(np.uint8),
            faces=inverse.reshape(-1, 3).astype(np.int32),
        )


@dataclass(frozen=True, slots=True)
class _Polygons:
    """P polygons of N corners: what `MeshBuilder.polygons` was given, nan where it was given nothing."""

    points: Floats
    surfaces: NDArray[np.uint8]
    facing: Floats
    uvs: Floats
    normals: Floats


def _fans(batches: Sequence[_Polygons]) -> tuple[Floats, NDArray[np.uint8], Floats, Floats]:
    """Turn polygons of equally many corners into triangles, counter-clockwise from outside.

    Returns:
        Corners (T, 3, 3), surfaces (T,), texture coordinates (T, 3, 2), given normals (T, 3, 3) or nan.
    """
    points, surfaces, facing, uvs, normals = (
        np.concatenate([getattr(batch, name) for batch in batches])
        for name in ("points", "surfaces", "facing", "uvs", "normals")
    )
    arms = points - points[:, :1]
    outward = np.cross(arms[:, 1:-1], arms[:, 2:]).sum(axis=1)
    inverted = (outward * np.nan_to_num(facing)).sum(axis=1) < 0
    outward[inverted] *= -1
    uvs = np.where(np.isnan(uvs), planar_uv(points, outward, surfaces), uvs)
    for array in (points, uvs, normals):
        array[inverted] = array[inverted, ::-1]
    count = points.shape[1]
    pick = np.array([(0, i, i + 1) for i in range(1, count - 1)])
    corners, uvs, normals = (
        array[:, pick].reshape(-1, 3, array.shape[-1]) for array in (points, uvs, normals)
    )
    surfaces = np.repeat(surfaces, count - 2)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    solid = (area**2).sum(axis=1) > 1e-14
    return corners[solid], surfaces[solid], uvs[solid], normals[solid]


def planar_uv(points: Floats, normals: Floats, surfaces: NDArray[np.uint8]) -> Floats:
    """Lay flat polygons on their textures: u to the right and v up as seen from outside.

    Args:
        points: (P, N, 3) metres.
        normals: (P, 3) outward, of any length.
        surfaces: (P,) deciding the scale.

    Returns:
        (P, N, 2) texture coordinates.
    """
    axis = np.abs(normals).argmax(axis=1)
    sign = np.where(np.take_along_axis(normals, axis[:, None], axis=1) > 0, 1.0, -1.0)
    x, y, z = (points[..., i] for i in range(3))
    across = np.stack([sign * y, -sign * x, x])[axis, np.arange(len(axis))]
    up = np.stack([z, z, sign * y])[axis, np.arange(len(axis))]
    scale = np.array([METRES_PER_REPEAT.get(surface, 1.0) for surface in Surface])[surfaces]
    return np.asarray(np.stack([across, up], axis=-1) / scale[:, None, None])


def _creased_normals(triangles: Floats, surfaces: NDArray[np.uint8]) -> Floats:
    """Average the normals of the faces that share a corner and a surface and meet at less than the crease."""
    area = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    unit = area / np.linalg.norm(area, axis=1, keepdims=True)
    keys = np.concatenate(
        [np.round(triangles.reshape(-1, 3) * 1e4), np.repeat(surfaces, 3)[:, None].astype(float)], axis=1
    )
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order], prepend=-1))
    normals = np.empty((len(order), 3))
    for members in np.split(order, starts[1:]):
        face = members // 3
        alike = unit[face] @ unit[face].T > np.cos(CREASE)
        normals[members] = alike @ area[face]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals.reshape(-1, 3, 3)


def scaled_to(builder: MeshBuilder, size: tuple[float, float, float]) -> Mesh:
    """Build a mesh and stretch it to fill ``size``, centred in x and y, its foot on the ground."""
    mesh = builder.build()
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    factor = np.array(size) / (high - low)
    origin = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    normals = mesh.normals / factor
    return Mesh(
        vertices=((mesh.vertices - origin) * factor).astype(np.float32),
        normals=(normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32),
        uvs=mesh.uvs,
        surfaces=mesh.surfaces,
        faces=mesh.faces,
    )
