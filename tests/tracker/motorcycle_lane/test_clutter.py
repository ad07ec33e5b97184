"""Places of clutter: against a plain twin, and what becomes of a region that sways in place."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.motorcycle_lane.clutter import AT_FIRST, CELL, ClutterMap


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_share_counts_what_was_measured_in_a_place_and_beside_it(seed):
    rng = np.random.default_rng(seed)
    places = ClutterMap(60, 45)
    riders, nothing, asked = (rng.uniform(-5.0, 70.0, (20, 2)) for _ in range(3))
    counts = rng.integers(1, 9, 20).astype(float)
    places.add_riders(riders)
    places.add_nothing(nothing, counts)

    def near(place, other):
        cells = np.clip([place, other], 0, (59, 44)) // CELL
        return np.abs(cells[0] - cells[1]).max() <= 1

    for place, share in zip(asked, places.share(asked), strict=True):
        good = AT_FIRST + sum(near(place, rider) for rider in riders)
        bad = sum(n for at, n in zip(nothing, counts, strict=True) if near(place, at))
        assert np.isclose(share, bad / (good + bad))


def test_what_sways_becomes_clutter_and_what_rides_does_not():
    leaf, road = np.array([[350.0, 90.0]]), np.array([[150.0, 90.0]])
    places = ClutterMap(360, 240)
    assert places.share(leaf).tolist() == [0.0]
    for _ in range(3):
        places.add_nothing(leaf, np.ones(1))
        places.add_nothing(road, np.ones(1))
        places.add_riders(road + 3.0)
    assert places.share(leaf)[0] > 0.5 > places.share(road)[0]
    assert places.share(leaf + 3 * CELL).tolist() == [0.0]
