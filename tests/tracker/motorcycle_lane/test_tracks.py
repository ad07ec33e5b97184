"""Who rides, who stands, and what never was a rider: the tracks' status."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tracker.motorcycle_lane import colour
from tracker.motorcycle_lane.measuring import Measurements
from tracker.motorcycle_lane.sizes import SizeModel
from tracker.motorcycle_lane.tracks import TrackStore
from tracker.types import Status

RATE = 30
WIDTH, HEIGHT = 360, 240
SIZE = np.array([20.0, 40.0])


def seen_at(place: NDArray[np.float64]) -> Measurements:
    """Return the measurement of one rider alone at ``place`` (2,)."""
    return Measurements(
        centres=place[None],
        sizes=SIZE[None],
        histograms=np.full((1, colour.REGIONS, colour.BINS), 1.0 / colour.BINS),
        alone=np.ones(1, np.bool_),
        sized=np.ones(1, np.bool_),
        shares=np.ones(1),
        joined=np.zeros(0, np.bool_),
    )


def statuses(ways: NDArray[np.float64]) -> list[Status]:
    """Return a rider's status, frame by frame, who has gone so many rider heights (N,) up the picture."""
    rng = np.random.default_rng(0)
    store, sizes = TrackStore(WIDTH, HEIGHT, RATE), SizeModel(HEIGHT)
    found = []
    for way in ways:
        store.predict(sizes)
        joined = np.zeros(len(store.tracks), np.bool_)
        place = np.array([180.0, 180.0 - way * SIZE[1]]) + rng.normal(0.0, 0.3, 2)
        store.update(seen_at(place), joined)
        assert len(store.tracks) == 1
        found.append(Status(int(store.status()[0])))
    return found


@pytest.mark.parametrize("speed", [0.3, 0.5, 2.0])
def test_who_rides_slowly_is_confirmed_and_stays_so(speed: float) -> None:
    found = statuses(np.arange(0.0, 2.0, speed / RATE))
    first = found.index(Status.CONFIRMED)
    # Asked are 0.2 rider heights, and to be seen three times.
    assert 0.2 <= first * speed / RATE <= 0.35
    assert set(found[first:]) == {Status.CONFIRMED}


def test_what_stands_before_it_has_gone_a_height_is_no_rider() -> None:
    riding = np.arange(0.0, 0.7, 1.0 / RATE)
    found = statuses(np.concatenate([riding, np.full(2 * RATE, riding[-1])]))
    assert Status.CONFIRMED in found[: len(riding)]
    assert set(found[len(riding) + RATE :]) == {Status.TENTATIVE}


def test_a_rider_who_stands_is_parked_after_three_seconds() -> None:
    riding = np.arange(0.0, 1.5, 1.0 / RATE)
    found = statuses(np.concatenate([riding, np.full(5 * RATE, riding[-1])]))
    stands = found[len(riding) :]
    assert set(stands[: 3 * RATE]) == {Status.CONFIRMED}
    assert set(stands[4 * RATE :]) == {Status.COASTING}
