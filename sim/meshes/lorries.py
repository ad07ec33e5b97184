"""Lorries: a cab, a box with two doors behind, a dark frame below."""

from __future__ import annotations

import numpy as np

from sim.meshes.builder import MeshBuilder
from sim.meshes.coachwork import add_tail_lamps, add_tyres, front_patch, rear_patch, side_patch, sweep
from sim.models import Surface


def _rear_doors(
    builder: MeshBuilder, rear: float, half: float, floor: float, height: float, detail: int
) -> None:
    """Add the two doors' gap, frame and locking bars."""
    rear_patch(builder, rear, (-0.02, 0.02), (floor + 0.05, height - 0.10), Surface.PLASTIC)
    if detail == 0:
        return
    for z in (floor + 0.04, height - 0.12):
        rear_patch(builder, rear, (-half * 0.97, half * 0.97), (z, z + 0.08), Surface.STEEL)
    for y in (-half * 0.96, half * 0.90):
        rear_patch(builder, rear, (y, y + half * 0.06), (floor + 0.05, height - 0.1), Surface.STEEL, 0.010)
    if detail == 2:
        for y in (-0.62, -0.28, 0.28, 0.62):
            rear_patch(
                builder,
                rear,
                (y * half - 0.018, y * half + 0.018),
                (floor + 0.1, height - 0.15),
                Surface.STEEL,
                0.03,
            )
        for y in (-half * 0.45, half * 0.45):
            rear_patch(
                builder, rear, (y - 0.14, y + 0.14), (floor + 0.55, floor + 0.60), Surface.STEEL, 0.035
            )


def _chassis(builder: MeshBuilder, rear: float, front: float, half: float, floor: float, detail: int) -> None:
    """Add frame, under-run bar, mudguards, lamps and plate of a lorry."""
    builder.box((rear + 0.3, -half * 0.45, 0.55), (front, half * 0.45, floor), Surface.PLASTIC, without="+z")
    builder.box((rear + 0.05, -half * 0.96, 0.50), (rear + 0.15, half * 0.96, 0.64), Surface.STEEL)
    builder.box((rear + 0.10, -half * 0.98, 0.74), (rear + 0.16, half * 0.98, 0.98), Surface.PLASTIC)
    add_tail_lamps(builder, rear + 0.10, half, (0.62, 0.94), (0.78, 0.93))
    if detail:
        rear_patch(builder, rear + 0.10, (-0.26, 0.26), (0.80, 0.92), Surface.PLATE, 0.02)
        for side in (1.0, -1.0):
            y = sorted((side * half * 0.98, side * half * 0.55))
            rear_patch(builder, rear + 0.42, (y[0], y[1]), (0.18, 0.70), Surface.RUBBER, 0.0)


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
        front_patch(builder, front, (y[0], y[1]), (0.62, 0.80), Surface.HEAD_LAMP, 0.02)
        side_patch(builder, side * half, (back + 0.75, front - 0.35), (1.62, top - 0.30))
        if detail == 2:
            y = sorted((side * half, side * (half + 0.16)))
            builder.box((front - 0.35, y[0], 1.7), (front - 0.2, y[1], 2.35), Surface.PLASTIC)
    front_patch(builder, front, (-half * 0.7, half * 0.7), (0.95, 1.40), Surface.PLASTIC, 0.01)
    if detail:
        front_patch(builder, front, (-0.26, 0.26), (0.50, 0.61), Surface.PLATE, 0.02)


def box_lorry(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    """Add a rigid lorry with a box."""
    length, width, height = size
    rear, front, half = -length / 2, length / 2, width / 2
    floor = 1.0
    builder.box((rear, -half, floor), (front - 2.25, half, height), Surface.CARGO)
    _rear_doors(builder, rear, half, floor, height, detail)
    _chassis(builder, rear, front - 0.5, half, floor, detail)
    _cab(builder, front, half * 0.95, min(2.75, height - 0.2), detail)
    add_tyres(builder, (rear + 1.8, front - 1.1), half * 0.97, 0.48, 0.50, detail)


def articulated_lorry(builder: MeshBuilder, size: tuple[float, float, float], detail: int) -> None:
    """Add a tractor and its trailer as one body."""
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
    add_tyres(builder, axles, half * 0.97, 0.50, 0.50, detail)
    if detail == 2:
        for side in (1.0, -1.0):
            side_patch(builder, side * half * 0.98, (rear + 5.4, front - 5.2), (0.55, 1.05), Surface.STEEL)
