"""Speed of the in-car tracker at 640 x 480 on one core, and where its time goes."""

from __future__ import annotations

import cProfile
import pstats
import time

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.in_car.tracker import InCarTracker
from tracker.types import Frame, Info, Intrinsics

WIDTH, HEIGHT, FOCAL, CAMERA_HEIGHT, RATE = 640, 480, 800.0, 1.2, 30
STAGES = {
    "follow": "points: optical flow",
    "refill": "points: new corners",
    "rotate": "yaw",
    "learn": "focus and ground",
    "motion_evidence": "evidence",
    "stiffness": "stiffness",
    "look": "segments and lamps",
    "trace": "profiles and traces",
    "step": "whole step",
}


def drive(frames: int, seed: int = 0) -> list[NDArray[np.uint8]]:
    """Draw a plain drive: a road of random grain that flows, scenery, and three cars ahead.

    (H, W, 3) each.
    """
    rng = np.random.default_rng(seed)
    grain = cv2.GaussianBlur(rng.integers(70, 130, (4096, 512), np.uint8), (0, 0), 1.2)
    posts = np.stack([rng.choice([-7.0, 7.0], 60), rng.uniform(5, 500, 60)], 1)
    rows = np.arange(HEIGHT)[:, None]
    columns = np.arange(WIDTH)[None]
    depth = FOCAL * CAMERA_HEIGHT / np.maximum(rows - HEIGHT / 2 + 0.5, 0.5)
    across = (columns - WIDTH / 2) * depth / FOCAL
    pictures = []
    for tick in range(frames):
        travelled = 20.0 * tick / RATE
        along = ((depth + travelled) * 20).astype(int) % grain.shape[0]
        road = grain[np.broadcast_to(along, across.shape), (across * 20).astype(int) % grain.shape[1]]
        image = np.where(rows > HEIGHT / 2, road, 190).astype(np.uint8)
        for x, z in posts[np.argsort(-posts[:, 1])]:
            z -= travelled
            if z > 3.0:
                place, size = WIDTH / 2 + FOCAL * x / z, FOCAL / z
                foot = HEIGHT / 2 + CAMERA_HEIGHT * size
                cv2.rectangle(
                    image,
                    (int(place - 0.2 * size), int(foot - 3 * size)),
                    (int(place + 0.2 * size), int(foot)),
                    60,
                    -1,
                )
        for x, z, shade in ((0.5, 40.0, 160), (-3.5, 25.0, 50), (3.2, 30.0, 210)):
            size, foot = FOCAL / z, HEIGHT / 2 + CAMERA_HEIGHT * FOCAL / z
            left, right = WIDTH / 2 + (x - 0.9) * size, WIDTH / 2 + (x + 0.9) * size
            cv2.rectangle(
                image, (int(left), int(foot - 1.4 * size)), (int(right), int(foot - 0.2 * size)), shade, -1
            )
            cv2.rectangle(
                image,
                (int(left + 0.2 * size), int(foot - 1.3 * size)),
                (int(right - 0.2 * size), int(foot - 0.8 * size)),
                30,
                -1,
            )
            cv2.rectangle(image, (int(left), int(foot - 0.2 * size)), (int(right), int(foot)), 20, -1)
        noisy = np.clip(image + rng.normal(0, 1.5, image.shape), 0, 255).astype(np.uint8)
        pictures.append(np.repeat(noisy[..., None], 3, 2))
    return pictures


def measure(pictures: list[NDArray[np.uint8]]) -> tuple[float, dict[str, float]]:
    """Return the median milliseconds of a step (CPU time of one thread), and the mean by stage."""
    cv2.setNumThreads(1)
    info = Info(
        width=WIDTH, height=HEIGHT, rate=RATE, intrinsics=Intrinsics(focal=FOCAL, cx=WIDTH / 2, cy=HEIGHT / 2)
    )
    frames = [Frame(image=image, tick=tick, time=tick / RATE) for tick, image in enumerate(pictures)]
    tracker = InCarTracker()
    tracker.start(info)
    for frame in frames[:5]:
        tracker.step(frame)
    tracker.start(info)
    taken = []
    for frame in frames:
        began = time.thread_time()
        tracker.step(frame)
        taken.append(time.thread_time() - began)
    tracker.start(info)
    profiler = cProfile.Profile(time.thread_time)
    profiler.enable()
    for frame in frames:
        tracker.step(frame)
    profiler.disable()
    stages: dict[str, float] = {}
    for (path, _, name), numbers in pstats.Stats(profiler).stats.items():  # type: ignore[attr-defined]
        if name in STAGES and "in_car" in path and not (name == "step" and "tracker.py" not in path):
            stages[STAGES[name]] = numbers[3] / len(frames) * 1e3
    return float(np.median(taken) * 1e3), stages


def main() -> None:
    """Print the tracker's speed."""
    median, stages = measure(drive(90))
    print(f"in-car tracker: {median:.2f} ms a frame, {1000 / median:.0f} frames a second on one core")
    for name, mean in sorted(stages.items(), key=lambda item: -item[1]):
        print(f"  {name:24} {mean:6.2f} ms (under the profiler)")


if __name__ == "__main__":
    main()
