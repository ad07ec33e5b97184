"""Passenger cars: a lattice of body stations along the length, a cabin on top, and what makes the rear a rear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.meshes.builder import Floats, MeshBuilder, scaled_to
from sim.models import Mesh, Model, Surface
from sim.world import Kind

SWITCH = (25.0, 70.0)
"""Metres at which the coarser meshes take over."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CarShape:
    """Proportions of a car, metres; x from the middle, ahead; z from the ground.

    Attributes:
        name: Of the model.
        length: Over the bumpers.
        width: Without mirrors.
        height: To the roof.
        deck: Height of the boot lid, or of the belt line where the tail gate begins.
        hood: Height of the bonnet's front edge.
        gate: (x, x) foot and head of the rear window, from the rear end.
        screen: (x, x) foot and head of the wind screen, from the front end.
        lamps: (z, z) lower and upper edge of the tail lamps.
        lamp_inner: Where the tail lamps begin, share of the half width.
        plate: Height of the number plate's middle.
        wheel: Radius of the wheels.
        roof: Half width of the roof's flat, share of the half width.
    """

    name: str
    length: float
    width: float
    height: float
    deck: float
    hood: float
    gate: tuple[float, float]
    screen: tuple[float, float]
    lamps: tuple[float, float]
    lamp_inner: float
    plate: float
    wheel: float
    roof: float


SHAPES = (
    CarShape(
        name="saloon-a", length=4.75, width=1.82, height=1.45, deck=1.04, hood=0.74, gate=(0.52, 1.30),
        screen=(1.30, 2.05), lamps=(0.72, 0.92), lamp_inner=0.62, plate=0.80, wheel=0.32, roof=0.62,
    ),
    CarShape(
        name="saloon-b", length=4.55, width=1.76, height=1.42, deck=0.98, hood=0.70, gate=(0.62, 1.22),
        screen=(1.22, 1.95), lamps=(0.66, 0.84), lamp_inner=0.68, plate=0.47, wheel=0.30, roof=0.64,
    ),
    CarShape(
        name="saloon-c", length=4.95, width=1.88, height=1.48, deck=1.09, hood=0.76, gate=(0.40, 1.35),
        screen=(1.40, 2.20), lamps=(0.80, 0.96), lamp_inner=0.50, plate=0.84, wheel=0.34, roof=0.62,
    ),
    CarShape(
        name="hatchback-a", length=4.05, width=1.74, height=1.48, deck=1.00, hood=0.74, gate=(0.10, 0.62),
        screen=(0.95, 1.75), lamps=(0.74, 0.99), lamp_inner=0.70, plate=0.66, wheel=0.30, roof=0.66,
    ),
    CarShape(
        name="hatchback-b", length=4.30, width=1.80, height=1.46, deck=0.96, hood=0.74, gate=(0.12, 0.80),
        screen=(1.05, 1.90), lamps=(0.72, 0.92), lamp_inner=0.62, plate=0.50, wheel=0.32, roof=0.64,
    ),
    CarShape(
        name="estate-a", length=4.70, width=1.82, height=1.50, deck=1.00, hood=0.76, gate=(0.12, 0.52),
        screen=(1.25, 2.05), lamps=(0.74, 0.98), lamp_inner=0.72, plate=0.70, wheel=0.32, roof=0.66,
    ),
    CarShape(
        name="suv-a", length=4.50, width=1.86, height=1.68, deck=1.12, hood=0.92, gate=(0.12, 0.45),
        screen=(1.15, 1.80), lamps=(0.86, 1.10), lamp_inner=0.70, plate=0.78, wheel=0.36, roof=0.70,
    ),
    CarShape(
        name="suv-b", length=4.90, width=1.95, height=1.78, deck=1.20, hood=1.00, gate=(0.08, 0.36),
        screen=(1.25, 1.85), lamps=(0.84, 1.18), lamp_inner=0.80, plate=0.92, wheel=0.38, roof=0.72,
    ),
)  # fmt: skip


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
    _rear(builder, shape, detail, body)
    _front(builder, shape, detail, body)
    _wheels(builder, shape, detail)
    if detail == 2:
        _side_lines(builder, shape)
    return scaled_to(builder, (shape.length, shape.width, shape.height))


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
        levels, bulge = np.array([0.20, 0.40, shape.deck]), np.array([0.96, 1.0, 0.94])
        tuck, nose = np.array([0.04, 0.0, 0.06]), np.array([0.20, 0.36, shape.hood])
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
        kinds[0, 0] = Surface.PLASTIC
        if detail == 2:
            kinds[0, 2] = Surface.PLASTIC
        builder.grid(strip, kinds, inside=(points[end, 0, 0] - facing, 0, 0.6))
    top = np.stack([points[:, -1], mirrored[:, -1]], axis=1)
    builder.grid(top, Surface.PAINT, inside=(0, 0, -5))
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
    ridge = (left[-1] + right[-1]) / 2 + (0, 0, 0.018)
    builder.grid(np.stack([left[-1], ridge, right[-1]]), Surface.PAINT, inside=middle)
    _windows(builder, left, detail)


def _windows(builder: MeshBuilder, left: Floats, detail: int) -> None:
    """Add the glass, a little above the cabin's faces; ``left`` is (levels, 2 ends, 3)."""
    foot, head = left[0], left[1]
    mirror = np.array([1.0, -1.0, 1.0])

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
        mirror_foot = beside(0.93, 0.06)
        for side in (1.0, -1.0):
            centre = mirror_foot * mirror if side < 0 else mirror_foot
            y = sorted((centre[1] + side * 0.02, centre[1] + side * 0.20))
            builder.box(
                (centre[0] - 0.06, y[0], centre[2] - 0.01),
                (centre[0] + 0.06, y[1], centre[2] + 0.13),
                Surface.PAINT,
            )


def _rear(builder: MeshBuilder, shape: CarShape, detail: int, body: Floats) -> None:
    """Add plate, lamps' coarse stand-ins, boot lid's lines, exhaust."""
    rear = -shape.length / 2
    low, high = shape.lamps
    half = shape.width / 2
    back = (-1.0, 0.0, 0.0)

    def strip(x: float, left: float, z0: float, z1: float, surface: Surface, lift: float = 0.012) -> None:
        corners = [(x, left, z0), (x, -left, z0), (x, -left, z1), (x, left, z1)]
        builder.decal(corners, surface, facing=back, lift=lift)

    plate_x = rear + (0.05 if shape.plate > 0.6 else 0.0)
    if detail == 0:
        for side in (1.0, -1.0):
            y = sorted((side * half * 0.62, side * half * 0.93))
            builder.decal(
                [(rear + 0.05, y[1], low), (rear + 0.05, y[0], low), (rear + 0.05, y[0], high), (rear + 0.05, y[1], high)],
                Surface.TAIL_LAMP, facing=back, lift=0.03,
            )  # fmt: skip
        return
    if detail == 1:
        for side in (1.0, -1.0):
            y = sorted((side * half * shape.lamp_inner, side * half * 0.87))
            builder.decal(
                [(rear + 0.05, y[1], low), (rear + 0.05, y[0], low), (rear + 0.06, y[0], high), (rear + 0.06, y[1], high)],
                Surface.TAIL_LAMP, facing=back, lift=0.015,
            )  # fmt: skip
        strip(rear + 0.05, half * 0.80, 0.60, 0.63, Surface.PLASTIC)
        strip(plate_x, 0.27, shape.plate - 0.06, shape.plate + 0.06, Surface.PLATE, 0.02)
        return
    inner = half * shape.lamp_inner
    strip(plate_x, 0.34, shape.plate - 0.09, shape.plate + 0.09, Surface.PLASTIC, 0.010)
    strip(plate_x, 0.26, shape.plate - 0.055, shape.plate + 0.055, Surface.PLATE, 0.022)
    strip(rear + 0.06, 0.30, shape.plate + 0.10, shape.plate + 0.125, Surface.CHROME, 0.014)
    # The boot lid's lip: a dark line below the deck's edge.
    strip(rear + 0.085, inner, shape.deck - 0.05, shape.deck - 0.03, Surface.PLASTIC, 0.010)
    for side in (1.0, -1.0):
        y = side * inner * 0.97
        builder.decal(
            [(rear + 0.05, y + 0.008, 0.62), (rear + 0.05, y - 0.008, 0.62), (rear + 0.08, y - 0.008, shape.deck - 0.04),
             (rear + 0.08, y + 0.008, shape.deck - 0.04)],
            Surface.PLASTIC, facing=back, lift=0.012,
        )  # fmt: skip
        # Reflectors in the bumper and the exhaust below it.
        r = side * half * 0.52
        builder.decal(
            [(rear, r + 0.09, 0.43), (rear, r - 0.09, 0.43), (rear, r - 0.09, 0.46), (rear, r + 0.09, 0.46)],
            Surface.TAIL_LAMP, facing=back,
        )  # fmt: skip
    builder.box((rear + 0.03, 0.42, 0.20), (rear + 0.20, 0.52, 0.27), Surface.CHROME, without="+x")
    # Dark underside: axle and tank, seen between the rear wheels.
    builder.box(
        (rear + 0.45, -half * 0.70, 0.15), (rear + 1.1, half * 0.70, 0.30), Surface.PLASTIC, without="+z"
    )


def _front(builder: MeshBuilder, shape: CarShape, detail: int, body: Floats) -> None:
    """Add grille, plate and, on coarse meshes, headlamps."""
    front, half = shape.length / 2, shape.width / 2
    ahead = (1.0, 0.0, 0.0)
    nose = float(body[-1, 1:, 0].max())
    x = nose + 0.005
    top = shape.hood

    def strip(y0: float, y1: float, z0: float, z1: float, surface: Surface, lift: float = 0.012) -> None:
        builder.decal([(x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1)], surface, facing=ahead, lift=lift)

    if detail < 2:
        for side in (1.0, -1.0):
            y = sorted((side * half * 0.52, side * half * (0.86 if detail == 0 else 0.73)))
            strip(y[0], y[1], top - 0.18, top - 0.04, Surface.HEAD_LAMP)
        if detail == 1:
            strip(-half * 0.48, half * 0.48, top - 0.20, top - 0.06, Surface.PLASTIC)
            strip(-0.26, 0.26, 0.40, 0.51, Surface.PLATE)
        return
    strip(-half * 0.52, half * 0.52, top - 0.19, top - 0.05, Surface.PLASTIC)
    strip(-half * 0.52, half * 0.52, top - 0.13, top - 0.11, Surface.CHROME, 0.018)
    strip(-half * 0.55, half * 0.55, 0.25, 0.36, Surface.PLASTIC)
    strip(-0.26, 0.26, 0.40, 0.51, Surface.PLATE)
    for side in (1.0, -1.0):
        y = sorted((side * half * 0.50, side * half * 0.60))
        strip(y[0], y[1], top - 0.17, top - 0.05, Surface.HEAD_LAMP, 0.010)
    _ = front


def _axles(shape: CarShape) -> tuple[float, float]:
    """Return where the axles are, metres from the middle."""
    return -shape.length / 2 + 0.205 * shape.length, shape.length / 2 - 0.19 * shape.length


def _wheels(builder: MeshBuilder, shape: CarShape, detail: int) -> None:
    half, radius = shape.width / 2, shape.wheel
    for x in _axles(shape):
        if detail == 0:
            box = (x - radius * 0.8, -half * 0.97, 0.0), (x + radius * 0.8, half * 0.97, radius)
            builder.box(*box, Surface.PLASTIC, without="+z-z")
            continue
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


def _side_lines(builder: MeshBuilder, shape: CarShape) -> None:
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
