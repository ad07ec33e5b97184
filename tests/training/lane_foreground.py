"""Learns the trees of the lane's tracker from simulated lanes: those of `.foreground` and of `.sizes`.

``python -m tests.training.lane_foreground`` simulates every lane scenario over seeds that no validation uses,
lets the background model look, compares each pixel near its foreground with the truth, and writes the trees.
The background model knows nothing of the trees, and the ground is told the true vehicles, so that one round
is enough; as the trees will not find all of these, half of the lanes show the background model's image in its
place. What is learnt from is kept in a folder (1.2 GB); a lane that is there already is not simulated again.
It needs ``pip install 'testtrack[training]'``.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

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
from tracker.motorcycle_lane.ground import Ground
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
MOST = 255
"""Vehicles of a picture."""
PIXELS, SIZED = 900, 150
"""Pixels of a picture that are learnt from, and those from which sizes are."""
SMALL, USUAL = 10.0, 16.0
"""Height of vehicles, px, that are hardly worth learning; and up to which each counts by its area."""
GUESSED, UNKNOWN = 0.3, 0.4
"""Standard deviation of the logarithm of a vehicle's height: it is known roughly, and there are others; and
that while it is to be learnt."""
TREES, LEAVES = 300, 32
"""How many trees, and of how many leaves."""
SIZE_TREES, SIZE_RATE = 100, 0.12
"""How many tell a width or height, and how much of each step they take."""
WRITTEN = Path(tracker.motorcycle_lane.__file__).parent


class Picture(NamedTuple):
    """What is known of a frame.

    Attributes:
        image: (H, W, 3) RGB.
        background: (H, W, 3) RGB, the ground or the background image.
        raw: (H, W) raw foreground.
        numbers: (H, W) of each pixel's vehicle; 0 is none.
        boxes: (`MOST`, 4) whole boxes of the vehicles, px.
    """

    image: NDArray[np.uint8]
    background: NDArray[np.uint8]
    raw: NDArray[np.bool_]
    numbers: NDArray[np.uint8]
    boxes: Floats


class Samples(NamedTuple):
    """Pixels that are learnt from.

    Attributes:
        cues: (N, COUNT) of pixels near the foreground.
        right: (N,) which of them are a vehicle's.
        sized: (M, COUNT) cues of pixels of vehicles.
        logs: (M, 2) logarithms of their vehicles' widths and heights, over the height expected of a vehicle
            where they are.
    """

    cues: NDArray[np.float32]
    right: NDArray[np.bool_]
    sized: NDArray[np.float32]
    logs: Floats


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

    The file holds of each sample (K): images, and the ground or the background image of each (K, H, W, 3);
    the raw foreground (K, H, W), packed; the number of each pixel's vehicle (K, H, W), 0 where there is none,
    and the vehicles' whole boxes (K, `MOST`, 4), px; and the height of a vehicle in each row, px (H,).
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
    model, ground = BackgroundModel(info.width, info.height), Ground()
    images, backgrounds, raws, numbers, boxes, usual = [], [], [], [], [], []
    with Simulation(scene, scenario.params.sensor, seed=seed) as simulation:
        for seen in simulation.run(scenario.frames):
            raw = model.apply(seen.image)
            clean, truth = ground.image(model.background), seen.truth
            usual.append(truth.box_amodal[truth.visible > WHOLE])
            if seen.tick >= FIRST and seen.tick % EVERY == 0:
                images.append(seen.image.copy())
                backgrounds.append((model.background if seed // 2 % 2 else clean).copy())
                raws.append(np.packbits(raw))
                number = np.zeros(int(max(seen.ids.max(), truth.ids.max(initial=0))) + 1, np.uint8)
                number[truth.ids] = np.arange(1, len(truth.ids) + 1)
                numbers.append(number[seen.ids])
                boxes.append(np.zeros((MOST, 4)))
                boxes[-1][: len(truth.ids)] = truth.box_amodal
            ground.learn(seen.image, raw, seen.ids >= FIRST_VEHICLE_ID)
    heights = height_by_row(np.concatenate(usual), info.width, info.height)
    with moved_in(kept) as path, path.open("wb") as file:
        np.savez_compressed(
            file,
            images=np.array(images),
            backgrounds=np.array(backgrounds),
            raws=np.array(raws),
            numbers=np.array(numbers),
            boxes=np.array(boxes),
            heights=heights,
        )
    return kept


def height_by_row(boxes: Floats, width: int, height: int) -> Floats:
    """Return (height,) how high vehicles are by the row of their middle, from their boxes (N, 4)."""
    inside = (boxes[:, :2] > 1.0).all(1) & (boxes[:, 2:] < np.array([width, height]) - 1.0).all(1)
    whole = boxes[inside]
    line = np.polyfit(0.5 * (whole[:, 1] + whole[:, 3]), whole[:, 3] - whole[:, 1], 1)
    return np.maximum(np.polyval(line, np.arange(height)), 5.0)


def pictures(kept: Path, drawn: np.random.Generator) -> Iterator[Picture]:
    """Yield the pictures of a lane; half of them in a mirror, as the sun stands on either side."""
    with np.load(kept) as stored:
        images, backgrounds, numbers, boxes = (
            stored[name] for name in ("images", "backgrounds", "numbers", "boxes")
        )
        shape = images.shape[1:3]
        raws = np.unpackbits(stored["raws"], axis=1, count=shape[0] * shape[1]).reshape(-1, *shape)
    for *seen, held in zip(images, backgrounds, raws.view(np.bool_), numbers, boxes, strict=True):
        if drawn.uniform() < 0.5:
            seen = [np.ascontiguousarray(layer[:, ::-1]) for layer in seen]
            held[:, [0, 2]] = shape[1] - held[:, [2, 0]]
        yield Picture(*seen, held)


def samples(kept: Path, seed: int) -> Samples:
    """Draw pixels of a lane. How high vehicles are is known roughly: less so when that is to be learnt."""
    drawn = np.random.default_rng(seed)
    with np.load(kept) as stored:
        heights = stored["heights"]
    rare = np.where(heights < SMALL, 0.2, 1.0) / np.maximum(heights, USUAL) ** 1.5
    found = []
    for picture in pictures(kept, drawn):
        near = candidates(picture.raw, DENSE)
        guessed = heights * np.exp(drawn.normal(0.0, GUESSED))
        rows, columns = thinned(near, rare, PIXELS, drawn)
        right = picture.numbers[rows, columns] > 0
        shown = cues(picture.image, picture.background, picture.raw, guessed, rows, columns)
        guessed = heights * np.exp(drawn.normal(0.0, UNKNOWN))
        rows, columns = thinned(near & (picture.numbers > 0), rare, SIZED, drawn)
        boxes = picture.boxes[picture.numbers[rows, columns] - 1]
        middles = np.clip(0.5 * (boxes[:, 1] + boxes[:, 3]), 0, len(heights) - 1).astype(np.int64)
        logs = np.log((boxes[:, 2:] - boxes[:, :2]) / guessed[middles, None])
        sized = cues(picture.image, picture.background, picture.raw, guessed, rows, columns)
        found.append(Samples(shown, right, sized, logs))
    return Samples(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def thinned(
    mask: NDArray[np.bool_], rare: Floats, number: float, drawn: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Draw about so many pixels of a mask, by the weights (H,) of their rows; return rows and columns."""
    rows, columns = np.nonzero(mask)
    chosen = drawn.uniform(size=len(rows)) < number * rare[rows] / max(rare[rows].sum(), 1e-9)
    return rows[chosen], columns[chosen]


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
        drawn = [np.concatenate(parts) for parts in zip(*pool.map(samples, kept, seeds), strict=True)]
    found = Samples(*drawn)
    write(fit(found.cues, found.right, trees=TREES, leaves=LEAVES), WRITTEN / "foreground.npz")
    for name, logs in zip(("widths", "heights"), found.logs.T, strict=True):
        trees = fit(found.sized, logs, trees=SIZE_TREES, leaves=LEAVES, objective="l1", rate=SIZE_RATE)
        write(trees, WRITTEN / f"{name}.npz")


if __name__ == "__main__":
    main()
