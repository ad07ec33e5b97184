"""Cars parked at the kerbs."""

from __future__ import annotations

import numpy as np

from sim.fleet import Fleet
from sim.roads import InCarRoad
from sim.world import Bodies, Role

CLEARANCE = 0.35
"""Metres between the outermost lane's edge and a parked car."""
SHORTEST_GAP = 0.9
"""Metres between two parked cars."""


def park(
    road: InCarRoad, fleet: Fleet, per_km: float, first_id: int, rng: np.random.Generator
) -> tuple[Bodies, list[float]]:
    """Park cars on the right of both directions, beside the lanes and never in them.

    Args:
        road: The road.
        fleet: Draws the cars.
        per_km: Cars per kilometre of kerb. Where that leaves no gaps, they stand bumper to bumper.
        first_id: Their ids count up from here.
        rng: Draws places and cars.

    Returns:
        The cars by ascending s, and their s, metres.
    """
    edges = {
        same_way: road.params.median / 2
        + (road.params.lanes if same_way else road.params.oncoming_lanes) * road.params.lane_width
        for same_way in (True, False)
    }
    rows = []
    for same_way in (True, False):
        s = road.pieces[0].start
        while per_km > 0 and (same_way or road.params.oncoming_lanes):
            draw = fleet.draw(rng, light=True)
            length, width, _ = draw.size
            s += (
                length
                + SHORTEST_GAP
                + float(rng.exponential(max(1000 / per_km - length - SHORTEST_GAP, 0.0)))
            )
            if s > road.length - length:
                break
            d = edges[same_way] + CLEARANCE + width / 2 + float(rng.uniform(0.0, 0.15))
            turn = float(rng.normal(0.0, 0.012)) + (0.0 if same_way else np.pi)
            rows.append((s - length / 2, -d if same_way else d, turn, draw))
    if not rows:
        return Bodies.empty(), []
    rows.sort(key=lambda row: row[0])
    s_all = np.array([row[0] for row in rows])
    x, y = road.to_world(s_all, np.array([row[1] for row in rows]))
    draws = [row[3] for row in rows]
    count = len(rows)
    bodies = Bodies(
        ids=np.arange(first_id, first_id + count, dtype=np.uint32),
        kinds=np.array([d.kind for d in draws], np.uint8),
        roles=np.full(count, Role.PARKED, np.uint8),
        models=np.array([d.model for d in draws], np.int32),
        positions=np.column_stack([x, y, np.zeros(count)]),
        yaws=road.heading(s_all) + np.array([row[2] for row in rows]),
        velocities=np.zeros((count, 3)),
        sizes=np.array([d.size for d in draws], float),
        colours=np.array([d.colour for d in draws], np.float32),
        lamps=np.zeros(count, np.uint8),
        leans=np.zeros((count, 2)),
    )
    return bodies, s_all.tolist()
