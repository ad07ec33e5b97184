"""Vans, lorries and buses: side profiles swept across the width, with what their rears carry."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from sim.meshes.builder import MeshBuilder
from sim.meshes.cars import SWITCH
from sim.models import Mesh, Model, Surface
from sim.world import Kind

BACK = (-1.0, 0.0, 0.0)

_Maker = Callable[[MeshBuilder, tuple[float, float, float], int], None]


def heavy_models() -> tuple[Model, ...]:
    """Make the vans, lorries and buses."""
    table = (
        ("van-a", Kind.VAN, (5.4, 2.00, 2.35), _van),
        ("van-b", Kind.VAN, (4.6, 1.86, 1.90), _van),
        ("lorry-a", Kind.LORRY, (8.2, 2.45, 3.40), _box_lorry),
        ("lorry-b", Kind.LORRY, (10.0, 2.50, 3.80), _box_lorry),
        ("lorry-c", Kind.LORRY, (16.2, 2.55, 4.00), _articulated),
        ("bus-a", Kind.BUS, (12.0, 2.55, 3.15), _bus),
        ("bus-b", Kind.BUS, (12.8, 2.55, 3.65), _bus),
    )
    return tuple(
        Model(
            name=name,
            kind=kind,
            size=size,
            lods=tuple(_mesh(make, size, detail) for detail in (2, 1, 0)),
            switch=SWITCH,
        )
        for name, kind, size, make in table
    )


def _mesh(make: _Maker, size: tuple[float, float, float], detail: int) -> Mesh:
    builder = MeshBuilder()
    make(builder, size, detail)
    return builder.build()


def sweep(
    builder: MeshBuilder,
    profile: Sequence[tuple[float, float]],
    half: float,
    surfaces: Sequence[Surface],
    *,
    side: Surface,
    tops: Sequence[float] | None = None,
) -> None:
    """Sweep a side profile across the width.

    Args:
        builder: Takes the faces.
        profile: (x, z) points round a convex outline.
        half: Half width, metres.
        surfaces: One an edge, the i-th from point i to the next.
        side: Of both flanks.
        tops: Half width at each point, share of ``half``.
    """
    points = np.array([(x, 0.0, z) for x, z in profile])
    shares = np.ones(len(profile)) if tops is None else np.asarray(tops, float)
    left, right = points.copy(), points.copy()
    left[:, 1], right[:, 1] = half * shares, -half * shares
    centre = points.mean(axis=0)
    for i in range(len(profile)):
        j = (i + 1) % len(profile)
        quad = np.stack([left[i], left[j], right[j], right[i]])
        builder.polygon(quad, surfaces[i], facing=quad.mean(axis=0) - centre)
    builder.polygon(left, side, facing=(0, 1, 0))
    builder.polygon(right, side, facing=(0, -1, 0))


def _patch(
    builder: MeshBuilder,
    x: float,
    y: tuple[float, float],
    z: tuple[float, float],
    surface: Surface,
    lift: float = 0.012,
) -> None:
    """Add an upright patch that looks back."""
    builder.decal(
        [(x, y[1], z[0]), (x, y[0], z[0]), (x, y[0], z[1]), (x, y[1], z[1])], surface, facing=BACK, lift=lift
    )


def _front_patch(
    builder: MeshBuilder,
    x: float,
    y: tuple[float, float],
    z: tuple[float, float],
    surface: Surface,
    lift: float = 0.012,
) -> None:
    """Add an upright patch that looks ahead."""
    corners = [(x, y[0], z[0]), (x, y[1], z[0]), (x, y[1], z[1]), (x, y[0], z[1])]
    builder.decal(corners, surface, facing=(1, 0, 0), lift=lift)


def _pane(
    builder: MeshBuilder,
    y: float,
    x: tuple[float, float],
    z: tuple[float, float],
    surface: Surface = Surface.GLASS,
) -> None:
    """Add a patch on a flank at ``y``."""
    corners = [(x[0], y, z[0]), (x[1], y, z[0]), (x[1], y, z[1]), (x[0], y, z[1])]
    builder.decal(corners, surface, facing=(0, np.sign(y), 0))


def _tyres(
    builder: MeshBuilder,
    axles: Sequence[float],
    half: float,
    radius: float,
    width: float,
    detail: int,
    arch: float = 0.0,
) -> None:
    """Add the wheels; ``arch`` is the radius of the dark wheel arch on the flank, 0 for none."""
    for x in axles:
        if detail == 0:
            builder.box(
                (x - radius * 0.85, -half * 0.98, 0),
                (x + radius * 0.85, half * 0.98, radius * 1.5),
                Surface.PLASTIC,
                without="+z-z",
            )
            continue
        for side in (1, -1):
            if detail == 2:
                builder.wheel((x, side * (half - width / 2), radius), radius, width, sides=10, outer=side)
                if arch:
                    turn = np.linspace(0, np.pi, 6)
                    outline = np.stack(
                        [x + arch * np.cos(turn), np.full(6, 0.0), radius + arch * np.sin(turn)], 1
                    )
                    outline[:, 1] = side * (half - 0.004)
                    builder.polygon(outline, Surface.PLASTIC, facing=(0, side, 0))
            else:
                y = sorted((side * half, side * (half - width)))
                builder.box(
                    (x - radius * 0.9, y[0], 0),
                    (x + radius * 0.9, y[1], 2 * radius),
                    Surface.RUBBER,
                    without="-z+z",
                    unit_uv=True,
                )


def _lamps(
    builder: MeshBuilder,
    rear: float,
    half: float,
    y: tuple[float, float],
    z: tuple[float, float],
    lift: float = 0.02,
) -> None:
    """Add tail lamps on both sides between shares ``y`` of the half width."""
    _patch(builder, rear, (half * y[0], half * y[1]), z, Surface.TAIL_LAMP, lift)
    _patch(builder, rear, (-half * y[1], -half * y[0]), z, Surface.TAIL_LAMP, lift)


def _van(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    length, width, height = size
    rear, front, half = -length / 2, length / 2, width / 2
    hood = 0.56 * height
    profile = [
        (rear + 0.05, 0.25),
        (front - 0.03, 0.25),
        (front, 0.45),
        (front - 0.10, hood - 0.22),
        (front - 0.75, hood),
        (front - 1.55, height - 0.10),
        (front - 1.95, height),
        (rear + 0.18, height),
        (rear + 0.06, height - 0.08),
        (rear + 0.02, 0.30),
    ]
    paint = Surface.PAINT
    edges = [Surface.PLASTIC, Surface.PLASTIC, paint, paint, paint, paint, paint, paint, paint, paint]
    shares = [0.97, 0.90, 0.94, 0.96, 0.97, 0.88, 0.86, 0.88, 0.92, 0.98]
    sweep(builder, profile, half, edges, side=paint, tops=shares)
    slope = np.array([0.55, 0.0, 0.8])
    screen = np.array(
        [
            (front - 0.80, -half * 0.88, hood + 0.03),
            (front - 0.80, half * 0.88, hood + 0.03),
            (front - 1.50, half * 0.80, height - 0.14),
            (front - 1.50, -half * 0.80, height - 0.14),
        ]
    )
    builder.decal(screen, Surface.GLASS, facing=slope)
    low, high = 0.42 * height, 0.62 * height
    _lamps(builder, rear + 0.035, half, (0.80, 0.93), (low, high))
    glass = (0.58 * height, 0.88 * height)
    for side in (1.0, -1.0):
        y = sorted((side * half * 0.06, side * half * 0.74))
        _patch(builder, rear + 0.06, (y[0], y[1]), glass, Surface.GLASS, 0.03)
        _pane(builder, side * half * 0.99, (front - 1.75, front - 1.05), (hood + 0.05, height * 0.84))
        y = sorted((side * half * 0.55, side * half * 0.88))
        _front_patch(builder, front - 0.05, (y[0], y[1]), (hood - 0.42, hood - 0.20), Surface.HEAD_LAMP, 0.03)
    builder.box((rear - 0.0, -half * 0.95, 0.30), (rear + 0.12, half * 0.95, 0.52), Surface.PLASTIC)
    _patch(builder, rear, (-0.26, 0.26), (0.60, 0.71), Surface.PLATE, 0.02)
    _tyres(builder, (rear + 0.95, front - 0.90), half + 0.01, 0.33, 0.22, detail, arch=0.40)
    if detail:
        _front_patch(
            builder,
            front - 0.05,
            (-half * 0.5, half * 0.5),
            (hood - 0.45, hood - 0.25),
            Surface.PLASTIC,
            0.03,
        )
        _patch(builder, rear + 0.03, (-0.012, 0.012), (0.52, height - 0.15), Surface.PLASTIC, 0.02)
    if detail == 2:
        _patch(builder, rear + 0.04, (-0.15, 0.15), (height - 0.14, height - 0.11), Surface.PLASTIC, 0.02)
        for side in (1.0, -1.0):
            x = front - 1.05
            y = sorted((side * half * 0.97, side * (half + 0.18)))
            builder.box((x - 0.08, y[0], hood + 0.05), (x, y[1], hood + 0.30), Surface.PLASTIC)
            _pane(builder, side * half, (rear + 0.3, front - 2.0), (0.62, 0.66), Surface.PLASTIC)


def _rear_doors(
    builder: MeshBuilder, rear: float, half: float, floor: float, height: float, detail: int
) -> None:
    """Add the two doors' gap, frame and locking bars."""
    _patch(builder, rear, (-0.02, 0.02), (floor + 0.05, height - 0.10), Surface.PLASTIC)
    if detail == 0:
        return
    for z in (floor + 0.04, height - 0.12):
        _patch(builder, rear, (-half * 0.97, half * 0.97), (z, z + 0.08), Surface.STEEL)
    for y in (-half * 0.96, half * 0.90):
        _patch(builder, rear, (y, y + half * 0.06), (floor + 0.05, height - 0.1), Surface.STEEL, 0.010)
    if detail == 2:
        for y in (-0.62, -0.28, 0.28, 0.62):
            _patch(
                builder,
                rear,
                (y * half - 0.018, y * half + 0.018),
                (floor + 0.1, height - 0.15),
                Surface.STEEL,
                0.03,
            )
        for y in (-half * 0.45, half * 0.45):
            _patch(builder, rear, (y - 0.14, y + 0.14), (floor + 0.55, floor + 0.60), Surface.STEEL, 0.035)


def _chassis(builder: MeshBuilder, rear: float, front: float, half: float, floor: float, detail: int) -> None:
    """Add frame, under-run bar, mudguards, lamps and plate of a lorry."""
    builder.box((rear + 0.3, -half * 0.45, 0.55), (front, half * 0.45, floor), Surface.PLASTIC, without="+z")
    builder.box((rear + 0.05, -half * 0.96, 0.50), (rear + 0.15, half * 0.96, 0.64), Surface.STEEL)
    builder.box((rear + 0.10, -half * 0.98, 0.74), (rear + 0.16, half * 0.98, 0.98), Surface.PLASTIC)
    _lamps(builder, rear + 0.10, half, (0.62, 0.94), (0.78, 0.93))
    if detail:
        _patch(builder, rear + 0.10, (-0.26, 0.26), (0.80, 0.92), Surface.PLATE, 0.02)
        for side in (1.0, -1.0):
            y = sorted((side * half * 0.98, side * half * 0.55))
            _patch(builder, rear + 0.42, (y[0], y[1]), (0.18, 0.70), Surface.RUBBER, 0.0)


def _cab(
    builder: MeshBuilder, front: float, half: float, top: float, detail: int, length: float = 2.1
) -> None:
    """Add a lorry's cab."""
    back = front - length
    profile = [
        (back, 0.45),
        (front - 0.05, 0.40),
        (front, 0.75),
        (front - 0.03, 1.55),
        (front - 0.28, top - 0.18),
        (front - 0.60, top),
        (back, top),
    ]
    paint = Surface.PAINT
    sweep(
        builder,
        profile,
        half,
        [Surface.PLASTIC, Surface.PLASTIC, paint, paint, paint, paint, paint],
        side=paint,
    )
    screen = np.array(
        [
            (front - 0.06, -half * 0.92, 1.62),
            (front - 0.06, half * 0.92, 1.62),
            (front - 0.25, half * 0.88, top - 0.28),
            (front - 0.25, -half * 0.88, top - 0.28),
        ]
    )
    builder.decal(screen, Surface.GLASS, facing=(1, 0, 0.2), lift=0.02)
    for side in (1.0, -1.0):
        y = sorted((side * half * 0.58, side * half * 0.92))
        _front_patch(builder, front, (y[0], y[1]), (0.62, 0.80), Surface.HEAD_LAMP, 0.02)
        _pane(builder, side * half, (back + 0.75, front - 0.35), (1.62, top - 0.30))
        if detail == 2:
            y = sorted((side * half, side * (half + 0.16)))
            builder.box((front - 0.35, y[0], 1.7), (front - 0.2, y[1], 2.35), Surface.PLASTIC)
    _front_patch(builder, front, (-half * 0.7, half * 0.7), (0.95, 1.40), Surface.PLASTIC, 0.01)
    if detail:
        _front_patch(builder, front, (-0.26, 0.26), (0.50, 0.61), Surface.PLATE, 0.02)


def _box_lorry(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    length, width, height = size
    rear, front, half = -length / 2, length / 2, width / 2
    floor = 1.0
    builder.box((rear, -half, floor), (front - 2.25, half, height), Surface.CARGO)
    _rear_doors(builder, rear, half, floor, height, detail)
    _chassis(builder, rear, front - 0.5, half, floor, detail)
    _cab(builder, front, half * 0.95, min(2.75, height - 0.2), detail)
    _tyres(builder, (rear + 1.8, front - 1.1), half * 0.97, 0.48, 0.50, detail)


def _articulated(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    length, width, height = size
    rear, front, half = -length / 2, length / 2, width / 2
    floor = 1.15
    builder.box((rear, -half, floor), (front - 2.6, half, height), Surface.CARGO)
    _rear_doors(builder, rear, half, floor, height, detail)
    _chassis(builder, rear, front - 0.5, half, floor, detail)
    _cab(builder, front, half * 0.97, height - 0.25, detail, 2.2)
    axles = (
        (rear + 2.0, rear + 3.3, rear + 4.6, front - 4.0, front - 1.3)
        if detail
        else (rear + 3.0, front - 2.5)
    )
    _tyres(builder, axles, half * 0.97, 0.50, 0.50, detail)
    if detail == 2:
        for side in (1.0, -1.0):
            _pane(builder, side * half * 0.98, (rear + 5.4, front - 5.2), (0.55, 1.05), Surface.STEEL)


def _bus(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    length, width, height = size
    rear, front, half = -length / 2, length / 2, width / 2
    profile = [
        (rear + 0.05, 0.32),
        (front - 0.05, 0.32),
        (front, 0.6),
        (front - 0.02, 1.3),
        (front - 0.22, height - 0.15),
        (front - 0.45, height),
        (rear + 0.30, height),
        (rear + 0.08, height - 0.20),
        (rear, 1.6),
        (rear, 0.5),
    ]
    paint = Surface.PAINT
    edges = [Surface.PLASTIC, Surface.PLASTIC, *[paint] * 7, Surface.PLASTIC]
    sweep(builder, profile, half, edges, side=paint)
    screen = np.array(
        [
            (front - 0.04, -half * 0.94, 1.15),
            (front - 0.04, half * 0.94, 1.15),
            (front - 0.20, half * 0.92, height - 0.35),
            (front - 0.20, -half * 0.92, height - 0.35),
        ]
    )
    builder.decal(screen, Surface.GLASS, facing=(1, 0, 0.2), lift=0.03)
    top = height - 0.40
    for side in (1.0, -1.0):
        count = 6 if detail == 2 else 1
        edges_x = np.linspace(rear + 0.35, front - 0.5, count + 1)
        for start, stop in pairwise(edges_x):
            _pane(builder, side * half, (start + 0.04, stop - 0.04), (1.35, top))
        y = sorted((side * half * 0.60, side * half * 0.92))
        _front_patch(builder, front, (y[0], y[1]), (0.66, 0.86), Surface.HEAD_LAMP, 0.02)
    back = np.array(
        [
            (rear + 0.02, half * 0.86, 1.75),
            (rear + 0.02, -half * 0.86, 1.75),
            (rear + 0.07, -half * 0.84, height - 0.38),
            (rear + 0.07, half * 0.84, height - 0.38),
        ]
    )
    builder.decal(back, Surface.GLASS, facing=BACK, lift=0.02)
    _lamps(builder, rear, half, (0.78, 0.94), (0.85, 1.30))
    _tyres(builder, (rear + 3.3, front - 2.7), half + 0.015, 0.48, 0.40, detail, arch=0.58)
    if detail:
        _patch(builder, rear, (-half * 0.6, half * 0.6), (0.80, 1.35), Surface.PLASTIC)
        _patch(builder, rear, (-0.26, 0.26), (0.62, 0.73), Surface.PLATE, 0.02)
        for z in (0.56, 1.45):
            _patch(builder, rear, (-half * 0.97, half * 0.97), (z, z + 0.03), Surface.PLASTIC, 0.016)
    if detail == 2:
        for z in (0.95, 1.10, 1.25):
            _patch(builder, rear, (-half * 0.55, half * 0.55), (z, z + 0.03), Surface.CHROME, 0.02)
        for side in (1.0, -1.0):
            y = sorted((side * half, side * (half + 0.25)))
            builder.box(
                (front - 0.14, y[0], height - 1.2), (front - 0.0, y[1], height - 0.6), Surface.PLASTIC
            )
