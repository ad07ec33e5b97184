"""Vehicles that vanish and come back, made by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from scenarios.score.disappearances import disappearances, summary
from scenarios.score.params import ScoringParams
from sim.truth.types import AerialTruth

BRIDGE = 5
PARAMS = ScoringParams()
Life = tuple[Sequence[float], Sequence[float], tuple[float, float, float]]


def episode(lives: Mapping[int, Life], *, inside: float = 1.0) -> list[AerialTruth]:
    """Vehicles as (visible share a frame, speed a frame, colour); ``inside``: the share in the frame."""
    frames = len(next(iter(lives.values()))[0])
    n = len(lives)
    truths = []
    for tick in range(frames):
        visible = np.array([life[0][tick] for life in lives.values()])
        boxes = np.tile([10.0, 10.0, 30.0, 20.0], (n, 1))
        truths.append(
            AerialTruth(
                tick=tick,
                ids=np.array(list(lives), np.uint32),
                kinds=np.full(n, 2, np.uint8),
                roles=np.zeros(n, np.uint8),
                visible_px=np.round(1000 * visible).astype(np.int64),
                amodal_px=np.full(n, round(1000 * inside), np.int64).clip(
                    np.round(1000 * visible).astype(int)
                ),
                amodal_px_full=np.full(n, 1000, np.int64),
                box_visible=np.where(visible[:, None] > 0, boxes, np.nan),
                box_amodal=boxes,
                occluder_ids=np.full(n, BRIDGE, np.uint32),
                distances=np.ones(n),
                positions=np.zeros((n, 3)),
                velocities=np.zeros((n, 3)),
                world_positions=np.zeros((n, 3)),
                world_velocities=np.array([[life[1][tick], 0.0, 0.0] for life in lives.values()]),
                sizes=np.tile([4.5, 1.8, 1.5], (n, 1)),
                colours=np.array([life[2] for life in lives.values()], np.float32),
                ground_to_image=np.eye(3),
            )
        )
    return truths


def passing(before: int, hidden: int, after: int, *, late: int = 0, frames: int = 140) -> list[float]:
    shares = [0.0] * late + [1.0] * before + [0.0] * hidden + [1.0] * after
    return shares + [0.2] * (frames - len(shares))


def found(shares: Sequence[float], **options: float):
    steady = [10.0] * len(shares)
    return disappearances(episode({9: (shares, steady, (1, 1, 1))}, **options), 30, PARAMS)


def test_one_vehicle_passes_beneath_a_bridge():
    (event,) = found(passing(40, 20, 35))
    assert (event.vehicle, event.occluder, event.first, event.last) == (9, BRIDGE, 40, 59)
    assert (len(event.before), len(event.after), event.frames) == (40, 35, 20)
    assert not event.changed_speed


def test_too_short_before_within_or_after_is_no_event():
    assert len(found(passing(30, 15, 30))) == 1
    assert found(passing(29, 15, 30)) == ()
    assert found(passing(30, 14, 30)) == ()
    assert found(passing(30, 15, 29)) == ()


def test_flicker_behind_a_tree_does_not_break_what_is_scored():
    shares = [*([1.0] * 16), *([0.0] * 5), *([1.0] * 16), *([0.0] * 20), *([1.0] * 40)]
    (event,) = found(shares)
    assert event.first == 37
    assert len(event.before) == 32


def test_out_of_view_has_no_occluder():
    (event,) = found(passing(40, 20, 35), inside=0.0)
    assert event.occluder == 0


def test_two_bridges_give_two_events_and_what_lies_between_counts_for_both():
    shares = [*([1.0] * 35), *([0.0] * 20), *([1.0] * 31), *([0.0] * 20), *([1.0] * 34)]
    first, second = found(shares)
    assert first.after == second.before
    assert len(found([*([1.0] * 35), *([0.0] * 20), *([1.0] * 25), *([0.0] * 20), *([1.0] * 34)])) == 0


def test_company_lookalikes_and_speeds():
    white, black = (0.9, 0.9, 0.9), (0.1, 0.1, 0.1)
    slowing = [10.0] * 50 + [7.0] * 90
    lives = {
        1: (passing(40, 20, 35), slowing, white),
        2: (passing(40, 20, 35, late=5), [10.0] * 140, white),
        3: (passing(40, 20, 35, late=10), [10.0] * 140, black),
        4: (passing(40, 20, 35, late=40), [10.0] * 140, white),
    }
    events = {one.vehicle: one for one in disappearances(episode(lives), 30, PARAMS)}
    assert set(events) == {1, 2, 3, 4}
    assert events[1].together == (2, 3)
    assert events[1].lookalikes == (2,)
    assert events[1].changed_speed
    assert not events[2].changed_speed
    assert events[3].lookalikes == ()
    assert events[4].together == ()
    told = summary(tuple(events.values()), 30)
    assert told["count"] == told["occluded"]["count"] == 4
    assert told["median_hidden_s"] == 20 / 30
    assert (told["changed_speed"], told["together"], told["lookalikes"]) == (0.25, 0.75, 0.5)


def test_nothing_is_null():
    told = summary((), 30)
    assert told["count"] == 0
    assert told["median_hidden_s"] is told["lookalikes"] is None
