"""Speed of the background model beside MOG2 and KNN, 360 x 240, one thread; and masks against the truth."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.lines import Line, table
from tracker.motorcycle_lane.background import PAPER, BackgroundModel
from tracker.motorcycle_lane.blobs import clean

WIDTH, HEIGHT, FRAMES, SKIPPED = 360, 240, 200, 60
NOISE = 4.0
SHADOWED = 127

Mask = NDArray[np.bool_]


def traffic(seed: int = 0, count: int = 10) -> Iterator[tuple[NDArray[np.uint8], Mask]]:
    """Draw frames (H, W, 3) and their true foreground: ellipses on texture, with noise, in changing light."""
    rng = np.random.default_rng(seed)
    texture = cv2.GaussianBlur(rng.integers(60, 160, (HEIGHT, WIDTH, 3), np.uint8), (0, 0), 2.0)
    ground = np.clip(3.0 * (texture.astype(float) - 110.0) + 110.0, 20, 235)
    places, colours = rng.uniform(0, [WIDTH, HEIGHT], (count, 2)), rng.integers(0, 256, (count, 3))
    speeds, sizes = rng.uniform([-1, 1.5], [1, 4], (count, 2)), rng.integers(8, 22, count)
    for t in range(FRAMES):
        picture, mask = ground * (1.0 + 0.15 * np.sin(t / 40.0)), np.zeros((HEIGHT, WIDTH), np.uint8)
        for place, speed, colour, size in zip(places, speeds, colours, sizes, strict=True):
            at = tuple(int(v) for v in (place + speed * t) % (WIDTH, HEIGHT))
            axes = (int(0.6 * size), int(size))
            cv2.ellipse(picture, at, axes, 0, 0, 360, colour.tolist(), -1)
            cv2.ellipse(mask, at, axes, 0, 0, 360, 1, -1)
        noisy = picture + rng.normal(0, NOISE, picture.shape)
        yield np.clip(noisy, 0, 255).astype(np.uint8), mask > 0


def measure(
    frames: list[tuple[NDArray[np.uint8], Mask]], apply: Callable[[NDArray[np.uint8]], Mask]
) -> tuple[float, float]:
    """Return the median milliseconds of a frame, and F of the cleaned masks."""
    taken, both, total = [], 0, 0
    for tick, (image, truth) in enumerate(frames):
        began = time.thread_time()
        mask = apply(image)
        if tick >= SKIPPED:
            taken.append(time.thread_time() - began)
            found = clean(mask)
            both += int((found & truth).sum())
            total += int(found.sum() + truth.sum())
    return float(np.median(taken)) * 1e3, 2 * both / total


def main() -> list[Line]:
    """Print times and F, and return our time over MOG2's."""
    cv2.setNumThreads(1)
    frames = list(traffic())
    BackgroundModel(WIDTH, HEIGHT).apply(frames[0][0])
    mog2, knn = cv2.createBackgroundSubtractorMOG2(), cv2.createBackgroundSubtractorKNN()
    methods: dict[str, Callable[[NDArray[np.uint8]], Mask]] = {
        "MOG2": lambda image: mog2.apply(image) > SHADOWED,
        "KNN": lambda image: knn.apply(image) > SHADOWED,
        "ours": BackgroundModel(WIDTH, HEIGHT).apply,
        "ours, as printed": BackgroundModel(WIDTH, HEIGHT, PAPER).apply,
    }
    found = {name: measure(frames, apply) for name, apply in methods.items()}
    for name, (taken, f) in found.items():
        print(f"{name:16} {taken:6.2f} ms, F {f:.3f}")
    ratio = found["ours"][0] / found["MOG2"][0]
    return [Line(what="background model / MOG2, drawn traffic, 360 x 240", measured=ratio, most=5.0)]


if __name__ == "__main__":
    print(table(main()))
