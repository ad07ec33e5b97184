"""Motorcycles with their riders: one object, in a few proportions and many colours.

A shape is built once, with faces of `Surface.PALETTE` laid on slots (helmet, trousers, machine, load, ...);
an outfit then says which colour each slot has. The rider's jacket takes the body's own colour.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import IntEnum
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sim.meshes.builder import Floats, MeshBuilder
from sim.models import Mesh, Model, Surface
from sim.textures import PALETTE
from sim.world import Kind

SWITCH = (36.0, 80.0)
"""Metres at which the coarser meshes take over: there a rider is about 37 px and 16 px high."""

Point = tuple[float, float, float]


class Slot(IntEnum):
    """What an outfit gives a colour to."""

    BLACK = 0
    HELMET = 1
    TROUSERS = 2
    MACHINE = 3
    LOAD = 4
    SKIN = 5
    SECOND = 6  # the pillion's jacket
    SECOND_HELMET = 7


OUTFITS: tuple[tuple[str, ...], ...] = (
    ("white", "jeans", "red", "cardboard", "green", "blue"),
    ("black", "grey", "blue", "khaki", "pink", "white"),
    ("red", "khaki", "black", "white", "grey", "yellow"),
    ("blue", "black", "silver", "brown", "orange", "red"),
    ("silver", "brown", "green", "cardboard", "teal", "black"),
    ("grey", "jeans", "white", "teal", "khaki", "pink"),
)
"""Colours of helmet, trousers, machine, load, the pillion's jacket and the pillion's helmet."""


class _Tailor(MeshBuilder):
    """A builder whose palette faces lie on the slot that is set."""

    def __init__(self) -> None:
        super().__init__()
        self.slot = Slot.BLACK

    def polygons(
        self,
        points: Floats,
        surface: Surface | NDArray[np.uint8],
        *,
        facing: Floats | None = None,
        uv: Floats | None = None,
        normals: Floats | None = None,
    ) -> None:
        if np.all(np.asarray(surface) == Surface.PALETTE):
            uv = np.full((*points.shape[:2], 2), float(self.slot))
        super().polygons(points, surface, facing=facing, uv=uv, normals=normals)

    def limb(self, points: Sequence[Point], radii: Sequence[float], surface: Surface, sides: int) -> None:
        """Add round bars from joint to joint."""
        for start, end, low, high in zip(points, points[1:], radii, radii[1:], strict=False):
            self.prism(start, end, (low, high), surface, sides=sides)

    def loft(
        self,
        rings: Sequence[tuple[Point, float, float]],
        surface: Surface,
        sides: int,
        *,
        capped: bool = True,
    ) -> None:
        """Add a skin over level ellipses: centre, half length along x, half width along y, from below."""
        turn = 2 * np.pi * np.arange(sides + 1) / sides
        lattice = np.array(
            [
                np.stack([x + a * np.cos(turn), y + b * np.sin(turn), np.full(sides + 1, z)], axis=1)
                for (x, y, z), a, b in rings
            ]
        )
        middles = lattice[:, :-1].mean(axis=1)
        inside = np.broadcast_to((0.5 * (middles[:-1] + middles[1:]))[:, None], (len(rings) - 1, sides, 3))
        self.grid(lattice, surface, inside=inside)
        if capped:
            self.polygon(lattice[-1, :-1], surface, facing=(0, 0, 1))

    def ball(self, centre: Point, radii: Point, surface: Surface, sides: int, rows: int) -> None:
        """Add an ellipsoid."""
        x, y, z = centre
        lifts = np.linspace(-0.45, 0.47, rows + 1) * np.pi
        rings = [
            (
                (x, y, z + radii[2] * float(np.sin(t))),
                radii[0] * float(np.cos(t)),
                radii[1] * float(np.cos(t)),
            )
            for t in lifts
        ]
        self.loft(rings, surface, sides)


def _person(b: _Tailor, hip: float, jacket: Surface, helmet: Slot, *, detail: int, pillion: bool) -> None:
    """Add a rider who sits at x = ``hip``: legs, jacket, arms, head with helmet."""
    sides, lean = (3, 4, 6)[detail], 0.10 if pillion else 0.16
    b.slot = Slot.TROUSERS
    for side in (1.0, -1.0):
        knee = (hip + 0.36, side * (0.24 if pillion else 0.21), 0.76)
        foot = (hip + (0.22 if pillion else 0.30), side * 0.22, 0.34)
        b.limb([(hip - 0.02, side * 0.10, 0.84), knee, foot], (0.105, 0.08, 0.055), Surface.PALETTE, sides)
        if detail:
            b.slot = Slot.BLACK
            b.box(
                (foot[0] - 0.08, foot[1] - 0.05, 0.26),
                (foot[0] + 0.17, foot[1] + 0.05, 0.36),
                Surface.PALETTE,
                without="-z",
            )
            b.slot = Slot.TROUSERS
    b.slot = Slot.SECOND
    top = hip + lean
    b.loft(
        [
            ((hip - 0.03, 0, 0.76), 0.13, 0.17),
            ((hip + 0.30 * lean, 0, 0.98), 0.13, 0.175),
            ((hip + 0.75 * lean, 0, 1.22), 0.13, 0.205),
            ((top, 0, 1.34), 0.105, 0.165),
            ((top + 0.01, 0, 1.39), 0.06, 0.07),
        ],
        jacket,
        sides + 2,
    )
    for side in (1.0, -1.0):
        shoulder = (top - 0.01, side * 0.20, 1.31)
        hand = (hip + 0.30, side * 0.14, 0.98) if pillion else (hip + 0.60, side * 0.31, 1.02)
        elbow = (hip + 0.14, side * 0.27, 1.05) if pillion else (hip + 0.30, side * 0.30, 1.06)
        b.limb([shoulder, elbow], (0.065, 0.05), jacket, sides)
        b.slot = Slot.SKIN
        b.limb([elbow, hand], (0.045, 0.04), Surface.PALETTE, sides)
        b.slot = Slot.SECOND
    b.slot = Slot.SKIN
    b.limb([(top, 0, 1.36), (top + 0.02, 0, 1.46)], (0.06, 0.06), Surface.PALETTE, sides)
    b.slot = helmet
    b.ball((top + 0.03, 0, 1.535), (0.135, 0.12, 0.135), Surface.PALETTE, sides + 2, (2, 3, 5)[detail])
    if detail == 2:
        b.slot = Slot.BLACK
        b.box((top + 0.10, -0.09, 1.49), (top + 0.172, 0.09, 1.56), Surface.PALETTE, without="-x")


def _machine(b: _Tailor, *, detail: int, fat: float) -> None:
    """Add a machine with a step-through frame: ``fat`` is the half width of its rear."""
    sides = (4, 5, 9)[detail]
    aside = np.array([0.0, 0.045, 0.0])  # half the width of a tyre
    for x in (-0.62, 0.63):
        turn = 2 * np.pi * np.arange(sides) / sides
        rim = np.stack([x + 0.29 * np.cos(turn), np.zeros(sides), 0.29 + 0.29 * np.sin(turn)], axis=1)
        b.slot = Slot.BLACK
        for side in (1.0, -1.0):
            b.polygon(rim + side * aside, Surface.PALETTE, facing=(0, side, 0))
        ring = np.concatenate([rim, rim[:1]])
        b.grid(np.stack([ring - aside, ring + aside]), Surface.PALETTE, inside=(x, 0, 0.29))
    b.slot = Slot.MACHINE
    b.loft(
        [((-0.42, 0, 0.46), 0.34, 0.6 * fat), ((-0.46, 0, 0.62), 0.44, fat), ((-0.40, 0, 0.76), 0.42, fat)],
        Surface.PALETTE,
        sides + 1,
    )
    b.box((0.30, -0.20, 0.34), (0.40, 0.20, 0.86), Surface.PALETTE)  # leg shield
    b.box((0.44, -0.06, 0.50), (0.86, 0.06, 0.62), Surface.PALETTE, without="-z")  # front mudguard
    b.slot = Slot.BLACK
    b.box((-0.10, -0.14, 0.24), (0.32, 0.14, 0.46), Surface.PALETTE)  # engine and foot board
    b.box((-0.72, -0.12, 0.74), (0.02, 0.12, 0.82), Surface.PALETTE, without="-z")  # seat
    b.limb([(0.63, 0, 0.29), (0.46, 0, 1.00)], (0.05, 0.05), Surface.PALETTE, 4)
    b.limb([(0.44, -0.35, 1.03), (0.44, 0.35, 1.03)], (0.025, 0.025), Surface.PALETTE, 3)
    if detail == 2:
        for side in (1.0, -1.0):
            b.limb([(0.44, side * 0.27, 1.03), (0.42, side * 0.33, 1.17)], (0.012, 0.012), Surface.PALETTE, 3)
            b.box((0.40, side * 0.33 - 0.05, 1.15), (0.43, side * 0.33 + 0.05, 1.22), Surface.PALETTE)
        b.prism((-0.55, -0.17, 0.30), (-0.95, -0.19, 0.40), (0.05, 0.06), Surface.CHROME, sides=5, caps=True)
    b.slot = Slot.MACHINE
    b.box((0.42, -0.11, 0.90), (0.56, 0.11, 1.06), Surface.PALETTE)
    lamp = [(0.565, -0.07, 0.93), (0.565, 0.07, 0.93), (0.565, 0.07, 1.03), (0.565, -0.07, 1.03)]
    b.decal(lamp, Surface.HEAD_LAMP, facing=(1, 0, 0))
    rear = [(-0.90, 0.08, 0.62), (-0.90, -0.08, 0.62), (-0.86, -0.08, 0.71), (-0.86, 0.08, 0.71)]
    b.decal(rear, Surface.TAIL_LAMP, facing=(-1, 0, 0))
    plate = [(-0.90, 0.10, 0.42), (-0.90, -0.10, 0.42), (-0.90, -0.10, 0.56), (-0.90, 0.10, 0.56)]
    b.decal(plate, Surface.PLATE, facing=(-1, 0, 0))


def _solo(b: _Tailor, detail: int) -> None:
    _machine(b, detail=detail, fat=0.13)
    _person(b, -0.16, Surface.FABRIC, Slot.HELMET, detail=detail, pillion=False)


def _scooter(b: _Tailor, detail: int) -> None:
    _machine(b, detail=detail, fat=0.21)
    _person(b, -0.20, Surface.FABRIC, Slot.HELMET, detail=detail, pillion=False)
    b.slot = Slot.LOAD
    b.box((-1.02, -0.20, 0.82), (-0.66, 0.20, 1.10), Surface.PALETTE)  # top case


def _pillion(b: _Tailor, detail: int) -> None:
    _machine(b, detail=detail, fat=0.15)
    _person(b, -0.06, Surface.FABRIC, Slot.HELMET, detail=detail, pillion=False)
    _person(b, -0.44, Surface.PALETTE, Slot.SECOND_HELMET, detail=detail, pillion=True)


def _boxes(b: _Tailor, detail: int) -> None:
    _machine(b, detail=detail, fat=0.13)
    _person(b, -0.08, Surface.FABRIC, Slot.HELMET, detail=detail, pillion=False)
    b.slot = Slot.LOAD
    b.box((-1.02, -0.32, 0.82), (-0.38, 0.32, 1.28), Surface.PALETTE)
    b.slot = Slot.SECOND
    b.box((-0.98, -0.24, 1.28), (-0.44, 0.26, 1.52), Surface.PALETTE, without="-z")


def _sacks(b: _Tailor, detail: int) -> None:
    _machine(b, detail=detail, fat=0.13)
    _person(b, -0.08, Surface.FABRIC, Slot.HELMET, detail=detail, pillion=False)
    b.slot = Slot.LOAD
    for side in (1.0, -1.0):
        b.ball(
            (-0.62, side * 0.31, 0.62),
            (0.34, 0.17, 0.29),
            Surface.PALETTE,
            (4, 5, 8)[detail],
            (2, 3, 4)[detail],
        )


_SHAPES: tuple[tuple[str, Callable[[_Tailor, int], None], int], ...] = (
    ("motorcycle-solo", _solo, 6),
    ("motorcycle-scooter", _scooter, 5),
    ("motorcycle-pillion", _pillion, 6),
    ("motorcycle-boxes", _boxes, 4),
    ("motorcycle-sacks", _sacks, 4),
)
"""Name, what builds it, and in how many of the outfits it is made."""


@cache
def rider_models() -> tuple[Model, ...]:
    """Return motorcycles with riders, from lone ones to loaded ones; names are unique."""
    models = []
    for shape, (name, build, count) in enumerate(_SHAPES):
        lods = [_built(build, detail) for detail in (2, 1, 0)]
        extent = lods[0].vertices.max(axis=0) - lods[0].vertices.min(axis=0)
        length, width, height = (round(float(size), 3) for size in extent)
        models += [
            Model(
                name=f"{name}-{'abcdef'[k]}",
                kind=Kind.MOTORCYCLE,
                size=(length, width, height),
                lods=tuple(_dressed(mesh, OUTFITS[(k + shape) % len(OUTFITS)]) for mesh in lods),
                switch=SWITCH,
            )
            for k in range(count)
        ]
    return tuple(models)


def _built(build: Callable[[_Tailor, int], None], detail: int) -> Mesh:
    """Build a shape with its middle above the origin."""
    builder = _Tailor()
    build(builder, detail)
    mesh = builder.build()
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return replace(mesh, vertices=mesh.vertices - np.array([(low[0] + high[0]) / 2, 0, low[2]], np.float32))


def _dressed(mesh: Mesh, outfit: Sequence[str]) -> Mesh:
    """Lay the slots of a shape on the palette's colours."""
    helmet, trousers, machine, load, second, second_helmet = outfit
    worn = ("black", helmet, trousers, machine, load, "skin", second, second_helmet)
    colours = np.array([list(PALETTE).index(colour) for colour in worn])
    uvs = mesh.uvs.copy()
    own = mesh.surfaces == Surface.PALETTE
    uvs[own] = np.stack(
        [(colours[uvs[own, 0].astype(int)] + 0.5) / len(PALETTE), np.full(int(own.sum()), 0.5)], axis=1
    )
    return replace(mesh, uvs=uvs)
