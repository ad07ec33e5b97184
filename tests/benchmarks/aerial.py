"""Speed of the aerial scene and its tracker: the search for predictors, frames a second, the whole loop.

Run with ``python -m tests.benchmarks.aerial``.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor

import cv2
import numpy as np

from scenarios import spec
from scenarios.bridge import tracker_frame, tracker_info
from scenarios.loop import make_scene
from sim.simulation import Simulation
from tests.benchmarks.lane import cpu_ms
from tests.benchmarks.lines import Line, table
from tracker import registry
from tracker.aerial import lyapunov
from tracker.aerial.forecasts import WINDOW
from tracker.aerial.motion_context import ContextParameters

TRACKS, POINTS, ROWS = 1000, 1000, 5
"""Tracks and points of each that are searched, and how many of the tracks the plain loop goes through."""
SCENARIO, FRAMES, WARM = "aerial-bridge", 120, 30
"""What is tracked, for how many frames, and from which on they count."""
STAGES = ("world", "render", "sensor", "truth", "track")
SEED = 0
REPEATS = 5

Numbers = dict[str, float]


def searches() -> tuple[float, float]:
    """Return median milliseconds of the search of all tracks, and of the plain loop over as many."""
    rng = np.random.default_rng(SEED)
    angles = rng.uniform(-np.pi, np.pi, (TRACKS, 1)) + np.cumsum(rng.normal(0, 0.02, (TRACKS, POINTS)), 1)
    steps = rng.uniform(1, 5, (TRACKS, 1, 1)) * np.stack([np.cos(angles), np.sin(angles)], -1)
    points = rng.uniform(0, 640, (TRACKS, 1, 2)) + np.cumsum(steps, 1)
    path = points[0, :WINDOW] + rng.normal(0, 0.7, (WINDOW, 2))
    p = ContextParameters()
    most = lyapunov.distance(WINDOW, p.start, lyapunov.threshold(WINDOW, p.start, p.most))

    def search(count: int) -> object:
        counts = np.full(count, POINTS)
        return lyapunov.search(points[:count], counts, path, most, p.reach, p.path * most, p.nearness)

    def plain() -> None:
        for track in points[:ROWS]:
            for end in range(WINDOW, POINTS + 1):
                lyapunov.exponent(path, track[end - WINDOW : end], p.start)

    search(1)  # compiles
    ours = np.median([cpu_ms(lambda: search(TRACKS)) for _ in range(REPEATS)])
    theirs = np.median([cpu_ms(plain) for _ in range(REPEATS)]) * TRACKS / ROWS
    return float(ours), float(theirs)


def drive() -> Numbers:
    """Render and track the beginning of a flight on one thread.

    Returns:
        Medians: ``simulated`` and ``track``, milliseconds of CPU time a frame; the stages of the former, by
        the clock; ``vehicles`` in the world, and ``in view``.
    """
    cv2.setNumThreads(1)
    scenario = spec.load(SCENARIO)
    scene, tracker = make_scene(scenario, SEED), registry.make("aerial")
    tracker.start(tracker_info(scene.camera, scenario.rate))
    rows: list[Numbers] = []
    with Simulation(scene, scenario.params.sensor, seed=SEED) as simulation:
        for _ in range(FRAMES):
            began = time.process_time()
            seen = simulation.step()
            simulated = 1e3 * (time.process_time() - began)
            frame = tracker_frame(seen, odometry=False)
            rows.append(
                {
                    "vehicles": float(len(seen.state.vehicles.ids)),
                    "in view": float((seen.truth.visible >= 0.3).sum()),
                    "simulated": simulated,
                    **seen.timing_ms,
                    "track": cpu_ms(lambda frame=frame: tracker.step(frame)),
                }
            )
    return {name: float(np.median([row[name] for row in rows[WARM:]])) for name in rows[0]}


def in_a_process() -> Numbers:
    """Run `drive` in a process of its own, with one thread to draw with."""
    os.environ["LP_NUM_THREADS"] = "1"  # Mesa's; the spawned process reads it before it draws
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(drive).result()


def main() -> list[Line]:
    """Print stages, and return speeds on one core."""
    cv2.setNumThreads(1)
    ours, plain = searches()
    print(f"search of {TRACKS} tracks, {POINTS} points each: {ours:.1f} ms, plain loop {plain:.0f} ms")
    found = in_a_process()
    whole = sum(found[stage] for stage in STAGES)
    there = f"{found['vehicles']:.0f} vehicles, {found['in view']:.0f} of them in view"
    print(f"{SCENARIO}, {there}:")
    print(", ".join(f"{stage} {found[stage]:.1f} ms ({found[stage] / whole:.0%})" for stage in STAGES))
    return [
        Line(what="predictor search, 1000 tracks of 1000 points, ms", measured=ours, most=20.0),
        Line(what="predictor search, times as fast as a plain loop", measured=plain / ours),
        Line(
            what=f"aerial tracker, frames a second, {found['in view']:.0f} vehicles in view, one core",
            measured=1e3 / found["track"],
            least=40.0,
        ),
        Line(
            what=f"aerial, {there}: rendered and tracked, frames a second",
            measured=1e3 / (found["simulated"] + found["track"]),
            least=12.0,
        ),
    ]


if __name__ == "__main__":
    print(table(main()))
