"""Places of clutter: against a plain twin, and what becomes of a region that sways in place."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.motorcycle_lane.clutter import AT_FIRST, CELL, ClutterMap


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_share_counts_the_riders_whose_boxes_held_a_place_and_what_was_nothing_in_it_or_beside_it(seed):
    rng = np.random.default_rng(seed)
    places = ClutterMap(60, 45)
    corners, nothing, asked = (rng.uniform(-5.0, 70.0, (20, 2)) for _ in range(3))
    riders = np.concatenate([corners, corners + rng.uniform(1.0, 30.0, (20, 2))], 1)
    counts = rng.integers(1, 9, 20).astype(float)
    places.add_riders(riders)
    places.add_nothing(nothing, counts)

    def cell(place):
        return np.clip(place, 0, (59, 44)) // CELL

    for place, share in zip(asked, places.share(asked), strict=True):
        at = cell(place)
        good = AT_FIRST + sum((cell(box[:2]) <= at).all() and (at <= cell(box[2:])).all() for box in riders)
        beside = [np.abs(cell(other) - at).max() <= 1 for other in nothing]
        bad = AT_FIRST + (counts * beside).sum()
        assert np.isclose(share, bad / (good + bad))


def test_what_sways_becomes_clutter_and_what_rides_does_not():
    leaf, road = np.array([[350.0, 90.0]]), np.array([[150.0, 90.0]])
    places = ClutterMap(360, 240)
    assert places.share(leaf).tolist() == [0.5]
    for _ in range(3):
        places.add_nothing(leaf, np.ones(1))
        places.add_nothing(road, np.ones(1))
        places.add_riders(np.concatenate([road - 20.0, road + 20.0], 1))
        places.add_riders(np.concatenate([road - 9.0, road + 30.0], 1))
    assert places.share(leaf)[0] > 0.5 > places.share(road)[0]
    assert places.share(leaf + 3 * CELL).tolist() == [0.5]
