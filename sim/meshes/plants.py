"""Trees and bushes: opaque crowns of small leaf clumps, since an id map knows no half-transparent leaf."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.meshes.builder import Floats, MeshBuilder, planar_uv, scaled_to
from sim.models import Mesh, Model, Surface
from sim.rng import stream
from sim.world import Kind

SWITCH = (42.0, 110.0)
"""Metres at which the coarser meshes take over."""

_SEED = 20110602

# Name, size, number of clumps, crown's lower edge as a share of the height, half width of the solid middle as
# a share of the width: where it is small, branches and sky show between the clumps.
_BROADLEAF = (
    ("broadleaf-a", (7.5, 7.5, 9.0), 8, 0.20, 0.34),
    ("broadleaf-b", (10.5, 10.5, 12.5), 10, 0.26, 0.20),
    ("broadleaf-c", (5.2, 5.2, 6.8), 7, 0.26, 0.34),
    ("broadleaf-d", (7.0, 7.0, 14.5), 10, 0.16, 0.24),
    ("broadleaf-e", (8.5, 8.5, 6.6), 9, 0.14, 0.36),
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
            lods=tuple(_broadleaf(name, size, clumps, low, core, detail) for detail in (2, 1, 0)),
        )
        for name, size, clumps, low, core in _BROADLEAF
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
        dents = np.clip(rng.normal(0.80, 0.05, len(corners)), 0.65, 0.9)[:, None]
        points = centre + corners * dents * radii
        points[:, 2] = np.maximum(points[:, 2], 0.0)
        fluff = _unit(corners + rng.normal(0, 0.25, corners.shape) + _LOW)
        shift = rng.uniform(0, 1, 2)
        triangles = points[faces]
        uv = _leaf_uv(triangles, corners[faces].mean(axis=1)) + shift
        builder.polygons(triangles, Surface.FOLIAGE, uv=uv, normals=fluff[faces])
    centres, extents = (np.array(column) for column in zip(*blobs, strict=True))
    weights = np.prod(extents, axis=1) ** (2 / 3)
    home = rng.choice(len(blobs), size=3 * leaves, p=weights / weights.sum())
    out = _unit(rng.normal(size=(3 * leaves, 3)))
    at = centres[home] + out * extents[home] * rng.uniform(0.80, 1.02, (3 * leaves, 1))
    inside = np.linalg.norm((at[:, None] - centres) / extents, axis=2) < 0.80
    inside[np.arange(len(at)), home] = False
    seen = np.flatnonzero(~inside.any(axis=1) & (at[:, 2] > 0.3 * leaf))[:leaves]
    add_leaves(builder, at[seen], out[seen], rng, leaf=leaf)


def add_leaves(
    builder: MeshBuilder, at: Floats, out: Floats, rng: np.random.Generator, *, leaf: float
) -> None:
    """Add leaf clumps, single triangles that look outward, some more and some less.

    Args:
        builder: Takes the faces.
        at: (N, 3) their middles, metres.
        out: (N, 3) unit vectors, out of the crown.
        rng: Of their tilt, size and place on the texture.
        leaf: Their radius, metres.
    """
    rolls = rng.random((len(at), 4))
    tilt = rng.normal(0, 0.7, (len(at), 3))
    normal = _unit(out + tilt)
    side = _unit(np.cross(normal, [0.31, -0.52, 0.80]))
    turn = 2 * np.pi * (rolls[:, 1:2] + np.array([0.0, 0.35, 0.66]))
    size = leaf * (0.7 + 0.6 * rolls[:, 3:]) * np.array([1.0, 0.75, 0.9])
    spokes = (
        np.cos(turn)[..., None] * side[:, None] + np.sin(turn)[..., None] * np.cross(normal, side)[:, None]
    )
    rings = at[:, None] + size[..., None] * spokes
    rings[..., 2] = np.maximum(rings[..., 2], 0.0)
    uv = _leaf_uv(rings, normal) + rolls[:, None, 2:]
    # Lit as parts of the crown, not as leaves of their own, they make it round.
    shade = np.repeat(_unit(out + 0.45 * tilt + 0.5 * _LOW)[:, None], 3, axis=1)
    builder.polygons(rings, Surface.FOLIAGE, facing=normal, uv=uv, normals=shade)


_LOW = np.array([0.0, 0.0, 0.12])  # light comes through the leaves from above


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _leaf_uv(points: Floats, normals: Floats) -> Floats:
    """Lay triangles (P, 3, 3) that look along ``normals`` (P, 3) on the leaves' texture."""
    return planar_uv(points, normals, np.full(len(points), Surface.FOLIAGE, np.uint8))


def _broadleaf(
    name: str, size: tuple[float, float, float], clumps: int, low: float, core: float, detail: int
) -> Mesh:
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
    blobs = [
        (
            np.array([lean[0], lean[1], middle]),
            np.array([core * width, core * width, (0.10 + 0.9 * core) * deep]),
        )
    ]
    for i in range(clumps):
        spread = 0.32 * width * np.sqrt(max(0.1, 1 - lifts[i] ** 2))
        centre = np.array(
            [spread * np.cos(angles[i]), spread * np.sin(angles[i]), middle + lifts[i] * 0.36 * deep]
        )
        blobs.append((centre, radii[i] * np.array([1, 1, 0.8])))
    if detail == 2:
        fork = np.array([0.7 * lean[0], 0.7 * lean[1], base + 0.12 * deep])
        for centre, _ in blobs[1:6]:
            builder.prism(
                fork.tolist(), centre.tolist(), (0.010 * height, 0.004 * height), Surface.BARK, sides=3
            )
    # Coarser levels keep fewer lumps, swollen to fill the same outline.
    if detail < 2:
        swell, least = (1.15, 0.27) if detail else (1.3, 0.36)
        solid = np.maximum(blobs[0][1], least * np.array([width, width, deep]))
        blobs[0] = (blobs[0][0], solid)
        blobs = [
            (centre, extent * (1 if i == 0 else swell))
            for i, (centre, extent) in enumerate(blobs[:: 2 if detail else 5])
        ]
    leaves = (16, 250, 540)[detail]
    crown(
        builder,
        blobs,
        stream(_SEED, "plants", name, "leaves"),
        leaves=leaves,
        leaf=(0.17, 0.070, 0.056)[detail] * (0.3 * width + 0.7 * (0.5 * width * width * deep) ** (1 / 3)),
    )
    return scaled_to(builder, size)


def _conifer(name: str, size: tuple[float, float, float], detail: int) -> Mesh:
    """Make a conifer: a cone with whorls of twigs."""
    builder = MeshBuilder()
    width, height = size[0], size[2]
    trunk, sides = (0.02 * height, 0.015 * height), (3, 5, 6)[detail]
    builder.prism((0, 0, 0), (0, 0, 0.3 * height), trunk, Surface.BARK, sides=3 + (detail > 0))
    rng = stream(_SEED, "plants", name, "leaves")
    foot, reach = 0.08 * height, 0.40 * width
    builder.prism((0, 0, foot), (0, 0, 0.97 * height), (reach, 0.01), Surface.FOLIAGE, sides=sides)
    # Twigs on the cone in whorls, longer by turns.
    leaves = (16, 120, 420)[detail]
    up = 1 - np.sqrt(rng.uniform(0, 1, leaves))
    turn = rng.uniform(0, 2 * np.pi, leaves)
    whorl = 0.86 + 0.24 * np.abs(np.sin(up * np.pi * (3, 6, 9)[detail])) * rng.uniform(0.6, 1.0, leaves)
    flat = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    at = flat * (reach * 1.1 * (1 - up) * whorl + 0.02)[:, None]
    at[:, 2] = foot + (0.985 * height - foot) * up
    leaf = (0.20, 0.12, 0.085)[detail] * width * (1.15 - 0.8 * up.mean())
    add_leaves(builder, at, _unit(flat + np.array([0, 0, 0.25])), rng, leaf=leaf)
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
    leaves = (10, 50, 170)[detail]
    crown(
        builder,
        blobs,
        stream(_SEED, "plants", name, "leaves"),
        leaves=leaves,
        leaf=(0.20, 0.12, 0.08)[detail] * length,
    )
    return scaled_to(builder, size)
