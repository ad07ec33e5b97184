"""How the land around the roads is used: plots in rows, each a field, a wood, a garden, a yard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sim.aerial.networks import Strip

Floats = NDArray[np.float64]


class Use(Enum):
    """What a parcel is."""

    CROP = "crop"
    STUBBLE = "stubble"
    SOIL = "soil"
    MEADOW = "meadow"
    WOOD = "wood"
    GARDEN = "garden"
    YARD = "yard"
    STREET = "street"


@dataclass(frozen=True, slots=True)
class Parcel:
    """A rectangle of land.

    Attributes:
        use: What it is.
        x: Of its middle, metres.
        y: Likewise.
        heading: Of its long side, radians.
        length: Metres.
        width: Metres.
        roll: (6,) numbers in [0, 1) that all its details come from.
    """

    use: Use
    x: float
    y: float
    heading: float
    length: float
    width: float
    roll: tuple[float, ...]

    def at(self, along: float, across: float) -> tuple[float, float]:
        """Return the world point that far from its middle, metres."""
        cos, sin = np.cos(self.heading), np.sin(self.heading)
        return float(self.x + along * cos - across * sin), float(self.y + along * sin + across * cos)

    def corners(self, inset: float = 0.0) -> Floats:
        """Return (4, 2) corners, moved inward by ``inset`` metres."""
        a, b = self.length / 2 - inset, self.width / 2 - inset
        return np.array([self.at(*corner) for corner in ((-a, -b), (a, -b), (a, b), (-a, b))])


@dataclass(frozen=True, slots=True)
class _Style:
    """Sizes of parcels, how many rows lie between streets (0: there are none), and shares of the uses."""

    length: float
    width: float
    rows: int
    shares: tuple[tuple[Use, float], ...]


_STYLES = {
    "open": _Style(
        105.0,
        72.0,
        0,
        (
            (Use.CROP, 0.30),
            (Use.STUBBLE, 0.20),
            (Use.SOIL, 0.12),
            (Use.MEADOW, 0.22),
            (Use.WOOD, 0.16),
        ),
    ),
    "suburb": _Style(
        27.0, 30.0, 2, ((Use.GARDEN, 0.72), (Use.MEADOW, 0.12), (Use.WOOD, 0.10), (Use.YARD, 0.06))
    ),
    "town": _Style(
        46.0, 36.0, 2, ((Use.YARD, 0.72), (Use.GARDEN, 0.10), (Use.MEADOW, 0.12), (Use.WOOD, 0.06))
    ),
}
STREET = 7.0
"""Metres of asphalt and pavement of a street between the rows."""


def divide(
    area: tuple[float, float, float, float], setting: str, heading: float, rng: np.random.Generator
) -> tuple[Parcel, ...]:
    """Divide an area into parcels.

    Args:
        area: West, south, east, north, metres.
        setting: Of `sim.params.AerialSceneryParams`.
        heading: That the rows run along, radians.
        rng: Draws uses and details.
    """
    style = _STYLES[setting]
    middle = np.array([(area[0] + area[2]) / 2, (area[1] + area[3]) / 2])
    reach = 0.5 * float(np.hypot(area[2] - area[0], area[3] - area[1])) + style.length
    along = np.array([np.cos(heading), np.sin(heading)])
    across = np.array([-along[1], along[0]])
    uses, shares = zip(*style.shares, strict=True)
    edges = np.cumsum(shares) / sum(shares)
    parcels = []
    place, row = -reach + rng.uniform(0, style.width), 0
    while place < reach:
        depth = style.width * rng.uniform(0.85, 1.15)
        if style.rows and row % style.rows == 0:
            x, y = middle + (place + STREET / 2) * across
            parcels.append(
                Parcel(
                    Use.STREET, float(x), float(y), heading, 2 * reach, STREET, tuple(rng.random(6).tolist())
                )
            )
            place += STREET
        s = -reach - rng.uniform(0, style.length)
        while s < reach:
            run = style.length * rng.uniform(0.8, 1.25)
            x, y = middle + (s + run / 2) * along + (place + depth / 2) * across
            use = uses[int(np.searchsorted(edges, rng.random()))]
            roll = tuple(rng.random(6).tolist())
            # Fronts face the street: rows on either side of it look toward each other.
            turn = heading if row % 2 == 0 else heading + np.pi
            parcels.append(Parcel(use, float(x), float(y), turn, run, depth, roll))
            s += run
        place, row = place + depth, row + 1
    return tuple(parcels)


class Free:
    """Says what is clear of the roads."""

    def __init__(self, strips: Sequence[Strip]) -> None:
        """Index the asphalt of ``strips``."""
        points, reach = [], []
        for strip in strips:
            low, high = strip.paved
            points.append(strip.beside((low + high) / 2))
            reach.append(np.full(len(strip.line), (high - low) / 2))
        self._tree = cKDTree(np.concatenate(points))
        self._reach = np.concatenate(reach)
        self._widest = float(self._reach.max())

    def room(self, x: float, y: float) -> float:
        """Return the metres from a point to the nearest asphalt, negative on it; 80 at most."""
        near = self._tree.query_ball_point([x, y], self._widest + 80.0)
        if not near:
            return 80.0
        points = self._tree.data[near]
        return float((np.hypot(points[:, 0] - x, points[:, 1] - y) - self._reach[near]).min())
