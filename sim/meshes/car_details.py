"""What makes a car's rear a rear and its front a front: plates, lamps, gaps, grille, wheels."""

from __future__ import annotations

import numpy as np

from sim.meshes.builder import MeshBuilder
from sim.meshes.car_shapes import CarShape
from sim.models import Surface


def add_rear(builder: MeshBuilder, shape: CarShape, detail: int) -> None:
    """Add number plate, boot lid's lines, reflectors and exhaust; on coarse meshes the tail lamps too."""
    rear, half = -shape.length / 2, shape.width / 2
    lamps = shape.lamps

    def strip(
        x: float,
        y: tuple[float, float],
        z: tuple[float, float],
        surface: Surface,
        lift: float = 0.012,
        lean: float = 0.0,
    ) -> None:
        corners = [(x, y[1], z[0]), (x, y[0], z[0]), (x + lean, y[0], z[1]), (x + lean, y[1], z[1])]
        builder.decal(corners, surface, facing=(-1, 0, 0), lift=lift)

    def pair(
        x: float,
        inner: float,
        outer: float,
        z: tuple[float, float],
        surface: Surface,
        lift: float,
        lean: float = 0.0,
    ) -> None:
        strip(x, (inner, outer), z, surface, lift, lean)
        strip(x, (-outer, -inner), z, surface, lift, lean)

    if detail == 0:
        pair(rear + 0.05, half * 0.62, half * 0.93, lamps, Surface.TAIL_LAMP, 0.03)
        return
    plate_x = rear + (0.05 if shape.plate > 0.6 else 0.0)
    inner = half * shape.lamp_inner
    if detail == 1:
        pair(rear + 0.05, inner, half * 0.87, lamps, Surface.TAIL_LAMP, 0.015, 0.01)
        strip(rear + 0.05, (-half * 0.80, half * 0.80), (0.60, 0.63), Surface.PLASTIC)
        strip(plate_x, (-0.27, 0.27), (shape.plate - 0.06, shape.plate + 0.06), Surface.PLATE, 0.02)
        return
    strip(plate_x, (-0.34, 0.34), (shape.plate - 0.09, shape.plate + 0.09), Surface.PLASTIC, 0.010)
    strip(plate_x, (-0.26, 0.26), (shape.plate - 0.055, shape.plate + 0.055), Surface.PLATE, 0.022)
    strip(rear + 0.06, (-0.30, 0.30), (shape.plate + 0.10, shape.plate + 0.125), Surface.CHROME, 0.014)
    # The boot lid: a dark line below the deck's edge, and gaps beside the lamps.
    strip(rear + 0.085, (-inner, inner), (shape.deck - 0.05, shape.deck - 0.03), Surface.PLASTIC, 0.010)
    gap = 0.97 * inner
    pair(rear + 0.05, gap - 0.008, gap + 0.008, (0.62, shape.deck - 0.04), Surface.PLASTIC, 0.012, 0.03)
    pair(rear, half * 0.52 - 0.09, half * 0.52 + 0.09, (0.43, 0.46), Surface.TAIL_LAMP, 0.012)
    builder.box((rear + 0.03, 0.42, 0.20), (rear + 0.20, 0.52, 0.27), Surface.CHROME, without="+x")
    # Dark underside: axle and tank, seen between the rear wheels.
    low, high = (rear + 0.45, -half * 0.70, 0.15), (rear + 1.1, half * 0.70, 0.30)
    builder.box(low, high, Surface.PLASTIC, without="+z")


def add_front(builder: MeshBuilder, shape: CarShape, detail: int, *, nose: float) -> None:
    """Add grille, plate and, on coarse meshes, headlamps; ``nose`` is the foremost x of the body."""
    half, top, x = shape.width / 2, shape.hood, nose + 0.005

    def strip(y: tuple[float, float], z: tuple[float, float], surface: Surface, lift: float = 0.012) -> None:
        corners = [(x, y[0], z[0]), (x, y[1], z[0]), (x, y[1], z[1]), (x, y[0], z[1])]
        builder.decal(corners, surface, facing=(1, 0, 0), lift=lift)

    def pair(
        inner: float, outer: float, z: tuple[float, float], surface: Surface, lift: float = 0.012
    ) -> None:
        strip((inner * half, outer * half), z, surface, lift)
        strip((-outer * half, -inner * half), z, surface, lift)

    if detail < 2:
        pair(0.52, 0.73 if detail else 0.86, (top - 0.18, top - 0.04), Surface.HEAD_LAMP)
        if detail:
            strip((-half * 0.48, half * 0.48), (top - 0.20, top - 0.06), Surface.PLASTIC)
            strip((-0.26, 0.26), (0.40, 0.51), Surface.PLATE)
        return
    strip((-half * 0.52, half * 0.52), (top - 0.19, top - 0.05), Surface.PLASTIC)
    strip((-half * 0.52, half * 0.52), (top - 0.13, top - 0.11), Surface.CHROME, 0.018)
    strip((-half * 0.55, half * 0.55), (0.25, 0.36), Surface.PLASTIC)
    strip((-0.26, 0.26), (0.40, 0.51), Surface.PLATE)
    pair(0.50, 0.60, (top - 0.17, top - 0.05), Surface.HEAD_LAMP, 0.010)


def _axles(shape: CarShape) -> tuple[float, float]:
    """Return where the axles are, metres from the middle."""
    return -shape.length / 2 + 0.205 * shape.length, shape.length / 2 - 0.19 * shape.length


def add_wheels(builder: MeshBuilder, shape: CarShape, detail: int) -> None:
    """Add four wheels and, on the finest mesh, dark wheel arches."""
    half, radius = shape.width / 2, shape.wheel
    if detail == 0:
        # From afar wheels and underside are one dark block.
        (back, ahead), wide = _axles(shape), 0.97 * half
        box = (back - radius, -wide, 0.0), (ahead + radius, wide, 0.30)
        builder.box(*box, Surface.PLASTIC, without="+z-z")
        return
    for x in _axles(shape):
        for side in (1, -1):
            centre = (x, side * (half - 0.10), radius)
            if detail == 2:
                builder.wheel(centre, radius, 0.21, sides=10, outer=side)
                turn = np.linspace(0, np.pi, 6)
                arch = np.stack(
                    [
                        x + 1.18 * radius * np.cos(turn),
                        np.full(6, side * (half + 0.002)),
                        0.9 * radius + 1.18 * radius * np.sin(turn),
                    ],
                    axis=1,
                )
                builder.polygon(arch, Surface.PLASTIC, facing=(0, side, 0))
            else:
                y = sorted((side * (half + 0.004), side * (half - 0.20)))
                builder.box(
                    (x - radius * 0.9, y[0], 0.0),
                    (x + radius * 0.9, y[1], radius * 1.9),
                    Surface.RUBBER,
                    without="-z+z",
                    unit_uv=True,
                )


def add_side_lines(builder: MeshBuilder, shape: CarShape) -> None:
    """Add door gaps and handles."""
    half = shape.width / 2
    for side in (1.0, -1.0):
        for x in (-0.62, 0.42):
            line = [(x - 0.008, side * half, 0.40), (x + 0.008, side * half, 0.40)]
            line += [
                (x + 0.008, side * half * 0.955, shape.deck - 0.06),
                (x - 0.008, side * half * 0.955, shape.deck - 0.06),
            ]
            builder.decal(line, Surface.PLASTIC, facing=(0, side, 0), lift=0.006)
