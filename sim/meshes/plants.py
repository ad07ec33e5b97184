"""Trees and bushes: opaque crowns of jagged clumps, since an id map knows no half-transparent leaf."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.meshes.builder import Floats, MeshBuilder, planar_uv, scaled_to
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
            name=name,
            kind=Kind.TREE,
            size=size,
            switch=SWITCH,
            lods=tuple(_broadleaf(name, size, clumps, low, detail) for detail in (2, 1, 0)),
        )
        for name, size, clumps, low in _BROADLEAF
    ]
    models += [
        Model(
            name=name,
            kind=Kind.TREE,
            size=size,
            switch=SWITCH,
            lods=tuple(_conifer(name, size, detail) for detail in (2, 1, 0)),
        )
        for name, size in _CONIFER
    ]
    models += [
        Model(
            name=name,
            kind=Kind.BUSH,
            size=size,
            switch=SWITCH,
            lods=tuple(_bush(name, size, clumps, detail) for detail in (2, 1, 0)),
        )
        for name, size, clumps in _BUSH
    ]
    return tuple(models)


def _icosahedron() -> tuple[Floats, Floats]:
    """Return unit corners (12, 3) and faces (20, 3)."""
    phi = (1 + 5**0.5) / 2
    corners = np.array(
        [
            (-1, phi, 0),
            (1, phi, 0),
            (-1, -phi, 0),
            (1, -phi, 0),
            (0, -1, phi),
            (0, 1, phi),
            (0, -1, -phi),
            (0, 1, -phi),
            (phi, 0, -1),
            (phi, 0, 1),
            (-phi, 0, -1),
            (-phi, 0, 1),
        ],
        float,
    )
    faces = np.array(
        [
            (0, 11, 5),
            (0, 5, 1),
            (0, 1, 7),
            (0, 7, 10),
            (0, 10, 11),
            (1, 5, 9),
            (5, 11, 4),
            (11, 10, 2),
            (10, 7, 6),
            (7, 1, 8),
            (3, 9, 4),
            (3, 4, 2),
            (3, 2, 6),
            (3, 6, 8),
            (3, 8, 9),
            (4, 9, 5),
            (2, 4, 11),
            (6, 2, 10),
            (8, 6, 7),
            (9, 8, 1),
        ],
    )
    return corners / np.linalg.norm(corners, axis=1, keepdims=True), faces


def crown(
    builder: MeshBuilder,
    blobs: Sequence[tuple[Floats, Floats]],
    rng: np.random.Generator,
    *,
    leaves: int,
    leaf: float,
) -> None:
    """Add a crown: dented lumps, and around them leaf clumps that break the outline.

    Args:
        builder: Takes the faces.
        blobs: Centre (3,) and radii (3,) of each lump, metres.
        rng: Of dents and leaves.
        leaves: How many leaf clumps, single triangles that look outward.
        leaf: Their size, metres.
    """
    corners, faces = _icosahedron()
    for centre, radii in blobs:
        dents = np.clip(rng.normal(0.84, 0.10, len(corners)), 0.6, 1.1)[:, None]
        points = centre + corners * dents * radii
        points[:, 2] = np.maximum(points[:, 2], 0.0)
        fluff = _unit(corners + rng.normal(0, 0.45, corners.shape))
        shift = rng.uniform(0, 1, 2)
        triangles = points[faces]
        uv = _leaf_uv(triangles, corners[faces].mean(axis=1)) + shift
        builder.polygons(triangles, Surface.FOLIAGE, uv=uv, normals=fluff[faces])
    centres, extents = (np.array(column) for column in zip(*blobs, strict=True))
    weights = np.prod(extents, axis=1) ** (2 / 3)
    home = rng.choice(len(blobs), size=3 * leaves, p=weights / weights.sum())
    out = _unit(rng.normal(size=(3 * leaves, 3)))
    rolls = rng.random((3 * leaves, 4))
    tilt = rng.normal(0, 0.55, (3 * leaves, 3))
    at = centres[home] + out * extents[home] * (0.82 + 0.20 * rolls[:, :1])
    inside = np.linalg.norm((at[:, None] - centres) / extents, axis=2) < 0.80
    inside[np.arange(len(at)), home] = False
    seen = np.flatnonzero(~inside.any(axis=1) & (at[:, 2] > 0.3 * leaf))[:leaves]
    at, out, rolls, tilt = at[seen], out[seen], rolls[seen], tilt[seen]
    normal = _unit(out + tilt)
    side = _unit(np.cross(normal, [0.31, -0.52, 0.80]))
    turn = 2 * np.pi * (rolls[:, 1:2] + np.array([0.0, 0.35, 0.66]))
    size = leaf * (0.7 + 0.6 * rolls[:, 3:]) * np.array([1.0, 0.62, 0.85])
    spokes = (
        np.cos(turn)[..., None] * side[:, None] + np.sin(turn)[..., None] * np.cross(normal, side)[:, None]
    )
    rings = at[:, None] + size[..., None] * spokes
    rings[..., 2] = np.maximum(rings[..., 2], 0.0)
    uv = _leaf_uv(rings, normal) + rolls[:, None, 2:]
    shade = np.repeat(_unit(out + 0.6 * tilt)[:, None], 3, axis=1)
    builder.polygons(rings, Surface.FOLIAGE, facing=normal, uv=uv, normals=shade)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _leaf_uv(points: Floats, normals: Floats) -> Floats:
    """Lay triangles (P, 3, 3) that look along ``normals`` (P, 3) on the leaves' texture."""
    return planar_uv(points, normals, np.full(len(points), Surface.FOLIAGE, np.uint8))


def _broadleaf(name: str, size: tuple[float, float, float], clumps: int, low: float, detail: int) -> Mesh:
    rng = stream(_SEED, "plants", name)
    builder = MeshBuilder()
    width, height = size[0], size[2]
    base, top = low * height, height
    middle = (base + top) / 2
    lean = rng.normal(0, 0.02 * width, 2)
    builder.prism(
        (0, 0, 0),
        (lean[0], lean[1], middle),
        (0.024 * height + 0.06, 0.014 * height),
        Surface.BARK,
        sides=(5, 4, 3)[2 - detail],
    )
    deep = top - base
    angles = np.arange(clumps) * 2.4 + rng.uniform(-0.4, 0.4, clumps)
    lifts = np.linspace(-0.75, 0.85, clumps) + rng.uniform(-0.1, 0.1, clumps)
    radii = rng.uniform(0.18, 0.27, clumps) * width
    blobs = [(np.array([lean[0], lean[1], middle]), np.array([0.36 * width, 0.36 * width, 0.42 * deep]))]
    for i in range(clumps):
        spread = 0.32 * width * np.sqrt(max(0.1, 1 - lifts[i] ** 2))
        centre = np.array(
            [spread * np.cos(angles[i]), spread * np.sin(angles[i]), middle + lifts[i] * 0.36 * deep]
        )
        blobs.append((centre, radii[i] * np.array([1, 1, 0.8])))
    # Coarser levels keep fewer lumps, swollen to fill the same outline.
    if detail < 2:
        swell = 1.25 if detail else 1.35
        blobs = [
            (centre, extent * (1 if i == 0 else swell))
            for i, (centre, extent) in enumerate(blobs[:: 3 if detail else 5])
        ]
    leaves = (14, 56, 260)[detail]
    crown(
        builder,
        blobs,
        stream(_SEED, "plants", name, "leaves"),
        leaves=leaves,
        leaf=(0.20, 0.13, 0.085)[detail] * width,
    )
    return scaled_to(builder, size)


def _conifer(name: str, size: tuple[float, float, float], detail: int) -> Mesh:
    """Make a conifer: flat lumps stacked to a cone."""
    builder = MeshBuilder()
    width, height = size[0], size[2]
    builder.prism(
        (0, 0, 0), (0, 0, 0.3 * height), (0.02 * height, 0.015 * height), Surface.BARK, sides=3 + (detail > 0)
    )
    tiers = (2, 4, 7)[detail]
    blobs = []
    for i in range(tiers):
        up = (i + 0.5) / tiers
        reach = 0.5 * width * (1.04 - up) ** 0.85
        blobs.append(
            (
                np.array([0.0, 0.0, height * (0.12 + 0.84 * up)]),
                np.array([reach, reach, 0.75 * height / tiers]),
            )
        )
    leaves = (10, 44, 190)[detail]
    rng = stream(_SEED, "plants", name, "leaves")
    crown(builder, blobs, rng, leaves=leaves, leaf=(0.24, 0.17, 0.12)[detail] * width)
    return scaled_to(builder, size)


def _bush(name: str, size: tuple[float, float, float], clumps: int, detail: int) -> Mesh:
    rng = stream(_SEED, "plants", name)
    builder = MeshBuilder()
    length, width, height = size
    count = clumps if detail == 2 else (2 if detail else 1)
    blobs = []
    for i in range(count):
        turn = 2 * np.pi * (i + rng.uniform(0, 0.5)) / count
        away = 0.22 * (count > 1)
        centre = np.array([away * length * np.cos(turn), away * width * np.sin(turn), height * 0.34])
        spread = 0.30 if count > 1 else 0.42
        blobs.append(
            (centre, np.array([spread * length, spread * width, 0.5 * height]) * rng.uniform(0.85, 1.1))
        )
    leaves = (8, 24, 90)[detail]
    crown(
        builder,
        blobs,
        stream(_SEED, "plants", name, "leaves"),
        leaves=leaves,
        leaf=(0.25, 0.18, 0.11)[detail] * length,
    )
    return scaled_to(builder, size)
