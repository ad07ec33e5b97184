"""Outlines: pairs of vertical edges over a contact row, against plain forms and on drawn cars."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tracker.in_car.reliefs import drawn_cars, layers, pictures, plain_mean, relief_of
from tracker.in_car import outlines as own
from tracker.in_car.relief import ACROSS, DOWN, SIGNED

Places = st.floats(-3, 27, allow_nan=False)


def plain_side(found, place, top, bottom):
    middle = math.floor(place + 0.5) if place + 0.5 >= 0 else math.ceil(place + 0.5)
    return max(
        0.0, *(plain_mean(found, ACROSS, j, top, j + 1, bottom) for j in range(middle - 1, middle + 2))
    )


def plain_foot(found, left, right, row, play, level):
    """Every row and every quarter of it, the first of the best."""
    wide, rated = right - left, []
    for i in range(int(row) - play, int(row) + play + 1):
        steps = [
            plain_mean(found, SIGNED, left + k * wide // 4, i, left + (k + 1) * wide // 4, i + 1)
            for k in range(4)
        ]
        values = [min(step if step > 0 else -0.5 * step, 4.0 * level) / level for step in steps]
        rated.append((i, min(values), sum(values) / 4))
    return max(rated, key=lambda one: one[1] + one[2])


def plain_roof(found, x0, x1, row, rear, body_top, tall):
    """Every row a roof may have."""
    width, wide = found.shape[2], x1 - x0
    left, right = int(max(x0 + 0.12 * wide, 0)), int(min(x1 - 0.12 * wide, width))
    usual, spread = (own.TALL_ASPECT, own.TALL_SPREAD) if tall else (own.ASPECT, own.ASPECT_SPREAD)
    low, high = (own.DIVIDE, own.TALLEST) if tall else (own.LOWEST, own.DIVIDE)
    first = int(max(row - high * rear, 2))
    level = plain_mean(found, DOWN, left, first, right, int(row)) + 3.0
    best = (-1e9, row - usual * rear, 0.0)
    for i in range(first, int(row - low * rear)):
        cuts = [left + k * (right - left) // 3 for k in range(4)]
        values = [
            min(abs(plain_mean(found, SIGNED, a, i, b, i + 1)) / level, 4.0)
            for a, b in itertools.pairwise(cuts)
        ]
        least, total = min(values), sum(values) / 3
        beyond = np.clip(12.0 * max((i - body_top) / rear - 0.04, 0.0), 0.0, 4.0)
        unusual = 0.5 * (((row - i) / rear - usual) / spread) ** 2
        value = 0.5 * least + 0.7 * total - unusual - beyond
        if value > best[0]:
            best = (value, i, 0.5 * (least + total))
    return best[1:]


@settings(max_examples=100, deadline=None)
@given(pictures(), Places, st.integers(-2, 20), st.integers(1, 12))
def test_side_is_the_strongest_of_three_columns(grey, place, top, tall):
    expected = plain_side(layers(grey), place, top, top + tall)
    assert own.side(relief_of(grey).sums, place, top, top + tall) == pytest.approx(expected, abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(
    pictures(),
    st.integers(0, 10),
    st.integers(4, 16),
    st.integers(2, 20),
    st.integers(1, 3),
    st.floats(3, 30),
)
def test_foot_is_the_best_of_all_rows(grey, left, wide, row, play, level):
    found = own.foot(relief_of(grey).sums, left, left + wide, row, play, level)
    expected = plain_foot(layers(grey), left, left + wide, row, play, level)
    # Rows that are equally good to the last bit may change places.
    assert found[1] + found[2] == pytest.approx(expected[1] + expected[2], abs=1e-9)
    if found[0] == expected[0]:
        assert found[1:] == pytest.approx(expected[1:], abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(
    pictures(10),
    Places,
    st.floats(5, 20),
    st.floats(6, 23),
    st.floats(0.4, 1.2),
    st.floats(0, 20),
    st.booleans(),
)
def test_roof_is_the_best_of_all_rows(grey, x0, wide, row, share, body_top, tall):
    rear = share * wide
    found = own.roof(relief_of(grey).sums, x0, x0 + wide, row, rear, body_top, tall)
    expected = plain_roof(layers(grey), x0, x0 + wide, row, rear, body_top, tall)
    assert found == pytest.approx(expected, abs=1e-9)


def plain_pairs(found, points, horizon, middle, focal, rows):
    """All pairs of all columns over all rows, each asked everything."""
    width, result = found.shape[2], []
    for number, row in enumerate(rows):
        contact = row - horizon
        usual = own.REAR * contact
        top, bottom = int(row - 0.5 * usual), int(row - 0.08 * usual)
        near = [x for x, y in points if row - 1.3 * usual < y <= row + 1]
        if bottom - top < 2 or not near:
            continue
        least = max(min(int(x - 2.2 * usual) for x in near), 0)
        most = min(max(int(x + 2.2 * usual) for x in near), width)
        if least >= most:
            continue
        strength = {j: plain_mean(found, ACROSS, j, top, j + 1, bottom) for j in range(least, most + 1)}
        floor = plain_mean(found, ACROSS, least, top, most, bottom) + 1.0
        apart, edges = max(1, int(own.APART * usual)), {}
        for j in range(least, most + 1):
            if j in (0, width):
                edges[j] = own.FRAME_SIDE * (floor + 1.0)
            elif 2 < j < width - 2 and strength[j] > 0.7 * floor:
                # The frame's own edges are taken for sides at their turn, and stand for what they count then.
                about = [
                    (edges.get(i, strength[i]) if i == 0 else strength[i], i) for i in range(least, most + 1)
                ]
                about = [one for one in about if abs(one[1] - j) <= apart]
                if max(about, key=lambda one: (one[0], -one[1]))[1] == j:
                    edges[j] = strength[j]
        for left in edges:
            for right in edges:
                wide = right - left
                if not 0.5 * usual <= wide <= 2.4 * usual or wide <= 0:
                    continue
                count = sum(left <= int(x) < right for x in near)
                a, b = own.rear_edges(float(left), float(right), contact, middle, focal)
                off = math.log(max((b - a) / usual, 0.05)) / own.REAR_SPREAD
                if left == 0 or right == width:
                    off = max(off, 0.0)
                if count < 1 or abs(off) > 3.5:
                    continue
                around = int(left - 0.5 * wide), top, int(right + 0.5 * wide), bottom
                level = plain_mean(found, ACROSS, *around) + 2.0
                weak, strong = sorted(min(edges[j] / level, 3.0) for j in (left, right))
                promise = (0.2 + 0.35 * weak + 0.15 * strong) * math.exp(-0.25 * off * off)
                promise *= 0.4 + 0.12 * min(count, 5)
                if promise >= 0.12:
                    result.append((left, right, row, promise, number))
    return np.array(result).reshape(-1, 5)


@settings(max_examples=60, deadline=None)
@given(pictures(16, 32), st.integers(0, 2**32 - 1))
def test_pairs_are_all_pairs_of_edges_a_vehicle_apart(grey, seed):
    rng = np.random.default_rng(seed)
    height, width = grey.shape
    horizon, middle = rng.uniform(2, 0.5 * height), rng.uniform(0, width)
    points = rng.uniform((0, horizon), (width - 0.01, height), (6, 2))
    rows = np.round(np.linspace(horizon + 3, height, 6))
    x, y = np.ascontiguousarray(points.T)
    found = own._pairs(relief_of(grey).sums, x, y, horizon, middle, 60.0, rows, 40_000)
    expected = plain_pairs(layers(grey), points, horizon, middle, 60.0, rows)
    order = [np.lexsort(pairs.T[[1, 0, 4]]) for pairs in (found, expected)]
    assert len(found) == len(expected)
    np.testing.assert_allclose(found[order[0]], expected[order[1]], atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(pictures(20, 32), st.integers(0, 2**32 - 1))
def test_feet_move_pairs_and_change_their_promise(grey, seed):
    rng = np.random.default_rng(seed)
    height, width = grey.shape
    horizon, middle, focal = 6.0, 0.5 * width, 60.0
    x0 = rng.uniform(0, width - 8, 5)
    pairs = np.stack(
        [x0, x0 + rng.uniform(5, 12, 5), rng.integers(10, height - 2, 5), np.ones(5), np.zeros(5)], axis=1
    )
    moved, found = pairs.copy(), layers(grey)
    own._with_feet(relief_of(grey).sums, moved, horizon, middle, focal)
    for before, after in zip(pairs, moved, strict=True):
        left, right, row = before[:3]
        contact = row - horizon
        a, b = own.rear_edges(left, right, contact, middle, focal)
        a, b = int(max(a, 0)), int(min(b, width))
        b = max(b, a + 4)
        level = plain_mean(found, DOWN, a, int(row - 0.5 * own.REAR * contact), b, int(row)) + 3.0
        play = max(1, int(0.5 * (own.ROW_STEP - 1) * contact + 0.5))
        _, least, total = plain_foot(found, a, b, row, play, level)
        assert after[3] == pytest.approx(min(max(0.5 + 0.3 * least + 0.25 * total, 0.3), 2.0), abs=1e-2)
        assert abs(after[2] - row) <= play


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 9)), max_size=30), st.integers(1, 4))
def test_best_keeps_the_most_promising_of_each_row(rated, most):
    pairs = np.zeros((len(rated), 5))
    pairs[:, 0] = np.arange(len(rated))
    pairs[:, 4], pairs[:, 3] = np.array(sorted(rated, key=lambda one: one[0]), float).reshape(-1, 2).T
    expected = []
    for row in range(4):
        # Of equal ones the first.
        ranked = sorted(pairs[pairs[:, 4] == row].tolist(), key=lambda pair: -pair[3])
        expected += ranked[:most]
    assert own._best(pairs, most).tolist() == expected


def test_rear_edges_leave_out_the_side_that_is_seen():
    # Right of the middle the left side is seen; across the middle only the rear is.
    x0, x1 = own.rear_edges(200.0, 260.0, 40.0, 160.0, 400.0)
    assert (x0, x1) == (200.0 + 40.0 * own.LENGTH * 40.0 / 400.0, 260.0)
    assert own.rear_edges(140.0, 180.0, 40.0, 160.0, 400.0) == (140.0, 180.0)


@pytest.mark.parametrize("car", [(150, 174, 126), (120, 165, 140), (60, 150, 170)])
def test_a_drawn_car_is_among_the_outlines(car):
    grey, boxes = drawn_cars([car])
    x0, x1, row = car
    points = np.stack(np.meshgrid(np.linspace(x0 + 2, x1 - 2, 4), np.linspace(row - 12, row - 3, 3)), -1)
    found = own.outlines(relief_of(grey, horizon=110.0), points.reshape(-1, 2), 4.0)
    off = np.abs(found - car).max(1)
    assert off.min() <= max(2.0, 0.05 * (x1 - x0))
    assert len(found) <= own.KEPT * 120
    assert len(np.unique(found, axis=0)) == len(found)
    assert boxes.shape == (1, 4)


def test_no_points_no_outlines():
    grey, _ = drawn_cars([(120, 165, 140)])
    assert own.outlines(relief_of(grey, horizon=110.0), np.empty((0, 2)), 4.0).shape == (0, 3)
