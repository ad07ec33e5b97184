"""Which things stand how far from the road, in each setting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

Knots = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Setting:
    """Which things stand how far from the asphalt.

    Attributes:
        per_km: Scattered things a kilometre, all species together.
        weights: For each species, (metres from the asphalt's edge, weight) knots, joined by lines.
            Only the ratio between the species matters: together they always follow eq. (12).
    """

    per_km: float
    weights: Mapping[str, Knots]


SETTINGS = {
    "motorway": Setting(
        per_km=110.0,
        weights={
            "tree": ((0, 0.0), (5, 0.0), (9, 3.0), (50, 5.0)),
            "bush": ((0, 0.0), (1, 1.0), (6, 4.0), (14, 2.0), (50, 1.0)),
            "sign": ((0, 1.0), (2, 1.6), (4, 0.4), (6, 0.0), (50, 0.0)),
            "pole": ((0, 0.6), (5, 0.6), (9, 0.2), (50, 0.05)),
            "building": ((0, 0.0), (18, 0.0), (25, 0.25), (50, 0.6)),
        },
    ),
    "rural": Setting(
        per_km=150.0,
        weights={
            "tree": ((0, 0.0), (2, 0.0), (4, 2.5), (50, 5.0)),
            "bush": ((0, 0.2), (1, 2.0), (5, 3.0), (12, 2.0), (50, 1.0)),
            "sign": ((0, 1.0), (2, 1.0), (3.5, 0.0), (50, 0.0)),
            "pole": ((0, 0.8), (3, 0.8), (7, 0.3), (10, 0.05), (50, 0.05)),
            "building": ((0, 0.0), (12, 0.0), (16, 0.25), (50, 0.35)),
        },
    ),
    "urban": Setting(
        per_km=150.0,
        weights={
            "tree": ((0, 0.0), (2, 0.6), (4, 2.0), (8, 1.2), (50, 1.0)),
            "bush": ((0, 0.2), (3, 0.6), (7, 0.8), (10, 0.2), (50, 0.2)),
            "sign": ((0, 1.5), (2, 1.5), (4, 0.2), (5, 0.0), (50, 0.0)),
            "pole": ((0, 1.0), (2, 1.0), (5, 0.1), (50, 0.0)),
            "building": ((0, 0.0), (8, 0.0), (9, 2.5), (50, 4.0)),
        },
    ),
    "avenue": Setting(
        per_km=260.0,
        weights={
            "tree": ((0, 0.0), (1.5, 1.0), (3, 6.0), (14, 6.0), (50, 3.0)),
            "bush": ((0, 0.3), (1, 2.0), (6, 2.0), (12, 1.0), (50, 0.5)),
            "sign": ((0, 0.4), (2, 0.4), (4, 0.1), (5, 0.0), (50, 0.0)),
            "pole": ((0, 0.3), (2, 0.3), (5, 0.1), (50, 0.0)),
            "building": ((0, 0.0), (14, 0.0), (18, 0.3), (50, 0.8)),
        },
    ),
}

SPECIES = ("tree", "bush", "sign", "pole", "building")

MODELS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "motorway": {
        "tree": (
            "broadleaf-a",
            "broadleaf-b",
            "broadleaf-c",
            "broadleaf-d",
            "broadleaf-e",
            "conifer-a",
            "conifer-b",
        ),
        "bush": ("bush-a", "bush-b", "bush-c"),
        "sign": ("sign-motorway", "sign-direction", "sign-speed", "sign-diamond"),
        "pole": ("pole-a", "delineator"),
        "building": ("hall", "barn", "house-b", "offices"),
    },
    "rural": {
        "tree": ("broadleaf-a", "broadleaf-b", "broadleaf-c", "broadleaf-e", "broadleaf-d", "conifer-a"),
        "bush": ("bush-a", "bush-b", "bush-c"),
        "sign": ("sign-direction", "sign-speed", "sign-warning", "sign-diamond"),
        "pole": ("pole-b", "delineator"),
        "building": ("house-a", "house-b", "house-c", "barn"),
    },
    "avenue": {
        "tree": ("broadleaf-c", "broadleaf-a", "broadleaf-e", "broadleaf-d", "conifer-a"),
        "bush": ("bush-a", "bush-b", "bush-c"),
        "sign": ("sign-speed", "sign-warning", "sign-diamond"),
        "pole": ("pole-b", "delineator"),
        "building": ("shops-a", "flats-a", "house-a", "shops-b", "house-c", "block-b"),
    },
    "urban": {
        "tree": ("broadleaf-a", "broadleaf-c", "broadleaf-e", "broadleaf-d"),
        "bush": ("bush-a", "bush-c"),
        "sign": ("sign-direction", "sign-speed", "sign-warning", "sign-diamond"),
        "pole": ("pole-b", "delineator"),
        "building": (
            "shops-a",
            "flats-a",
            "block-a",
            "house-a",
            "shops-b",
            "offices",
            "block-b",
            "house-c",
            "flats-b",
            "shops-a",
            "block-c",
            "house-b",
        ),
    },
}

WALLS = np.array(
    [
        (1.0, 0.96, 0.86),
        (0.96, 0.88, 0.76),
        (0.84, 0.60, 0.48),
        (1.0, 1.0, 1.0),
        (0.80, 0.80, 0.80),
        (0.98, 0.86, 0.62),
        (0.74, 0.82, 0.88),
    ]
)
"""Paints of walls, over the facade's own pale plaster."""

LEAVES = np.array(
    [
        (0.58, 0.62, 0.38),
        (0.54, 0.60, 0.39),
        (0.62, 0.62, 0.46),
        (0.70, 0.66, 0.38),
        (0.50, 0.56, 0.40),
        (0.72, 0.62, 0.44),
    ]
)
"""Hues of leaves, over a pale texture: oak, fresh, grey like olives, yellowing, dark, dry."""

NEEDLES = (0.46, 0.54, 0.40)
SIGNS = {
    "sign-speed": (0.93, 0.93, 0.91),
    "sign-warning": (0.90, 0.90, 0.86),
    "sign-diamond": (0.93, 0.70, 0.10),
    "sign-direction": (0.06, 0.33, 0.20),
    "sign-motorway": (0.05, 0.30, 0.18),
    "gantry": (0.05, 0.30, 0.18),
    "delineator": (0.90, 0.90, 0.88),
}


@dataclass(frozen=True, slots=True)
class Lines:
    """What runs along the road.

    Attributes:
        shares: Share of the road's length with a rail, a wall, a fence.
        wall: Model of the wall.
        wall_away: Metres from the asphalt's edge.
        fence_away: Likewise.
    """

    shares: tuple[float, float, float]
    wall: str
    wall_away: float
    fence_away: float


LINES = {
    "motorway": Lines(shares=(0.55, 0.14, 0.25), wall="noise-wall", wall_away=4.0, fence_away=11.0),
    "rural": Lines(shares=(0.12, 0.0, 0.25), wall="wall", wall_away=3.2, fence_away=6.0),
    "avenue": Lines(shares=(0.25, 0.15, 0.10), wall="wall", wall_away=3.2, fence_away=5.2),
    "urban": Lines(shares=(0.0, 0.10, 0.20), wall="wall", wall_away=3.2, fence_away=5.2),
}
