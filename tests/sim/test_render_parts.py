from dataclasses import replace

import numpy as np
import pytest

from sim.camera import Pose
from sim.models import Surface
from sim.render.ground import cut, fractal, mark_table
from sim.render.instances import SWITCH_FOCAL, Library, in_bands
from sim.render.lamps import LIGHTS, LampPlan, _centres, halos, lights
from sim.rng import stream
from sim.world import FIRST_VEHICLE_ID, Lamps
from tests.sim.toy_stage import CAMERA, MODELS, POSE, bodies, ground, stage, state


def test_stretches_hold_every_face_once_and_in_place():
    whole = ground()
    parts = cut(whole)
    assert parts.count.sum() == 3 * len(whole.faces)
    found = []
    for k in range(len(parts.first)):
        index = parts.faces.ravel()[parts.first[k] : parts.first[k] + parts.count[k]] + parts.base_vertex[k]
        found.append(parts.vertices[index, :3] + parts.origins[k])
    triangles = np.sort(np.concatenate(found).reshape(-1, 9), axis=0)
    expected = np.sort(whole.vertices[whole.faces].reshape(-1, 9), axis=0)
    np.testing.assert_allclose(triangles, expected, atol=1e-3)


def test_the_paved_faces_come_first():
    parts = cut(ground())
    for k in range(len(parts.first)):
        index = parts.faces.ravel()[parts.first[k] : parts.first[k] + parts.count[k]] + parts.base_vertex[k]
        offset = np.abs(parts.vertices[index, 4]).reshape(-1, 3).max(axis=1)
        paved = int(parts.paved[k]) // 3
        assert (offset[:paved] <= 8.01).all()
        assert (offset[paved:] > 8.01).all()


def test_what_the_camera_sees_is_a_small_part_of_a_long_road():
    parts = cut(ground())
    chosen = parts.select(CAMERA, Pose.looking((900.0, 0.0, 1.2), yaw=0.0))
    assert 0 < len(chosen) < len(parts.first)
    behind = parts.upper[:, 0] < 850
    assert not np.isin(np.flatnonzero(behind), chosen).any()


def test_fractal_noise_repeats_without_a_seam():
    noise = fractal(stream(0, "test"), (128, 128), 1.5)
    assert noise.std() == pytest.approx(1.0)
    inner = np.abs(np.diff(noise, axis=1)).mean()
    assert np.abs(noise[:, 0] - noise[:, -1]).mean() < 1.5 * inner


def test_nearest_line_of_each_place():
    table = mark_table(ground())[0]
    low, high = -8.0 - 4.0, 8.0 + 4.0
    place = int((3.7 - low) / (high - low) * 2048)
    np.testing.assert_allclose(table[place], [3.6, 0.075, 1.0, 0.0])
    place = int((0.2 - low) / (high - low) * 2048)
    np.testing.assert_allclose(table[place], [0.15, 0.075, 0.0, 1.0])


def test_selection_agrees_with_a_look_at_every_corner():
    library = Library(MODELS)
    rng = np.random.default_rng(1)
    rows = [(0, x, y, yaw) for x, y, yaw in rng.uniform([-40, -40, -3], [120, 40, 3], (300, 3))]
    cars = bodies(rows, FIRST_VEHICLE_ID)
    chosen = library.select(cars, CAMERA, POSE)
    everything = library.select(cars, CAMERA, POSE, widen=1e3)
    corners = library.corners(cars, everything)
    local = POSE.to_camera(corners)
    x = CAMERA.focal * local[..., 0] / local[..., 2] + CAMERA.cx
    y = CAMERA.focal * local[..., 1] / local[..., 2] + CAMERA.cy
    ahead = local[..., 2] > CAMERA.near
    within = ahead & (x > 0) & (x < CAMERA.width) & (y > 0) & (y < CAMERA.height)
    assert set(everything.rows[within.any(axis=1)].tolist()) <= set(chosen.rows.tolist())
    assert len(chosen) < 0.6 * len(cars)


def test_levels_of_detail_follow_the_distance_and_bands_keep_all():
    library = Library(MODELS)
    cars = state().vehicles
    chosen = library.select(cars, CAMERA, POSE)
    distance = np.linalg.norm(cars.positions[chosen.rows] - POSE.position + [0, 0, 0.75], axis=1)
    # The camera's short focal length shows everything small: the coarse mesh takes over sooner.
    np.testing.assert_array_equal(chosen.meshes == 1, distance >= 60.0 * CAMERA.focal / SWITCH_FOCAL)
    banded = in_bands(cars, chosen, POSE)
    assert sorted(banded.rows.tolist()) == sorted(chosen.rows.tolist())
    commands = library.commands(banded.meshes)
    assert commands["instances"].sum() == len(banded)


def test_lamps_of_a_car_are_where_its_mesh_has_them():
    plan = LampPlan(MODELS)
    cars = bodies([(0, 20.0, -1.8, 0.0)], FIRST_VEHICLE_ID, Lamps.TAIL | Lamps.HEAD)
    burning = plan.burning(cars, CAMERA, POSE, streets=False)
    assert len(burning.power) == 4
    tail = burning.position[burning.direction[:, 0] < 0]
    np.testing.assert_allclose(np.sort(tail[:, 1]), [-0.7, 0.7], atol=0.02)
    np.testing.assert_allclose(tail[:, 0], 20.0 - 2.22, atol=0.05)
    glare = halos(burning, CAMERA, night=True)
    assert len(glare) == 2  # the head lamps shine away from the camera
    assert (glare["colour"][:, 0] > 5 * glare["colour"][:, 2]).all()


def test_dark_cars_have_no_lamps_and_the_list_of_lights_is_full_of_nothing():
    plan = LampPlan(MODELS)
    burning = plan.burning(stage().scenery, CAMERA, POSE, streets=False)
    shining = lights(burning)
    assert shining.position.shape == (LIGHTS, 3)
    assert not shining.colour.any()
    assert len(halos(burning, CAMERA, night=True)) == 0


def test_every_lamp_that_is_on_is_found_body_by_body():
    plan, rng = LampPlan(MODELS), np.random.default_rng(0)
    rows = [(0, x, y, yaw) for x, y, yaw in rng.uniform([-30, -10, -3], [300, 10, 3], (40, 3))]
    cars = bodies(rows, FIRST_VEHICLE_ID)
    cars = replace(cars, lamps=rng.integers(0, 8, 40).astype(np.uint8), sizes=cars.sizes * 1.1)
    found = plan.burning(cars, CAMERA, POSE, streets=False)
    position, direction, power, strength = [], [], [], []
    for k in range(40):
        ahead = (cars.positions[k] - POSE.position) @ POSE.rotation[2]
        if not -20 < ahead < 0.5 * CAMERA.far:
            continue
        lamps, cos, sin = int(cars.lamps[k]), np.cos(cars.yaws[k]), np.sin(cars.yaws[k])
        turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        shown = []
        if lamps & (Lamps.TAIL | Lamps.BRAKE):
            braking = bool(lamps & Lamps.BRAKE)
            shown.append((Surface.TAIL_LAMP, [-cos, -sin, 0], 1.0, 2.0 if braking else 1.0))
        if lamps & Lamps.HEAD:
            shown.append((Surface.HEAD_LAMP, [cos, sin, -0.05], 28.0, 14.0))
        for surface, aim, sharpness, reach in shown:
            for place in _centres(MODELS[0], surface):
                scale = cars.sizes[k] / MODELS[0].size
                position.append(cars.positions[k] - POSE.position + turn @ (place * scale))
                direction.append(aim)
                power.append(sharpness)
                strength.append(reach)
    np.testing.assert_allclose(found.position, position)
    np.testing.assert_allclose(found.direction, direction)
    np.testing.assert_array_equal(found.power, power)
    np.testing.assert_array_equal(found.strength, strength)
