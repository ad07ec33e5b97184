"""The whole loop: frames a second by stage on the shipped scenario, and memory over a ten-minute drive."""

from __future__ import annotations

import argparse
import resource
import statistics
import time

from scenarios import spec
from scenarios.bridge import tracker_frame, tracker_info
from sim.scenes.in_car import InCarScene
from sim.simulation import Simulation
from tracker import registry


def drive(
    scenario_name: str, frames: int, seconds: float, report_every: int | None = None
) -> dict[str, float]:
    """Simulate and track; return the median milliseconds a frame by stage, and the frames a second."""
    scenario = spec.load(scenario_name, ())
    scene = InCarScene(scenario.in_car, seed=0, rate=scenario.rate, seconds=seconds)
    tracker = registry.make("in-car")
    laps: dict[str, list[float]] = {}
    with Simulation(scene, scenario.in_car.sensor, seed=0) as simulation:
        tracker.start(tracker_info(scene.camera, scenario.rate))
        started = time.perf_counter()
        for observation in simulation.run(frames):
            before = time.perf_counter()
            tracker.step(tracker_frame(observation, odometry=False))
            for stage, ms in observation.timing_ms.items():
                laps.setdefault(stage, []).append(ms)
            laps.setdefault("track", []).append(1e3 * (time.perf_counter() - before))
            if report_every and (observation.tick + 1) % report_every == 0:
                print(f"  {observation.time / 60:5.1f} min  peak {peak_rss_mb():6.0f} MB", flush=True)
        elapsed = time.perf_counter() - started
    return {stage: statistics.median(ms) for stage, ms in laps.items()} | {"fps": frames / elapsed}


def peak_rss_mb() -> float:
    """Peak resident memory of this process, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main(argv: list[str] | None = None) -> None:
    """Print the stages' cost; with ``--long``, drive ten minutes and print the peak memory as it goes."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--long", action="store_true")
    arguments = parser.parse_args(argv or [])
    drive("in-car-day", 30, 20.0)  # compiles
    result = drive("in-car-day", 300, 20.0)
    print(
        "  ".join(f"{stage} {value:.1f}" for stage, value in result.items()), "(ms a frame; fps of the loop)"
    )
    print(f"peak memory {peak_rss_mb():.0f} MB")
    if arguments.long:
        drive("in-car-day", 18000, 600.0, report_every=1800)


if __name__ == "__main__":
    import sys

    main(sys.argv[1:])
