"""What of the foreground is a vehicle: cues as naive code reads them, squares, a rider and its shadow."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.tracker.surroundings import average, differences, reaches, smoothed
from tracker.blobs import clean
from tracker.boosting import learnt
from tracker.motorcycle_lane import foreground as fg

SHAPE = 14, 17
Images = arrays(np.uint8, (*SHAPE, 3))
Masks = arrays(np.bool_, SHAPE)


def naive_cues(image, background, raw, heights, y, x):
    now, then = smoothed(image), smoothed(background)
    maps = differences(now, then)
    red, green, blue = (now[y, x] + 1) / (then[y, x] + 1)
    mean = (red + green + blue) / 3
    most, least = now[y, x].max(), now[y, x].min()
    found = [mean, (blue - red) / mean, (green - (red + blue) / 2) / mean]
    found += [(most - least) / (most + fg.DIM), now[y, x].sum()]
    found += [steps / heights[y] for steps in reaches(raw, y, x)]
    half = int(fg.WINDOW * heights[y] + 0.3)
    for across, down in fg.OFFSETS:
        v, u = int(np.floor(y + down * heights[y] + 0.5)), int(np.floor(x + across * heights[y] + 0.5))
        found += [average(part, v, u, half) for part in maps]
    return found


@settings(max_examples=40, deadline=None)
@given(Images, Images, Masks, st.floats(3, 40), st.floats(0, 2), st.data())
def test_cues_are_those_of_naive_code(image, background, raw, height, slope, data):
    heights = height + slope * np.arange(SHAPE[0])
    y, x = data.draw(st.integers(0, SHAPE[0] - 1)), data.draw(st.integers(0, SHAPE[1] - 1))
    found = fg.cues(image, background, raw, heights, np.array([y]), np.array([x]))
    wanted = naive_cues(image, background, raw, heights, y, x)
    assert found.shape == (1, fg.COUNT)
    np.testing.assert_allclose(found[0], wanted, rtol=1e-3, atol=1.1 / fg.UNIT)


@settings(max_examples=50, deadline=None)
@given(Masks, st.floats(1, 60), st.floats(0, 6))
@example(np.arange(SHAPE[0] * SHAPE[1]).reshape(SHAPE) // SHAPE[1] == 8, 18.0, 6.0)
def test_squares_cover_the_candidates_and_are_as_wide_as_vehicles_are_large(mask, height, slope):
    heights = height + slope * np.arange(SHAPE[0])
    rows, columns, numbers = fg.blocks(mask, fg.widths(heights))
    assert ((numbers >= 0) == mask).all()
    assert len(rows) == len(columns) == len(np.unique(numbers[mask]))
    begins, widths = np.zeros(SHAPE[0], int), np.zeros(SHAPE[0], int)
    y = 0
    while y < SHAPE[0]:
        width = max(int(heights[y] // fg.BLOCK), 1)
        begins[y : y + width], widths[y : y + width] = y, width
        y += width
    for k in range(len(rows)):
        ys, xs = np.nonzero(numbers == k)
        # Each lies about its middle, in one band of rows, and begins where one of its width does.
        assert len(set(begins[ys])) == 1
        width = widths[ys[0]]
        assert len({int(x) // width for x in xs}) == 1
        assert abs(rows[k] - ys).max() <= width
        assert abs(columns[k] - xs).max() <= width


def rider(rng, *, side):
    """A road with a pattern; on it a dark rider, and beside it the shadow that it casts: where is which."""
    road = np.clip(120 + 6 * rng.standard_normal((120, 160, 1)) + np.zeros(3), 0, 255)
    image = road.copy()
    shadow, body = np.zeros((120, 160), bool), np.zeros((120, 160), bool)
    body[40:80, 72:88] = True
    columns = slice(88, 110) if side > 0 else slice(50, 72)
    shadow[66:80, columns] = True
    image[shadow] *= 0.55
    image[40:60, 72:88] = (150, 40, 45)
    image[60:80, 72:88] = (35, 35, 38)
    image[40:47, 76:84] = (225, 220, 215)
    return image, road, body, shadow


@pytest.mark.parametrize("side", [-1, 1])
def test_a_rider_stays_and_its_shadow_goes(side):
    rng = np.random.default_rng(2)
    image, road, body, shadow = rider(rng, side=side)
    noisy = np.clip(image + rng.normal(0, 1.5, image.shape), 0, 255).astype(np.uint8)
    trees = learnt("tracker.motorcycle_lane", "foreground")
    found = clean(fg.weigh(noisy, road.astype(np.uint8), body | shadow, np.full(120, 40.0), trees).vehicles)
    assert found[body].mean() > 0.7
    assert found[shadow].mean() < 0.25
    assert found[~body & ~shadow].mean() < 0.01


def test_what_was_missed_within_a_rider_is_given_back():
    rng = np.random.default_rng(3)
    image, road, body, _ = rider(rng, side=1)
    raw = body & (rng.uniform(size=body.shape) < 0.6)
    trees = learnt("tracker.motorcycle_lane", "foreground")
    found = fg.weigh(image.astype(np.uint8), road.astype(np.uint8), raw, np.full(120, 40.0), trees).vehicles
    assert found[body].mean() > raw[body].mean() + 0.1


def test_nothing_is_found_where_nothing_differs():
    picture = np.full((60, 80, 3), 90, np.uint8)
    trees = learnt("tracker.motorcycle_lane", "foreground")
    none = np.zeros((60, 80), bool)
    assert not fg.weigh(picture, picture, none, np.full(60, 20.0), trees).vehicles.any()
