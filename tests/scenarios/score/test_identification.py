"""Traces judged by hand."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from scenarios.score.identification import judge_traces
from scenarios.score.params import ScoringParams
from scenarios.score.summary import score
from sim.world import Role
from tests.scenarios.score.episodes import CAR, RATE, Car, Trace, episode, trace_log
from tracker.types import Label

U, B, C = Label.UNDECIDED, Label.BACKGROUND, Label.CAR
TREE, GROUND, SKY = 17, 1, 0
SAME, ONCOMING, PARKED, FAR, CROSSING = CAR, CAR + 1, CAR + 2, CAR + 3, CAR + 4
SCENE = [
    Car(id=SAME),
    Car(id=ONCOMING, role=Role.ONCOMING),
    Car(id=PARKED, role=Role.PARKED),
    Car(id=FAR, distance=70),
    Car(id=CROSSING, role=Role.CROSSING),
]
FRAMES = 40


def truth_of(trace: Trace, params: ScoringParams | None = None) -> str:
    log = episode([SCENE] * FRAMES, traces=trace_log({5: trace}))
    (judged,) = judge_traces(log, params or ScoringParams())
    return judged.truth


@pytest.mark.parametrize(
    ("votes", "wanted"),
    [
        ([(SAME, 3)], "car"),
        ([(ONCOMING, 3)], "oncoming"),
        ([(PARKED, 3)], "background"),
        ([(TREE, 3)], "background"),
        ([(GROUND, 3)], "background"),
        ([(SKY, 3)], "background"),
        ([(TREE, 1), (GROUND, 1), (SKY, 1), (PARKED, 1)], "background"),
        ([(FAR, 3)], "ignored"),
        ([(CROSSING, 3)], "ignored"),
        ([(SAME, 3), (TREE, 2)], "car"),
        ([(SAME, 4), (TREE, 3)], "ignored"),
        ([(SAME, 2), (FAR, 2)], "ignored"),
        ([], "ignored"),
    ],
)
def test_what_a_trace_belongs_to(votes: list[tuple[int, int]], wanted: str) -> None:
    assert truth_of(Trace(labels=[U] * 10, votes=votes)) == wanted


def test_short_traces_are_ignored() -> None:
    assert truth_of(Trace(labels=[U] * (RATE - 1), votes=[(SAME, 3)])) == "ignored"
    assert truth_of(Trace(labels=[U] * RATE, votes=[(SAME, 3)])) == "car"
    params = ScoringParams(min_trace_seconds=0.5)
    assert truth_of(Trace(labels=[U] * 5, votes=[(SAME, 3)]), params) == "car"


def test_what_stands_beyond_sixty_metres_is_ignored_where_depths_are_known() -> None:
    assert truth_of(Trace(labels=[U] * 10, votes=[(TREE, 3)], depth=59.0)) == "background"
    assert truth_of(Trace(labels=[U] * 10, votes=[(TREE, 3)], depth=61.0)) == "ignored"
    assert truth_of(Trace(labels=[U] * 10, votes=[(SKY, 3)], depth=np.inf)) == "ignored"
    assert truth_of(Trace(labels=[U] * 10, votes=[(SAME, 3)], depth=61.0)) == "car"


def test_the_majority_is_over_the_life() -> None:
    """A trace that slides from a car onto a tree after most of its life is still the car's."""
    log = trace_log({5: Trace(labels=[C] * 10, votes=[(SAME, 2)])})
    slid = replace(log, vote_objects=np.where(log.vote_ticks < 7, SAME, TREE).astype(np.uint32))
    (judged,) = judge_traces(episode([SCENE] * FRAMES, traces=slid), ScoringParams())
    assert (judged.owner, judged.truth) == (SAME, "car")


def test_rows_in_any_order() -> None:
    log = trace_log(
        {5: Trace(labels=[U] * 5 + [C] * 5, votes=[(SAME, 2)]), 2: Trace(labels=[B] * 10, votes=[(TREE, 1)])}
    )
    order = np.random.default_rng(0).permutation(len(log.ids))
    columns = ("ticks", "ids", "x", "v", "labels", "p_car", "owners")
    shuffled = replace(log, **{name: getattr(log, name)[order] for name in columns})
    first, second = (
        judge_traces(episode([SCENE] * FRAMES, traces=traces), ScoringParams()) for traces in (log, shuffled)
    )
    assert first == second
    assert [trace.id for trace in first] == [2, 5]


@pytest.mark.parametrize(
    ("labels", "seconds"),
    [
        ([C] * 10, 0.0),
        ([U] * 4 + [C] * 6, 0.4),
        ([C, B, C, U] + [C] * 6, 0.4),
        ([C] * 9 + [B], np.inf),
        ([U] * 10, np.inf),
    ],
)
def test_seconds_until_the_label_stays_right(labels: list[Label], seconds: float) -> None:
    trace = Trace(first=12, labels=labels, votes=[(SAME, 1)])
    (judged,) = judge_traces(episode([SCENE] * FRAMES, traces=trace_log({1: trace})), ScoringParams())
    assert judged.seconds == pytest.approx(seconds)
    assert judged.right == np.isfinite(seconds)


def drive() -> dict[int, Trace]:
    on = {"car": [(SAME, 2)], "tree": [(TREE, 2)], "oncoming": [(ONCOMING, 2)]}
    return {
        1: Trace(labels=[U] * 5 + [C] * 15, votes=on["car"]),
        2: Trace(labels=[U] * 10 + [C] * 10, votes=on["car"]),
        3: Trace(labels=[B] * 20, votes=on["car"]),
        4: Trace(labels=[B] * 20, votes=on["tree"]),
        5: Trace(labels=[B] * 20, votes=[(PARKED, 1)]),
        6: Trace(labels=[C] * 20, votes=on["tree"]),
        7: Trace(labels=[U] * 20, votes=on["tree"]),
        8: Trace(labels=[C] * 20, votes=on["oncoming"]),
        9: Trace(labels=[B] * 20, votes=on["oncoming"]),
        10: Trace(labels=[C] * 5, votes=on["car"]),
        11: Trace(labels=[C] * 20, votes=[(FAR, 2)]),
    }


def identification_of(log: Any) -> dict[str, Any]:
    return score(log)[0]["identification"]


def test_a_drive_by_hand() -> None:
    scores = identification_of(episode([SCENE] * FRAMES, traces=trace_log(drive())))
    assert scores["car_recall"] == pytest.approx(2 / 3)
    assert scores["background_recall"] == pytest.approx(2 / 4)
    assert scores["accuracy"] == pytest.approx(4 / 7)
    assert scores["balanced_accuracy"] == pytest.approx((2 / 3 + 1 / 2) / 2)
    assert scores["confusion"] == {
        "car": {"car": 2, "background": 1, "undecided": 0},
        "background": {"car": 1, "background": 2, "undecided": 1},
        "oncoming": {"car": 1, "background": 1, "undecided": 0},
    }
    assert scores["median_seconds_to_identify"] == pytest.approx(1.0)
    assert scores["never_identified"] == pytest.approx(1 / 3)
    assert scores["oncoming_as_car"] == 0.5
    assert scores["traces_per_10s"] == {"car": 7.5, "background": 10.0, "oncoming": 5.0}
    assert scores["vehicle_coverage"] == 1
    assert scores["moving"]["car_recall"] == scores["car_recall"]


def test_an_infinite_median_is_null_and_json_can_hold_all() -> None:
    traces = {1: Trace(labels=[B] * 20, votes=[(SAME, 2)]), 2: Trace(labels=[C] * 20, votes=[(SAME, 2)])}
    log = episode([SCENE] * FRAMES, traces=trace_log(traces))
    scores, difficulty = score(log)
    assert scores["identification"]["median_seconds_to_identify"] is None
    assert scores["identification"]["never_identified"] == 0.5
    json.dumps([scores, difficulty], allow_nan=False)


def test_coverage_counts_vehicles_scored_for_two_seconds() -> None:
    other, brief = Car(id=CAR + 20), Car(id=CAR + 21)
    cars = [[*SCENE, other] + [brief] * (k < 2 * RATE - 1) for k in range(FRAMES)]
    traces = trace_log(
        {1: Trace(labels=[C] * 10, votes=[(SAME, 1)]), 2: Trace(labels=[B] * 10, votes=[(CAR + 20, 1)])}
    )
    assert identification_of(episode(cars, traces=traces))["vehicle_coverage"] == 0.5


def test_moving_leaves_out_traces_of_a_standing_car() -> None:
    traces = {
        1: Trace(labels=[B] * 20, votes=[(SAME, 2)]),
        2: Trace(first=20, labels=[C] * 20, votes=[(SAME, 2)]),
    }
    speed = [0.0] * 20 + [10.0] * 20
    scores = identification_of(episode([SCENE] * FRAMES, traces=trace_log(traces), speed=speed))
    assert scores["car_recall"] == 0.5
    assert scores["moving"]["car_recall"] == 1
    assert scores["moving"]["background_recall"] is None
    standing = identification_of(episode([SCENE] * FRAMES, traces=trace_log(traces), speed=np.nan))
    assert standing["moving"]["car_recall"] is None


def test_a_tracker_without_traces_gets_nulls() -> None:
    def leaves(value: Any) -> list[Any]:
        return [x for v in value.values() for x in leaves(v)] if isinstance(value, dict) else [value]

    scores, difficulty = score(episode([SCENE] * FRAMES))
    assert leaves(scores["identification"]) == [None] * len(leaves(scores["identification"]))
    assert difficulty["traces"] == {"car": None, "background": None, "oncoming": None}
    shown_none = identification_of(episode([SCENE] * FRAMES, traces=trace_log({})))
    assert shown_none["car_recall"] is None
    assert shown_none["vehicle_coverage"] == 0
    assert shown_none["traces_per_10s"]["car"] == 0
