import hashlib
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from sim.camera import Pose, project
from sim.render.context import DEBIAN_PACKAGES, RenderUnavailableError
from sim.render.gl import GlRenderer
from sim.render.pbr import PbrRenderer, code_colour
from sim.render.types import Picture
from sim.world import FIRST_VEHICLE_ID, GROUND_ID, SKY_ID, Lamps
from tests.sim.toy_stage import CAMERA, POSE, bodies, light, stage, state


@pytest.fixture(scope="module")
def renderer():
    with GlRenderer(stage(), CAMERA) as made:
        yield made


def digest(picture: Picture) -> str:
    parts = (picture.colour, picture.ids, picture.depth)
    return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).hexdigest()


def poses() -> list[Pose]:
    rng = np.random.default_rng(4)
    return [
        Pose.looking((x, -1.8 + rng.normal(0, 0.3), 1.2), yaw=rng.normal(0, 0.1), pitch=rng.normal(0, 0.03))
        for x in np.linspace(0.0, 45.0, 12)
    ]


def test_ids_partition_the_frame(renderer):
    picture = renderer.render(state(), CAMERA, POSE)
    assert picture.colour.shape == (120, 160, 3)
    assert picture.ids.dtype == np.uint32
    known = {SKY_ID, GROUND_ID, *stage().scenery.ids.tolist(), *state().vehicles.ids.tolist()}
    assert set(np.unique(picture.ids).tolist()) <= known
    assert {SKY_ID, GROUND_ID, 5, FIRST_VEHICLE_ID} <= set(np.unique(picture.ids).tolist())
    np.testing.assert_array_equal(np.isinf(picture.depth), picture.ids == SKY_ID)
    assert picture.depth.min() >= CAMERA.near


def test_depth_of_the_ground_is_that_of_the_pixels_centre(renderer):
    picture = renderer.render(state(), CAMERA, POSE)
    rows, _ = np.nonzero(picture.ids == GROUND_ID)
    expected = CAMERA.focal * 1.2 / (rows + 0.5 - CAMERA.cy)
    np.testing.assert_allclose(picture.depth[picture.ids == GROUND_ID], expected, rtol=1e-4)


def test_bodies_lie_where_the_camera_projects_them(renderer):
    picture = renderer.render(state(), CAMERA, POSE)
    rear = np.array([[12 - 2.2, -1.8 + y, z] for y in (-0.9, 0.9) for z in (0.2, 1.0)])
    pixels, depth = project(CAMERA, POSE, rear)
    inside = picture.ids[
        int(pixels[:, 1].min()) + 2 : int(pixels[:, 1].max()) - 1,
        int(pixels[:, 0].min()) + 2 : int(pixels[:, 0].max()) - 1,
    ]
    assert (inside == FIRST_VEHICLE_ID).all()
    rows, columns = np.nonzero(picture.ids == FIRST_VEHICLE_ID)
    assert rows.max() + 1 == pytest.approx(pixels[:, 1].max(), abs=1)
    assert columns.min() == pytest.approx(pixels[:, 0].min(), abs=1)
    assert picture.depth[picture.ids == FIRST_VEHICLE_ID].min() == pytest.approx(depth[0] - 0.05, abs=0.02)


def test_two_renderers_and_two_renderings_give_the_same_bits(renderer):
    first = digest(renderer.render(state(), CAMERA, POSE))
    renderer.render(state(7), CAMERA, poses()[3])
    assert digest(renderer.render(state(), CAMERA, POSE)) == first
    with GlRenderer(stage(), CAMERA) as other:
        assert digest(other.render(state(), CAMERA, POSE)) == first


@pytest.mark.parametrize("scale", [1.0, 1.37])
def test_pyrender_sees_the_same_world(renderer, scale):
    camera = replace(CAMERA, focal=CAMERA.focal * scale)
    with PbrRenderer(stage(), camera) as oracle:
        for tick, pose in enumerate(poses()):
            ours, theirs = (
                renderer.render(state(tick), camera, pose),
                oracle.render(state(tick), camera, pose),
            )
            signed = ours.ids.astype(np.int64)
            inner = ndimage.maximum_filter(signed, 3) == ndimage.minimum_filter(signed, 3)
            np.testing.assert_array_equal(ours.ids[inner], theirs.ids[inner])
            assert np.mean(ours.ids != theirs.ids) < 1e-3
            # Inside one body depth jumps too, where one of its parts stands before another.
            finite = np.where(ours.ids == SKY_ID, 1.0, ours.depth)
            smooth = ndimage.maximum_filter(finite, 3) < 1.2 * ndimage.minimum_filter(finite, 3)
            held = inner & smooth & (ours.ids != SKY_ID)
            np.testing.assert_allclose(ours.depth[held], theirs.depth[held], rtol=1e-3)


def test_interleaved_with_pyrender_nothing_changes(renderer):
    alone = [digest(renderer.render(state(tick), CAMERA, pose)) for tick, pose in enumerate(poses()[:4])]
    with PbrRenderer(stage(), CAMERA) as oracle:
        theirs = []
        for tick, pose in enumerate(poses()[:4]):
            theirs.append(digest(oracle.render(state(tick), CAMERA, pose)))
            assert digest(renderer.render(state(tick), CAMERA, pose)) == alone[tick]
        with GlRenderer(stage(), CAMERA) as fresh:
            assert digest(fresh.render(state(0), CAMERA, poses()[0])) == alone[0]
        again = [digest(oracle.render(state(tick), CAMERA, pose)) for tick, pose in enumerate(poses()[:4])]
        assert again == theirs


def test_far_from_the_origin_the_picture_is_as_sharp(renderer):
    shift = np.array([15000.0, -9000.0, 0.0])
    there = stage()
    moved = replace(
        there,
        scenery=replace(there.scenery, positions=there.scenery.positions + shift),
        ground=replace(there.ground, vertices=(there.ground.vertices + shift).astype(np.float32)),
    )
    cars = replace(state(), vehicles=replace(state().vehicles, positions=state().vehicles.positions + shift))
    with GlRenderer(moved, CAMERA) as far:
        picture = far.render(cars, CAMERA, Pose(POSE.position + shift, POSE.rotation))
    near = renderer.render(state(), CAMERA, POSE)
    assert np.mean(picture.ids != near.ids) < 1e-3
    assert np.abs(picture.colour.astype(int) - near.colour).mean() < 0.5


def test_shadows_and_lamps_belong_to_no_identity():
    with GlRenderer(stage(), CAMERA) as day, GlRenderer(stage(night=True, wet=1.0), CAMERA) as night:
        dark = night.render(state(), CAMERA, POSE)
        lit = night.render(state(lamps=Lamps.TAIL | Lamps.BRAKE), CAMERA, POSE)
        np.testing.assert_array_equal(day.render(state(), CAMERA, POSE).ids, dark.ids)
        np.testing.assert_array_equal(dark.ids, lit.ids)
        np.testing.assert_array_equal(dark.depth, lit.depth)
        own = dark.ids == FIRST_VEHICLE_ID
        red = lit.colour[own].astype(int) - dark.colour[own]
        assert red[:, 0].max() > 80
        assert red[:, 0].sum() > 2 * red[:, 2].sum()


def test_the_sun_casts_shadows_on_the_ground():
    with GlRenderer(stage(), CAMERA) as sunny:
        # The sun stands to the left and behind: the first car's shadow falls to its right and ahead.
        car = replace(state(), vehicles=bodies([(0, 12.0, -1.8, 0.0)], FIRST_VEHICLE_ID))
        none = replace(state(), vehicles=bodies([], FIRST_VEHICLE_ID))
        with_car, without = sunny.render(car, CAMERA, POSE), sunny.render(none, CAMERA, POSE)
    (pixel,), _ = project(CAMERA, POSE, [[11.0, -3.1, 0.0]])
    row, column = int(pixel[1]), int(pixel[0])
    assert with_car.ids[row, column] == GROUND_ID
    assert with_car.colour[row, column].sum() < 0.8 * without.colour[row, column].sum()


def test_what_drives_on_a_bridge_casts_its_shadow_there():
    # Of the stage's bridge the deck lies 7 m up; the shadow of a car on it falls to the right and ahead.
    above = Pose.looking((60.0, 0.0, 30.0), yaw=0.0, pitch=-np.pi / 2)
    on_deck = bodies([(0, 60.0, 0.0, 0.0)], FIRST_VEHICLE_ID)
    on_deck = replace(on_deck, positions=np.array([[60.0, 0.0, 7.0]]))
    below = bodies([(0, 60.0, 0.0, 0.0)], FIRST_VEHICLE_ID)
    none = bodies([], FIRST_VEHICLE_ID)
    with GlRenderer(stage(), CAMERA) as sunny:
        upon, under, empty = (
            sunny.render(replace(state(), vehicles=vehicles), CAMERA, above).colour.astype(int)
            for vehicles in (on_deck, below, none)
        )
    (pixel, lit), _ = project(CAMERA, above, [[60.4, -1.3, 7.0], [60.0, 1.5, 7.0]])
    row, column = int(pixel[1]), int(pixel[0])
    assert upon[row, column].sum() < 0.8 * empty[row, column].sum()
    np.testing.assert_array_equal(upon[int(lit[1]), int(lit[0])], empty[int(lit[1]), int(lit[0])])
    # That of a car below does not show through.
    np.testing.assert_array_equal(under[row, column], empty[row, column])


def test_codes_keep_24_bits():
    for code in (1, 255, 256, 65_535, 65_536, 1 << 23):
        red, green, blue = code_colour(code)
        assert (red << 16) + (green << 8) + blue == code


def test_without_egl_the_error_names_the_packages(monkeypatch):
    code = (
        "import moderngl\n"
        "def broken(**kwargs):\n    raise OSError('libEGL.so not found')\n"
        "moderngl.create_context = broken\n"
        "from sim.render.context import RenderUnavailableError, context\n"
        "try:\n    context()\nexcept RenderUnavailableError as error:\n    print(error)\n"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert all(package in said for package in DEBIAN_PACKAGES)
    assert "libEGL.so not found" in said
    assert len(said.strip().splitlines()) == 1
    assert issubclass(RenderUnavailableError, RuntimeError)


def test_importing_the_renderer_opens_no_context():
    code = (
        "import sys, sim.render.gl, sim.render.pbr; print('OpenGL' in sys.modules, 'pyrender' in sys.modules)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.split() == ["False", "False"]


def test_light_of_the_stage_is_what_the_ground_shows():
    dim = replace(stage(), light=replace(light(), sun_colour=np.zeros(3)))
    with GlRenderer(stage(), CAMERA) as bright, GlRenderer(dim, CAMERA) as dull:
        first, second = bright.render(state(), CAMERA, POSE), dull.render(state(), CAMERA, POSE)
    on = first.ids == GROUND_ID
    assert first.colour[on].mean() > 1.2 * second.colour[on].mean()
