"""Speed on the motorcycle lane, as ratios and milliseconds on frames of shipped scenes, the sensor on.

Run with ``python -m tests.benchmarks.lane``. Everything is measured on one core, in one process on one
thread, and then in two processes at once, each on a core of its own: what they share, memory and caches, then
shows.
"""

from __future__ import annotations

import cProfile
import multiprocessing
import os
import pstats
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor

import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios import spec
from scenarios.bridge import tracker_frame, tracker_info
from scenarios.loop import make_scene
from sim.simulation import Simulation
from tests.benchmarks.lines import Line, table
from tracker import registry
from tracker.motorcycle_lane.background import BackgroundModel
from tracker.motorcycle_lane.tracker import MotorcycleLaneTracker
from tracker.types import Frame, Info

SCENARIO = "lane-day"
"""Ten riders in view at the most."""
FRAMES, TRAINED = 200, 60
"""Frames that are rendered, and from which on they count: the models have been trained, all is compiled."""
SEED = 0
SIMULATED = 15.0
"""Milliseconds a frame that world, render, sensor and truth may take in the median."""
MOG2_RATIO = 5.0
RIDDEN = 100.0
"""Frames a second that the tracker should do on one core."""

Images = Sequence[NDArray[np.uint8]]
Numbers = dict[str, float]


def record() -> tuple[Info, list[Frame], Numbers]:
    """Render the beginning of a drive; return what a tracker is given, and median milliseconds by stage.

    ``simulated`` is CPU time of all threads, the stages are by the clock: what else runs slows those down.
    """
    scenario = spec.load(SCENARIO)
    scene = make_scene(scenario, SEED)
    frames, stages, taken = [], [], []
    with Simulation(scene, scenario.params.sensor, seed=SEED) as simulation:
        for _ in range(FRAMES):
            began = time.process_time()
            seen = simulation.step()
            taken.append(1e3 * (time.process_time() - began))
            frames.append(tracker_frame(seen, odometry=False))
            stages.append(seen.timing_ms)
    medians = {name: float(np.median([ms[name] for ms in stages[TRAINED:]])) for name in stages[0]}
    medians = {"simulated": float(np.median(taken[TRAINED:])), **medians}
    return tracker_info(scene.camera, scenario.rate), frames, medians


def cpu_ms(work: Callable[[], object]) -> float:
    """Return the milliseconds of this thread's CPU time that ``work`` takes."""
    began = time.thread_time()
    work()
    return 1e3 * (time.thread_time() - began)


def models(info: Info, images: Images) -> Numbers:
    """Return the median milliseconds a frame of our background model and of MOG2, frame by frame in turns."""
    ours, mog2 = BackgroundModel(info.width, info.height), cv2.createBackgroundSubtractorMOG2()
    taken = [
        (cpu_ms(lambda image=image: ours.apply(image)), cpu_ms(lambda image=image: mog2.apply(image)))
        for image in images
    ]
    first, second = np.median(taken[TRAINED:], axis=0)
    return {"ours": float(first), "MOG2": float(second)}


def steps(info: Info, frames: Sequence[Frame]) -> float:
    """Return the tracker's mean milliseconds a frame."""
    tracker = registry.make("motorcycle-lane")
    tracker.start(info)
    taken = [cpu_ms(lambda frame=frame: tracker.step(frame)) for frame in frames]
    return float(np.mean(taken[TRAINED:]))


def shares(info: Info, frames: Sequence[Frame]) -> Numbers:
    """Return the mean milliseconds of what a step calls; the profiler adds to what calls much."""
    tracker = MotorcycleLaneTracker()
    tracker.start(info)
    for frame in frames[:TRAINED]:
        tracker.step(frame)
    profiler = cProfile.Profile(time.thread_time)
    profiler.enable()
    for frame in frames[TRAINED:]:
        tracker.step(frame)
    profiler.disable()
    code = MotorcycleLaneTracker.step.__code__
    caller = (code.co_filename, code.co_firstlineno, code.co_name)
    found: Numbers = {}
    for (path, _, name), row in pstats.Stats(profiler).stats.items():  # type: ignore[attr-defined]
        if caller in row[4]:
            stage = f"{path.rsplit('/', 1)[-1].removesuffix('.py')}.{name.strip('_')}"
            found[stage] = found.get(stage, 0.0) + 1e3 * row[4][caller][3] / len(frames[TRAINED:])
    return found


def measure() -> tuple[Numbers, Numbers]:
    """Measure everything in this process on one thread: milliseconds a frame, and the tracker's stages."""
    cv2.setNumThreads(1)
    info, frames, simulated = record()
    images = [frame.image for frame in frames]
    track = steps(info, frames)
    found = {**simulated, "track": track, **models(info, images)}
    return found, shares(info, frames)


def in_processes(count: int) -> list[tuple[Numbers, Numbers]]:
    """Run `measure` in so many processes at once, each with one thread to draw with."""
    os.environ["LP_NUM_THREADS"] = "1"  # Mesa's; spawned processes read it before they draw
    with ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn")) as pool:
        return [job.result() for job in [pool.submit(measure) for _ in range(count)]]


def main() -> list[Line]:
    """Print milliseconds a frame, and return speeds and ratios on one core and on two."""
    lines = []
    for count, cores in ((1, "one core"), (2, "two cores")):
        measured = in_processes(count)
        found = {name: float(np.mean([numbers[name] for numbers, _ in measured])) for name in measured[0][0]}
        print(f"{SCENARIO}, {cores}: " + ", ".join(f"{name} {ms:.2f} ms" for name, ms in found.items()))
        stages = measured[0][1]
        whole = sum(stages.values())
        for stage, ms in sorted(stages.items(), key=lambda item: -item[1])[:8]:
            print(f"  {stage:28} {ms:6.2f} ms  {ms / whole:4.0%}")
        ratio, fps = found["ours"] / found["MOG2"], count * 1e3 / found["track"]
        lines += [
            Line(what=f"background model / MOG2, {SCENARIO}, {cores}", measured=ratio, most=MOG2_RATIO),
            Line(
                what=f"lane tracker, frames a second, ten riders, {cores}",
                measured=fps,
                least=RIDDEN if count == 1 else None,
            ),
            Line(
                what=f"world, render, sensor and truth, ms a frame, {SCENARIO}, {cores}",
                measured=found["simulated"],
                most=SIMULATED if count == 1 else None,
            ),
            Line(
                what=f"whole loop, ms a frame and process, {SCENARIO}, {cores}",
                measured=found["simulated"] + found["track"],
            ),
        ]
    return lines


if __name__ == "__main__":
    print(table(main()))
