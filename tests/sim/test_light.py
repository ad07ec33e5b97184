from __future__ import annotations

import numpy as np
import pytest

from sim.light import make_light
from sim.params import LightParams


@pytest.mark.parametrize("seed", range(12))
def test_day(seed):
    light = make_light(LightParams(), seed)
    assert np.linalg.norm(light.sun) == pytest.approx(1)
    assert np.radians(20) <= np.arcsin(light.sun[2]) <= np.radians(60)
    assert light.zenith[2] > light.zenith[0], "blue overhead"
    assert light.horizon.sum() > light.zenith.sum()
    assert light.sun_colour[0] > light.sun_colour[2], "the sun is warm"
    assert not light.night
    assert light.wet == 0


def test_rain_is_grey_dim_and_wet():
    dry, rain = make_light(LightParams(), 3), make_light(LightParams(rain=0.8), 3)
    assert rain.wet > 0.9
    assert rain.cloud == 1
    assert rain.haze > dry.haze
    assert rain.sun_colour.sum() < 0.2 * dry.sun_colour.sum()
    assert np.ptp(rain.zenith) < 0.3 * np.ptp(dry.zenith)


def test_night_is_faint():
    light = make_light(LightParams(time="night"), 1)
    assert light.night
    assert max(light.sun_colour.max(), light.zenith.max(), light.horizon.max()) < 0.01


def test_cloud_dims_the_sun_step_by_step():
    power = [make_light(LightParams(cloud=cloud), 5).sun_colour.sum() for cloud in (0, 0.3, 0.6, 0.8, 1.0)]
    assert power == sorted(power, reverse=True)
    assert power[-1] < 0.1 * power[0]


def test_depends_on_seed_alone():
    first, again, other = (make_light(LightParams(), seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(first.sun, again.sun)
    assert first.seed == again.seed
    assert first.seed != other.seed
    assert not np.array_equal(first.sun, other.sun)
