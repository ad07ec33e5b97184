"""How well the aerial tracker knows where its camera looks, on rendered drives whose homographies are known.

``python -m tests.validation.stabilisation [--seeds A:B] [--seconds S] [SCENARIO ...]`` prints, scene by
scene, medians and 95 % quantiles of the distance between where points of the ground are and where they lie,
px: on the mosaic of the whole episode, and on a picture of two seconds before, which re-acquisition rests on.
"""

from __future__ import annotations

import argparse

import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios import spec
from sim.camera import ground_homography
from sim.scenes import make_scene
from sim.simulation import Simulation
from tracker.aerial.stabilisation import Stabiliser, inverse, transform

Floats = NDArray[np.float64]

SCENARIOS = ("aerial-bridge", "aerial-bridges", "aerial-intersection", "aerial-convoy", "aerial-winding")
GRID = np.stack(np.meshgrid(np.linspace(0.1, 0.9, 5), np.linspace(0.1, 0.9, 5)), axis=-1).reshape(-1, 2)
"""Points of a picture, in widths and heights, at which errors are taken."""
BACK = 60
"""Frames between the two pictures of the short errors."""


def homographies(name: str, seed: int, seconds: float) -> tuple[list[Floats], list[Floats], Floats]:
    """Drive; return homographies (3, 3) to the first picture, true and estimated, and the grid, px."""
    scenario = spec.load(name)
    scene = make_scene(scenario.params, seed=seed, rate=scenario.rate, seconds=seconds)
    stabiliser = Stabiliser()
    true, estimated = [], []
    with Simulation(scene, scenario.params.sensor, seed=seed) as simulation:
        for seen in simulation.run(round(seconds * scenario.rate)):
            true.append(inverse(ground_homography(scene.camera, seen.pose)))
            estimated.append(stabiliser.step(cv2.cvtColor(seen.image, cv2.COLOR_RGB2GRAY)))
    first = inverse(true[0])
    return [first @ back for back in true], estimated, GRID * seen.image.shape[1::-1]


def errors(true: list[Floats], estimated: list[Floats], grid: Floats) -> tuple[Floats, Floats]:
    """Return the errors of each frame's grid on the mosaic, and on the picture `BACK` frames before, px."""

    def apart(k: int, since: int) -> Floats:
        there = [transform(inverse(way[since]) @ way[k], grid) for way in (true, estimated)]
        return np.asarray(np.hypot(*(there[0] - there[1]).T))

    return (
        np.array([apart(k, 0) for k in range(1, len(true))]),
        np.array([apart(k, k - BACK) for k in range(BACK, len(true))]),
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenarios", nargs="*", default=SCENARIOS, metavar="SCENARIO")
    parser.add_argument("--seeds", default="600:602", help="A:B, half open")
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    first, last = (int(part) for part in options.seeds.split(":"))
    print(f"{'scene':24}{'seed':>6}{'mosaic: median':>16}{'95 %':>8}{'2 s: median':>14}{'95 %':>8}   px")
    for name in options.scenarios:
        for seed in range(first, last):
            whole, short = errors(*homographies(name, seed, options.seconds))
            numbers = [f"{q:.2f}" for part in (whole, short) for q in np.quantile(part, [0.5, 0.95])]
            print(
                f"{name:24}{seed:6}{numbers[0]:>16}{numbers[1]:>8}{numbers[2]:>14}{numbers[3]:>8}", flush=True
            )


if __name__ == "__main__":
    main()
