"""Speed of the in-car tracker on one core, and where its time goes, on frames of shipped scenarios.

Run with ``python -m tests.benchmarks.tracker``. The frames are rendered once, with the sensor on, and kept.
"""

from __future__ import annotations

import cProfile
import pstats
import time

import cv2
import numpy as np

from scenarios import spec
from scenarios.bridge import tracker_frame, tracker_info
from sim.scenes.in_car import InCarScene
from sim.simulation import Simulation
from tests.benchmarks.lines import Line, table
from tracker.in_car.tracker import InCarTracker
from tracker.types import Frame, Info

SCENARIOS = ("in-car-day", "in-car-urban")
FRAMES = 120
WARM = 30
"""Frames from the first that do not count: the tracker compiles, and has yet to find anything."""


def record(scenario_name: str) -> tuple[Info, list[Frame]]:
    """Render the beginning of a scenario's drive of seed 0; return what the tracker is given."""
    scenario = spec.load(scenario_name)
    scene = InCarScene(scenario.params, seed=0, rate=scenario.rate, seconds=scenario.seconds)
    with Simulation(scene, scenario.params.sensor, seed=0) as simulation:
        frames = [tracker_frame(seen, odometry=False) for seen in simulation.run(WARM + FRAMES)]
    return tracker_info(scene.camera, scenario.rate), frames


def measure(info: Info, frames: list[Frame]) -> tuple[list[float], dict[str, float]]:
    """Return each step's milliseconds (CPU time of the one thread), and the mean by what it calls.

    The latter under the profiler, which adds to what calls much.
    """
    cv2.setNumThreads(1)
    tracker = InCarTracker()
    tracker.start(info)
    taken = []
    for frame in frames:
        began = time.thread_time()
        tracker.step(frame)
        taken.append(1e3 * (time.thread_time() - began))
    tracker.start(info)
    for frame in frames[:WARM]:
        tracker.step(frame)
    profiler = cProfile.Profile(time.thread_time)
    profiler.enable()
    for frame in frames[WARM:]:
        tracker.step(frame)
    profiler.disable()
    stages = {}
    step = InCarTracker.step.__code__
    caller = (step.co_filename, step.co_firstlineno, step.co_name)
    for (path, _, name), row in pstats.Stats(profiler).stats.items():  # type: ignore[attr-defined]
        if caller in row[4]:
            spent = 1e3 * row[4][caller][3] / len(frames[WARM:])
            stage = f"{path.rsplit('/', 1)[-1].removesuffix('.py')}.{name}"
            stages[stage] = stages.get(stage, 0.0) + spent
    return taken[WARM:], stages


def main() -> list[Line]:
    """Print the stages, and return the tracker's speed."""
    lines = []
    for name in SCENARIOS:
        taken, stages = measure(*record(name))
        mean, median = np.mean(taken), np.median(taken)
        print(f"{name}: {mean:.2f} ms a frame, {median:.2f} in the median; by stage, under the profiler:")
        for stage, ms in sorted(stages.items(), key=lambda item: -item[1])[:12]:
            print(f"  {stage:32} {ms:6.2f} ms")
        what = f"in-car tracker on one core, frames a second, {name}"
        lines.append(Line(what=what, measured=float(1e3 / mean), least=120.0))
    return lines


if __name__ == "__main__":
    print(table(main()))
