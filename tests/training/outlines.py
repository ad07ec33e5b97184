"""Learns the tables of `tracker.in_car.outline_odds` from simulated drives.

``python -m tests.training.outlines`` drives every in-car scenario over seeds that no validation uses, lets
the tracker look, compares the outlines that it weighs with the truth, and writes the tables. An additive
logistic regression: each cue's range is cut at quantiles, neighbouring bins are held together, and the fit is
convex, so that the same drives give the same tables.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import tracker.in_car
from scenarios import spec
from scenarios.loop import run_episode
from scenarios.score.params import ScoringParams
from scenarios.score.preprocess import clip, select
from sim.simulation import Observation
from sim.world import Role
from tracker.boxes import iou
from tracker.in_car.cues import Cue
from tracker.in_car.tracker import InCarTracker
from tracker.types import Diagnostics, Tracks

Floats = NDArray[np.float64]

TABLES = Path(tracker.in_car.__file__).with_name("outline_odds.json")
SCENARIOS = ("day", "curve", "night", "urban", "stop-and-go", "rain")
FIRST_SEED = 1000
"""Far from the seeds of the tests and of the tables in the README."""
EVERY = 6
"""Frames from one sample to the next: neighbours are alike."""
RIGHT, WRONG = 0.7, 0.45
"""Overlap with a scored vehicle from which an outline is right, and below which it is wrong."""
RIGHT_KEPT, WRONG_KEPT = 30, 60
"""Outlines of a frame that are learnt from at most."""
BINS = 16
SHRINK, SMOOTH = 20.0, 30.0
"""Penalties on the squares of the tables, and of their steps from bin to bin."""


def samples(scenario: str, seed: int) -> tuple[Floats, NDArray[np.bool_]]:
    """Drive once: cues (N, C) of outlines, and whether each is a vehicle's (N,)."""
    drawn = np.random.default_rng(seed)
    scored_by = ScoringParams()
    cues, right = [], []
    watched = InCarTracker()

    def look(observation: Observation, _: Mapping[str, tuple[Tracks, Diagnostics]]) -> None:
        sighting = watched.sighting
        if observation.tick % EVERY or sighting is None:
            return
        height, width = observation.ids.shape
        truth = observation.truth
        chosen = select(truth, width=width, height=height, params=scored_by)
        # Vehicles that go the ego's way, but too far away or too much hidden to be scored, teach nothing.
        unclear = chosen.boxes[chosen.ignored & (truth.roles == Role.SAME_WAY)]
        boxes = clip(sighting.boxes, width, height)
        overlap = _greatest(chosen.boxes[chosen.scored], boxes)
        for kept, most in (
            (overlap > RIGHT, RIGHT_KEPT),
            ((overlap < WRONG) & (_greatest(unclear, boxes) < 0.3), WRONG_KEPT),
        ):
            index = np.flatnonzero(kept)
            if len(index) > most:
                index = drawn.choice(index, most, replace=False)
            cues.append(sighting.cues[index])
            right.append(overlap[index] > RIGHT)

    run_episode(spec.load(f"in-car-{scenario}"), seed, {"in-car": watched}, on_frame=look)
    return np.concatenate(cues), np.concatenate(right)


def _greatest(boxes: Floats, others: Floats) -> Floats:
    """Return the greatest overlap of each of ``others`` (N, 4) with ``boxes`` (M, 4)."""
    return iou(boxes, others).max(0) if len(boxes) else np.zeros(len(others))


def fit(cues: Floats, right: NDArray[np.bool_]) -> tuple[list[Floats], list[Floats], float]:
    """Fit the tables: inner edges of each cue's bins, their log odds, and the bias."""
    count, columns = cues.shape
    shares = np.linspace(0, 1, BINS + 1)[1:-1]
    edges = [np.unique(np.quantile(cues[:, k], shares)) for k in range(columns)]
    first = np.cumsum([0] + [len(row) + 1 for row in edges])
    place = np.stack(
        [first[k] + np.searchsorted(edges[k], cues[:, k], side="right") for k in range(columns)], 1
    )
    left = np.concatenate([np.arange(first[k], first[k + 1] - 1) for k in range(columns)])
    bias = first[-1]

    def cost(weights: Floats) -> tuple[float, Floats]:
        odds = weights[place].sum(1) + weights[bias]
        step = weights[left + 1] - weights[left]
        loss = np.logaddexp(0.0, odds).sum() - odds[right].sum()
        loss += 0.5 * SHRINK * (weights[:bias] ** 2).sum() + 0.5 * SMOOTH * (step**2).sum()
        off = 1.0 / (1.0 + np.exp(-odds)) - right
        slope = np.append(np.bincount(place.ravel(), np.repeat(off, columns), bias), off.sum())
        slope[:bias] += SHRINK * weights[:bias]
        slope[left + 1] += SMOOTH * step
        slope[left] -= SMOOTH * step
        return float(loss), slope

    weights = minimize(cost, np.zeros(bias + 1), jac=True, method="L-BFGS-B", options={"maxiter": 300}).x
    print(f"{count} outlines, {right.mean():.2f} of them vehicles; fitted.")
    return edges, [weights[first[k] : first[k + 1]] for k in range(columns)], float(weights[bias])


def main() -> None:
    """Drive, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drives", type=int, default=6, help="of each scenario")
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    drives = [(name, FIRST_SEED + k) for k in range(arguments.drives) for name in SCENARIOS]
    with ProcessPoolExecutor(arguments.jobs, mp_context=get_context("spawn")) as pool:
        found = []
        for drive, sample in zip(drives, pool.map(samples, *zip(*drives, strict=True)), strict=True):
            print(*drive, len(sample[1]), flush=True)
            found.append(sample)
    edges, odds, bias = fit(np.concatenate([f[0] for f in found]), np.concatenate([f[1] for f in found]))
    document = {
        "drives": {"scenarios": SCENARIOS, "seeds": [FIRST_SEED, FIRST_SEED + arguments.drives]},
        "bias": round(bias, 4),
        "cues": {
            cue.name.lower(): {
                "edges": [float(f"{edge:.5g}") for edge in edges[cue]],
                "odds": [round(float(value), 4) for value in odds[cue]],
            }
            for cue in Cue
        },
    }
    TABLES.write_text(json.dumps(document, indent=1) + "\n")
    print(f"Written: {TABLES}")


if __name__ == "__main__":
    main()
