"""Pictures of vehicles in one light: what a shade takes is given back, and nothing else is changed."""

from __future__ import annotations

import numpy as np
import pytest

from tracker.aerial.appearance import PATCH
from tracker.aerial.daylight import Daylight, _median

ROAD, SHADE = np.array([110.0, 112.0, 115.0]), np.array([0.45, 0.5, 0.58])


def patch(colour) -> np.ndarray:
    return np.broadcast_to(colour, (*PATCH, 3)).astype(float)


def daylight(seed: int = 0) -> Daylight:
    rng, known = np.random.default_rng(seed), Daylight()
    for _ in range(30):
        ground = patch(ROAD) + rng.normal(0, 3, (*PATCH, 3))
        car = rng.uniform(0, 255, ground.size)
        assert np.array_equal(known.restore(car, ground.reshape(-1)), car)
    return known


def test_a_vehicle_in_the_shade_looks_as_in_the_sun():
    car = np.random.default_rng(1).uniform(20, 240, (*PATCH, 3))
    found = daylight().restore((SHADE * car).reshape(-1), (SHADE * patch(ROAD)).reshape(-1))
    assert np.allclose(found, car.reshape(-1), rtol=0.06)


def test_only_the_part_that_is_in_the_shade_is_made_lighter():
    car, light = np.random.default_rng(2).uniform(20, 240, (*PATCH, 3)), np.ones((*PATCH, 3))
    light[:6] = SHADE
    found = daylight().restore((light * car).reshape(-1), (light * patch(ROAD)).reshape(-1))
    found = found.reshape(*PATCH, 3)
    # At the shade's edge cells are between.
    assert np.allclose(found[:5], car[:5], rtol=0.06)
    assert np.array_equal(found[7:], car[7:])


def test_pale_lines_change_nothing():
    car, ground = np.random.default_rng(3).uniform(20, 240, (*PATCH, 3)), patch(ROAD).copy()
    ground[:, 2:4] = 230.0
    assert np.array_equal(daylight().restore(car.reshape(-1), ground.reshape(-1)), car.reshape(-1))


def test_black_ground_makes_no_picture_brighter_than_white():
    found = daylight().restore(patch(200.0).reshape(-1), patch(0.0).reshape(-1))
    assert (found == 255.0).all()


@pytest.mark.parametrize("count", [1, 2, 5, 72, 200])
def test_the_median_is_numpys(count):
    colours = np.random.default_rng(count).uniform(0, 255, (count, 3))
    assert np.array_equal(_median(colours), np.median(colours, axis=0))
