"""Buildings, bridges, and what closes the horizon: woods and hills."""

from __future__ import annotations

import numpy as np

from sim.meshes.builder import MeshBuilder, scaled_to
from sim.models import Mesh, Model, Surface
from sim.rng import stream
from sim.world import Kind

_SEED = 20110603

FLOOR = 3.2
"""Height of a storey, metres; also the width of a window's bay."""


WOODS = (120.0, 12.0, 13.0)
"""Size of a strip of distant wood, metres."""


def structure_models() -> tuple[Model, ...]:
    """Make buildings, bridges, distant woods and hills."""
    houses = tuple(
        Model(
            name=name,
            kind=Kind.BUILDING,
            size=size,
            lods=(_house(size, True), _house(size, False)),
            switch=(90.0,),
        )
        for name, size in (
            ("house-a", (9.6, 9.6, 8.6)),
            ("house-b", (12.8, 9.6, 6.8)),
            ("house-c", (8.0, 12.8, 10.2)),
            ("barn", (18.0, 11.0, 8.0)),
        )
    )
    blocks = tuple(
        Model(
            name=name,
            kind=Kind.BUILDING,
            size=size,
            lods=(_block(size, True), _block(size, False)),
            switch=(90.0,),
        )
        for name, size in (
            ("block-a", (19.2, 12.8, 16.6)),
            ("block-b", (25.6, 12.8, 10.2)),
            ("block-c", (16.0, 16.0, 23.0)),
            ("hall", (38.4, 22.4, 8.0)),
        )
    )
    blocks += tuple(
        Model(
            name=name,
            kind=Kind.BUILDING,
            size=size,
            lods=(make(size, True), make(size, False)),
            switch=(90.0,),
        )
        for name, size, make in (
            ("flats-a", (22.4, 12.8, 13.4), _flats),
            ("flats-b", (16.0, 12.8, 19.8), _flats),
            ("shops-a", (19.2, 12.8, 10.6), _shops),
            ("shops-b", (12.8, 12.8, 13.8), _shops),
            ("offices", (22.4, 16.0, 20.0), _offices),
        )
    )
    bridges = (
        Model(name="bridge-a", kind=Kind.BRIDGE, size=(10.0, 60.0, 7.4), lods=(_bridge((10.0, 60.0, 7.4)),)),
        Model(name="bridge-b", kind=Kind.BRIDGE, size=(6.0, 60.0, 7.0), lods=(_bridge((6.0, 60.0, 7.0)),)),
    )
    woods = tuple(
        Model(name=f"woods-{letter}", kind=Kind.TREE, size=WOODS, lods=_woods(letter), switch=(110.0, 260.0))
        for letter in "abc"
    )
    hills = tuple(
        Model(name=f"hill-{letter}", kind=Kind.HILL, size=(900.0, 260.0, 60.0), lods=(_hill(letter),))
        for letter in "abc"
    )
    return houses + blocks + bridges + woods + hills


def _walls(builder: MeshBuilder, half_x: float, half_y: float, top: float) -> None:
    """Add four outer walls whose windows stand in whole bays."""
    ring = np.array([(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)])
    for i in range(4):
        start, end = ring[i], ring[(i + 1) % 4]
        width = float(np.hypot(*(end - start)))
        bays = max(1, round(width / FLOOR)) / 4
        # A quarter repeat is a bay and a storey; each wall starts at another bay, so that its blinds differ.
        u0, v1 = 0.25 * i, max(1, round(top / FLOOR)) / 4
        corners = [(*start, 0.0), (*end, 0.0), (*end, top), (*start, top)]
        builder.polygon(corners, Surface.FACADE, uv=[(u0, 0), (u0 + bays, 0), (u0 + bays, v1), (u0, v1)])


def _house(size: tuple[float, float, float], detail: bool) -> Mesh:
    length, width, height = size
    builder = MeshBuilder()
    eave = height - 0.36 * width
    half_x, half_y = length / 2 - 0.3, width / 2 - 0.4
    _walls(builder, half_x, half_y, eave)
    for sign in (1, -1):
        gable = [(sign * half_x, -half_y, eave), (sign * half_x, half_y, eave), (sign * half_x, 0, height)]
        builder.polygon(gable, Surface.CARGO, facing=(sign, 0, 0))
        slope = [
            (-length / 2, sign * width / 2, eave - 0.25),
            (length / 2, sign * width / 2, eave - 0.25),
            (length / 2, 0, height),
            (-length / 2, 0, height),
        ]
        builder.polygon(slope, Surface.ROOF, facing=(0, sign, 1))
        if detail:
            # Underside of the eaves: a dark line between wall and roof.
            builder.polygon(np.array(slope) - (0, 0, 0.10), Surface.PLASTIC, facing=(0, -sign, -1))
            edge = np.array(
                [
                    slope[0],
                    slope[1],
                    (slope[1][0], slope[1][1], slope[1][2] - 0.10),
                    (slope[0][0], slope[0][1], slope[0][2] - 0.10),
                ]
            )
            builder.polygon(edge, Surface.PAINT, facing=(0, sign, 0))
    if detail:
        builder.box(
            (length * 0.18, -0.35, height - 1.2),
            (length * 0.18 + 0.7, 0.35, height),
            Surface.ROOF,
            without="-z",
        )
    return scaled_to(builder, size)


def _block(size: tuple[float, float, float], detail: bool) -> Mesh:
    length, width, height = size
    builder = MeshBuilder()
    half_x, half_y = length / 2 - 0.2, width / 2 - 0.2
    _walls(builder, half_x, half_y, height - 0.6)
    builder.box(
        (-half_x - 0.2, -half_y - 0.2, height - 0.7), (half_x + 0.2, half_y + 0.2, height), Surface.CONCRETE
    )
    if detail:
        builder.box(
            (-half_x - 0.05, -half_y - 0.05, 0),
            (half_x + 0.05, half_y + 0.05, 0.5),
            Surface.CONCRETE,
            without="-z",
        )
        builder.box(
            (-half_x - 0.12, -half_y - 0.12, FLOOR),
            (half_x + 0.12, half_y + 0.12, FLOOR + 0.25),
            Surface.CONCRETE,
        )
    return scaled_to(builder, size)


def _flats(size: tuple[float, float, float], detail: bool) -> Mesh:
    """Make flats with balconies on the sides along x, in every second bay."""
    length, width, height = size
    builder = MeshBuilder()
    half_x, half_y = length / 2 - 0.2, width / 2 - 1.2
    _walls(builder, half_x, half_y, height - 0.6)
    builder.box(
        (-half_x - 0.2, -half_y - 0.5, height - 0.7), (half_x + 0.2, half_y + 0.5, height), Surface.CONCRETE
    )
    for side in (1, -1):
        near, far = side * half_y, side * (width / 2)
        for x in np.arange(-half_x + 0.4, half_x - 3.0, 2 * FLOOR):
            if not detail:
                # From afar a row of balconies is one pale band up the wall.
                band = (x, min(near, far), FLOOR), (x + 0.9 * FLOOR, max(near, far), height - 1.6)
                builder.box(*band, Surface.FACADE)
                continue
            for z in np.arange(FLOOR, height - 2.4, FLOOR):
                low, high = (x, min(near, far)), (x + 0.9 * FLOOR, max(near, far))
                builder.box(
                    (*low, z), (*high, z + 0.18), Surface.CONCRETE, without="-y" if side > 0 else "+y"
                )
                front = sorted((far, far - side * 0.06))
                builder.box(
                    (low[0], front[0], z + 0.18), (high[0], front[1], z + 1.1), Surface.CARGO, without="-z"
                )
    return scaled_to(builder, size)


def _shops(size: tuple[float, float, float], detail: bool) -> Mesh:
    """Make shops below flats: panes from wall to wall under a board and awnings, on the sides along x."""
    length, width, height = size
    builder = MeshBuilder()
    half_x, half_y = length / 2 - 0.2, width / 2 - 1.0
    _walls(builder, half_x, half_y, height - 0.5)
    builder.box(
        (-half_x - 0.2, -half_y - 0.3, height - 0.5), (half_x + 0.2, half_y + 0.3, height), Surface.ROOF
    )
    for side in (1, -1):
        face, facing = side * (half_y + 0.05), (0, side, 0)
        quad = [(-half_x, face, 0.0), (half_x, face, 0.0), (half_x, face, FLOOR), (-half_x, face, FLOOR)]
        builder.polygon(quad, Surface.PLASTIC, facing=facing)
        board = [(-half_x, face, 2.7), (half_x, face, 2.7), (half_x, face, 3.4), (-half_x, face, 3.4)]
        builder.polygon(np.array(board) + np.array([0, side * 0.06, 0]), Surface.PAINT, facing=facing)
        count = max(2, round(length / 4.8))
        for i in range(count):
            x0, x1 = (-half_x + 2 * half_x * (i + share) / count for share in (0.06, 0.94))
            pane = np.array([(x0, face, 0.5), (x1, face, 0.5), (x1, face, 2.6), (x0, face, 2.6)])
            builder.polygon(pane + np.array([0, side * 0.03, 0]), Surface.GLASS, facing=facing)
            if detail and i % 2 == 0:
                out = side * (width / 2)
                awning = [(x0, face, 2.75), (x1, face, 2.75), (x1, out, 2.35), (x0, out, 2.35)]
                for up in (1, -1):
                    builder.polygon(awning, Surface.CARGO, facing=(0, 0.3 * side * up, up))
    return scaled_to(builder, size)


def _offices(size: tuple[float, float, float], detail: bool) -> Mesh:
    """Make offices: bands of glass between bands of concrete, and a plant room on the roof."""
    length, width, height = size
    builder = MeshBuilder()
    half_x, half_y = length / 2, width / 2
    top = height - 2.2
    builder.box(
        (-half_x + 0.1, -half_y + 0.1, 0), (half_x - 0.1, half_y - 0.1, top), Surface.GLASS, without="-z"
    )
    for z in np.arange(FLOOR - 0.9, top, FLOOR):
        band = (-half_x, -half_y, z), (half_x, half_y, min(z + 1.2, top + 0.3))
        builder.box(*band, Surface.CARGO, without="" if detail else "-z+z")
    builder.box((-half_x, -half_y, top), (half_x, half_y, top + 0.4), Surface.CARGO, without="-z")
    if detail:
        for x in np.linspace(-half_x + 0.15, half_x - 0.15, 8):
            for side in (1, -1):
                y = sorted((side * (half_y - 0.2), side * (half_y + 0.0)))
                builder.box((x - 0.12, y[0], 0), (x + 0.12, y[1], top), Surface.CARGO, without="-z+z")
    builder.box(
        (-0.3 * length, -0.25 * width, top + 0.4),
        (0.1 * length, 0.25 * width, height),
        Surface.STEEL,
        without="-z",
    )
    return scaled_to(builder, size)


def _bridge(size: tuple[float, float, float]) -> Mesh:
    """Make a bridge across y; the road runs along x beneath. Its clear span is 70 % of the width."""
    length, width, height = size
    builder = MeshBuilder()
    half_x, half_y = length / 2, width / 2
    deck, soffit = height - 1.0, height - 2.2
    builder.box((-half_x + 0.6, -half_y, soffit), (half_x - 0.6, half_y, deck), Surface.CONCRETE)
    builder.box((-half_x, -half_y, deck - 0.3), (half_x, half_y, deck + 0.05), Surface.CONCRETE)
    for x in (-half_x + 0.02, half_x - 0.12):
        for z in (deck + 0.50, height - 0.06):
            builder.box((x, -half_y, z), (x + 0.10, half_y, z + 0.06), Surface.STEEL)
        for y in np.linspace(-half_y + 0.1, half_y - 0.1, 25):
            builder.box((x, y - 0.04, deck), (x + 0.08, y + 0.04, height), Surface.STEEL, without="-z+z+x")
    for sign in (1, -1):
        inner, outer = 0.70 * half_y, half_y
        for x in (-half_x * 0.5, half_x * 0.5):
            builder.box(
                (x - 0.45, min(sign * inner, sign * (inner + 0.9)), 0),
                (x + 0.45, max(sign * inner, sign * (inner + 0.9)), soffit),
                Surface.CONCRETE,
                without="-z+z",
            )
        # The embankment that carries the crossing road.
        foot = inner + 1.0
        slope = [
            (-half_x + 0.5, sign * foot, 0),
            (half_x - 0.5, sign * foot, 0),
            (half_x - 0.5, sign * (outer - 2), soffit),
            (-half_x + 0.5, sign * (outer - 2), soffit),
        ]
        builder.polygon(slope, Surface.CONCRETE, facing=(0, -sign, 1))
        for end in (1, -1):
            x0, x1 = end * (half_x - 0.5), end * (half_x + 0.0)
            side = [
                (x0, sign * foot, 0),
                (x1, sign * outer, 0),
                (x1, sign * outer, deck - 0.4),
                (x0, sign * (outer - 2), soffit),
            ]
            builder.polygon(side, Surface.GRASS, facing=(end, 0, 0))
    return scaled_to(builder, size)


def _woods(letter: str) -> tuple[Mesh, ...]:
    """Make a strip of distant wood along x, from fine to coarse: round crowns, lower toward the ends."""
    rng = stream(_SEED, "woods", letter)
    crowns = 17
    foot = np.linspace(-60, 60, crowns + 1)
    middles = (foot[1:] + foot[:-1]) / 2
    heights = (9.0 + 4.0 * rng.uniform(-1, 1, crowns)) * np.clip(1.15 - (np.abs(middles) / 62) ** 4, 0.4, 1)
    reach = rng.uniform(0.75, 1.0, crowns)
    meshes = []
    for columns, leaves in ((2, 110), (2, 0), (1, 0)):
        bend = np.linspace(0, np.pi, columns, endpoint=False) + np.pi / (2 * columns)
        x = (foot[:-1, None] + (foot[1:] - foot[:-1])[:, None] * (0.5 - 0.5 * np.cos(bend))).ravel()
        tops = (heights[:, None] * (0.68 + 0.32 * np.sin(bend))).ravel()
        tops *= stream(_SEED, "woods", letter, "twigs").uniform(0.93, 1.07, 2 * crowns)[:: 2 // columns]
        depth = np.repeat(reach, columns)
        flat = np.zeros(len(x))
        builder = MeshBuilder()
        for side in (1, -1):
            rows = [(flat + side * 6.0 * depth, flat), (flat + side * 4.6 * depth, 0.66 * tops), (flat, tops)]
            if not leaves:
                del rows[1]
            lattice = np.stack([np.stack([x, y, z], axis=1) for y, z in rows])
            fluff = rng.normal(0, 0.35, lattice.shape) + np.array([0.0, 0.8 * side, 0.45])
            fluff /= np.linalg.norm(fluff, axis=2, keepdims=True)
            cuts = [
                (slice(i, i - 1 or None), slice(j, j - 1 or None))
                for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))
            ]
            quads, shades = (
                np.stack([a[cut] for cut in cuts], axis=2).reshape(-1, 4, 3) for a in (lattice, fluff)
            )
            facing = np.broadcast_to(np.array([0, side, 0.6]), (len(quads), 3))
            builder.polygons(quads, Surface.FOLIAGE, facing=facing, normals=shades)
        if leaves:
            # Twigs along the crest and on both flanks break the outline.
            twigs = stream(_SEED, "woods", letter, "leaves")
            place = twigs.integers(0, len(x), leaves)
            flank, up = twigs.choice([-1.0, 1.0], leaves), twigs.uniform(0.5, 1.0, leaves)
            at = np.stack([x[place], flank * 8.5 * (1.05 - up) * depth[place], up * tops[place]], axis=1)
            at[:, 0] = np.clip(at[:, 0] + twigs.uniform(-2, 2, leaves), -59, 59)
            rings = at[:, None] + twigs.normal(0, 0.75, (leaves, 3, 3))
            normals = np.repeat(
                np.stack([0 * flank, 0.8 * flank, 0.6 + 0 * flank], axis=1)[:, None], 3, axis=1
            )
            builder.polygons(rings, Surface.FOLIAGE, facing=normals[:, 0], normals=normals)
        meshes.append(scaled_to(builder, WOODS))
    return tuple(meshes)


def _hill(letter: str) -> Mesh:
    """Make a ridge along x with a wavy crest."""
    rng = stream(_SEED, "hills", letter)
    builder = MeshBuilder()
    count = 25
    x = np.linspace(-450, 450, count)
    envelope = np.clip(1 - (x / 450) ** 2, 0, 1)
    crest = 26 * np.sqrt(envelope)
    for octave in (1, 2, 3, 5, 8):
        crest += 15 / octave * np.sin(x / 900 * 2 * np.pi * octave + rng.uniform(0, 2 * np.pi)) * envelope
    crest = np.clip(crest + 4, 0.0, None) * np.clip(1 - (x / 450) ** 4, 0, 1)
    rows = [
        np.stack([x, np.full(count, y), crest * share], axis=1)
        for y, share in ((-130.0, 0.0), (0.0, 1.0), (130.0, 0.0))
    ]
    builder.grid(np.stack(rows), Surface.HILL, inside=(0, 0, -400))
    return scaled_to(builder, (900.0, 260.0, 60.0))
