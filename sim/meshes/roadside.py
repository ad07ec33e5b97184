"""What stands beside a road: poles, lamp posts, signs, rails, walls and fences."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from sim.meshes.builder import Floats, MeshBuilder, scaled_to
from sim.models import Model, Surface
from sim.world import Kind

SEGMENT = 8.0
"""Length of a piece of rail, wall or fence, metres."""

SWITCH = (60.0,)

SIGN_FACES = {
    "speed": (0.0, 0.0, 0.5, 0.5),
    "warning": (0.5, 0.0, 1.0, 0.5),
    "direction": (0.0, 0.5, 0.5, 1.0),
    "gantry": (0.5, 0.5, 1.0, 1.0),
}
"""Quarter of the SIGN texture of each face: u0, v0, u1, v1."""

_Maker = Callable[[MeshBuilder, tuple[float, float, float], int], None]


def roadside_models() -> tuple[Model, ...]:
    """Make the poles, signs, rails and walls. Signs show their face to who drives along +x."""
    table: tuple[tuple[str, Kind, tuple[float, float, float], _Maker], ...] = (
        ("pole-a", Kind.POLE, (0.35, 2.2, 9.5), _utility_pole),
        ("pole-b", Kind.POLE, (0.30, 1.6, 8.0), _utility_pole),
        ("delineator", Kind.POLE, (0.10, 0.14, 1.05), _delineator),
        ("lamp-post-a", Kind.LAMP_POST, (0.34, 2.4, 9.0), _lamp_post),
        ("lamp-post-b", Kind.LAMP_POST, (0.34, 1.6, 7.0), _lamp_post),
        ("sign-speed", Kind.SIGN, (0.12, 0.75, 2.75), _sign("speed", 8)),
        ("sign-warning", Kind.SIGN, (0.12, 0.95, 2.90), _sign("warning", 3)),
        ("sign-diamond", Kind.SIGN, (0.12, 0.95, 2.90), _sign("warning", -4)),
        ("sign-direction", Kind.SIGN, (0.14, 2.60, 3.40), _board),
        ("sign-motorway", Kind.SIGN, (0.20, 4.20, 5.20), _board),
        ("gantry", Kind.SIGN, (0.60, 20.0, 8.20), _gantry),
        ("rail", Kind.RAIL, (SEGMENT, 0.34, 0.78), _rail),
        ("barrier", Kind.WALL, (SEGMENT, 0.60, 0.95), _barrier),
        ("noise-wall", Kind.WALL, (SEGMENT, 0.30, 3.20), _noise_wall),
        ("fence", Kind.WALL, (SEGMENT, 0.12, 1.70), _fence),
        ("wall", Kind.WALL, (SEGMENT, 0.30, 1.60), _stone_wall),
    )
    models = []
    for name, kind, size, make in table:
        lods = []
        for detail in (1, 0):
            builder = MeshBuilder()
            make(builder, size, detail)
            lods.append(scaled_to(builder, size))
        models.append(Model(name=name, kind=kind, size=size, lods=tuple(lods), switch=SWITCH))
    return tuple(models)


def _utility_pole(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    _, width, height = size
    builder.prism((0, 0, 0), (0, 0, height), (0.16, 0.11), Surface.BARK, sides=6 if detail else 3)
    for z in (height - 0.5, height - 1.2)[: 1 + detail]:
        builder.box((-0.06, -width / 2, z), (0.06, width / 2, z + 0.12), Surface.BARK)
    if detail:
        for y in (-0.45, -0.2, 0.2, 0.45):
            builder.box(
                (-0.04, y * width - 0.04, height - 0.38),
                (0.04, y * width + 0.04, height - 0.2),
                Surface.STEEL,
            )


def _delineator(builder: MeshBuilder, size: tuple[float, float, float], _detail: int) -> None:
    length, width, height = size
    half = (length / 2, width / 2)
    builder.box(
        (-half[0], -half[1], 0), (half[0], half[1], height * 0.68), Surface.SIGN, without="-z", unit_uv=False
    )
    builder.box(
        (-half[0], -half[1], height * 0.68),
        (half[0], half[1], height * 0.88),
        Surface.PLASTIC,
        without="-z+z",
    )
    builder.box((-half[0], -half[1], height * 0.88), (half[0], half[1], height), Surface.PAINT, without="-z")


def _lamp_post(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    """Add a post at the right end whose arm reaches to the left (+y)."""
    _, width, height = size
    foot = -width + 0.17
    sides = 6 if detail else 3
    builder.prism((0, foot, 0), (0, foot, height - 0.35), (0.11, 0.07), Surface.STEEL, sides=sides)
    builder.prism(
        (0, foot, height - 0.40),
        (0, -0.3, height - 0.08),
        (0.06, 0.045),
        Surface.STEEL,
        sides=4 if detail else 3,
    )
    builder.box((-0.17, -0.75, height - 0.12), (0.17, 0.0, height), Surface.STEEL, without="-z")
    builder.polygon(
        [
            (-0.15, -0.70, height - 0.12),
            (0.15, -0.70, height - 0.12),
            (0.15, -0.05, height - 0.12),
            (-0.15, -0.05, height - 0.12),
        ],
        Surface.STREET_LAMP,
        facing=(0, 0, -1),
    )
    if detail:
        builder.box((-0.17, foot - 0.17, 0), (0.17, foot + 0.17, 0.35), Surface.STEEL, without="-z")


def _quarter(name: str, y: Floats, z: Floats) -> Floats:
    """Map a face that looks back, spanning ``y`` and ``z``, to its quarter of the texture."""
    u0, v0, u1, v1 = SIGN_FACES[name]
    right = (y.max() - y) / np.ptp(y)
    up = (z - z.min()) / np.ptp(z)
    margin = 0.015
    return np.stack(
        [u0 + margin + right * (u1 - u0 - 2 * margin), v0 + margin + up * (v1 - v0 - 2 * margin)], axis=1
    )


def _plate(builder: MeshBuilder, outline: Floats, face: str, x: float) -> None:
    """Add a flat plate: marked face looking back, bare metal on its other side."""
    y, z = outline[:, 0], outline[:, 1]
    corners = np.stack([np.full(len(y), x - 0.02), y, z], axis=1)
    builder.polygon(corners, Surface.SIGN, facing=(-1, 0, 0), uv=_quarter(face, y, z))
    builder.polygon(corners + np.array([0.03, 0.0, 0.0]), Surface.STEEL, facing=(1, 0, 0))


def _sign(face: str, sides: int) -> _Maker:
    """Return the maker of a small sign on one post: a polygon of ``sides``, on a corner if negative."""

    def make(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
        _, width, height = size
        count = abs(sides)
        if count == 3:
            turn = np.pi / 2 + 2 * np.pi * np.arange(3.0) / 3
        elif sides < 0:
            turn = np.pi / 2 * np.arange(4.0)
        else:
            turn = 2 * np.pi * (np.arange(float(count)) + 0.5) / count
        outline = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        outline *= width / np.ptp(outline[:, 0])
        outline[:, 1] += height - outline[:, 1].max()
        _plate(builder, outline, face, -0.035)
        builder.prism(
            (0, 0, 0), (0, 0, height - 0.1), (0.035, 0.035), Surface.STEEL, sides=5 if detail else 3
        )

    return make


def _board(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    _, width, height = size
    low = 0.42 * height
    outline = np.array([(width / 2, low), (-width / 2, low), (-width / 2, height), (width / 2, height)])
    _plate(builder, outline, "direction", -0.06)
    for y in (-0.32 * width, 0.32 * width):
        builder.prism((0, y, 0), (0, y, height - 0.1), (0.06, 0.06), Surface.STEEL, sides=5 if detail else 3)
    if detail:
        for z in (low + 0.2 * (height - low), low + 0.8 * (height - low)):
            builder.box(
                (-0.03, -width * 0.48, z - 0.03), (0.02, width * 0.48, z + 0.03), Surface.STEEL, without="-x"
            )


def _gantry(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    """Add a gantry across the whole width, its boards over the right half."""
    _, width, height = size
    half = width / 2
    for y in (-half + 0.2, half - 0.2):
        builder.box((-0.2, y - 0.2, 0), (0.2, y + 0.2, height - 1.0), Surface.STEEL, without="-z")
    for z in (height - 2.2, height - 1.25):
        builder.box((-0.15, -half, z), (0.15, half, z + 0.22), Surface.STEEL)
    if detail:
        for y in np.linspace(-half + 0.5, half - 1.5, 13):
            bar = [
                (-0.16, y, height - 2.0),
                (-0.16, y + 0.10, height - 2.0),
                (-0.16, y + 1.0, height - 1.2),
                (-0.16, y + 0.9, height - 1.2),
            ]
            builder.polygon(bar, Surface.STEEL, facing=(-1, 0, 0))
    for left, right in ((-0.06, -0.42), (-0.52, -0.90)):
        outline = np.array(
            [
                (left * half, height - 2.7),
                (right * half, height - 2.7),
                (right * half, height),
                (left * half, height),
            ]
        )
        _plate(builder, outline, "gantry", -0.30)


def _rail(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    """Add a W-beam on posts; it looks to both sides."""
    length, _, height = size
    half = length / 2
    top, low = height, height - 0.31
    profile = [(0.10, low), (0.17, low + 0.08), (0.12, (low + top) / 2), (0.17, top - 0.08), (0.10, top)]
    if not detail:
        profile = [(0.15, low), (0.15, top)]
    for sign in (1, -1):
        for (y0, z0), (y1, z1) in pairwise(profile):
            quad = [
                (-half, sign * y0, z0),
                (half, sign * y0, z0),
                (half, sign * y1, z1),
                (-half, sign * y1, z1),
            ]
            builder.polygon(quad, Surface.STEEL, facing=(0, sign, 0))
    builder.box((-half, -0.15, low), (half, 0.15, top), Surface.STEEL, without="+y-y-x+x")
    for x in np.arange(-half + 1.0, half, 2.0) if detail else (-half + 1.0,):
        builder.box((x - 0.05, -0.07, 0), (x + 0.05, 0.07, low + 0.1), Surface.STEEL, without="-z+z")


def _barrier(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    """Add a concrete barrier with a sloping foot."""
    length, width, height = size
    half, wide = length / 2, width / 2
    profile = [(wide, 0.0), (wide, 0.10), (0.45 * wide, 0.36), (0.28 * wide, height)]
    if not detail:
        profile = [(wide, 0.0), (0.28 * wide, height)]
    for sign in (1, -1):
        for (y0, z0), (y1, z1) in pairwise(profile):
            quad = [
                (-half, sign * y0, z0),
                (half, sign * y0, z0),
                (half, sign * y1, z1),
                (-half, sign * y1, z1),
            ]
            builder.polygon(quad, Surface.CONCRETE, facing=(0, sign, 0.1))
        end = [(sign * half, sign * y, z) for y, z in profile] + [
            (sign * half, -sign * y, z) for y, z in profile[::-1]
        ]
        builder.polygon(end, Surface.CONCRETE, facing=(sign, 0, 0))
    y = 0.28 * wide
    builder.polygon(
        [(-half, -y, height), (half, -y, height), (half, y, height), (-half, y, height)],
        Surface.CONCRETE,
        facing=(0, 0, 1),
    )


def _noise_wall(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    length, width, height = size
    half = length / 2
    builder.box((-half, -0.06, 0), (half, 0.06, height - 0.08), Surface.CONCRETE, without="-z")
    for x in (-half + 0.12, 0.0)[: 1 + detail]:
        builder.box((x - 0.12, -width / 2, 0), (x + 0.12, width / 2, height), Surface.STEEL, without="-z")
    if detail:
        for z in (0.25, 1.2, 2.2):
            for sign in (1, -1):
                strip = [
                    (-half, sign * 0.065, z),
                    (half, sign * 0.065, z),
                    (half, sign * 0.065, z + 0.06),
                    (-half, sign * 0.065, z + 0.06),
                ]
                builder.polygon(strip, Surface.PLASTIC, facing=(0, sign, 0))


def _fence(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    """Add wooden boards with gaps between them."""
    length, width, height = size
    half = length / 2
    count = 12 if detail else 1
    step = length / count
    for i in range(count):
        x = -half + i * step
        top = height - 0.05 * (i % 2)
        builder.box(
            (x, -0.02, 0.05), (x + step * (0.86 if detail else 1), 0.02, top), Surface.BARK, without="-z-x+x"
        )
    for z in (0.35, height - 0.4):
        builder.box((-half, -width / 2, z), (half, width / 2, z + 0.1), Surface.BARK, without="-x+x")
    builder.box((-half, -0.055, 0), (-half + 0.12, 0.055, height), Surface.BARK, without="-z")


def _stone_wall(builder: MeshBuilder, size: tuple[float, float, float], _detail: int) -> None:
    length, width, height = size
    half = length / 2
    builder.box(
        (-half, -width * 0.42, 0), (half, width * 0.42, height - 0.12), Surface.CONCRETE, without="-z+z"
    )
    builder.box((-half, -width / 2, height - 0.12), (half, width / 2, height), Surface.CONCRETE)
