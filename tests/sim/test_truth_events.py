"""Occlusion events of hand-made drives."""

from collections.abc import Sequence
from itertools import groupby

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sim.truth.events import occlusion_events
from sim.truth.types import FrameTruth

RATE = 20  # the shortest event has 2 frames
TREE, LORRY = 7, 1 << 20


def frame(tick: int, vehicles: dict[int, tuple[float, float, int]]) -> FrameTruth:
    """Vehicles as (visible share, share inside the frame, occluder)."""
    n = len(vehicles)
    columns = np.array(list(vehicles.values()), float).reshape(n, 3)
    boxes = np.tile([10.0 + tick, 20.0, 30.0 + tick, 40.0], (n, 1))
    return FrameTruth(
        tick=tick,
        ids=np.array(list(vehicles), np.uint32),
        kinds=np.zeros(n, np.uint8),
        roles=np.zeros(n, np.uint8),
        visible_px=np.round(1000 * columns[:, 0]).astype(np.int64),
        amodal_px=np.round(1000 * columns[:, 1]).astype(np.int64),
        amodal_px_full=np.full(n, 1000, np.int64),
        box_visible=np.where(columns[:, :1] > 0, boxes, np.nan),
        box_amodal=boxes,
        occluder_ids=columns[:, 2].astype(np.uint32),
        distances=np.ones(n),
        positions=np.zeros((n, 3)),
        velocities=np.zeros((n, 3)),
    )


def drive(shares: Sequence[float], *, inside: float = 1.0, occluder: int = TREE) -> list[FrameTruth]:
    return [frame(tick, {5: (share, max(share, inside), occluder)}) for tick, share in enumerate(shares)]


def test_one_car_passes_behind_a_tree() -> None:
    (event,) = occlusion_events(drive([1, 1, 0.5, 0.05, 0.0, 0.02, 0.2, 0.8]), RATE)
    assert (event.hidden, event.occluder) == (5, TREE)
    assert (event.first, event.last) == (3, 5)
    assert event.deepest == 0.0
    assert event.returned == (27.0, 30.0)


def test_deepest_is_the_least_share() -> None:
    (event,) = occlusion_events(drive([1, 0.09, 0.03, 0.06, 1]), RATE)
    assert event.deepest == 0.03


def test_what_never_comes_back_and_what_was_never_seen() -> None:
    (event,) = occlusion_events(drive([1, 0, 0, 0.2]), RATE)
    assert event.returned is None
    assert (event.first, event.last) == (1, 2)
    assert occlusion_events(drive([0.0, 0.0, 0.2, 0.0, 0.0]), RATE) == ()


def test_half_hidden_is_no_event_and_flicker_is_none() -> None:
    assert occlusion_events(drive([1, 0.5, 0.12, 0.5, 1]), RATE) == ()
    assert occlusion_events(drive([1, 0.0, 1, 0.0, 1]), RATE) == ()
    # Only once it is well seen again does an event end.
    (event,) = occlusion_events(drive([1, 0.0, 0.2, 0.0, 1]), RATE)
    assert (event.first, event.last) == (1, 3)


def test_out_of_view_by_the_larger_share() -> None:
    (event,) = occlusion_events(drive([1, 0, 0, 0, 1], inside=0.2), RATE)
    assert event.occluder == 0
    (event,) = occlusion_events(drive([1, 0, 0, 0, 1], inside=0.8), RATE)
    assert event.occluder == TREE


def test_leaving_the_extended_frame_is_out_of_view() -> None:
    there = {5: (1.0, 1.0, 0)}
    truths = [frame(tick, there if tick in (0, 1, 6) else {}) for tick in range(7)]
    (event,) = occlusion_events(truths, RATE)
    assert (event.first, event.last, event.occluder, event.deepest) == (2, 5, 0, 0.0)
    assert event.returned == (26.0, 30.0)


def test_who_took_most_of_it_over_the_event() -> None:
    shares = [(1, 0), (0.0, TREE), (0.05, LORRY), (0.0, LORRY), (1, 0)]
    truths = [frame(tick, {5: (share, 1.0, by)}) for tick, (share, by) in enumerate(shares)]
    (event,) = occlusion_events(truths, RATE)
    assert event.occluder == LORRY


def test_two_vehicles_in_the_order_of_their_first_frames() -> None:
    a, b = [1, 1, 0, 0, 1], [1, 0, 0, 0, 1]
    truths = [frame(k, {5: (x, 1, TREE), 3: (y, 1, 5)}) for k, (x, y) in enumerate(zip(a, b, strict=True))]
    first, second = occlusion_events(truths, RATE)
    assert (first.hidden, first.occluder, second.hidden, second.occluder) == (3, 5, 5, TREE)
    assert occlusion_events([], RATE) == ()


@given(st.lists(st.sampled_from([0.0, 0.05, 0.2, 0.5, 1.0]), max_size=25))
def test_against_a_naive_oracle(shares: list[float]) -> None:
    """Write each frame as seen, hidden or between; an event is what stands between two seen frames."""
    word = "".join("s" if x >= 0.3 else "h" if x < 0.1 else "-" for x in shares)
    wanted = []
    if "s" in word:
        position = word.index("s")
        for letter, group in groupby(word[position:], key=lambda c: c == "s"):
            gap = "".join(group)
            if not letter and "h" in gap:
                first, last = position + gap.index("h"), position + gap.rindex("h")
                if last - first + 1 >= 2:
                    wanted.append((first, last, position + len(gap) < len(word)))
            position += len(gap)
    events = occlusion_events(drive(shares), RATE)
    assert [(e.first, e.last, e.returned is not None) for e in events] == wanted
