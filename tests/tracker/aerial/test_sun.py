"""Where shadows fall: sums over offsets against their plain twin, votes, and who may vote."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.aerial.sun import DIRECTIONS, ENOUGH, LONGEST, Sun, elect, left_out


@given(st.integers(0, 1000), st.floats(0.0, 6.3))
@settings(max_examples=20, deadline=None)
def test_sums_of_what_is_left_out_are_their_plain_twin(seed, angle):
    rng = np.random.default_rng(seed)
    region = (rng.random((4, 5)) < 0.8).repeat(4, 0).repeat(4, 1)
    worth = rng.normal(size=region.shape)
    side = np.array([np.cos(angle), np.sin(angle)])
    wanted = np.zeros(LONGEST + 1)
    for i, j in np.argwhere(region):
        for length in range(LONGEST + 1):
            ways = np.floor((j + 0.5, i + 0.5) + np.arange(1, length + 1)[:, None] * side).astype(int)
            outside = (ways < 0).any(1) | (ways >= (20, 16)).any(1)
            leaves = outside.any() or not region[ways[:, 1], ways[:, 0]].all()
            wanted[length] += worth[i, j] if leaves else 0.0
    np.testing.assert_allclose(left_out(region, worth, side[None])[0], wanted, atol=1e-9)


def test_the_elected_offset_is_that_of_most_and_stray_votes_do_not_count():
    rng = np.random.default_rng(3)
    directions = np.append(rng.choice([7, 8, 9], 60), rng.integers(14, 24, 30))
    lengths = np.append(rng.choice([5, 6, 7], 60), rng.integers(12, 20, 30))
    found = elect(directions, lengths)
    assert np.hypot(*found) == pytest.approx(5.5, abs=0.5)
    assert found / np.hypot(*found) @ DIRECTIONS[8] > 0.97


def test_directions_on_both_sides_of_the_first_are_one():
    found = elect(np.array([31, 0, 1] * 5), np.full(15, 6))
    assert found == pytest.approx([6.0, 0.0], abs=0.1)


def _scene(vehicles, share=1.0):
    """Draw vehicles (x, y, length, width, fall) and their shadows: whole, dark, own."""
    own, whole = np.zeros((200, 300), bool), np.zeros((200, 300), bool)
    for x, y, length, width, fall in vehicles:
        for k in range(fall + 1):
            whole[y + k : y + k + width, x : x + length] = True
        own[y : y + width, x : x + round(share * length)] = True
    return whole, whole & ~own, own


def _learnt(vehicles, valid=True, share=1.0):
    sun = Sun()
    for _ in range(ENOUGH):
        sun.learn(*_scene(vehicles, share), np.full((200, 300), valid), 240.0)
    return sun.offset


CARS = [(20, 20, 24, 10, 5), (80, 90, 24, 10, 5)]


def test_shadows_of_cars_are_learnt_but_not_those_of_lorries():
    assert _learnt(CARS) == pytest.approx([0.0, 5.0], abs=0.6)
    lorries = [(20, 120, 60, 13, 15), (120, 120, 60, 13, 15), (200, 20, 60, 13, 15)]
    assert _learnt(CARS + lorries) == pytest.approx([0.0, 5.0], abs=0.6)
    assert not _learnt(lorries).any()


def test_who_is_not_wholly_in_the_picture_or_shows_little_of_itself_has_no_vote():
    assert not _learnt(CARS, valid=False).any()
    assert not _learnt(CARS, share=0.2).any()
    assert _learnt(CARS, share=0.9)[1] > 3


def test_dark_windows_are_no_shadow():
    whole, dark, own = _scene([(x, y, n, w, 0) for x, y, n, w, _ in CARS])
    for x, y, *_ in CARS:
        dark[y + 2 : y + 8, x + 6 : x + 18] = True
    own &= ~dark
    sun = Sun()
    for _ in range(ENOUGH):
        sun.learn(whole, dark, own, np.ones((200, 300), bool), 240.0)
    assert not sun.offset.any()


def test_the_reach_of_one_shadow_is_measured_to_the_known_side():
    sun = Sun()
    for _ in range(ENOUGH):
        sun.learn(*_scene(CARS), np.ones((200, 300), bool), 240.0)
    assert sun.reach(*_scene([(50, 50, 40, 12, 9)])) == pytest.approx(9, abs=1)
