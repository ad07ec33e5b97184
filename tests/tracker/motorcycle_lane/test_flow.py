"""Who goes against the traffic: by a way gone, not by a jump."""

from __future__ import annotations

import numpy as np

from tracker.motorcycle_lane.flow import WAY, Flow

HEIGHT, SPEED, RATE = 20.0, 60.0, 30.0


def follow(turns):
    """Two ride up the picture; a third does, too, its row and velocity in frame k being ``turns(k)``."""
    flow, flagged = Flow(360, 240, RATE), []
    for k in range(90):
        row = 230.0 - SPEED / RATE * k
        third, down = turns(k)
        places = np.array([[100.0, row], [130.0, row], [115.0, third]])
        velocities = np.array([[0.0, -SPEED], [0.0, -SPEED], [0.0, down]])
        flagged.append(flow.step(np.arange(1, 4), places, velocities, np.full(3, HEIGHT)).tolist())
    return flagged


def test_one_that_comes_the_other_way_is_flagged_once_it_has_gone_a_way():
    flagged = follow(lambda k: (60.0 + SPEED / RATE * k, SPEED))
    first = next(k for k, ids in enumerate(flagged) if ids)
    assert SPEED / RATE * first > WAY * HEIGHT
    assert all(ids == [3] for ids in flagged[first:])


def test_one_that_jumps_back_to_another_is_not():
    flagged = follow(lambda k: (230.0 - SPEED / RATE * k + 30.0 * (k > 30), SPEED if 30 < k < 45 else -SPEED))
    assert not any(flagged)


def test_one_other_is_not_the_traffic_however_long_it_is_seen():
    flow = Flow(360, 240, RATE)
    for k in range(90):
        way = SPEED / RATE * k
        places = np.array([[100.0, 230.0 - way], [115.0, 60.0 + way]])
        velocities = np.array([[0.0, -SPEED], [0.0, SPEED]])
        assert not len(flow.step(np.arange(1, 3), places, velocities, np.full(2, HEIGHT)))
