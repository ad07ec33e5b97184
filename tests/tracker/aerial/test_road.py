"""The way of the road against its plain twin, in bends, and beside what is none."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.aerial.road import ALIKE, ENOUGH, FAR, LEAST, NEAR, SPAN, course


@given(st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_course_is_its_plain_twin(seed):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal([1.0, 0.3], 0.6, (4, 60, 2)), axis=1) + rng.normal(0, 15.0, (4, 1, 2))
    counts = rng.integers(0, 61, 4)
    place, angle = points[:, :30].mean((0, 1)), rng.uniform(0, 2 * np.pi)
    heading = np.array([np.cos(angle), np.sin(angle)])
    total, weight = np.zeros(2), 0.0
    for path, count in zip(points, counts.tolist(), strict=True):
        for i in range(0, count - SPAN, SPAN // 2):
            step = path[i + SPAN] - path[i]
            away = np.hypot(*(path[i + SPAN // 2] - place))
            if away <= FAR * NEAR and np.hypot(*step) >= LEAST:
                ahead = step / np.hypot(*step)
                if abs(ahead @ heading) >= ALIKE:
                    near = np.exp(-0.5 * (away / NEAR) ** 2)
                    total, weight = total + near * np.sign(ahead @ heading) * ahead, weight + near
    wanted = total / np.hypot(*total) if weight >= ENOUGH else heading
    np.testing.assert_allclose(course(points, counts, place, heading), wanted, atol=1e-9)


def _path(angle, speed=2.0, at=(0.0, 0.0)):
    along = (np.arange(60) - 30.0)[:, None] * speed
    return (np.array(at) + along * [np.cos(angle), np.sin(angle)])[None]


EAST = np.array([1.0, 0.0])


@pytest.mark.parametrize("angle", [0.3, 0.3 + np.pi])
def test_a_heading_turns_to_the_road_whichever_way_its_traffic_goes(angle):
    found = course(_path(angle), np.array([60]), np.zeros(2), EAST)
    assert found == pytest.approx([np.cos(0.3), np.sin(0.3)], abs=1e-6)


@pytest.mark.parametrize(
    "path",
    [_path(1.2), _path(0.3, at=(0, 60)), _path(0.3, speed=0.3), _path(0.3)[:, :10]],
    ids=["crosses", "is far away", "stands", "is too short"],
)
def test_what_is_no_road_here_turns_nobody(path):
    assert course(path, np.array([path.shape[1]]), np.zeros(2), EAST) == pytest.approx(EAST)
