"""Which regions travel: pairs of labels against a plain twin, and drawn squares of known ways."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.blobs import find_blobs
from tracker.motorcycle_lane.travellers import FRAMES, Travellers, only_pairs


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_pairs_of_regions_that_overlap_each_other_only(seed):
    rng = np.random.default_rng(seed)
    before, now = (find_blobs(rng.random((20, 30)) < share, 2) for share in rng.uniform(0.05, 0.4, 2))
    partners = [set(np.unique(now.labels[before.labels == k + 1])) - {0} for k in range(len(before))]
    wanted = [
        (k, mine.pop() - 1)
        for k, mine in enumerate(map(set, partners))
        if len(mine) == 1 and sum(mine <= theirs for theirs in partners) == 1
    ]
    found = only_pairs(before.labels, now.labels, len(before), len(now))
    assert list(zip(*map(np.ndarray.tolist, found), strict=True)) == wanted


def travelled(frames):
    """Return the boxes of the regions that counted, frame by frame; a frame is a list of boxes."""
    travellers, shown = Travellers(), []
    for boxes in frames:
        mask = np.zeros((60, 120), bool)
        for x0, y0, x1, y1 in boxes:
            mask[y0:y1, x0:x1] = True
        blobs = find_blobs(mask)
        whole = (blobs.boxes[:, :2] > 0).all(1) & (blobs.boxes[:, 2:] < (120, 60)).all(1)
        shown.append(blobs.boxes[travellers.step(blobs, blobs.boxes, whole)].tolist())
    return shown


def test_what_rides_counts_by_its_way_and_what_flickers_does_not():
    fast = travelled([[(5 + 2 * k, 10, 15 + 2 * k, 30)] for k in range(30)])
    slow = travelled([[(5 + k // 4, 10, 15 + k // 4, 30)] for k in range(30)])
    assert [k for k, boxes in enumerate(fast) if boxes] == list(range(FRAMES, 30, FRAMES))
    assert sum(map(len, slow)) == 7
    assert fast[FRAMES] == [[5.0 + 2 * FRAMES, 10.0, 15.0 + 2 * FRAMES, 30.0]]
    sways = travelled([[(50 + k % 2, 10, 62 + k % 2, 50)] for k in range(30)])
    grows = travelled([[(20, 10, 30 + 12 * (k % 2), 30)] for k in range(30)])
    assert not any(sways)
    assert not any(grows)


def test_who_joins_parts_or_comes_in_begins_anew():
    pair = [[(10, 10, 20, 30), (60 - 3 * k, 10, 70 - 3 * k, 30)] for k in range(15)]
    joined = [k for k, boxes in enumerate(pair) if boxes[1][0] <= 20]
    assert not any(travelled(pair)[joined[0] : joined[0] + FRAMES])
    entering = travelled([[(0, 10, 2 + 3 * k, 30)] for k in range(12)])
    assert not any(entering)
