"""A body's motion from its points, beside a plain NumPy twin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.in_car.body import BODY_PLAY, BODY_SHARE, STEP_PLAY, STEP_SHARE, body_motion, inward


def plainly(position, flow, moved, ripe, middle, wide, growth, remembered):
    """The same, array by array."""
    shift = np.median(flow, axis=0)
    away = position - middle - shift
    bad = np.abs(flow - shift - growth * away).max(1) > STEP_PLAY + STEP_SHARE * wide
    if len(position) >= 3:
        long = moved - growth * remembered * away
        apart = np.abs(long - np.median(long, axis=0)).max(1)
        bad |= ripe & (apart > 2.0 * BODY_PLAY + 2.0 * BODY_SHARE * wide)
    flow, away = flow[~bad], away[~bad]
    if not len(flow):
        return ~bad, np.zeros(2), np.zeros(2), 0.0, 0.0
    scale = trust = 0.0
    if len(flow) >= 3:
        centred = away - away.mean(0)
        power = (centred**2).sum()
        scale = np.clip((centred * (flow - flow.mean(0))).sum() / max(power, 30.0), -0.05, 0.05)
        trust = power / (power + 2000.0)
    return ~bad, np.median(flow, axis=0), np.median(away, axis=0), scale, trust


@given(st.integers(0, 2**32 - 1), st.integers(1, 20), st.floats(0.01, 3.0))
def test_as_the_plain_twin_says(seed, count, scatter):
    rng = np.random.default_rng(seed)
    middle = rng.uniform(50, 200, 2)
    position = middle + rng.normal(0, 20, (count, 2))
    growth = rng.uniform(-0.01, 0.01)
    flow = rng.normal(0, 2, 2) + growth * (position - middle) + rng.normal(0, scatter, (count, 2))
    moved = 10 * flow + rng.normal(0, scatter, (count, 2))
    given_ = position, flow, moved, rng.random(count) < 0.7, middle, rng.uniform(10, 80), growth, 10.5
    found, expected = body_motion(*given_), plainly(*given_)
    assert found[0].tolist() == expected[0].tolist()
    for one, other in zip(found[1:], expected[1:], strict=True):
        assert one == pytest.approx(other, abs=1e-9)


def test_a_point_that_stays_behind_is_not_the_bodys():
    rng = np.random.default_rng(1)
    position = rng.uniform(100, 140, (12, 2))
    flow = np.tile([2.0, 0.5], (12, 1)) + 0.003 * (position - 120.0)
    flow[4] = 0.0
    moved = 10.5 * flow
    middle, ripe = np.array([118.0, 119.5]), np.ones(12, bool)
    kept, shift, _, growth, trust = body_motion(position, flow, moved, ripe, middle, 40.0, 0.0, 10.5)
    assert np.flatnonzero(~kept).tolist() == [4]
    assert shift == pytest.approx([2.0, 0.5], abs=0.05)
    assert growth == pytest.approx(0.003, abs=1e-6)
    assert 0.0 < trust < 1.0


def test_inward_is_the_median_way_toward_the_focus():
    rng = np.random.default_rng(7)
    relative, moved = rng.normal(0, 80, (30, 2)), rng.normal(0, 3, (30, 2))
    ways = [-np.dot(m, r) / np.hypot(*r) for r, m in zip(relative, moved, strict=True)]
    assert inward(relative, moved) == pytest.approx(np.median(ways))
    assert inward(relative, -0.1 * relative) > 0.0
