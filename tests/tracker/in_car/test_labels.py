"""Which traces lie over a track's roof."""

from __future__ import annotations

import numpy as np
import pytest

from tracker.in_car.traces import TraceSet
from tracker.in_car.tracker import _over_roofs
from tracker.types import Status, Tracks


@pytest.mark.parametrize(
    ("x", "y", "width", "status", "over"),
    [
        (120, 70, 30, Status.CONFIRMED, True),
        (120, 70, 30, Status.TENTATIVE, False),
        (120, 110, 30, Status.CONFIRMED, False),
        (120, 30, 30, Status.CONFIRMED, False),
        (170, 70, 30, Status.CONFIRMED, False),
        (120, 70, 90, Status.CONFIRMED, False),
    ],
)
def test_what_lies_over_a_sure_roof_may_be_the_vehicles(x, y, width, status, over):
    one, none = np.ones(1), np.zeros(1, np.int64)
    traces = TraceSet(
        ids=none + 1,
        x=x * one,
        y=y * one,
        v=0 * one,
        sigma_v=one,
        width=width * one,
        age=one,
        missed=none,
        points=np.zeros((0, 2)),
        point_traces=none[:0],
    )
    tracks = Tracks(
        ids=none + 1,
        boxes=np.array([[100.0, 100, 160, 140]]),
        status=np.array([status], np.uint8),
        score=one,
        state=np.zeros((1, 4)),
    )
    assert _over_roofs(traces, tracks).tolist() == [over]
