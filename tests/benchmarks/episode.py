"""The whole loop: frames a second and shares of the stages, and memory over a drive.

Run with ``python -m tests.benchmarks.episode``; ``--long`` drives ten minutes and prints the memory as it
goes.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from resource import getpagesize

import numpy as np

from scenarios import spec
from scenarios.bridge import tracker_frame, tracker_info
from scenarios.loop import run_episode
from sim.scenes.in_car import InCarScene
from sim.simulation import Simulation
from tests.benchmarks.lines import Line, table
from tracker import registry

TRACKER = "in-car"
SCENARIOS = {"in-car-day": 20.0, "in-car-urban": None}
"""What is driven, and the frames a second that are wanted."""
WARM = 30
"""Frames from the first that do not count."""
SIMULATED = 28.0
"""Milliseconds a frame that world, render, sensor and truth may take in the median."""
FLAT = 1.05
"""Memory at the end of a drive, as a multiple of what it was when everything was in place, at most."""


def drive(name: str) -> tuple[float, dict[str, float]]:
    """Run the loop as `testtrack run` does; return frames a second and each stage's median milliseconds."""
    shown: list[float] = []
    (log,) = run_episode(
        spec.load(name),
        0,
        {TRACKER: registry.make(TRACKER)},
        on_frame=lambda *_: shown.append(time.perf_counter()),
    )
    frames = len(shown) - 1 - WARM
    medians = {stage: float(np.median(ms[WARM:])) for stage, ms in log.timing_ms.items()}
    return frames / (shown[-1] - shown[WARM]), medians


def memory_over(minutes: float, name: str = "in-car-day") -> list[float]:
    """Drive that long with the tracker, printing and returning the resident MB twenty times, evenly spaced.

    What is logged for the scores is left out: it grows with the drive, because it is what is asked for.
    """
    scenario = spec.load(name)
    frames = round(60 * minutes * scenario.rate)
    scene = InCarScene(scenario.params, seed=0, rate=scenario.rate, seconds=60 * minutes)
    tracker = registry.make(TRACKER)
    tracker.start(tracker_info(scene.camera, scenario.rate))
    resident = []
    with Simulation(scene, scenario.params.sensor, seed=0) as simulation:
        for observation in simulation.run(frames):
            tracker.step(tracker_frame(observation, odometry=False))
            if (observation.tick + 1) % (frames // 20) == 0:
                resident.append(resident_mb())
                print(f"  {observation.time / 60:5.1f} min  {resident[-1]:6.0f} MB resident", flush=True)
    return resident


def resident_mb() -> float:
    """Resident memory of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * getpagesize() / 2**20


def main(argv: list[str] | None = None) -> list[Line]:
    """Print what the loop costs, and return its speed and whether its memory stays flat."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--long", action="store_true", help="drive ten minutes instead of one")
    minutes = 10.0 if parser.parse_args(argv or []).long else 1.0
    lines = []
    for name, least in SCENARIOS.items():
        fps, medians = drive(name)
        whole = sum(medians.values())
        print(f"{name}: {whole:.1f} ms a frame, of which")
        for stage, ms in medians.items():
            print(f"  {stage:7} {ms:6.1f} ms  {ms / whole:4.0%}")
        lines.append(Line(what=f"whole loop, frames a second, {name}", measured=fps, least=least))
        what = f"world, render, sensor and truth, ms a frame, {name}"
        lines.append(Line(what=what, measured=whole - medians["track"], most=SIMULATED))
    resident = memory_over(minutes)
    what = f"memory after {minutes:g} min / after a tenth of it"
    lines.append(Line(what="peak memory, MB", measured=max(resident)))
    return [*lines, Line(what=what, measured=resident[-1] / resident[1], most=FLAT)]


if __name__ == "__main__":
    print(table(main(sys.argv[1:])))
