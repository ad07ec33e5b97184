"""Shadows: where they fall is learnt from bright vehicles, and taken off all."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.aerial.appearance import PATCH
from tracker.aerial.background import Background
from tracker.aerial.daylight import Daylight
from tracker.aerial.shadows import EVERY, CastShadows, filled, goes_on

NONE = np.zeros((0, 4))
PIXELS = 3 * PATCH[0] * PATCH[1]


ROAD = np.array([110, 112, 114], np.uint8)
SHADE = (0.55 * ROAD).astype(np.uint8)


@given(st.floats(0.0, 6.3), st.lists(st.integers(0, 6), min_size=3, max_size=3), st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_a_region_goes_on_where_every_pixel_on_the_way_is_its_own(angle, reaches, seed):
    labels = np.random.default_rng(seed).integers(0, 3, (10, 12)).repeat(3, 0).repeat(3, 1).astype(np.int32)
    side = np.array([np.cos(angle), np.sin(angle)])
    found = goes_on(labels, side, np.array(reaches))
    for i, j in np.ndindex(labels.shape):
        label = labels[i, j]
        ways = [(j + 0.5, i + 0.5) + step * side for step in range(1, reaches[label] + 1)]
        inside = [(int(np.floor(y)), int(np.floor(x))) for x, y in ways if 0 <= x < 36 and 0 <= y < 30]
        assert found[i, j] == (label > 0 and all(labels[at] == label for at in inside))


@given(st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_what_is_filled_lies_between_two_pixels_of_its_region(seed):
    mask = cv2.medianBlur((np.random.default_rng(seed).random((30, 36)) < 0.6).astype(np.uint8), 5) > 0
    whole = filled(mask)
    assert (whole >= mask).all()
    _, labels = cv2.connectedComponents(mask.astype(np.uint8))
    hulls = [
        cv2.convexHull(cv2.findNonZero((labels == k).astype(np.uint8))) for k in range(1, labels.max() + 1)
    ]
    for y, x in np.argwhere(whole & ~mask):
        point = (float(x), float(y))
        # A hull that is drawn on pixels reaches up to half of one beyond its line.
        assert max(cv2.pointPolygonTest(hull, point, True) for hull in hulls) >= -0.75


def test_a_vehicle_of_the_roads_colour_is_filled_and_two_that_touch_are_not():
    mask = np.zeros((60, 120), bool)
    mask[20:34, 10:34] = True
    mask[20:28, 14:30] = False
    mask[20, 14:30] = True
    mask[5:15, 60:80] = mask[14:50, 79:82] = mask[40:50, 60:80] = True
    whole = filled(mask)
    assert whole[20:34, 10:34].all()
    assert not whole[25:35, 62:75].any()


def _drive(frames, draw, shaded=slice(0, 0)):
    """Let shadows be learnt from vehicles that are drawn on a plain road; return them and what is left.

    The rows ``shaded`` are in the shade.
    """
    ground = np.tile(ROAD, (120, 160, 1))
    ground[shaded] = SHADE
    daylight = Daylight()
    daylight.restore(np.zeros(PIXELS), np.tile(ROAD, PIXELS // 3))
    background, shadows = Background(daylight), CastShadows()
    for _ in range(12):
        background.apply(ground, np.eye(3), NONE)
    for k in range(frames):
        seen = ground.copy()
        draw(seen, 10 + k % 100)
        left = shadows.take_off(background, background.apply(seen, np.eye(3), NONE))
    return shadows, left


def _with_shadow(seen, x, y, colour, fall=4):
    seen[y + fall : y + fall + 10, x : x + 24] = SHADE
    seen[y : y + 10, x : x + 24] = colour


@pytest.mark.parametrize("colour", [(235, 230, 228), (30, 30, 31), (160, 40, 30)])
def test_the_offset_is_learnt_from_vehicles_of_any_colour(colour):
    shadows, left = _drive(20 * EVERY, lambda seen, x: _with_shadow(seen, x, 40, colour))
    assert shadows.offset == pytest.approx([0.0, 4.0], abs=1.0)
    rows, columns = np.nonzero(left)
    assert (rows.min(), rows.max()) == pytest.approx((40, 49), abs=1)
    assert np.ptp(columns) == pytest.approx(23, abs=2)


def test_a_dark_vehicle_gets_the_usual_shadow_taken_off_and_a_tall_bright_one_its_own():
    def draw(seen, x):
        _with_shadow(seen, x, 20, (235, 230, 228))
        _with_shadow(seen, 130 - x, 60, SHADE)
        if x > 30:
            _with_shadow(seen, x, 90, (160, 40, 30), fall=8)

    shadows, left = _drive(20 * EVERY, draw)
    assert shadows.offset == pytest.approx([0.0, 4.0], abs=1.0)
    for top in (20, 60, 90):
        rows = np.flatnonzero(left[top - 5 : top + 25].any(1)) + top - 5
        assert (rows[0], rows[-1]) == pytest.approx((top, top + 9), abs=1)


@pytest.mark.parametrize("shaded", [True, False])
def test_nothing_is_taken_off_who_drives_in_the_shade(shaded):
    def draw(seen, x):
        _with_shadow(seen, x, 20, (235, 230, 228))
        seen[90:100, 130 - x : 154 - x] = 0.55 * seen[90:100, 130 - x : 154 - x]

    _, left = _drive(20 * EVERY, draw, slice(60, 120 if shaded else 60))
    assert left[85:105].sum() == 10 * 24 if shaded else left[85:105].sum() < 0.7 * 10 * 24


def test_vehicles_that_a_shadow_joins_fall_apart():
    def draw(seen, x):
        _with_shadow(seen, x, 20, (235, 230, 228))
        if x > 70:
            _with_shadow(seen, x, 60, (235, 230, 228), fall=12)
            _with_shadow(seen, x, 76, (160, 40, 30))

    _, left = _drive(20 * EVERY, draw)
    count, _ = cv2.connectedComponents(left.astype(np.uint8))
    assert count - 1 == 3
