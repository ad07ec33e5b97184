from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.camera import Camera
from sim.params import SensorParams
from sim.render.types import Picture
from sim.sensor import Sensor, _develop, falloff, noise_amplitude, noise_tile
from tests.sim.toy_stage import light

CAMERA = Camera(width=320, height=240, focal=400.0, cx=160.0, cy=120.0)
CLEAN = SensorParams(noise=0, blur=0, vignetting=0, exposure_lag=0, compression=0)


def grey(level: int) -> Picture:
    shape = (CAMERA.height, CAMERA.width)
    return Picture(
        colour=np.full((*shape, 3), level, np.uint8),
        ids=np.ones(shape, np.uint32),
        depth=np.ones(shape, np.float32),
    )


def sensor(params: SensorParams, *, night: bool = False, wet: float = 0.0, seed: int = 0) -> Sensor:
    return Sensor(params, light(night=night, wet=wet), CAMERA, 30, seed)


def test_the_picture_is_left_as_it_is():
    picture = grey(90)
    before = picture.colour.copy()
    for wet, night in ((0.0, False), (1.0, False), (1.0, True)):
        image = sensor(SensorParams(), night=night, wet=wet).expose(picture, 5, 20.0)
        assert image.shape == picture.colour.shape
        assert image.dtype == np.uint8
        np.testing.assert_array_equal(picture.colour, before)


@pytest.mark.parametrize("noise", [1.0, 2.0, 4.0])
def test_noise_at_mid_grey_has_the_given_deviation(noise):
    made = sensor(CLEAN.model_copy(update={"noise": noise}))
    image = made.expose(grey(112), 0, 0.0).astype(float)
    expected = float(np.hypot(noise_amplitude(noise)[112], 1 / np.sqrt(12)))
    assert image.std() == pytest.approx(expected, rel=0.08)


def test_noise_depends_on_seed_and_tick_alone():
    params = CLEAN.model_copy(update={"noise": 2.0})
    in_order = [sensor(params).expose(grey(112), tick, 0.0) for tick in range(3)]
    running = sensor(params)
    for tick, image in enumerate(in_order):
        np.testing.assert_array_equal(running.expose(grey(112), tick, 0.0), image)
    assert (in_order[0] != in_order[1]).any()
    assert (sensor(params, seed=1).expose(grey(112), 0, 0.0) != in_order[0]).any()


def test_without_any_fault_an_even_picture_stays_even():
    image = sensor(CLEAN).expose(grey(112), 0, 0.0)
    assert np.ptp(image) == 0
    assert abs(int(image[0, 0, 0]) - 112) <= 1


def test_the_exposure_follows_with_its_lag():
    params = CLEAN.model_copy(update={"exposure_lag": 0.5})
    made = sensor(params)
    first = made.expose(grey(200), 0, 0.0).mean()
    after = [made.expose(grey(70), tick, 0.0).mean() for tick in range(1, 61)]
    assert first < 200
    assert np.all(np.diff(after) >= -1e-9)
    assert after[0] < 0.8 * after[-1]
    # After one lag about 63 % of the way is behind it.
    assert (after[14] - after[0]) / (after[-1] - after[0]) == pytest.approx(0.63, abs=0.12)


def test_corners_lose_the_given_share_of_light():
    factors = falloff(CAMERA, 0.25)
    assert factors.max() == pytest.approx(1.0, abs=1e-3)
    assert factors[0, 0] ** 2 == pytest.approx(0.75, abs=0.01)
    image = sensor(CLEAN.model_copy(update={"vignetting": 0.25})).expose(grey(112), 0, 0.0)
    assert image[0, 0, 0] < image[120, 160, 0]


def test_noise_tile_is_standard_and_larger_than_the_frame():
    tile = noise_tile(0, CAMERA)
    assert tile.shape[0] > CAMERA.height
    assert tile.shape[1] > CAMERA.width
    assert tile.std() == pytest.approx(1.0, abs=1e-3)
    assert abs(tile.mean()) < 0.02


def test_compression_loses_detail_and_none_loses_nothing():
    rng = np.random.default_rng(0)
    picture = replace(grey(0), colour=rng.integers(80, 150, (240, 320, 3)).astype(np.uint8))
    plain = sensor(CLEAN).expose(picture, 0, 0.0).astype(int)
    coded = sensor(CLEAN.model_copy(update={"compression": 60})).expose(picture, 0, 0.0).astype(int)
    assert np.abs(coded - plain).mean() > 2


def test_rain_shows_and_is_the_same_for_the_same_tick():
    picture = grey(60)
    dry, wet = sensor(CLEAN), sensor(CLEAN, wet=1.4)
    clean, first = dry.expose(picture, 20, 25.0), wet.expose(picture, 20, 25.0)
    assert np.ptp(clean) == 0
    assert np.ptp(first.astype(int)) > 8
    np.testing.assert_array_equal(sensor(CLEAN, wet=1.4).expose(picture, 20, 25.0), first)


def test_bright_lamps_glare_at_night():
    picture = grey(4)
    picture.colour[108:120, 146:158] = 255
    image = sensor(CLEAN, night=True).expose(picture, 0, 0.0)
    assert int(image[113, 164, 0]) > int(image[20, 20, 0]) + 3


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), gain=st.floats(0.5, 2.0), noise=st.floats(0.0, 20.0))
def test_developing_is_what_numpy_says_pixel_by_pixel(seed, gain, noise):
    rng = np.random.default_rng(seed)
    rows, columns = 7, 37
    image = rng.integers(0, 256, (3, rows, columns)).astype(np.uint8)
    lens = rng.uniform(0.6, 1.0, (rows, columns)).astype(np.float32)
    tile = rng.standard_normal((rows + 9, columns + 9)).astype(np.float32)
    shifts, amplitude = rng.integers(0, 9, (4, 2)), noise_amplitude(noise)
    out = np.empty_like(image)
    _develop(image, lens, gain, tile, shifts, amplitude, out)

    one, windows = np.float32(1), [tile[a : a + rows, b : b + columns] for a, b in shifts]
    red, green, blue = np.float32(gain) * lens * image
    grey = np.minimum((red + green + green + blue) * np.float32(0.25), 255).astype(int)
    common = np.float32(0.5) + amplitude[grey] * np.float32(0.8) * windows[0]
    for plane, found, window in zip((red, green, blue), out, windows[1:], strict=True):
        wanted = np.minimum(plane, 255 * one) + common + amplitude[grey] * np.float32(0.6) * window
        np.testing.assert_array_equal(found, np.clip(wanted, 0, 255).astype(np.uint8))
