"""Which traces belong to a vehicle, and which lie on the road at its feet: against plain loops."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.in_car.traces import TraceSet
from tracker.in_car.tracker import AROUND_X, AROUND_Y, FIRM, INNER, RIM, InCarTracker, _at_feet, _in_boxes
from tracker.in_car.vehicles import Vehicle
from tracker.types import Info, Label, Status, Tracks


def drawn(seed, traces, tracks):
    """Traces and tracks at random, some of them over each other."""
    rng = np.random.default_rng(seed)
    corner, size = rng.uniform(0, 200, (tracks, 2)), rng.uniform(10, 120, (tracks, 2))
    count, nothing = traces, np.zeros(traces)
    return (
        TraceSet(
            ids=np.arange(1, count + 1),
            x=rng.uniform(0, 320, count),
            y=rng.uniform(0, 320, count),
            v=nothing,
            sigma_v=nothing,
            width=rng.uniform(1, 120, count),
            age=nothing,
            missed=np.zeros(count, np.int64),
            points=np.zeros((0, 2)),
            point_traces=np.zeros(0, np.int64),
        ),
        Tracks(
            ids=rng.permutation(np.arange(1, tracks + 1)),
            boxes=np.concatenate([corner, corner + size], 1),
            status=rng.integers(0, 3, tracks).astype(np.uint8),
        ),
    )


Cases = (st.integers(0, 2**32 - 1), st.integers(0, 30), st.integers(0, 5))


@settings(max_examples=100, deadline=None)
@given(*Cases, st.sampled_from([INNER, RIM]))
def test_a_trace_belongs_to_the_nearest_of_the_boxes_it_lies_in(seed, count, boxes, margins):
    traces, tracks = drawn(seed, count, boxes)
    aside, above = margins
    for found, x, y, width in zip(
        _in_boxes(traces, tracks, margins), traces.x, traces.y, traces.width, strict=True
    ):
        owners = []
        for identity, (x0, y0, x1, y1) in zip(tracks.ids, tracks.boxes, strict=True):
            wide, tall = x1 - x0, y1 - y0
            within = x0 + aside * wide < x < x1 - aside * wide
            if within and y0 - above * tall < y < y1 + 0.08 * tall and width < 1.3 * wide:
                owners.append((abs(x - 0.5 * (x0 + x1)) / wide, identity))
        assert found == (min(owners)[1] if owners else 0)


@settings(max_examples=100, deadline=None)
@given(*Cases)
def test_at_the_feet_of_sure_tracks_is_road(seed, count, boxes):
    traces, tracks = drawn(seed, count, boxes)
    for found, x, y in zip(_at_feet(traces, tracks), traces.x, traces.y, strict=True):
        expected = False
        for status, (x0, y0, x1, y1) in zip(tracks.status, tracks.boxes, strict=True):
            wide, tall = x1 - x0, y1 - y0
            near = x0 - wide < x < x1 + wide and y1 - 0.1 * tall < y < y1 + 1.5 * tall
            expected |= status != Status.TENTATIVE and near
        assert found == expected


def traces_at(*places):
    """Traces that are old enough for a label, at (x, y)."""
    count = len(places)
    x, y = np.array(places, float).T
    return TraceSet(
        ids=np.arange(1, count + 1),
        x=x,
        y=y,
        v=np.zeros(count),
        sigma_v=np.zeros(count),
        width=np.full(count, 10.0),
        age=np.ones(count),
        missed=np.zeros(count, np.int64),
        points=np.zeros((0, 2)),
        point_traces=np.zeros(0, np.int64),
    )


@pytest.mark.parametrize("status", [Status.CONFIRMED, Status.TENTATIVE])
def test_a_trace_that_was_long_in_a_sure_vehicles_box_stays_with_it(status):
    tracker = InCarTracker()
    tracker.start(Info(width=640, height=480, rate=30.0, intrinsics=None))
    box = np.array([100.0, 100, 140, 130])
    tracks = Tracks(ids=np.array([7]), boxes=box[None], status=np.array([status], np.uint8))
    tracker._vehicles.vehicles = [Vehicle(id=7, box=box, log_width=0.0)]
    if status == Status.TENTATIVE:  # As sure as it can be, by its points.
        tracker._odds = {1: FIRM}
    bounded = []
    for _ in range(30):
        tracker._label(traces_at((120, 115), (300, 115)), tracks, scale=1.0)
        bounded.append(set(tracker._bounds()))
    assert bounded[9] == set()
    assert bounded[-1] == ({1} if status == Status.CONFIRMED else set())
    if status == Status.CONFIRMED:
        aside, beyond = AROUND_X * 40, AROUND_Y * 30
        expected = [100 - aside, 100 - beyond, 140 + aside, 130 + beyond]
        assert tracker._bounds()[1] == pytest.approx(expected)
        # Over its roof, and with another in its place, it is still the first one's.
        tracker._label(traces_at((120, 90), (120, 115)), tracks, scale=1.0)
        assert set(tracker._bounds()) == {1}
    tracker._vehicles.vehicles = []
    assert tracker._bounds() == {}


def test_a_trace_that_was_surely_background_is_bound_to_no_vehicle_that_comes():
    tracker = InCarTracker()
    tracker.start(Info(width=640, height=480, rate=30.0, intrinsics=None))
    tracker._vehicles.vehicles = [Vehicle(id=7, box=np.array([100.0, 100, 140, 130]), log_width=0.0)]
    for left in [300.0] * 60 + [100.0] * 60:
        boxes = np.array([[left, 100, left + 40, 130]])
        tracks = Tracks(ids=np.array([7]), boxes=boxes, status=np.array([Status.CONFIRMED], np.uint8))
        tracker._label(traces_at((120, 115), (320, 115)), tracks, scale=1.0)
    assert tracker.diagnostics.traces is not None
    assert tracker.diagnostics.traces.labels.tolist() == [Label.CAR, Label.BACKGROUND]
    assert set(tracker._bounds()) == set()


def test_a_trace_in_no_box_is_background():
    tracker = InCarTracker()
    tracker.start(Info(width=640, height=480, rate=30.0, intrinsics=None))
    tracks = Tracks(ids=np.array([7]), boxes=np.array([[100.0, 100, 140, 130]]), status=np.zeros(1, np.uint8))
    tracks.status[:] = Status.CONFIRMED
    for _ in range(30):
        tracker._label(traces_at((120, 115), (300, 115)), tracks, scale=1.0)
    found = tracker.diagnostics.traces
    assert found is not None
    assert found.labels.tolist() == [Label.CAR, Label.BACKGROUND]
    assert found.owners.tolist() == [7, 0]


@pytest.mark.parametrize(
    ("above", "evidence", "label"),
    [
        (20.0, 1.5, Label.CAR),
        (20.0, -1.5, Label.BACKGROUND),
        (30.0, 1.5, Label.BACKGROUND),
    ],
)
def test_above_a_low_box_the_points_say_whether_a_trace_is_a_roof(above, evidence, label):
    tracker = InCarTracker()
    tracker.start(Info(width=640, height=480, rate=30.0, intrinsics=None))
    boxes = np.array([[100.0, 100, 140, 130]])
    tracks = Tracks(ids=np.array([7]), boxes=boxes, status=np.array([Status.CONFIRMED], np.uint8))
    points = tracker._points
    points._add(np.array([[120.0, 100.0 - above]]))
    points.age[:], points.evidence[:] = 30, evidence
    for _ in range(30):
        tracker._label(traces_at((120, 100 - above)), tracks, scale=1.0)
    assert tracker.diagnostics.traces is not None
    assert tracker.diagnostics.traces.labels.tolist() == [label]
