"""Scenery on the horizon: distant woods and hills."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.roads import LEAD_IN
from sim.scenery.yard import Yard

Floats = NDArray[np.float64]


def place_horizon(yard: Yard) -> None:
    """Place woods and hills beside and beyond the road, outside the reach of eq. (12)."""
    road = yard.road
    low, high = road.paved
    # Woods differ between drives: from open country to forest; hills from none in sight to near and high.
    openness, relief, nearness = yard.stream("horizon").uniform((0.3, 0.25, 0.55), (1.15, 1.5, 1.3))
    moisture = yard.stream("horizon", "hue").uniform(0, 1)
    slope = np.array([0.98, 0.90, 0.74]) * (1 - moisture) + np.array([0.74, 0.86, 0.66]) * moisture
    for rank, (nearest, spread, share) in enumerate(((58.0, 30.0, 0.55), (110.0, 130.0, 0.85))):
        for side, edge in ((-1.0, low), (1.0, high)):
            rng = yard.stream("woods", rank, int(side))
            for s in np.arange(-40.0, road.length + 900, 112.0):
                roll = rng.random(7)
                if roll[0] > share * openness:
                    continue
                size = yard.size("woods-a") * (0.85 + 0.5 * roll[1], 1.0, 0.55 + 0.6 * roll[2])
                name, turn = f"woods-{'abc'[int(roll[3] * 3)]}", 0.3 * (roll[4] - 0.5)
                _far(
                    yard,
                    name,
                    s + 60 * roll[5],
                    edge + side * (nearest + spread * roll[6]),
                    turn,
                    size,
                    30.0,
                    yard.leaves(float(roll[2]), float(roll[5])),
                )
    for side in (-1.0, 1.0):
        rng = yard.stream("hills", int(side))
        for s in np.arange(0.0, road.length + 1600, 420.0):
            roll = rng.random(6)
            size = yard.size("hill-a") * (0.7 + 0.6 * roll[0], 1.0, (0.3 + 0.9 * roll[1]) * relief)
            d = side * (300 + 450 * roll[2]) * nearness
            _far(
                yard,
                f"hill-{'abc'[int(roll[3] * 3)]}",
                s + 300 * roll[4],
                d,
                0.4 * (roll[5] - 0.5),
                size,
                60.0,
                slope,
            )
    rng = yard.stream("hills", "ahead")
    for i in range(3):
        roll = rng.random(3)
        size = yard.size("hill-a") * (1.2, 1.0, (0.4 + 0.6 * roll[0]) * relief)
        turn = np.pi / 2 + 0.3 * (roll[2] - 0.5)
        _far(
            yard,
            f"hill-{'abc'[i]}",
            road.length + 700 + 250 * i,
            400 * (roll[1] - 0.5),
            turn,
            size,
            60.0,
            slope,
        )


def _far(
    yard: Yard, name: str, s: float, d: float, turn: float, size: Floats, keep: float, colour: Floats
) -> None:
    """Place a far thing, unless any stretch of the road runs within ``keep`` metres of its footprint."""
    end = yard.road.length
    on = min(s, end)
    x, y = (float(a) for a in yard.road.to_world(on, d))
    heading = float(yard.road.heading(on))
    x, y = x + (s - on) * np.cos(heading), y + (s - on) * np.sin(heading)
    yaw = heading + turn
    xs, ys = yard.road.to_world(np.arange(-LEAD_IN, end + 10.0, 10.0), 0.0)
    along = (xs - x) * np.cos(yaw) + (ys - y) * np.sin(yaw)
    aside = (ys - y) * np.cos(yaw) - (xs - x) * np.sin(yaw)
    if ((np.abs(along) < size[0] / 2 + keep) & (np.abs(aside) < size[1] / 2 + keep)).any():
        return
    yard.add_at(name, x, y, yaw, size, colour)
