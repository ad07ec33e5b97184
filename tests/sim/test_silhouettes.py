from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sim.camera import Pose
from sim.render.gl import GlRenderer
from sim.render.silhouettes import PLOT, laid_out, survey
from sim.render.types import Plots
from sim.world import FIRST_VEHICLE_ID
from tests.sim.toy_stage import CAMERA, POSE, bodies, stage, state


@pytest.fixture(scope="module")
def renderer():
    with GlRenderer(stage(), CAMERA) as made:
        yield made


def framed(plots: Plots, k: int) -> np.ndarray:
    x0, y0, x1, y1 = plots.boxes[k]
    out = np.zeros((CAMERA.height, CAMERA.width), bool)
    out[y0:y1, x0:x1] = plots.mask(k)
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
            mask = framed(found.plots, k)
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


def test_seen_with_the_picture_or_alone_it_is_the_same(renderer):
    for tick in range(0, 30, 10):
        pose = Pose.looking((0.3 * tick, -1.8, 1.2), yaw=0.02 * np.sin(tick), pitch=0.004)
        picture, found = renderer.finish(renderer.begin(state(tick), CAMERA, pose))
        other, alone_found = (
            renderer.render(state(tick), CAMERA, pose),
            renderer.silhouettes(state(tick), CAMERA, pose),
        )
        for name in ("colour", "ids", "depth"):
            np.testing.assert_array_equal(getattr(picture, name), getattr(other, name))
        for name in ("ids", "pixels", "pixels_full", "boxes"):
            np.testing.assert_array_equal(getattr(found, name), getattr(alone_found, name))
        for k in range(len(found.ids)):
            np.testing.assert_array_equal(found.plots.mask(k), alone_found.plots.mask(k))


@settings(max_examples=50, deadline=None)
@given(
    masks=st.lists(hnp.arrays(bool, st.tuples(st.integers(1, 7), st.integers(1, 9))), max_size=5),
    corner=st.tuples(st.integers(0, 12), st.integers(0, 12)),
    hole=st.tuples(*[st.integers(0, 25)] * 4),
)
def test_what_is_marked_in_a_plot_is_counted_outside_the_hole(masks, corner, hole):
    x, y = corner
    boxes = np.array([[x, y, x + m.shape[1], y + m.shape[0]] for m in masks], np.int64).reshape(-1, 4)
    plots = laid_out(boxes)
    assert plots.dtype == PLOT
    covered = np.concatenate([np.zeros(0, bool), *(m.ravel() for m in masks)]).astype(np.uint32)
    found = survey(covered, plots, np.array(hole))
    for k, mask in enumerate(masks):
        rows, columns = np.nonzero(mask)
        rows, columns = rows + y, columns + x
        kept = ~((rows >= hole[1]) & (rows < hole[3]) & (columns >= hole[0]) & (columns < hole[2]))
        rows, columns = rows[kept], columns[kept]
        wanted = [0] * 5
        if len(rows):
            wanted = [len(rows), columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        assert found[k].tolist() == wanted
