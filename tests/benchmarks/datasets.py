"""Datasets: frames a second that `testtrack generate` writes, at one and at two jobs, scene by scene.

Run with ``python -m tests.benchmarks.datasets [--seconds S] [--cluster ADDRESS]``; a cluster takes the place
of the jobs. What starts the processes and populates the worlds is part of it: the longer the drives, the
less it weighs.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from scenarios import spec
from scenarios.dataset import Dataset
from scenarios.generate import generate
from scenarios.workers import open_workers
from tests.benchmarks.lines import Line, table

SCENARIOS = ("in-car-day", "aerial-bridge", "lane-day")
SEEDS = range(500, 504)
"""Four drives: as many for each of two jobs."""


def write(name: str, seconds: float, jobs: int, cluster: str | None) -> float:
    """Write a dataset in the layout of MOTChallenge, with lossless pictures; return frames a second."""
    dataset = Dataset(scenario=spec.load(name, [f"seconds={seconds}"]), seeds=SEEDS, format="mot")
    with tempfile.TemporaryDirectory() as folder, open_workers(jobs, cluster) as workers:
        began = time.perf_counter()
        document = generate(dataset, Path(folder) / "set", workers)
        return float(document["frames"] / (time.perf_counter() - began))


def main(argv: list[str] | None = None) -> list[Line]:
    """Write one dataset a scenario and number of jobs, and return their speeds."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=5.0, help="length of a drive")
    parser.add_argument("--cluster", metavar="ADDRESS", help="of a Dask scheduler on this machine")
    chosen = parser.parse_args(argv or [])
    who = {"cluster": 1} if chosen.cluster else {"1 job": 1, "2 jobs": 2}
    lines = []
    for name in SCENARIOS:
        for workers, jobs in who.items():
            speed = write(name, chosen.seconds, jobs, chosen.cluster)
            lines.append(Line(what=f"generate, frames a second, {name}, {workers}", measured=speed))
            print(table(lines[-1:]), flush=True)
    return lines


if __name__ == "__main__":
    main(sys.argv[1:])
