"""Proportions of the passenger cars."""

from __future__ import annotations

from dataclasses import dataclass


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
