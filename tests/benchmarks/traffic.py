"""Indexed traffic against stock highway-env: milliseconds a tick and their ratio, measured in one run.

Run with ``python -m tests.benchmarks.traffic``. Both sides start from the same vehicles and are stepped in
turns; their final states are compared, so that a ratio is only ever printed for equal trajectories.
"""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np

from sim.params import RoadParams
from sim.rng import stream
from sim.roads import InCarRoad, build_road
from tests.benchmarks.lines import Line, table

RATE = 30
LEAST = {20: None, 50: None, 100: 4.0}
"""Vehicles, and how many times as fast the indexed road should be with them."""
REPEATS = 5
TICKS = 10
METRES_PER_VEHICLE = 11.0
"""Of the road: 100 vehicles share 1100 m of two lanes each way, as in the shipped scenarios."""


def populate(road: InCarRoad, world: Any, vehicle: Any, count: int, seed: int) -> None:
    """Put ``count`` vehicles on a highway-env road, alternating between the lanes of both directions.

    Args:
        road: The road whose network ``world`` has.
        world: A `highway_env.road.road.Road`, or an indexed one.
        vehicle: The class of its vehicles.
        count: How many.
        seed: Of their places and speeds.
    """
    rng = stream(seed, "benchmark")
    lanes = [(True, 0), (True, 1), (False, 0), (False, 1)]
    step = METRES_PER_VEHICLE * len(lanes)
    for number in range(count):
        same_way, lane_id = lanes[number % len(lanes)]
        s = 20.0 + step * (number // len(lanes)) + rng.uniform(0, 20)
        k = next(k for k, piece in enumerate(road.pieces) if s < piece.end)
        index = (f"f{k}", f"f{k + 1}", lane_id) if same_way else (f"b{k + 1}", f"b{k}", lane_id)
        lane = road.network.get_lane(index)
        piece = road.pieces[k]
        part = (s - piece.start if same_way else piece.end - s) / piece.length
        speed = rng.uniform(18, 26)
        driver = vehicle(
            world,
            lane.position(part * lane.length, 0),
            heading=lane.heading_at(part * lane.length),
            speed=speed,
            target_lane_index=index,
            target_speed=rng.uniform(18, 30),
        )
        world.vehicles.append(driver)


def state(world: Any) -> bytes:
    """Return every vehicle's position, heading and speed, to the last bit."""
    rows = [[*v.position, v.heading, v.speed] for v in world.vehicles]
    return np.array(rows, float).tobytes()


def measure(count: int) -> tuple[float, float]:
    """Return milliseconds a tick of stock highway-env and of the indexed road, medians over repeats.

    Raises:
        RuntimeError: If the two end in different states.
    """
    from highway_env.road.road import Road
    from highway_env.vehicle.behavior import IDMVehicle

    from sim.indexed_road import IndexedRoad
    from sim.quick_vehicle import QuickVehicle

    road = build_road(RoadParams(curved=True), 2000.0, stream(0, "road"))
    worlds = []
    for kind, vehicle in ((Road, IDMVehicle), (IndexedRoad, QuickVehicle)):
        world = kind(
            network=road.network, np_random=stream(0, "np_random"), neighbour_vehicles_connected_lanes=True
        )
        populate(road, world, vehicle, count, seed=1)
        worlds.append(world)
    times: list[list[float]] = [[], []]
    for _ in range(REPEATS):
        for world, record in zip(worlds, times, strict=True):
            start = time.perf_counter()
            for _ in range(TICKS):
                world.act()
                world.step(1 / RATE)
            record.append(1e3 * (time.perf_counter() - start) / TICKS)
    if state(worlds[0]) != state(worlds[1]):
        raise RuntimeError(f"stock and indexed traffic of {count} vehicles came to different states")
    stock, indexed = (statistics.median(record) for record in times)
    return stock, indexed


def main() -> list[Line]:
    """Print the table, and return its ratios."""
    print("traffic: stock highway-env against the indexed road, ms a tick (equal trajectories)")
    print(f"{'vehicles':>9} {'stock':>9} {'indexed':>9} {'ratio':>7}")
    lines = []
    for count, least in LEAST.items():
        stock, indexed = measure(count)
        print(f"{count:>9} {stock:>9.2f} {indexed:>9.2f} {stock / indexed:>7.1f}", flush=True)
        what = f"highway-env / indexed traffic, {count} vehicles"
        lines.append(Line(what=what, measured=stock / indexed, least=least))
    return lines


if __name__ == "__main__":
    print(table(main()))
