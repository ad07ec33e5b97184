"""Learns the trees of `tracker.aerial.foreground` from simulated flights.

``python -m tests.training.aerial_foreground`` simulates every aerial scenario over seeds that no validation
uses, lets the stabilisation and the background look, compares pixels that change with the truth, and writes
the trees. What is learnt from is kept in a folder (1.2 GB); a flight that is there already is not simulated
again. It needs ``pip install 'testtrack[training]'``.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
from numpy.typing import NDArray

import tracker.aerial
from scenarios import bridge, spec
from scenarios.files import moved_in
from scenarios.loop import make_scene
from scenarios.spec import Scenario
from sim.simulation import Simulation
from sim.world import FIRST_VEHICLE_ID
from tests.training.boosting import fit, write
from tracker.aerial.background import Background
from tracker.aerial.foreground import BLOCK, cues, squares
from tracker.aerial.stabilisation import Stabiliser, transform

SCENARIOS = ("winding", "intersection", "convoy", "bridge", "bridges")
FIRST_SEED = 1000
"""Far from the seeds of the tests and of the tables in the README."""
SECONDS = 6.5
FIRST, EVERY = 24, 12
"""Frames before the first sample, and from one to the next: neighbours are alike."""
MOVING = 1.0
"""M/s from which on a vehicle has a track, below which nothing is learnt to be ground."""
SQUARES = 1500
"""Squares of a picture that are learnt from."""
TREES, LEAVES = 300, 32
"""How many trees, and of how many leaves."""
WRITTEN = Path(tracker.aerial.__file__).with_name("foreground.npz")
FIELDS = ("laid", "ground", "spread", "often")


def drawn_flight(name: str, seed: int) -> Scenario:
    """Return a scenario of the library; every second seed elsewhere, in another light."""
    changes: dict[str, object] = {"seconds": SECONDS}
    if seed % 2:
        drawn = np.random.default_rng(seed)
        changes |= {
            "camera.focal": 800.0 * np.exp(drawn.uniform(-0.2, 0.3)),
            "camera.tilt": drawn.uniform(0.05, 0.4),
            "platform.altitude": drawn.uniform(130.0, 270.0),
            "platform.jitter": drawn.uniform(0.3, 2.5),
            "road.lane_width": drawn.uniform(3.2, 4.2),
            "traffic.looks": int(drawn.integers(1, 8)),
            "traffic.lookalikes": drawn.uniform(0.0, 0.9),
            "traffic.lorries": drawn.uniform(0.0, 0.12),
            "traffic.speed": drawn.uniform(8.0, 18.0),
            "scenery.setting": drawn.choice(["open", "suburb", "town"]),
            "scenery.trees": drawn.uniform(0.3, 2.0),
            "scenery.overhang": drawn.uniform(0.0, 26.0),
            "scenery.wind": drawn.uniform(0.0, 1.0),
            "light.cloud": drawn.uniform(0.0, 1.0),
            "light.passing": drawn.uniform(0.0, 0.5),
            "sensor.noise": drawn.uniform(0.7, 4.0),
            "sensor.blur": drawn.uniform(0.3, 1.2),
            "sensor.sharpening": drawn.uniform(0.0, 2.0),
            "sensor.compression": int(drawn.integers(5, 60)),
        }
    return spec.load(f"aerial-{name}", [f"{key}={value}" for key, value in changes.items()])


def render(name: str, seed: int, folder: Path) -> Path:
    """Simulate a flight into a file of the folder, unless it is there.

    The file holds of each sample what `Background` shows (``FIELDS``), its changes and what vehicles cover,
    packed.
    """
    kept = folder / f"{name}-{seed}.npz"
    if kept.exists():
        return kept
    scenario = drawn_flight(name, seed)
    scene = make_scene(scenario, seed)
    stabiliser, background = Stabiliser(), Background()
    stored: dict[str, NDArray[np.generic]] = {}
    with Simulation(scene, scenario.params.sensor, seed=seed) as simulation:
        for seen in simulation.run(scenario.frames):
            image = bridge.tracker_frame(seen, odometry=False).image
            to_mosaic = stabiliser.step(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
            truth = seen.truth
            going = (np.hypot(*truth.world_velocities[:, :2].T) > MOVING) & (truth.visible > 0.3)
            boxes = truth.box_amodal[going]
            corners = transform(to_mosaic, boxes[:, [[0, 1], [2, 1], [2, 3], [0, 3]]])
            raw = background.apply(image, to_mosaic, np.concatenate([corners.min(1), corners.max(1)], 1))
            if seen.tick >= FIRST and seen.tick % EVERY == 0:
                true = np.where(seen.ids >= FIRST_VEHICLE_ID, 255, 0).astype(np.uint8)
                k = len(stored) // (len(FIELDS) + 2)
                stored |= {f"{field}-{k}": getattr(background, field).copy() for field in FIELDS}
                stored[f"raw-{k}"] = np.packbits(raw)
                stored[f"true-{k}"] = np.packbits(background.lay(true, to_mosaic) > 127)
    with moved_in(kept) as path, path.open("wb") as file:
        np.savez_compressed(file, **stored)
    return kept


def samples(kept: Path, seed: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Draw squares of a flight: their cues (N, COUNT), and which are a vehicle's (N,).

    Each picture is looked at turned by a quarter or more, some in a mirror: the sun stands anywhere.
    """
    drawn = np.random.default_rng(seed)
    found, right = [], []
    with np.load(kept) as stored:
        for k in (int(name.split("-")[1]) for name in stored if name.startswith("laid")):
            fields = {field: stored[f"{field}-{k}"] for field in FIELDS}
            shape = fields["laid"].shape[:2]
            for name in ("raw", "true"):
                packed = stored[f"{name}-{k}"]
                fields[name] = np.unpackbits(packed, count=shape[0] * shape[1]).reshape(shape).view(np.bool_)
            turns, mirrored = int(drawn.integers(4)), bool(drawn.integers(2))
            for name, field in fields.items():
                field = np.rot90(field, turns)
                fields[name] = np.ascontiguousarray(field[:, ::-1] if mirrored else field)
            raw, true = fields.pop("raw"), fields.pop("true")
            rows, columns, _ = squares(raw)
            chosen = drawn.permutation(len(rows))[:SQUARES]
            rows, columns = rows[chosen], columns[chosen]
            found.append(cues(SimpleNamespace(**fields), raw, rows, columns))
            share = cv2.blur(true.astype(np.float32), (BLOCK, BLOCK))
            right.append(share[rows, columns] > 0.49)
    return np.concatenate(found), np.concatenate(right)


def main() -> None:
    """Simulate, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--flights", type=int, default=6, help="of each scenario")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--frames", type=Path, default=Path("training-flights"), help="folder to keep them in"
    )
    arguments = parser.parse_args()
    arguments.frames.mkdir(parents=True, exist_ok=True)
    names, seeds = zip(
        *((n, FIRST_SEED + k) for k in range(arguments.flights) for n in SCENARIOS), strict=True
    )
    kept = []
    with ProcessPoolExecutor(arguments.jobs, mp_context=get_context("spawn")) as pool:
        for path in pool.map(render, names, seeds, repeat(arguments.frames)):
            print(f"Simulated: {path}", flush=True)
            kept.append(path)
        found, right = (np.concatenate(parts) for parts in zip(*pool.map(samples, kept, seeds), strict=True))
    write(fit(found, right, trees=TREES, leaves=LEAVES), WRITTEN)


if __name__ == "__main__":
    main()
