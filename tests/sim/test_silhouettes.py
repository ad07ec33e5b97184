from dataclasses import replace

import numpy as np
import pytest

from sim.camera import Pose
from sim.render.gl import GlRenderer
from sim.render.silhouettes import layered
from sim.world import FIRST_VEHICLE_ID
from tests.sim.toy_stage import CAMERA, POSE, bodies, stage, state


@pytest.fixture(scope="module")
def renderer():
    with GlRenderer(stage(), CAMERA) as made:
        yield made


def framed(mask: tuple[int, int, np.ndarray]) -> np.ndarray:
    row, column, inside = mask
    out = np.zeros((CAMERA.height, CAMERA.width), bool)
    out[row : row + inside.shape[0], column : column + inside.shape[1]] = inside
    return out


def alone(number: int, tick: int = 0):
    cars = state(tick)
    return replace(cars, vehicles=cars.vehicles.take(np.array([number])))


@pytest.mark.parametrize("tick", range(0, 30, 3))
def test_each_silhouette_is_the_vehicle_rendered_alone(renderer, tick):
    pose = Pose.looking((0.3 * tick, -1.8, 1.2), yaw=0.02 * np.sin(tick), pitch=0.004)
    found = renderer.silhouettes(state(tick), CAMERA, pose)
    picture = renderer.render(state(tick), CAMERA, pose)
    empty = replace(stage(), scenery=bodies([], 2))
    with GlRenderer(empty, CAMERA) as bare:
        for k, number in enumerate(found.ids - FIRST_VEHICLE_ID):
            mask = framed(found.masks[k])
            own = bare.render(alone(int(number), tick), CAMERA, pose).ids == found.ids[k]
            np.testing.assert_array_equal(mask, own)
            assert mask.sum() == found.pixels[k] <= found.pixels_full[k]
            visible = picture.ids == found.ids[k]
            assert not (visible & ~mask).any()


def test_the_extended_frame_is_a_frame_three_times_as_wide(renderer):
    pose = POSE
    found = renderer.silhouettes(state(), CAMERA, pose)
    wide = replace(
        CAMERA,
        width=3 * CAMERA.width,
        height=3 * CAMERA.height,
        cx=CAMERA.cx + CAMERA.width,
        cy=CAMERA.cy + CAMERA.height,
    )
    with GlRenderer(replace(stage(), scenery=bodies([], 2)), wide) as bare:
        for k, number in enumerate(found.ids - FIRST_VEHICLE_ID):
            own = bare.render(alone(int(number)), wide, pose).ids == found.ids[k]
            assert abs(int(own.sum()) - int(found.pixels_full[k])) <= 2
            rows, columns = np.nonzero(own)
            if len(rows):
                expected = (
                    np.array([columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]) - [160, 120] * 2
                )
                np.testing.assert_allclose(found.boxes[k], expected, atol=1)
            else:
                assert np.isnan(found.boxes[k]).all()


def test_vehicles_across_the_edge_and_beside_the_camera_are_counted_beyond_it(renderer):
    found = renderer.silhouettes(state(), CAMERA, POSE)
    full = dict(zip(found.ids.tolist(), found.pixels_full.tolist(), strict=True))
    inside = dict(zip(found.ids.tolist(), found.pixels.tolist(), strict=True))
    across, beside = FIRST_VEHICLE_ID + 3, FIRST_VEHICLE_ID + 5
    assert full[across] > inside[across] > 0
    assert inside[beside] == 0
    assert full[beside] > 0


def test_no_vehicles_no_silhouettes(renderer):
    found = renderer.silhouettes(replace(state(), vehicles=bodies([], FIRST_VEHICLE_ID)), CAMERA, POSE)
    assert len(found.ids) == len(found.pixels) == 0
    assert found.boxes.shape == (0, 4)


def test_boxes_in_one_drawing_do_not_overlap():
    rng = np.random.default_rng(0)
    low = rng.integers(0, 100, (40, 2))
    boxes = np.concatenate([low, low + rng.integers(1, 30, (40, 2))], axis=1)
    drawings = layered(boxes, np.arange(40))
    assert sorted(np.concatenate([drawing.rows for drawing in drawings]).tolist()) == list(range(40))
    for drawing in drawings:
        painted = np.zeros((140, 140), int)
        for x0, y0, x1, y1 in boxes[drawing.rows]:
            painted[y0:y1, x0:x1] += 1
        assert painted.max() == 1
        rows, columns = np.nonzero(painted)
        assert drawing.area == (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
