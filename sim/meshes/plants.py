"""Trees and bushes: opaque crowns of jagged clumps, since an id map knows no half-transparent leaf."""

from __future__ import annotations

import numpy as np

from sim.meshes.builder import Floats, MeshBuilder, scaled_to
from sim.models import Mesh, Model, Surface
from sim.rng import stream
from sim.world import Kind

SWITCH = (45.0, 130.0)
"""Metres at which the coarser meshes take over."""

_SEED = 20110602

# Name, size, number of clumps, crown's lower edge as a share of the height.
_BROADLEAF = (
    ("broadleaf-a", (7.5, 7.5, 9.0), 8, 0.17),
    ("broadleaf-b", (10.5, 10.5, 12.5), 9, 0.16),
    ("broadleaf-c", (5.2, 5.2, 6.8), 7, 0.20),
    ("broadleaf-d", (7.0, 7.0, 14.5), 9, 0.12),
    ("broadleaf-e", (8.5, 8.5, 6.6), 8, 0.10),
)
_CONIFER = (("conifer-a", (4.0, 4.0, 12.0)), ("conifer-b", (5.0, 5.0, 16.0)))
_BUSH = (
    ("bush-a", (2.2, 2.2, 1.4), 3),
    ("bush-b", (3.4, 2.6, 2.0), 4),
    ("bush-c", (1.4, 1.4, 0.9), 2),
)


def plant_models() -> tuple[Model, ...]:
    """Make the trees and bushes."""
    models = [
        Model(
            name=name, kind=Kind.TREE, size=size, switch=SWITCH,
            lods=tuple(_broadleaf(name, size, clumps, low, detail) for detail in (2, 1, 0)),
        )
        for name, size, clumps, low in _BROADLEAF
    ]  # fmt: skip
    models += [
        Model(
            name=name, kind=Kind.TREE, size=size, switch=SWITCH,
            lods=tuple(_conifer(name, size, detail) for detail in (2, 1, 0)),
        )
        for name, size in _CONIFER
    ]  # fmt: skip
    models += [
        Model(
            name=name, kind=Kind.BUSH, size=size, switch=SWITCH,
            lods=tuple(_bush(name, size, clumps, detail) for detail in (2, 1, 0)),
        )
        for name, size, clumps in _BUSH
    ]  # fmt: skip
    return tuple(models)


def _icosahedron() -> tuple[Floats, Floats]:
    """Return unit corners (12, 3) and faces (20, 3)."""
    phi = (1 + 5**0.5) / 2
    corners = np.array(
        [(-1, phi, 0), (1, phi, 0), (-1, -phi, 0), (1, -phi, 0), (0, -1, phi), (0, 1, phi), (0, -1, -phi), (0, 1, -phi),
         (phi, 0, -1), (phi, 0, 1), (-phi, 0, -1), (-phi, 0, 1)], float,
    )  # fmt: skip
    faces = np.array(
        [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
         (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)],
    )  # fmt: skip
    return corners / np.linalg.norm(corners, axis=1, keepdims=True), faces


def clump(
    builder: MeshBuilder,
    centre: Floats,
    radii: Floats,
    rng: np.random.Generator,
    *,
    spikes: int,
    rough: float = 0.24,
) -> None:
    """Add a lump of leaves: a dented icosahedron, and twigs that break its outline.

    Args:
        builder: Takes the faces.
        centre: (3,) metres.
        radii: (3,) metres.
        rng: Of the dents.
        spikes: How many three-sided twigs stand out.
        rough: Relative standard deviation of the corners' distance.
    """
    corners, faces = _icosahedron()
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    corners = corners @ turn
    if np.linalg.det(turn) < 0:
        faces = faces[:, ::-1]
    dents = np.clip(rng.normal(1, rough, len(corners)), 0.6, 1.5)[:, None]
    points = centre + corners * dents * radii
    points[:, 2] = np.maximum(points[:, 2], 0.0)
    fluff = corners + rng.normal(0, 0.30, corners.shape)
    fluff /= np.linalg.norm(fluff, axis=1, keepdims=True)
    shift = rng.uniform(0, 1, 2)
    for face in faces:
        uv = _leaf_uv(points[face], corners[face].mean(axis=0)) + shift
        builder.polygon(points[face], Surface.FOLIAGE, uv=uv, normals=fluff[face])
    for direction in rng.normal(size=(spikes, 3)):
        out = direction / np.linalg.norm(direction)
        side = np.cross(out, rng.normal(size=3))
        side /= np.linalg.norm(side)
        other = np.cross(out, side)
        tip = centre + out * radii * rng.uniform(1.05, 1.38) + rng.normal(0, 0.10, 3) * radii
        ring = [
            centre + radii * (0.72 * out + 0.34 * (np.cos(a) * side + np.sin(a) * other))
            for a in (0.0, 2.1, 4.2)
        ]
        tip[2] = max(tip[2], 0.0)
        for corner in ring:
            corner[2] = max(corner[2], 0.0)
        normal = out + rng.normal(0, 0.35, 3)
        normal /= np.linalg.norm(normal)
        for i in range(3):
            corner = np.stack([ring[i], ring[(i + 1) % 3], tip])
            builder.polygon(
                corner, Surface.FOLIAGE, facing=corner.mean(axis=0) - centre - 0.8 * out * radii,
                uv=_leaf_uv(corner, out) + shift, normals=np.tile(normal, (3, 1)),
            )  # fmt: skip


def _leaf_uv(points: Floats, normal: Floats) -> Floats:
    axis = int(np.argmax(np.abs(normal)))
    flat = np.delete(points, axis, axis=1)
    return np.asarray(flat / 2.4)


def _broadleaf(name: str, size: tuple[float, float, float], clumps: int, low: float, detail: int) -> Mesh:
    rng = stream(_SEED, "plants", name)
    builder = MeshBuilder()
    width, height = size[0], size[2]
    base, top = low * height, height
    middle = (base + top) / 2
    lean = rng.normal(0, 0.02 * width, 2)
    builder.prism(
        (0, 0, 0), (lean[0], lean[1], middle), (0.024 * height + 0.06, 0.014 * height), Surface.BARK,
        sides=(5, 4, 3)[2 - detail],
    )  # fmt: skip
    deep = top - base
    shape = stream(_SEED, "plants", name, "clumps")
    if detail == 0:
        clump(
            builder,
            np.array([0, 0, middle]),
            np.array([0.46 * width, 0.46 * width, 0.48 * deep]),
            shape,
            spikes=5,
            rough=0.16,
        )
        return scaled_to(builder, size)
    # The same clumps on both finer levels; the coarser keeps a few, swollen to fill the same outline.
    angles = np.arange(clumps) * 2.4 + rng.uniform(-0.4, 0.4, clumps)
    lifts = np.linspace(-0.75, 0.85, clumps) + rng.uniform(-0.1, 0.1, clumps)
    radii = rng.uniform(0.19, 0.27, clumps) * width
    chosen = range(clumps) if detail == 2 else range(0, clumps, 3)
    swell = 1.0 if detail == 2 else 1.3
    clump(
        builder, np.array([lean[0], lean[1], middle]), np.array([0.37 * width, 0.37 * width, 0.42 * deep]), shape,
        spikes=8 if detail == 2 else 4,
    )  # fmt: skip
    for i in chosen:
        spread = 0.33 * width * np.sqrt(max(0.1, 1 - lifts[i] ** 2))
        centre = np.array(
            [spread * np.cos(angles[i]), spread * np.sin(angles[i]), middle + lifts[i] * 0.36 * deep]
        )
        clump(
            builder, centre, swell * radii[i] * np.array([1, 1, 0.8]), shape, spikes=5 if detail == 2 else 3
        )
    return scaled_to(builder, size)


def _conifer(name: str, size: tuple[float, float, float], detail: int) -> Mesh:
    rng = stream(_SEED, "plants", name)
    builder = MeshBuilder()
    width, height = size[0], size[2]
    builder.prism((0, 0, 0), (0, 0, 0.3 * height), (0.02 * height, 0.015 * height), Surface.BARK, sides=4)
    tiers, sides = {2: (6, 9), 1: (4, 7), 0: (1, 5)}[detail]
    for i in range(tiers):
        low = height * (0.10 + 0.82 * i / tiers)
        high = min(height, low + height * (0.9 / tiers) * 1.55) if tiers > 1 else height
        reach = width / 2 * (1 - 0.85 * i / max(tiers, 1)) ** 0.9
        turn = 2 * np.pi * np.arange(sides) / sides + rng.uniform(0, 1)
        jag = reach * rng.uniform(0.70, 1.0, sides)
        drop = low + rng.uniform(-0.03, 0.02, sides) * height
        ring = np.stack([jag * np.cos(turn), jag * np.sin(turn), drop], axis=1)
        tip = np.array([0, 0, high])
        for j in range(sides):
            corner = np.stack([ring[j], ring[(j + 1) % sides], tip])
            out = corner.mean(axis=0) - (0, 0, low)
            normal = out / np.linalg.norm(out) + rng.normal(0, 0.25, (3, 3))
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            builder.polygon(corner, Surface.FOLIAGE, facing=out, normals=normal)
        builder.polygon(ring, Surface.FOLIAGE, facing=(0, 0, -1))
    return scaled_to(builder, size)


def _bush(name: str, size: tuple[float, float, float], clumps: int, detail: int) -> Mesh:
    rng = stream(_SEED, "plants", name)
    builder = MeshBuilder()
    length, width, height = size
    count = clumps if detail == 2 else (2 if detail else 1)
    for i in range(count):
        turn = 2 * np.pi * (i + rng.uniform(0, 0.5)) / count
        centre = np.array([0.22 * length * np.cos(turn), 0.22 * width * np.sin(turn), height * 0.36]) * (
            count > 1
        )
        centre[2] = height * 0.36
        radii = np.array([0.30 * length, 0.30 * width, 0.46 * height]) * rng.uniform(0.8, 1.1)
        clump(builder, centre, radii, rng, spikes=(0, 3, 7)[detail])
    return scaled_to(builder, size)
