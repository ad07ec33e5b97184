"""Paper 1's p(x, y | C) against rendered truth: do vehicles lie in the rows that it says?

``python -m tests.validation.occurrence`` renders drives, takes the id maps' pixels of the vehicles that go
the ego's way, each vehicle weighing the same, and compares their rows below the horizon with eq. (19) at the
distances and heights as measured.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.camera import project
from sim.params import InCarParams
from sim.render.gl import GlRenderer
from sim.scenes.in_car import InCarScene
from sim.world import Role
from tracker.in_car.likelihood import MotionPriors
from tracker.in_car.occurrence import Occurrence

DRIVES, SECONDS, RATE, EVERY = 12, 4.0, 15, 10
NEAR, FAR = 5.0, 100.0
LEAST_PIXELS = 30


def rows(params: InCarParams, seed: int) -> tuple[list[NDArray[np.float64]], list[tuple[float, float]]]:
    """Return, for each vehicle and frame, the rows of its pixels below the horizon, and (Z, height)."""
    scene = InCarScene(params, seed=seed, rate=RATE, seconds=SECONDS)
    found, places = [], []
    with GlRenderer(scene.stage, scene.camera) as renderer:
        for tick in range(round(SECONDS * RATE)):
            state = scene.step()
            if tick % EVERY:
                continue
            pose, vehicles = scene.pose(state), state.vehicles
            ids = renderer.render(state, scene.camera, pose).ids
            _, depth = project(scene.camera, pose, vehicles.positions)
            # The horizon moves with the car's pitch.
            horizon = scene.camera.cy + scene.camera.focal * pose.rotation[2, 2] / np.hypot(
                *pose.rotation[2, :2]
            )
            wanted = (vehicles.roles == Role.SAME_WAY) & (depth > NEAR) & (depth < FAR)
            for k in np.flatnonzero(wanted):
                row = np.nonzero(ids == vehicles.ids[k])[0] + 0.5 - horizon
                if len(row) >= LEAST_PIXELS:
                    found.append(row)
                    places.append((float(depth[k]), float(vehicles.sizes[k, 2])))
    return found, places


def run(drives: int = DRIVES) -> dict[str, float]:
    """Return the share of pixels in the band that should hold 0.9, and the rows' total variation."""
    params = InCarParams()
    found, places = [], []
    for seed in range(drives):
        part = rows(params, seed)
        found += part[0]
        places += part[1]
    edges = np.arange(-120.0, 161.0, 10.0)
    counts = np.mean([np.histogram(row, edges)[0] / len(row) for row in found], axis=0)
    depth, height = np.array(places).T
    expected = np.zeros(len(edges) - 1)
    for low, high in ((0.0, 1.7), (1.7, 2.6), (2.6, 9.0)):
        chosen = (height > low) & (height <= high)
        if not chosen.any():
            continue
        priors = MotionPriors(
            car_depth=float(depth[chosen].mean()),
            car_depth_sd=float(depth[chosen].std() + 0.1),
            car_depth_range=(NEAR, FAR),
        )
        model = Occurrence(
            params.camera.focal,
            priors,
            camera_height=params.camera.mount_height,
            vehicle_height=float(height[chosen].mean()),
        )
        expected += chosen.mean() * np.diff(model.below(edges))
    priors = MotionPriors(
        car_depth=float(depth.mean()), car_depth_sd=float(depth.std()), car_depth_range=(NEAR, FAR)
    )
    band = Occurrence(
        params.camera.focal,
        priors,
        camera_height=params.camera.mount_height,
        vehicle_height=float(height.mean()),
    ).useful_band(0.9)
    return {
        "vehicles": float(len(found)),
        "upper row": band[0],
        "lower row": band[1],
        "share in the band": float(np.mean([np.mean((row > band[0]) & (row < band[1])) for row in found])),
        "total variation of rows": float(0.5 * np.abs(counts - expected).sum()),
    }


if __name__ == "__main__":
    for name, value in run().items():
        print(f"{name:25s} {value:.3f}")
