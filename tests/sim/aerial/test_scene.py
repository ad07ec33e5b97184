"""What the camera in the air sees, against what is true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sim.camera import ground_homography, project
from sim.params import (
    AerialCameraParams,
    AerialParams,
    AerialRoadParams,
    AerialSceneryParams,
    AerialTrafficParams,
    LaneLightParams,
    PlatformParams,
    SensorParams,
)
from sim.scenes.aerial import AerialScene, view_reach
from sim.simulation import Simulation
from sim.truth.types import AerialTruth
from sim.world import FIRST_SCENERY_ID, GROUND_ID, Kind

PLAIN = AerialParams(
    camera=AerialCameraParams(width=320, height=240, focal=400.0),
    road=AerialRoadParams(lanes=2, bridge_width=26.0),
    traffic=AerialTrafficParams(density=42.0, oncoming_density=40.0, bridge_density=10.0),
    scenery=AerialSceneryParams(trees=0.3),
)


def run(params: AerialParams, seed: int, frames: int):
    scene = AerialScene(params, seed=seed, rate=30, seconds=2.0)
    with Simulation(scene, params.sensor, seed=seed) as simulation:
        return scene, list(simulation.run(frames))


class Zooming(AerialScene):
    """A scene whose camera zooms from tick to tick."""

    def step(self, action=None):
        state = super().step(action)
        self.camera = replace(self.camera, focal=400.0 + 20.0 * state.tick)
        return state


def test_frames_that_are_drawn_ahead_are_those_of_single_steps():
    recorded = []
    for ahead in (True, False):
        scene = Zooming(PLAIN, seed=4, rate=30, seconds=2.0)
        with Simulation(scene, PLAIN.sensor, seed=4) as simulation:
            recorded.append(list(simulation.run(4)) if ahead else [simulation.step() for _ in range(4)])
    assert len(recorded[0]) == 4
    for one, other in zip(*recorded, strict=True):
        assert one.tick == other.tick
        np.testing.assert_array_equal(one.pose.position, other.pose.position)
        for name in ("image", "ids", "depth"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        for name in ("ids", "box_amodal", "box_visible", "visible_px", "ground_to_image"):
            np.testing.assert_array_equal(getattr(one.truth, name), getattr(other.truth, name))


@pytest.fixture(scope="module")
def flight():
    return run(PLAIN, 5, 3)


def test_same_seed_same_pixels_and_truth_other_seed_others(flight):
    first, again, other = flight[1][-1], run(PLAIN, 5, 3)[1][-1], run(PLAIN, 6, 3)[1][-1]
    assert first.image.tobytes() == again.image.tobytes()
    assert first.ids.tobytes() == again.ids.tobytes()
    assert first.truth.box_amodal.tobytes() == again.truth.box_amodal.tobytes()
    assert first.truth.ground_to_image.tobytes() == again.truth.ground_to_image.tobytes()
    assert not np.array_equal(first.ids, other.ids)


def test_noise_light_and_wind_move_no_vehicle_and_no_camera(flight):
    params = PLAIN.model_copy(
        update={
            "sensor": SensorParams(noise=9.0),
            "light": LaneLightParams(passing=0.8, cloud=0.5),
            "scenery": PLAIN.scenery.model_copy(update={"wind": 3.0}),
        }
    )
    for a, b in zip(flight[1], run(params, 5, 3)[1], strict=True):
        assert a.state.vehicles.positions.tobytes() == b.state.vehicles.positions.tobytes()
        assert a.pose.position.tobytes() == b.pose.position.tobytes()
        assert not np.array_equal(a.image, b.image)


def test_truth_agrees_with_the_id_map(flight):
    for seen in flight[1]:
        truth = seen.truth
        assert isinstance(truth, AerialTruth)
        for k, vehicle in enumerate(truth.ids.tolist()):
            mask = seen.ids == vehicle
            assert truth.visible_px[k] == mask.sum()
            if mask.any():
                rows, columns = np.nonzero(mask)
                box = [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
                assert truth.box_visible[k].tolist() == box
        assert not (seen.ids == 0).any(), "no sky"


def test_vehicles_below_the_bridge_are_hidden_by_it_and_boxed_all_the_same(flight):
    scene, frames = flight
    bridges = scene.stage.scenery.ids[scene.stage.scenery.kinds == Kind.BRIDGE]
    assert len(bridges) == 1
    truth = frames[-1].truth
    hidden = (truth.visible_px == 0) & (truth.amodal_px > 10)
    below = hidden & (truth.occluder_ids == bridges[0])
    assert below.any()
    for k in np.flatnonzero(below):
        x0, y0, x1, y1 = truth.box_amodal[k].astype(int).clip(0, [320, 240, 320, 240])
        assert (frames[-1].ids[y0:y1, x0:x1] == bridges[0]).mean() > 0.5
    above = (truth.world_positions[:, 2] > 1.0) & (truth.amodal_px > 10)
    assert above.any()
    # Parapets hide a strip of those on the bridge, and no more.
    assert truth.visibility_in_frame[above].min() > 0.5


def test_the_homography_puts_points_of_the_ground_where_the_camera_sees_them(flight):
    scene, frames = flight
    for seen in frames:
        points = np.random.default_rng(0).uniform(-60, 60, (50, 2)) + seen.pose.position[:2]
        pixels, depth = project(scene.camera, seen.pose, np.column_stack([points, np.zeros(50)]))
        mapped = np.column_stack([points, np.ones(50)]) @ seen.truth.ground_to_image.T
        assert np.allclose(mapped[:, 2], depth)
        assert np.allclose(mapped[:, :2] / mapped[:, 2:], pixels)


def test_the_homography_agrees_with_the_depth_map(flight):
    """A ground pixel, taken back to the ground plane, is as deep as the renderer says."""
    seen = flight[1][-1]
    rows, columns = np.nonzero(seen.ids == GROUND_ID)
    pick = np.random.default_rng(1).integers(0, len(rows), 200)
    pixels = np.column_stack([columns[pick] + 0.5, rows[pick] + 0.5, np.ones(200)])
    ground = pixels @ np.linalg.inv(seen.truth.ground_to_image).T
    ground /= ground[:, 2:]
    depth = (ground @ seen.truth.ground_to_image.T)[:, 2]
    # The plain beyond the photo lies a little lower.
    assert np.abs(depth - seen.depth[rows[pick], columns[pick]]).max() < 0.08


def test_frame_to_frame_homographies_move_the_picture_as_it_moved():
    """Warped by the truth, one frame's ground lies on the next's better than it does unwarped."""
    import cv2

    params = PLAIN.model_copy(
        update={
            "sensor": SensorParams(noise=0.0, compression=0, vignetting=0.0),
            "platform": PlatformParams(jitter=4.0),
        }
    )
    _, frames = run(params, 5, 6)
    first, last = frames[0], frames[-1]
    between = last.truth.ground_to_image @ np.linalg.inv(first.truth.ground_to_image)
    shift = np.array([[1, 0, -0.5], [0, 1, -0.5], [0, 0, 1.0]])  # OpenCV's pixel centres are whole numbers
    moved = cv2.warpPerspective(first.image, shift @ between @ np.linalg.inv(shift), (320, 240))
    both = (last.ids == GROUND_ID) & (
        cv2.warpPerspective((first.ids == GROUND_ID) * 1.0, between, (320, 240)) == 1
    )

    def error(image):
        return np.abs(image.astype(int) - last.image)[both].mean()

    assert error(moved) < 0.6 * error(first.image)


def test_amodal_boxes_hold_the_projected_middle(flight):
    scene, frames = flight
    truth = frames[-1].truth
    middle = truth.world_positions + [0, 0, 0.5] * truth.sizes
    pixels, _ = project(scene.camera, frames[-1].pose, middle)
    inside = (pixels > truth.box_amodal[:, :2] - 1) & (pixels < truth.box_amodal[:, 2:] + 1)
    near = ~np.isnan(truth.box_amodal).any(axis=1) & (truth.in_frame > 0.5)
    assert near.any()
    assert inside[near].all()


def test_vehicles_are_as_long_as_the_paper_has_them():
    scene = AerialScene(AerialParams(), seed=3, rate=30, seconds=1.0)
    state = scene.step()
    cars = state.vehicles.take(state.vehicles.kinds == Kind.CAR)
    homography = ground_homography(scene.camera, scene.pose(state))
    scale = np.sqrt(np.abs(np.linalg.det(homography[:2, :2]))) / scene.pose(state).position[2]
    assert 10 < np.median(cars.sizes[:, 0]) * scale < 40


def test_the_photo_covers_all_that_the_camera_may_see(flight):
    scene, frames = flight
    photo = scene.stage.ground.photo
    for seen in frames:
        corners = np.array([[x, y, 1.0] for x in (0, 320) for y in (0, 240)])
        ground = corners @ np.linalg.inv(seen.truth.ground_to_image).T
        ground = ground[:, :2] / ground[:, 2:]
        assert (ground > photo.low).all()
        assert (ground < np.add(photo.low, photo.extent)).all()
    assert view_reach(scene.camera, PLAIN) > 60


def test_scenery_is_numbered_and_clear_of_the_asphalt(flight):
    scene, _ = flight
    scenery = scene.stage.scenery
    assert scenery.ids[0] == FIRST_SCENERY_ID
    assert len(np.unique(scenery.ids)) == len(scenery)
    strip = scene._layout.network.strips[0]
    standing = scenery.take(np.isin(scenery.kinds, (Kind.TREE, Kind.BUILDING, Kind.CAR, Kind.BUSH)))
    road = strip.beside((strip.paved[0] + strip.paved[1]) / 2)
    away = np.hypot(*(standing.positions[:, None, :2] - road).transpose(2, 0, 1)).min(axis=1)
    assert away.min() > (strip.paved[1] - strip.paved[0]) / 2
