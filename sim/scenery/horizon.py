"""Scenery on the horizon: distant woods and hills."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.scenery.yard import Yard

Floats = NDArray[np.float64]


def place_horizon(yard: Yard) -> None:
    """Place woods from 65 to 260 m and hills from 450 to 1000 m beside and beyond the road."""
    road = yard.road
    rng = yard.stream("woods")
    for side in (-1.0, 1.0):
        for s in np.arange(-40.0, road.length + 900, 110.0):
            roll = rng.random(6)
            d = side * (65 + 195 * roll[0] ** 1.5)
            if roll[1] > 0.75:
                continue
            size = yard.size("woods-a") * (0.8 + 0.5 * roll[2], 1.0, 0.7 + 0.6 * roll[3])
            _far(
                yard,
                f"woods-{'abc'[int(roll[4] * 3)]}",
                s + 60 * roll[5],
                d,
                0.25 * (roll[5] - 0.5),
                size,
                45.0,
            )
    rng = yard.stream("hills")
    for side in (-1.0, 1.0):
        for s in np.arange(0.0, road.length + 2000, 520.0):
            roll = rng.random(6)
            size = yard.size("hill-a") * (0.8 + 0.6 * roll[0], 1.0, 0.5 + 0.9 * roll[1])
            d = side * (450 + 550 * roll[2])
            _far(
                yard,
                f"hill-{'abc'[int(roll[3] * 3)]}",
                s + 300 * roll[4],
                d,
                0.5 * (roll[5] - 0.5),
                size,
                300.0,
            )
    for i in range(3):
        roll = rng.random(3)
        size = yard.size("hill-a") * (1.2, 1.0, 0.5 + 0.6 * roll[0])
        _far(
            yard,
            f"hill-{'abc'[i]}",
            road.length + 900 + 250 * i,
            400 * (roll[1] - 0.5),
            np.pi / 2 + 0.3 * (roll[2] - 0.5),
            size,
            0.0,
        )


def _far(yard: Yard, name: str, s: float, d: float, turn: float, size: Floats, keep: float) -> None:
    """Place a far thing, unless a bend brings the asphalt within ``keep`` metres of its middle."""
    end = yard.road.length
    on = min(s, end)
    x, y = (float(a) for a in yard.road.to_world(on, d))
    heading = float(yard.road.heading(on))
    x, y = x + (s - on) * np.cos(heading), y + (s - on) * np.sin(heading)
    along = np.linspace(0, end, max(2, int(end / 25)))
    xs, ys = yard.road.to_world(along, 0.0)
    if float(np.hypot(xs - x, ys - y).min()) < keep:
        return
    yard.add_at(name, x, y, heading + turn, size)
