"""Traces: slope, identity, gaps."""

from __future__ import annotations

import numpy as np
import pytest

from tracker.in_car.profile import SEGMENT, Centres
from tracker.in_car.traces import TraceStore, _slopes, slope_error

RATE = 30.0


def centres(*places, width=20.0):
    count = len(places)
    x = np.array([place[0] for place in places], float)
    y = np.array([place[1] for place in places], float)
    return Centres(
        x=x,
        y=y,
        width=np.full(count, width),
        weight=np.full(count, 40.0),
        kind=np.full(count, SEGMENT, np.uint8),
        points=np.stack([x, y], 1).reshape(-1, 2),
        owners=np.arange(count),
    )


def test_slope_and_identity_of_two_crossing_rows():
    store = TraceStore(rate=RATE)
    for tick in range(40):
        # At the same x in the middle of the time, but at different heights.
        store.step(centres((200 + tick, 100), (240 - tick, 160)))
    assert store.live["id"].tolist() == [1, 2]
    slope, error = store.slopes()
    assert np.allclose(slope, [RATE, -RATE], atol=1e-6)
    assert (error > 0).all()


def test_a_short_gap_keeps_the_id_and_a_long_one_does_not():
    store = TraceStore(rate=RATE)
    for tick in range(40):
        gone = 15 <= tick < 19 or 28 <= tick < 38
        store.step(centres() if gone else centres((100 + tick, 50)))
        if tick == 27:
            assert store.live["id"].tolist() == [1]
    assert store.live["id"].tolist() == [2]


SIDES = {"left": (-1, 0), "right": (1, 0), "up": (0, -1), "down": (0, 1)}


@pytest.mark.parametrize("way", SIDES.values(), ids=SIDES.keys())
@pytest.mark.parametrize("bound", [True, False])
def test_a_trace_with_bounds_does_not_follow_what_leaves_them(way, bound):
    store = TraceStore(rate=RATE)
    for tick in range(60):
        x, y = 100 + max(tick - 20, 0) * way[0], 100 + max(tick - 20, 0) * way[1]
        # A second one that may go where it likes.
        store.bound({1: np.array([85.0, 85, 115, 115])} if bound else {})
        store.step(centres((x, y), (x + 300, y)))
    # The same thing goes on as another trace.
    assert store.live["id"].tolist() == ([2, 3] if bound else [1, 2])
    assert np.allclose(
        store.live["mean"][np.argsort(store.live["mean"][:, 0, 0]), 0, 0], [x, x + 300], atol=1
    )


@pytest.mark.parametrize(("widest", "ids"), [(35, [1]), (25, [2])])
def test_a_trace_does_not_take_what_is_wider_than_its_bounds(widest, ids):
    store = TraceStore(rate=RATE)
    for tick in range(40):
        store.bound({1: np.array([100 - widest / 2, 0, 100 + widest / 2, 200])})
        store.step(centres((100, 100), width=20.0 if tick < 20 else 30.0))
    assert store.live["id"].tolist() == ids


def test_bounds_end_with_what_they_were_for():
    store = TraceStore(rate=RATE)
    for tick in range(60):
        store.bound({1: np.array([85.0, 85, 115, 115])} if tick < 20 else {})
        store.step(centres((100 + max(tick - 20, 0), 100)))
    assert store.live["id"].tolist() == [1]


def test_slope_error_is_that_of_a_line_fit():
    rng = np.random.default_rng(0)
    times = np.arange(12) / RATE
    slopes = [np.polyfit(times, rng.normal(0, 0.5, 12), 1)[0] for _ in range(4000)]
    assert np.isclose(np.std(slopes), slope_error(0.5, RATE, np.array([12]))[0], rtol=0.05)


def test_slopes_are_those_of_fitted_lines():
    rng = np.random.default_rng(1)
    history = rng.normal(0, 5, (40, 12)) + np.linspace(0, 30, 12)
    history[rng.random(history.shape) < 0.5] = np.nan
    slopes, counts = _slopes(history)
    for row, slope, count in zip(history, slopes, counts, strict=True):
        times = np.flatnonzero(np.isfinite(row))
        assert count == len(times)
        assert np.isclose(slope, np.polyfit(times, row[times], 1)[0] if count >= 2 else 0.0)
