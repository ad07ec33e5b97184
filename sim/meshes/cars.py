"""Passenger cars: a lattice of stations along the body, a cabin on top, and what makes the rear a rear."""

from __future__ import annotations

import numpy as np

from sim.meshes.builder import Floats, MeshBuilder
from sim.meshes.car_details import add_front, add_rear, add_side_lines, add_wheels
from sim.meshes.car_shapes import SHAPES, CarShape
from sim.models import Mesh, Model, Surface
from sim.world import Kind

SWITCH = (25.0, 70.0)
"""Metres at which the coarser meshes take over."""


def car_models() -> tuple[Model, ...]:
    """Make the passenger cars."""
    return tuple(
        Model(
            name=shape.name,
            kind=Kind.CAR,
            size=(shape.length, shape.width, shape.height),
            lods=tuple(car_mesh(shape, detail) for detail in (2, 1, 0)),
            switch=SWITCH,
        )
        for shape in SHAPES
    )


def car_mesh(shape: CarShape, detail: int) -> Mesh:
    """Make a car at one level of detail, 2 the finest."""
    builder = MeshBuilder()
    body = _body(builder, shape, detail)
    _cabin(builder, shape, detail)
    add_rear(builder, shape, detail)
    add_front(builder, shape, detail, nose=float(body[-1, 1:, 0].max()))
    add_wheels(builder, shape, detail)
    if detail == 2:
        add_side_lines(builder, shape)
    return builder.build()


def _body(builder: MeshBuilder, shape: CarShape, detail: int) -> Floats:
    """Add the body up to the belt line; return its lattice (stations, levels, 3) of the left side."""
    rear, front, half = -shape.length / 2, shape.length / 2, shape.width / 2
    low, high = shape.lamps
    if detail == 2:
        stations = [(0.0, shape.lamp_inner), (0.07, 0.93), (0.32, 1.0), (shape.length - 0.42, 1.0)]
        stations += [(shape.length - 0.09, 0.90), (shape.length, 0.60)]
        levels = np.array([0.20, 0.38, 0.585, 0.615, low, high, shape.deck])
        bulge = np.array([0.93, 0.98, 1.0, 1.0, 1.0, 0.985, 0.94])
        tuck = np.array([0.07, 0.0, 0.0, 0.05, 0.05, 0.06, 0.09])
        nose = np.array([0.20, 0.33, 0.50, 0.53, shape.hood - 0.17, shape.hood - 0.03, shape.hood])
    elif detail == 1:
        stations = [(0.0, 0.88), (0.25, 1.0), (shape.length - 0.3, 1.0), (shape.length, 0.74)]
        levels = np.array([0.20, 0.38, 0.60, low, high, shape.deck])
        bulge = np.array([0.93, 0.98, 1.0, 1.0, 0.985, 0.94])
        tuck = np.array([0.07, 0.0, 0.0, 0.05, 0.06, 0.09])
        nose = np.array([0.20, 0.33, 0.50, shape.hood - 0.17, shape.hood - 0.03, shape.hood])
    else:
        stations = [(0.0, 0.97), (shape.length, 0.90)]
        levels, bulge = np.array([0.26, shape.deck]), np.array([1.0, 0.94])
        tuck, nose = np.array([0.0, 0.06]), np.array([0.24, shape.hood])
    points = np.zeros((len(stations), len(levels), 3))
    belt = shape.deck - 0.02
    for i, (along, share) in enumerate(stations):
        blend = along / shape.length
        end = np.exp(-along / 0.12)
        points[i, :, 0] = (
            rear
            + along
            + tuck * end
            - 0.06 * (1 - np.exp(-max(along - shape.length + 0.2, 0))) * (levels > 0.6)
        )
        points[i, :, 1] = half * share * bulge
        # The nose is lower than the tail; between the axles the belt runs nearly level.
        points[i, :, 2] = levels + (nose - levels) * np.clip((blend - 0.3) / 0.7, 0, 1)
    if len(stations) > 2:
        cowl = shape.length - shape.screen[0]
        points[-3 if detail == 2 else -2, -1, 2] = shape.hood + (belt - shape.hood) * 0.35 * (cowl > 0)
    surfaces = np.full((len(stations) - 1, len(levels) - 1), Surface.PAINT, np.uint8)
    if detail:
        surfaces[:, 0] = Surface.PLASTIC
    if detail == 2:
        surfaces[0, 2] = Surface.PLASTIC
        surfaces[:2, 4] = Surface.TAIL_LAMP
        surfaces[-2:, 4] = Surface.HEAD_LAMP
    elif detail == 1:
        surfaces[0, 3] = Surface.TAIL_LAMP
        surfaces[-1, 3] = Surface.HEAD_LAMP
    inside = np.zeros((len(stations) - 1, len(levels) - 1, 3))
    inside[..., 0] = ((points[:-1, :-1, 0] + points[1:, 1:, 0]) / 2).clip(rear + 0.8, front - 0.8)
    inside[..., 2] = 0.6
    mirrored = points * (1, -1, 1)
    builder.grid(points, surfaces, inside=inside)
    builder.grid(mirrored, surfaces, inside=inside)
    for end, facing in ((0, -1), (-1, 1)):
        strip = np.stack([points[end], mirrored[end]])
        kinds = np.full((1, len(levels) - 1), Surface.PAINT, np.uint8)
        if detail:
            kinds[0, 0] = Surface.PLASTIC
        if detail == 2:
            kinds[0, 2] = Surface.PLASTIC
        builder.grid(strip, kinds, inside=(points[end, 0, 0] - facing, 0, 0.6))
    top = np.stack([points[:, -1], mirrored[:, -1]], axis=1)
    builder.grid(top, Surface.PAINT, inside=(0, 0, -5))
    if detail:
        floor = np.stack([points[:, 0], mirrored[:, 0]], axis=1)
        builder.grid(floor[[0, -1]], Surface.PLASTIC, inside=(0, 0, 5))
    return points


def _cabin(builder: MeshBuilder, shape: CarShape, detail: int) -> None:
    """Add roof, pillars and windows."""
    rear, front, half = -shape.length / 2, shape.length / 2, shape.width / 2
    belt = shape.deck - 0.03
    cowl = min(belt, shape.hood + 0.20)
    eave = shape.height - 0.10
    foot_x = (rear + shape.gate[0], front - shape.screen[0])
    head_x = (rear + shape.gate[1], front - shape.screen[1])
    waist, roof = 0.93 * half, shape.roof * half
    # Three levels: belt, eave, roof; at the ends the eave lies on the line from foot to head.
    share = (eave - belt) / (shape.height - belt)
    rear_eave = foot_x[0] + (head_x[0] - foot_x[0]) * share * 0.93
    front_eave = foot_x[1] + (head_x[1] - foot_x[1]) * share * 0.93
    eave_half = waist + (roof - waist) * 0.62
    levels = [
        (foot_x[0], foot_x[1], waist, belt, cowl),
        (rear_eave, front_eave, eave_half, eave, eave),
        (head_x[0], head_x[1], roof, shape.height - 0.015, shape.height - 0.02),
    ]
    if detail == 0:
        levels = [levels[0], levels[2]]
    left = np.array([[(x0, y, z0), (x1, y, z1)] for x0, x1, y, z0, z1 in levels])
    right = left * (1, -1, 1)
    middle = (0.0, 0.0, belt - 0.3)
    for side in (left, right):
        builder.grid(side, Surface.PAINT, inside=middle)
    for end in (0, 1):
        builder.grid(np.stack([left[:, end], right[:, end]]), Surface.PAINT, inside=middle)
    ridge = [(left[-1] + right[-1]) / 2 + (0, 0, 0.018)] if detail else []
    builder.grid(np.stack([left[-1], *ridge, right[-1]]), Surface.PAINT, inside=middle)
    _windows(builder, left, detail)


def _windows(builder: MeshBuilder, left: Floats, detail: int) -> None:
    """Add the glass, a little above the cabin's faces; ``left`` is (levels, 2 ends, 3)."""
    foot, head = left[0], left[1]

    def at(end: int, across: float, up: float) -> Floats:
        """Point of a screen: across in [-1, 1] of its width (left is 1), up in [0, 1] of its height."""
        edge = foot[end] + (head[end] - foot[end]) * up
        return np.asarray(edge * (1, across, 1))

    def beside(along: float, up: float) -> Floats:
        """Point of the left side: along in [0, 1] from the rear, up in [0, 1]."""
        rear = foot[0] + (head[0] - foot[0]) * up
        front = foot[1] + (head[1] - foot[1]) * up
        return np.asarray(rear + (front - rear) * along)

    top = 0.97 if detail else 0.88
    rear = [at(0, 0.84, 0.10), at(0, -0.84, 0.10), at(0, -0.84, top), at(0, 0.84, top)]
    front = [at(1, -0.90, 0.06), at(1, 0.90, 0.06), at(1, 0.90, top), at(1, -0.90, top)]
    builder.decal(rear, Surface.GLASS, facing=(-1, 0, 0.4))
    builder.decal(front, Surface.GLASS, facing=(1, 0, 0.4))
    panes = ((0.10, 0.46), (0.49, 0.93)) if detail == 2 else ((0.10, 0.93),)
    for start, stop in panes:
        pane = np.array([beside(start, 0.08), beside(stop, 0.08), beside(stop, 0.93), beside(start, 0.93)])
        if start < 0.2:
            pane[3] = beside(start + 0.06, 0.93)
        for side in (1.0, -1.0):
            builder.decal(pane * (1, side, 1), Surface.GLASS, facing=(0, side, 0.3))
    if detail == 2:
        lamp = np.array([at(0, 0.17, 0.90), at(0, -0.17, 0.90), at(0, -0.17, 0.96), at(0, 0.17, 0.96)])
        lamp[:, 0] -= 0.02
        facing = np.array([-1.0, 0.0, 0.4])
        builder.polygon(
            lamp, Surface.TAIL_LAMP, facing=facing, uv=[(2.0, 0.4), (2.2, 0.4), (2.2, 0.6), (2.0, 0.6)]
        )
        # Seals round the rear window: a thin dark frame between glass and paint.
        for low, high, inner, outer in ((0.05, 0.10, 0.84, 0.84), (0.97, 1.0, 0.84, 0.84)):
            strip = [at(0, outer, low), at(0, -outer, low), at(0, -inner, high), at(0, inner, high)]
            builder.decal(strip, Surface.PLASTIC, facing=facing, lift=0.008)
    if detail:
        _mirrors(builder, beside(0.93, 0.06), detail)


def _mirrors(builder: MeshBuilder, foot: Floats, detail: int) -> None:
    """Add the wing mirrors at ``foot`` (3,) on the left and its twin: boxes, or leaves when coarse."""
    x, z = float(foot[0]), (float(foot[2]) - 0.01, float(foot[2]) + 0.13)
    for side in (1.0, -1.0):
        y0, y1 = sorted((side * (float(foot[1]) + 0.02), side * (float(foot[1]) + 0.20)))
        if detail == 2:
            builder.box((x - 0.06, y0, z[0]), (x + 0.06, y1, z[1]), Surface.PAINT)
            continue
        leaf = [(x, y0, z[0]), (x, y1, z[0]), (x, y1, z[1]), (x, y0, z[1])]
        for facing in (-1, 1):
            builder.polygon(leaf, Surface.PAINT, facing=(facing, 0, 0))
