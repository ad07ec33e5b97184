"""Learns the trees that weigh outlines (`tracker.in_car.cues`) from simulated drives.

``python -m tests.training.outlines`` drives every in-car scenario over seeds that no validation uses, lets
the tracker look, compares the outlines that it weighs with the truth, and writes the trees. It begins
without any trees and goes over the drives again with those that it has learnt, to learn from their
mistakes: nothing of the present trees enters. The frames are rendered once and kept in a folder (10 GB); a
drive that is there already is not rendered again. It needs ``pip install 'testtrack[training]'``.
"""

from __future__ import annotations

import argparse
import pickle
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import tracker.in_car
from scenarios import bridge, spec
from scenarios.files import moved_in
from scenarios.loop import make_scene
from scenarios.score.params import ScoringParams
from scenarios.score.preprocess import clip, select
from scenarios.spec import Scenario
from sim.simulation import Simulation
from sim.truth.types import FrameTruth
from sim.world import Role
from tests.training.boosting import fit, write
from tracker.boosting import Trees
from tracker.boxes import iou
from tracker.in_car.cues import Cue
from tracker.in_car.tracker import InCarTracker
from tracker.in_car.vehicles import Sighting
from tracker.types import Frame, Info

Floats = NDArray[np.float64]

WRITTEN = Path(tracker.in_car.__file__).with_name("outline_odds.npz")
SCENARIOS = ("day", "curve", "night", "urban", "stop-and-go", "rain")
FIRST_SEED = 1000
"""Far from the seeds of the tests and of the tables in the README."""
EVERY = 6
"""Frames from one sample to the next: neighbours are alike."""
RIGHT, WRONG = 0.7, 0.45
"""Overlap with a scored vehicle from which an outline is right, and below which it is wrong."""
GENERATIONS = 3
"""How often the drives are gone over. What earlier trees got wrong is kept: it is the more diverse."""
KEPT = 20
"""Outlines of a frame that are learnt from at most: of each, right ones, wrong ones, wrong ones that stand on
another vehicle (parked, oncoming), and the wrong ones that the last trees found likeliest."""
TREES, LEAVES = 200, 32
"""How many trees, and of how many leaves."""
SCORED = ScoringParams(max_distance=100.0, min_height=9.0)
"""Farther ones than are scored, too: they are seen before they are near."""
RISING = {
    Cue.FRAME, Cue.WEAKER_SIDE, Cue.WEAKER_CONTRAST, Cue.FOOT_LEAST, Cue.FOOT_MEAN, Cue.ROOF,
    Cue.FOR, Cue.SHARE, Cue.COUNT_FOR, Cue.DENSITY, Cue.WEAKER_LAMP,
}  # fmt: skip
FALLING = {
    Cue.ROAD, Cue.SHADOW, Cue.SIDE_ABOVE, Cue.AGAINST, Cue.COUNT_AGAINST, Cue.CORE_AGAINST, Cue.GAP_INNER,
    Cue.GAP_OUTER, Cue.GAP_ABOVE, Cue.GAP_BELOW, Cue.SCATTER, Cue.ALIKE_BESIDE, Cue.FOR_BELOW,
}  # fmt: skip
"""Cues of which more never speaks against a vehicle, or never for one: what simulated drives teach beyond
that does not hold on real ones."""
MONOTONE = [(cue in RISING) - (cue in FALLING) for cue in Cue]


NONE = Trees(
    roots=np.zeros(0, np.int32),
    cues=np.zeros(0, np.int16),
    limits=np.zeros(0, np.float32),
    rights=np.zeros(0, np.int32),
)
"""By these every outline's odds are even, and no vehicle is begun."""


def drive(name: str, seed: int) -> Scenario:
    """Return a scenario of the library; two seeds in three with another camera, road, country and weather.

    Real cameras hang higher or lower, see wider, blur and compress differently, and what stands behind the
    vehicles differs: what is learnt has to hold for them, too.
    """
    if seed % 3 == 0:
        return spec.load(f"in-car-{name}")
    drawn = np.random.default_rng(seed)
    changes = {
        "camera.mount_height": drawn.uniform(1.1, 1.6),
        "camera.focal": 800.0 * np.exp(drawn.uniform(-0.45, 0.35)),
        "camera.pitch": drawn.uniform(-0.04, 0.02),
        "road.lanes": int(drawn.integers(2, 6)),
        "road.median": drawn.uniform(0.0, 6.0),
        "road.lane_width": drawn.uniform(3.2, 3.8),
        "traffic.density": drawn.uniform(10.0, 40.0),
        "scenery.setting": drawn.choice(["motorway", "rural", "urban"]),
        "scenery.density": np.exp(drawn.uniform(-0.5, 1.1)),
        "scenery.corridor": drawn.uniform(3.0, 8.0),
        "light.cloud": drawn.uniform(0.0, 1.0),
        "light.haze": drawn.uniform(0.0002, 0.0015),
        "sensor.noise": drawn.uniform(0.7, 4.0),
        "sensor.blur": drawn.uniform(0.3, 1.5),
        "sensor.sharpening": drawn.uniform(0.0, 2.0),
        "sensor.compression": int(drawn.integers(5, 70)),
    }
    return spec.load(f"in-car-{name}", [f"{key}={value}" for key, value in changes.items()])


class Shot(NamedTuple):
    """What is kept of an observation.

    Attributes:
        tick: The frame's number.
        time: Seconds.
        image: (H, W, 3) uint8, RGB.
        truth: Of the vehicles.
    """

    tick: int
    time: float
    image: NDArray[np.uint8]
    truth: FrameTruth


def render(name: str, seed: int, folder: Path) -> Path:
    """Render a drive into a file of the folder, unless it is there: the tracker's `Info`, then the shots."""
    kept = folder / f"{name}-{seed}.pickle"
    if not kept.exists():
        scenario = drive(name, seed)
        scene = make_scene(scenario, seed)
        with (
            moved_in(kept) as path,
            path.open("wb") as file,
            Simulation(scene, scenario.params.sensor, seed=seed) as simulation,
        ):
            pickle.dump(bridge.tracker_info(scene.camera, scenario.rate), file)
            for seen in simulation.run(scenario.frames):
                pickle.dump(Shot(seen.tick, seen.time, seen.image, seen.truth), file)
    return kept


def samples(kept: Path, seed: int, trees: Trees) -> tuple[Floats, NDArray[np.bool_]]:
    """Let the tracker watch a drive with the last trees: cues (N, C), and which are a vehicle's (N,)."""
    drawn = np.random.default_rng((seed, len(trees.roots)))
    cues, right = [], []
    watched = InCarTracker(trees)
    with kept.open("rb") as file:
        info: Info = pickle.load(file)
        watched.start(info)
        while file.peek(1):
            shot: Shot = pickle.load(file)
            watched.step(Frame(image=shot.image, tick=shot.tick, time=shot.time))
            if shot.tick % EVERY or watched.sighting is None:
                continue
            index, vehicle = _chosen(watched.sighting, shot.truth, info, drawn)
            cues.append(watched.sighting.cues[index])
            right.append(vehicle)
    return np.concatenate(cues), np.concatenate(right)


def _chosen(
    sighting: Sighting, truth: FrameTruth, info: Info, drawn: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Choose the outlines of a frame that are learnt from (N,), and tell which are a vehicle's (N,)."""
    chosen = select(truth, width=info.width, height=info.height, params=SCORED)
    # Vehicles that go the ego's way, but too far away or too much hidden to be scored, teach nothing.
    unclear = chosen.ignored & (truth.roles == Role.SAME_WAY)
    others = chosen.boxes[~chosen.scored & ~unclear & ~np.isnan(chosen.boxes[:, 0])]
    boxes = clip(sighting.boxes, info.width, info.height)
    overlap = _greatest(chosen.boxes[chosen.scored], boxes)
    wrong = (overlap < WRONG) & (_greatest(chosen.boxes[unclear], boxes) < 0.3)
    found = np.flatnonzero(overlap > RIGHT)
    missed = drawn.permutation(np.flatnonzero(wrong))
    parked = np.flatnonzero(wrong & (_greatest(others, boxes) > WRONG))
    mistaken = missed[np.argsort(-sighting.odds[missed], kind="stable")[:KEPT]]
    groups = [
        drawn.choice(group, KEPT, replace=False) if len(group) > KEPT else group
        for group in (found, missed, parked, mistaken)
    ]
    index = np.concatenate(groups)
    return index, overlap[index] > RIGHT


def _greatest(boxes: Floats, others: Floats) -> Floats:
    """Return the greatest overlap of each of ``others`` (N, 4) with ``boxes`` (M, 4)."""
    return iou(boxes, others).max(0) if len(boxes) else np.zeros(len(others))


def main() -> None:
    """Drive, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drives", type=int, default=6, help="of each scenario")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--frames", type=Path, default=Path("training-frames"), help="folder to keep them in")
    arguments = parser.parse_args()
    arguments.frames.mkdir(parents=True, exist_ok=True)
    names, seeds = zip(
        *((n, FIRST_SEED + k) for k in range(arguments.drives) for n in SCENARIOS), strict=True
    )
    trees = NONE
    found: list[tuple[Floats, NDArray[np.bool_]]] = []
    with ProcessPoolExecutor(arguments.jobs, mp_context=get_context("spawn")) as pool:
        kept = []
        for path in pool.map(render, names, seeds, repeat(arguments.frames)):
            print(f"Rendered: {path}", flush=True)
            kept.append(path)
        for _ in range(GENERATIONS):
            found += pool.map(samples, kept, seeds, repeat(trees))
            cues, right = (np.concatenate(parts) for parts in zip(*found, strict=True))
            trees = fit(cues, right, trees=TREES, leaves=LEAVES, monotone=MONOTONE)
    write(trees, WRITTEN)


if __name__ == "__main__":
    main()
