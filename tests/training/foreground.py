"""Learns the trees of `tracker.motorcycle_lane.foreground` from simulated lanes.

``python -m tests.training.foreground`` simulates every lane scenario over seeds that no validation uses, lets
the background model look, compares each pixel near its foreground with the truth, and writes the trees. The
background model knows nothing of the trees, so that one round is enough. What is learnt from is kept in a
folder (1.2 GB); a lane that is there already is not simulated again. It needs
``pip install 'testtrack[training]'``.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tracker.motorcycle_lane
from scenarios import bridge, spec
from scenarios.files import moved_in
from scenarios.loop import make_scene
from scenarios.spec import Scenario
from sim.models import Model
from sim.simulation import Simulation
from sim.world import FIRST_VEHICLE_ID, Bodies, Kind, WorldState
from tests.training.boosting import fit, write
from tracker.motorcycle_lane.background import BackgroundModel
from tracker.motorcycle_lane.foreground import DENSE, cues
from tracker.surroundings import candidates

Floats = NDArray[np.float64]

SCENARIOS = ("day", "cloudy", "dense", "flash", "wrong-way", "parked")
FIRST_SEED = 1000
"""Far from the seeds of the tests and of the tables in the README."""
LONGEST = 11.0
"""Seconds of a scenario that are simulated at most."""
FIRST, EVERY = 15, 9
"""Frames before the first sample, and from one to the next: neighbours are alike."""
CARS, HEAVIER = 0.6, 0.15
"""Shares of the riders that become cars in some lanes, and of those that become vans, lorries and buses."""
WHOLE = 0.6
"""Share of a vehicle that must be visible to tell how large vehicles are."""
PIXELS = 900
"""Pixels of a picture that are learnt from."""
SMALL, USUAL = 10.0, 16.0
"""Height of vehicles, px, that are hardly worth learning; and up to which each counts by its area."""
GUESSED = 0.3
"""Standard deviation of the logarithm of a vehicle's height: it is known roughly, and there are others."""
TREES, LEAVES = 300, 32
"""How many trees, and of how many leaves."""
WRITTEN = Path(tracker.motorcycle_lane.__file__).with_name("foreground.npz")


def drawn_lane(name: str, seed: int) -> Scenario:
    """Return a scenario of the library; every second seed with another camera, lane, place and weather.

    What is learnt has to hold for cameras that hang elsewhere, see wider, blur and compress differently.
    """
    changes: dict[str, object] = {"seconds": min(spec.load(f"lane-{name}").seconds, LONGEST)}
    if seed % 2:
        drawn = np.random.default_rng(seed)
        size = drawn.choice([1.0, 1.0, 1.5, 2.0])
        height = drawn.uniform(4.0, 14.0)
        changes |= {
            "camera.width": int(360 * size),
            "camera.height": int(240 * size),
            "camera.focal": 380.0 * size * np.exp(drawn.uniform(-0.4, 0.4)),
            "camera.mount_height": height,
            "camera.mount_offset": drawn.uniform(-9.0, 9.0),
            "camera.yaw": drawn.uniform(-0.25, 0.25),
            "camera.pitch": -drawn.uniform(0.2, 0.36) - 0.018 * height,
            "lane.width": drawn.uniform(5.0, 14.0),
            "riders.riders": int(drawn.integers(6, 40)),
            "riders.speed": drawn.uniform(3.0, 14.0),
            "scenery.setting": drawn.choice(["motorway", "rural", "urban", "avenue"]),
            "light.cloud": drawn.uniform(0.0, 1.0),
            "light.haze": drawn.uniform(0.0002, 0.003),
            "sensor.noise": drawn.uniform(0.7, 4.0),
            "sensor.blur": drawn.uniform(0.3, 1.3),
            "sensor.sharpening": drawn.uniform(0.0, 2.0),
            "sensor.compression": int(drawn.integers(5, 60)),
        }
    return spec.load(f"lane-{name}", [f"{key}={value}" for key, value in changes.items()])


def some_cars(bodies: Bodies, models: tuple[Model, ...], seed: int) -> Bodies:
    """Make some riders cars, and a few of them heavier, each its whole life: real lanes have those, too."""
    heavier = (Kind.VAN, Kind.LORRY, Kind.BUS)
    kinds = {
        kind: [k for k, model in enumerate(models) if model.kind == kind] for kind in (Kind.CAR, *heavier)
    }
    new = {name: getattr(bodies, name).copy() for name in ("models", "kinds", "sizes")}
    for k, vehicle in enumerate(bodies.ids.tolist()):
        drawn = np.random.default_rng((seed, vehicle))
        if drawn.uniform() < CARS:
            kind = Kind(drawn.choice(heavier)) if drawn.uniform() < HEAVIER else Kind.CAR
            index = int(drawn.choice(kinds[kind]))
            new["models"][k], new["kinds"][k] = index, models[index].kind
            new["sizes"][k] = models[index].size
    return replace(bodies, **new)


def render(name: str, seed: int, folder: Path) -> Path:
    """Simulate a lane into a file of the folder, unless it is there.

    The file holds of each sample (K): images and background images (K, H, W, 3), the raw foreground and
    the true one (K, H, W), packed; and the height of a vehicle in each row, px (H,).
    """
    kept = folder / f"{name}-{seed}.npz"
    if kept.exists():
        return kept
    scenario = drawn_lane(name, seed)
    scene = make_scene(scenario, seed)
    if seed % 4 == 3:
        stepped, models = scene.step, scene.stage.models

        def step(action: NDArray[np.float32] | None = None) -> WorldState:
            state = stepped(action)
            return replace(state, vehicles=some_cars(state.vehicles, models, seed))

        scene.step = step  # type: ignore[method-assign]
    info = bridge.tracker_info(scene.camera, scenario.rate)
    model = BackgroundModel(info.width, info.height)
    images, backgrounds, raws, trues, boxes = [], [], [], [], []
    with Simulation(scene, scenario.params.sensor, seed=seed) as simulation:
        for seen in simulation.run(scenario.frames):
            raw = model.apply(seen.image)
            boxes.append(seen.truth.box_amodal[seen.truth.visible > WHOLE])
            if seen.tick >= FIRST and seen.tick % EVERY == 0:
                images.append(seen.image.copy())
                backgrounds.append(model.background.copy())
                raws.append(np.packbits(raw))
                trues.append(np.packbits(seen.ids >= FIRST_VEHICLE_ID))
    heights = height_by_row(np.concatenate(boxes), info.width, info.height)
    with moved_in(kept) as path, path.open("wb") as file:
        np.savez_compressed(
            file,
            images=np.array(images),
            backgrounds=np.array(backgrounds),
            raws=np.array(raws),
            trues=np.array(trues),
            heights=heights,
        )
    return kept


def height_by_row(boxes: Floats, width: int, height: int) -> Floats:
    """Return (height,) how high vehicles are by the row of their middle, from their boxes (N, 4)."""
    inside = (boxes[:, :2] > 1.0).all(1) & (boxes[:, 2:] < np.array([width, height]) - 1.0).all(1)
    whole = boxes[inside]
    line = np.polyfit(0.5 * (whole[:, 1] + whole[:, 3]), whole[:, 3] - whole[:, 1], 1)
    return np.maximum(np.polyval(line, np.arange(height)), 5.0)


def samples(kept: Path, seed: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Draw pixels of a lane: their cues (N, COUNT), and which are a vehicle's (N,).

    How high vehicles are is known roughly, and half of the pictures are looked at in a mirror: the sun stands
    on either side.
    """
    drawn = np.random.default_rng(seed)
    found, right = [], []
    with np.load(kept) as stored:
        images, backgrounds, heights = stored["images"], stored["backgrounds"], stored["heights"]
        shape = images.shape[1:3]
        raws, trues = (
            np.unpackbits(stored[name], axis=1, count=shape[0] * shape[1]).reshape(-1, *shape).view(np.bool_)
            for name in ("raws", "trues")
        )
    rare = np.where(heights < SMALL, 0.2, 1.0) / np.maximum(heights, USUAL) ** 1.5
    for image, background, raw, true in zip(images, backgrounds, raws, trues, strict=True):
        guessed = heights * np.exp(drawn.normal(0.0, GUESSED))
        if drawn.uniform() < 0.5:
            image, background, raw, true = (
                np.ascontiguousarray(a[:, ::-1]) for a in (image, background, raw, true)
            )
        rows, columns = np.nonzero(candidates(raw, DENSE))
        chosen = drawn.uniform(size=len(rows)) < PIXELS * rare[rows] / max(rare[rows].sum(), 1e-9)
        rows, columns = rows[chosen], columns[chosen]
        found.append(cues(image, background, raw, guessed, rows, columns))
        right.append(true[rows, columns])
    return np.concatenate(found), np.concatenate(right)


def main() -> None:
    """Simulate, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lanes", type=int, default=12, help="of each scenario")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--frames", type=Path, default=Path("training-lanes"), help="folder to keep them in")
    arguments = parser.parse_args()
    arguments.frames.mkdir(parents=True, exist_ok=True)
    names, seeds = zip(*((n, FIRST_SEED + k) for k in range(arguments.lanes) for n in SCENARIOS), strict=True)
    kept = []
    with ProcessPoolExecutor(arguments.jobs, mp_context=get_context("spawn")) as pool:
        for path in pool.map(render, names, seeds, repeat(arguments.frames)):
            print(f"Simulated: {path}", flush=True)
            kept.append(path)
        found, right = (np.concatenate(parts) for parts in zip(*pool.map(samples, kept, seeds), strict=True))
    write(fit(found, right, trees=TREES, leaves=LEAVES), WRITTEN)


if __name__ == "__main__":
    main()
