"""How riders see each other, against loops that say it one pair after another."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sim.riding import BRAKING, SIDE, Riders, ahead, apart, idm, space


def random_riders(seed: int, count: int, *, two_ways: bool = False) -> Riders:
    rng = np.random.default_rng(seed)
    zero, one = np.zeros(count), np.ones(count)
    half = rng.uniform((0.9, 0.4), (1.1, 0.6), (count, 2))
    return Riders(
        ids=np.arange(count, dtype=np.uint32),
        way=rng.choice([1.0, -1.0], count) if two_ways else one,
        s=rng.uniform(0, 30, count),
        d=rng.uniform(-6, 0, count),
        v=rng.uniform(0, 9, count),
        u=zero,
        yaw=zero,
        lean=zero,
        aim=zero,
        wanted=8 * one,
        favourite=zero,
        weave=np.zeros((count, 3)),
        stop=np.nan * one,
        leave=np.zeros(count, np.int64),
        half=half,
        sizes=np.ones((count, 3)),
        models=np.zeros(count, np.int32),
        colours=np.ones((count, 3), np.float32),
    )


def touch(riders: Riders, s, d, a: int, b: int) -> bool:
    length, width = riders.half[a] + riders.half[b]
    return bool(abs(s[a] - s[b]) < length and abs(d[a] - d[b]) < width)


@given(st.integers(0, 10_000), st.integers(0, 9))
def test_who_is_ahead(seed, count):
    riders = random_riders(seed, count, two_ways=True)
    gap, closing = ahead(riders)
    for i in range(count):
        for j in range(count):
            along = riders.way[i] * (riders.s[j] - riders.s[i])
            free = along - riders.half[i, 0] - riders.half[j, 0]
            approach = riders.v[i] - riders.v[j] * (1 if riders.way[i] == riders.way[j] else -1)
            assert closing[i, j] == pytest.approx(approach)
            assert (
                gap[i, j] == pytest.approx(free)
                if along > 0 and free < 28
                else np.isinf(gap[i, j]) or free > 28
            )


@given(st.integers(0, 10_000), st.integers(1, 9))
def test_space_beside(seed, count):
    riders = random_riders(seed, count)
    right, left = space(riders)
    for i in range(count):
        nearest = {1: np.inf, -1: np.inf}
        for j in set(range(count)) - {i}:
            rear, front = sorted((i, j), key=lambda k: riders.s[k])
            between = riders.s[front] - riders.s[rear] - riders.half[i, 0] - riders.half[j, 0]
            brake = max(riders.v[rear] - riders.v[front], 0.0) ** 2 / (2 * BRAKING)
            if between < 0.7 + 0.2 * riders.v[rear] + brake:
                free = abs(riders.d[j] - riders.d[i]) - riders.half[i, 1] - riders.half[j, 1] - SIDE
                side = 1 if riders.d[j] > riders.d[i] else -1
                nearest[side] = min(nearest[side], max(free, 0.0))
        assert (right[i], left[i]) == pytest.approx((nearest[-1], nearest[1]))


@settings(max_examples=200)
@example(seed=190, count=3, two_ways=True, stride=3.25)
@given(st.integers(0, 100_000), st.integers(1, 12), st.booleans(), st.floats(0.1, 4.0))
def test_steps_that_would_touch_are_not_taken(seed, count, two_ways, stride):
    riders = random_riders(seed, count, two_ways=two_ways)
    kept = np.ones(count, bool)
    for i in range(count):
        kept[i] = not any(kept[j] and touch(riders, riders.s, riders.d, i, j) for j in range(i))
    riders = riders.take(kept)
    rng = np.random.default_rng(seed + 1)
    s = riders.s + riders.way * rng.uniform(0, stride, len(riders))
    d = riders.d + rng.uniform(-stride, stride, len(riders))
    new_s, new_d = apart(riders, s, d)
    pairs = [(a, b) for a in range(len(riders)) for b in range(a)]
    assert not any(touch(riders, new_s, new_d, a, b) for a, b in pairs)
    assert (((new_s == s) | (new_s == riders.s)) & ((new_d == d) | (new_d == riders.d))).all()
    for i in range(len(riders)):
        crowd = set(range(len(riders))) - {i}
        reach = 2.0 * stride + 4.0
        if all(abs(riders.s[i] - riders.s[j]) > reach for j in crowd):
            assert (new_s[i], new_d[i]) == (s[i], d[i])


def test_idm_on_a_free_road_behind_a_leader_and_when_cut_in_on():
    v, wanted = np.array([0.0, 8.0, 8.0, 8.0]), np.full(4, 8.0)
    gap, closing = np.array([np.inf, np.inf, 1.0, 2.0]), np.array([0.0, 0.0, 0.0, 6.0])
    free, cruising, cut_in, emergency = idm(v, wanted, gap, closing)
    assert free == pytest.approx(1.8)
    assert cruising == pytest.approx(0.0)
    assert cut_in == pytest.approx(-3.2)  # who is as fast ahead asks for no more than firm braking
    assert emergency == pytest.approx(-1.2 * 36 / (2 * 1.6))
