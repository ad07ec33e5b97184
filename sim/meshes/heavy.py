"""Vans, lorries and buses: side profiles swept across the width, with what their rears carry."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from sim.meshes.builder import MeshBuilder
from sim.meshes.cars import SWITCH
from sim.meshes.coachwork import BACK, add_tail_lamps, add_tyres, front_patch, rear_patch, side_patch, sweep
from sim.meshes.lorries import articulated_lorry, box_lorry
from sim.models import Mesh, Model, Surface
from sim.world import Kind

_Maker = Callable[[MeshBuilder, tuple[float, float, float], int], None]


def heavy_models() -> tuple[Model, ...]:
    """Make the vans, lorries and buses."""
    table = (
        ("van-a", Kind.VAN, (5.4, 2.00, 2.35), _van),
        ("van-b", Kind.VAN, (4.6, 1.86, 1.90), _van),
        ("lorry-a", Kind.LORRY, (8.2, 2.45, 3.40), box_lorry),
        ("lorry-b", Kind.LORRY, (10.0, 2.50, 3.80), box_lorry),
        ("lorry-c", Kind.LORRY, (16.2, 2.55, 4.00), articulated_lorry),
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
    add_tail_lamps(builder, rear + 0.035, half, (0.80, 0.93), (low, high))
    glass = (0.58 * height, 0.88 * height)
    for side in (1.0, -1.0):
        y = sorted((side * half * 0.06, side * half * 0.74))
        rear_patch(builder, rear + 0.06, (y[0], y[1]), glass, Surface.GLASS, 0.03)
        side_patch(builder, side * half * 0.99, (front - 1.75, front - 1.05), (hood + 0.05, height * 0.84))
        y = sorted((side * half * 0.55, side * half * 0.88))
        front_patch(builder, front - 0.05, (y[0], y[1]), (hood - 0.42, hood - 0.20), Surface.HEAD_LAMP, 0.03)
    builder.box((rear - 0.0, -half * 0.95, 0.30), (rear + 0.12, half * 0.95, 0.52), Surface.PLASTIC)
    rear_patch(builder, rear, (-0.26, 0.26), (0.60, 0.71), Surface.PLATE, 0.02)
    add_tyres(builder, (rear + 0.95, front - 0.90), half + 0.01, 0.33, 0.22, detail, arch=0.40)
    if detail:
        front_patch(
            builder,
            front - 0.05,
            (-half * 0.5, half * 0.5),
            (hood - 0.45, hood - 0.25),
            Surface.PLASTIC,
            0.03,
        )
        rear_patch(builder, rear + 0.03, (-0.012, 0.012), (0.52, height - 0.15), Surface.PLASTIC, 0.02)
    if detail == 2:
        rear_patch(builder, rear + 0.04, (-0.15, 0.15), (height - 0.14, height - 0.11), Surface.PLASTIC, 0.02)
        for side in (1.0, -1.0):
            x = front - 1.05
            y = sorted((side * half * 0.97, side * (half + 0.18)))
            builder.box((x - 0.08, y[0], hood + 0.05), (x, y[1], hood + 0.30), Surface.PLASTIC)
            side_patch(builder, side * half, (rear + 0.3, front - 2.0), (0.62, 0.66), Surface.PLASTIC)


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
            side_patch(builder, side * half, (start + 0.04, stop - 0.04), (1.35, top))
        y = sorted((side * half * 0.60, side * half * 0.92))
        front_patch(builder, front, (y[0], y[1]), (0.66, 0.86), Surface.HEAD_LAMP, 0.02)
    back = np.array(
        [
            (rear + 0.02, half * 0.86, 1.75),
            (rear + 0.02, -half * 0.86, 1.75),
            (rear + 0.07, -half * 0.84, height - 0.38),
            (rear + 0.07, half * 0.84, height - 0.38),
        ]
    )
    builder.decal(back, Surface.GLASS, facing=BACK, lift=0.02)
    add_tail_lamps(builder, rear, half, (0.78, 0.94), (0.85, 1.30))
    add_tyres(builder, (rear + 3.3, front - 2.7), half + 0.015, 0.48, 0.40, detail, arch=0.58)
    if detail:
        rear_patch(builder, rear, (-half * 0.6, half * 0.6), (0.80, 1.35), Surface.PLASTIC)
        rear_patch(builder, rear, (-0.26, 0.26), (0.62, 0.73), Surface.PLATE, 0.02)
        for z in (0.56, 1.45):
            rear_patch(builder, rear, (-half * 0.97, half * 0.97), (z, z + 0.03), Surface.PLASTIC, 0.016)
    if detail == 2:
        for z in (0.95, 1.10, 1.25):
            rear_patch(builder, rear, (-half * 0.55, half * 0.55), (z, z + 0.03), Surface.CHROME, 0.02)
        for side in (1.0, -1.0):
            y = sorted((side * half, side * (half + 0.25)))
            builder.box(
                (front - 0.14, y[0], height - 1.2), (front - 0.0, y[1], height - 0.6), Surface.PLASTIC
            )
