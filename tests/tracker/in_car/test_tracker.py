"""Which traces belong to a vehicle, and which lie on the road at its feet: against plain loops."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.in_car.traces import TraceSet
from tracker.in_car.tracker import INNER, RIM, _at_feet, _in_boxes
from tracker.types import Status, Tracks


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
@given(*Cases, st.sampled_from([INNER, -RIM]))
def test_a_trace_belongs_to_the_nearest_of_the_boxes_it_lies_in(seed, count, boxes, margin):
    traces, tracks = drawn(seed, count, boxes)
    for found, x, y, width in zip(
        _in_boxes(traces, tracks, margin), traces.x, traces.y, traces.width, strict=True
    ):
        owners = []
        for identity, (x0, y0, x1, y1) in zip(tracks.ids, tracks.boxes, strict=True):
            wide, tall = x1 - x0, y1 - y0
            within = x0 + margin * wide < x < x1 - margin * wide
            if within and y0 - 0.1 * tall < y < y1 + 0.08 * tall and width < 1.3 * wide:
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
