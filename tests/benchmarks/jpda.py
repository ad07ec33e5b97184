"""Speed of exact association probabilities: beside PyEHM's EHM2 where it is installed, and by targets.

PyEHM is no dependency of the project (its licence); ``pip install pyehm`` for the comparison,
which then takes four minutes and 2.3 GB for the larger problem.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.lines import Line, table
from tracker.filtering import jpda, planar

Floats = NDArray[np.float64]

DENSE = ((10, 20), (15, 20))
SPARSE = (5, 10, 20, 30, 40, 60)


def dense(targets: int, measured: int, seed: int = 0) -> Floats:
    """Draw weights (N, M + 1) of which none is zero."""
    rng = np.random.default_rng(seed)
    return np.concatenate([np.full((targets, 1), 0.1), rng.uniform(0.01, 5.0, (targets, measured))], 1)


def lane(targets: int, seed: int) -> Floats:
    """Draw weights of riders in a lane: a stream of them, one measurement each, little clutter."""
    rng = np.random.default_rng(seed)
    places = np.stack([rng.uniform(0, 100.0, targets), rng.uniform(0, 20.0 * targets, targets)], 1)
    mean = np.insert(places, [1, 2], 0.0, axis=1)
    covariance = np.tile(np.diag([16.0, 25.0, 16.0, 25.0]), (targets, 1, 1))
    clutter = rng.uniform(0, [100.0, 20.0 * targets], (targets // 4, 2))
    measured = np.concatenate([places + rng.normal(0, 4.0, places.shape), clutter])
    found = jpda.innovations(mean, covariance, measured, planar.POSITION, 4.0 * np.eye(2))
    return jpda.likelihoods(found, detection=0.95, gate=0.99, clutter=1e-4)


def seconds(work: Callable[[], object], times: int) -> float:
    """Return the median CPU time of one thread."""
    taken = []
    for _ in range(times):
        began = time.thread_time()
        work()
        taken.append(time.thread_time() - began)
    return float(np.median(taken))


def main() -> list[Line]:
    """Print both comparisons; return how much faster than EHM2 it is, and how equal, where that is here."""
    lines = []
    try:
        from pyehm.core import EHM2
    except ImportError:
        EHM2 = None
        print("pyehm is not installed: no comparison")
    jpda.associate(dense(2, 2))
    for targets, measured in DENSE:
        weights = dense(targets, measured)
        ours = seconds(lambda weights=weights: jpda.associate(weights), 9)
        print(f"dense {targets} x {measured}: {ours * 1e3:8.2f} ms")
        if EHM2 is None:
            continue
        began = time.thread_time()
        theirs = EHM2().run(np.ones(weights.shape, int), weights)
        taken = time.thread_time() - began
        error = np.abs(theirs - jpda.associate(weights).beta).max()
        print(f"  EHM2 {taken * 1e3:.0f} ms; largest difference {error:.1e}")
        size = f"dense {targets} x {measured}"
        lines.append(Line(what=f"EHM2 / JPDA, {size}", measured=taken / ours, least=20.0))
        lines.append(Line(what=f"their largest difference, 1e-10, {size}", measured=error / 1e-10, most=1.0))
    for targets in SPARSE:
        scenes = [lane(targets, seed) for seed in range(20)]
        taken = seconds(lambda scenes=scenes: [jpda.associate(scene) for scene in scenes], 5) / len(scenes)
        largest = max(np.bincount(jpda.associate(scene).clusters).max() for scene in scenes)
        inexact = sum(jpda.associate(scene).approximate.any() for scene in scenes)
        print(
            f"sparse, {targets:2d} targets: {taken * 1e3:6.3f} ms, cluster of up to {largest}, "
            f"{inexact} of {len(scenes)} scenes approximate"
        )
        lines.append(Line(what=f"JPDA, ms, sparse lane of {targets} targets", measured=taken * 1e3))
    return lines


if __name__ == "__main__":
    print(table(main()))
