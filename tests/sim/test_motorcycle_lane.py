"""The lane as its camera sees it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sim.camera import project
from sim.params import LaneLightParams, LaneSceneryParams, MotorcycleLaneParams, RiderParams, SensorParams
from sim.render.gl import GlRenderer
from sim.scenes.motorcycle_lane import MotorcycleLaneScene, view_end
from sim.simulation import Simulation
from sim.world import FIRST_VEHICLE_ID, GROUND_ID, Kind, Lighting
from tests.sim.toy_stage import CAMERA, POSE, stage, state

PLAIN = MotorcycleLaneParams()


def run(params: MotorcycleLaneParams, seed: int, frames: int):
    scene = MotorcycleLaneScene(params, seed=seed, rate=30)
    with Simulation(scene, params.sensor, seed=seed) as simulation:
        return list(simulation.run(frames))


def test_same_seed_same_pixels_and_truth_other_seed_others():
    first, again, other = (run(PLAIN, seed, 4)[-1] for seed in (2, 2, 3))
    assert first.image.tobytes() == again.image.tobytes()
    assert first.ids.tobytes() == again.ids.tobytes()
    assert first.truth.box_amodal.tobytes() == again.truth.box_amodal.tobytes()
    assert not np.array_equal(first.ids, other.ids)


def test_noise_light_and_wind_move_no_rider():
    params = PLAIN.model_copy(
        update={
            "sensor": SensorParams(noise=9.0),
            "light": LaneLightParams(flash="sun", flash_at=0.05, passing=0.5),
            "scenery": LaneSceneryParams(wind=4.0),
        }
    )
    for a, b in zip(run(PLAIN, 2, 4), run(params, 2, 4), strict=True):
        assert a.state.vehicles.positions.tobytes() == b.state.vehicles.positions.tobytes()
        assert not np.array_equal(a.image, b.image)


def test_riders_are_seen_from_behind_small_at_the_far_end_and_large_near():
    params = PLAIN.model_copy(update={"riders": RiderParams(riders=40, speed=5.0)})
    seen = run(params, 1, 2)[-1]
    truth = seen.truth
    whole = truth.visible > 0.95
    heights = (truth.box_amodal[:, 3] - truth.box_amodal[:, 1])[whole]
    far, near = truth.distances[whole].argmax(), truth.distances[whole].argmin()
    assert seen.image.shape == (240, 360, 3)
    assert 12 < heights[far] < 24
    assert 50 < heights[near] < 100
    assert set(truth.kinds.tolist()) == {Kind.MOTORCYCLE}
    assert not (seen.ids == 0).any(), "no sky"
    assert (seen.ids == GROUND_ID).mean() > 0.3


def test_shadows_are_the_grounds():
    """Where a rider's shadow falls, the id map says ground: the mask of riders is without it."""
    params = PLAIN.model_copy(update={"light": LaneLightParams(cloud=0.0)})
    scene = MotorcycleLaneScene(params, seed=1, rate=30)
    shown = scene.step()
    with GlRenderer(scene.stage, scene.camera) as renderer:
        sunny = renderer.render(shown, scene.camera, scene.pose(shown))
        dull = renderer.render(
            replace(shown, lighting=Lighting(sun=(0.0,) * 3)), scene.camera, scene.pose(shown)
        )
    assert np.array_equal(sunny.ids, dull.ids)
    assert (sunny.ids >= FIRST_VEHICLE_ID).any()
    assert sunny.colour.mean() > 1.1 * dull.colour.mean()


def test_the_view_ends_where_the_upper_border_meets_the_ground():
    scene = MotorcycleLaneScene(PLAIN, seed=0, rate=30)
    pose = scene.pose(scene.step())
    end = view_end(scene.camera, pose)
    ahead = pose.rotation[2] * [1, 1, 0]
    point = pose.position * [1, 1, 0] + end * ahead / np.linalg.norm(ahead)
    pixel, _ = project(scene.camera, pose, point)
    assert np.allclose(pixel, [scene.camera.cx, 0.0], atol=1e-6)


def test_light_of_the_state_scales_what_the_stage_shows():
    with GlRenderer(stage(), CAMERA) as renderer:
        plain = renderer.render(state(), CAMERA, POSE)
        lit = replace(state(), lighting=Lighting(sun=(0.2,) * 3, sky=(0.5,) * 3))
        dim = renderer.render(lit, CAMERA, POSE)
        again = renderer.render(state(), CAMERA, POSE)
    ground = plain.ids == GROUND_ID
    assert dim.colour[ground].mean() < 0.75 * plain.colour[ground].mean()
    assert dim.colour[plain.ids == 0].mean() < 0.8 * plain.colour[plain.ids == 0].mean()
    assert np.array_equal(plain.ids, dim.ids)
    assert np.array_equal(plain.colour, again.colour)


def test_what_leans_is_sheared_where_it_stands():
    """A pillar's foot keeps its place; its top moves by its height times the lean."""
    plain, shown = stage(), state()
    row = int(np.flatnonzero(plain.scenery.ids == 3)[0])
    sway = np.zeros((len(plain.scenery), 2))
    sway[row] = 0.0, 0.1
    tall = plain.scenery.positions[row] + [0.0, 0.0, plain.scenery.sizes[row, 2]]
    with GlRenderer(plain, CAMERA) as renderer:
        upright = renderer.render(shown, CAMERA, POSE)
        leaning = renderer.render(replace(shown, sway=sway), CAMERA, POSE)
    moved = project(CAMERA, POSE, np.add(tall, [0.0, 0.6, 0.0]))[0] - project(CAMERA, POSE, tall)[0]
    columns = [np.nonzero(picture.ids == 3) for picture in (upright, leaning)]
    tops = [x[y == y.min()].mean() for y, x in columns]
    feet = [x[y == y.max()].mean() for y, x in columns]
    assert abs(feet[1] - feet[0]) < 1.0
    assert abs((tops[1] - tops[0]) - moved[0]) < 1.0
    assert abs(moved[0]) > 2.0
