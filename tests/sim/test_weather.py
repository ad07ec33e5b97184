"""Light that changes, and plants that sway."""

from __future__ import annotations

import numpy as np

from sim.params import LaneLightParams
from sim.weather import SHADED, ChangingLight, Wind
from sim.world import Kind, Lighting
from tests.sim.toy_stage import bodies


def test_nothing_changes_unless_asked_for():
    light = ChangingLight(LaneLightParams(), 3)
    assert {light.at(t) for t in (0.0, 3.0, 20.0)} == {Lighting()}


def test_clouds_dim_the_sun_over_seconds():
    light = ChangingLight(LaneLightParams(passing=0.7), 3)
    sun = np.array([light.at(k / 30).sun[0] for k in range(600)])
    assert sun.min() < 0.55 < 0.75 < sun.max() <= 1.0
    assert sun.min() >= 0.3
    assert (np.abs(np.diff(sun)) / sun[:-1]).max() < 0.05


def test_the_sun_comes_out_from_one_frame_to_the_next():
    light = ChangingLight(LaneLightParams(flash="sun", flash_at=2.0), 0)
    before, after = light.at(59 / 30), light.at(60 / 30)
    assert np.allclose(before.sun, SHADED)
    assert np.allclose(after.sun, 1.0)
    assert before.sky == after.sky


def test_a_lamp_adds_to_the_sky_and_casts_no_shadow():
    light = ChangingLight(LaneLightParams(flash="lamp", flash_at=2.0), 0)
    before, after = light.at(1.9), light.at(2.1)
    assert before.sun == after.sun
    assert np.all(np.array(after.sky) > 1.3 * np.array(before.sky))


def test_plants_sway_about_their_place_and_nothing_else_does():
    scenery = bodies([(1, 5.0, 4.0, 0.0), (1, 15.0, 4.0, 0.0), (2, 40.0, 0.0, 0.0)], 2)
    scenery.kinds[:] = Kind.TREE, Kind.BUSH, Kind.BRIDGE
    wind = Wind(scenery, 0.02, 1)
    leans = np.array([wind.at(k / 30) for k in range(600)])
    assert leans.shape == (600, 3, 2)
    assert not leans[:, 2].any()
    assert (leans[:, :2].std(axis=0).max(axis=1) > 0.004).all()
    assert np.abs(leans).max() < 0.08
    assert np.abs(np.diff(leans, axis=0)).max() < 0.01
    assert not np.allclose(leans[:, 0], leans[:, 1])
