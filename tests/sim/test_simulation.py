"""The simulation as a whole: determinism, and image motion held against the id and depth maps."""

import numpy as np
import pytest

from sim.camera import image_motion, project
from sim.params import EgoParams, InCarParams, RoadParams
from sim.scenes.in_car import InCarScene
from sim.simulation import Simulation
from sim.world import FIRST_VEHICLE_ID, SKY_ID

RATE = 30
STILL = EgoParams(pitch_vibration=0.0)


def observe(params: InCarParams, seed: int, frames: int) -> list:
    scene = InCarScene(params, seed=seed, rate=RATE, seconds=1.0)
    with Simulation(scene, params.sensor, seed=seed) as simulation:
        return list(simulation.run(frames))


def test_same_seed_same_pixels_other_seed_others():
    params = InCarParams()
    first, again, other = (observe(params, seed, 3) for seed in (0, 0, 1))
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.image, b.image)
        np.testing.assert_array_equal(a.ids, b.ids)
        np.testing.assert_array_equal(a.depth, b.depth)
        np.testing.assert_array_equal(a.truth.box_amodal, b.truth.box_amodal)
        assert a.odometer == b.odometer
    assert not np.array_equal(first[0].ids, other[0].ids)


@pytest.mark.parametrize("curved", [False, True])
def test_image_motion_agrees_with_the_depth_map(curved):
    """A static pixel, carried by its depth into the next frame, moves as paper 1's eq. (8) with yaw says."""
    params = InCarParams(road=RoadParams(curved=curved, min_radius=120.0, max_radius=150.0), ego=STILL)
    scene = InCarScene(params, seed=2, rate=RATE, seconds=20.0)
    for _ in range(250):  # well into the first arc, where there is one
        scene.step()
    with Simulation(scene, params.sensor, seed=2) as simulation:
        now, after = simulation.step(), simulation.step()
    camera, ego = scene.camera, now.state.ego
    assert ego is not None
    if curved:
        assert abs(ego.yaw_rate) > 0.02

    rng = np.random.default_rng(0)
    v, u = rng.integers(60, 420, 4000), rng.integers(20, 620, 4000)
    static = (now.ids[v, u] != SKY_ID) & (now.ids[v, u] < FIRST_VEHICLE_ID) & (now.depth[v, u] < 80)
    u, v, depth = u[static], v[static], now.depth[v[static], u[static]].astype(float)
    x, y = u + 0.5 - camera.cx, v + 0.5 - camera.cy
    local = np.stack([x * depth / camera.focal, y * depth / camera.focal, depth], axis=-1)
    pixels, new_depth = project(camera, after.pose, local @ now.pose.rotation + now.pose.position)

    inside = (pixels > 0).all(-1) & (pixels < [camera.width, camera.height]).all(-1) & (new_depth > 1)
    moved = np.clip(pixels, 0, [camera.width - 1, camera.height - 1]).astype(int)
    same = after.ids[moved[:, 1], moved[:, 0]] == now.ids[v, u]
    close = np.abs(after.depth[moved[:, 1], moved[:, 0]] / new_depth - 1) < 0.05
    assert inside.sum() > 500
    assert (same & close)[inside].mean() > 0.95

    translation = now.pose.rotation @ (after.pose.position - now.pose.position) * RATE
    travelled = pixels[:, 0] - (u + 0.5)
    halfway = x + travelled / 2, (depth + new_depth) / 2  # a frame is long: the speed of its middle counts
    speed = image_motion(camera.focal, *halfway, -translation[0], -translation[2], ego.yaw_rate)
    far = inside & (depth > 10)
    assert far.sum() > 100
    np.testing.assert_allclose(travelled[far], speed[far] / RATE, rtol=0.02, atol=0.15)


def test_a_vehicle_in_the_open_is_seen_where_it_projects():
    seen = 0
    for observation in observe(InCarParams(), 3, 2):
        truth = observation.truth
        for row in np.flatnonzero(truth.visibility_in_frame > 0.95):
            x0, y0, x1, y1 = truth.box_amodal[row]
            middle = int((x0 + x1) / 2), int((y0 + y1) / 2)
            if truth.in_frame[row] == 1 and truth.amodal_px[row] > 400:
                assert observation.ids[middle[1], middle[0]] == truth.ids[row]
                seen += 1
    assert seen > 0
