"""Events whose outcome is plain, made by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from scenarios.score.disappearances import Disappearance
from scenarios.score.params import ScoringParams
from scenarios.score.reacquisition import majority, outcomes, owner, reacquisition
from scenarios.score.summary import score
from tests.scenarios.score.episodes import episode, tracks
from tests.scenarios.score.test_disappearances import episode as seen_from_above
from tests.scenarios.score.test_disappearances import passing
from tracker.types import Status, Tracks

PARAMS = ScoringParams()
BOX = (10.0, 10.0, 30.0, 20.0)
EVENT = Disappearance(
    vehicle=7,
    occluder=1,
    first=40,
    last=59,
    before=tuple(range(40)),
    after=tuple(range(60, 100)),
    speeds=(10.0, 8.0),
)


def following(*spans: tuple[int, int, int, int]) -> dict[int, dict[int, int]]:
    """Put tracks on vehicles: (vehicle, id, first, last)."""
    on: dict[int, dict[int, int]] = {tick: {} for tick in range(100)}
    for vehicle, number, first, last in spans:
        for tick in range(first, last + 1):
            on[tick][vehicle] = number
    return on


@pytest.mark.parametrize(
    ("spans", "outcome"),
    [
        ([(7, 1, 0, 39), (7, 1, 60, 99)], "correct"),
        ([(7, 1, 0, 39), (7, 2, 60, 99)], "missed"),  # a new id
        ([(7, 1, 0, 39), (8, 2, 0, 59), (7, 2, 60, 99)], "wrong"),  # another's id
        ([(8, 2, 0, 59), (7, 2, 60, 99)], "wrong"),  # never followed before
        ([(7, 1, 0, 39)], "missed"),  # not found again
        ([(7, 1, 60, 99)], "missed"),  # not followed before, and a new id
        ([], "missed"),
        ([(7, 1, 25, 39), (7, 1, 65, 99), (7, 2, 60, 64)], "correct"),  # late, but for the most
        ([(7, 1, 0, 39), (7, 2, 60, 80), (7, 1, 81, 99)], "missed"),  # too late
        ([(7, 1, 0, 24), (7, 2, 25, 39), (7, 1, 60, 99)], "missed"),  # its own, of long before
        ([(7, 1, 0, 39), (7, 2, 60, 99), (8, 2, 0, 0)], "wrong"),
        ([(7, 1, 0, 39), (7, 2, 60, 99), (8, 3, 0, 59)], "missed"),
    ],
)
def test_outcomes(spans, outcome):
    assert outcomes([EVENT], following(*spans)) == [outcome]


def test_only_frames_in_which_it_was_scored_count():
    sparse = replace(EVENT, before=tuple(range(0, 40, 2)))
    # Of the last 15 scored frames, 12 to 40, most are before 30.
    on = following((7, 1, 0, 27), (7, 2, 28, 39), (7, 1, 60, 99))
    assert outcomes([sparse], on) == ["correct"]
    assert outcomes([EVENT], on) == ["missed"]


def test_majority_and_owner():
    on = following((7, 3, 0, 9), (7, 2, 10, 19), (8, 3, 10, 30))
    assert majority(on, 7, range(20)) == 2
    assert majority(on, 7, range(19)) == 3
    assert majority(on, 9, range(20)) is None
    assert owner(on, 3, 12) == 7
    assert owner(on, 3, 40) == 8
    assert owner(on, 4, 40) is None


def aloft(shown: list[Tracks]):
    truth = seen_from_above({9: (passing(40, 20, 40), [10.0] * 140, (1, 1, 1))})[: len(shown)]
    log = episode([[] for _ in shown], found=shown, scene="aerial")
    return replace(log, truth=tuple(truth), rate=30)


def test_a_whole_log_is_scored():
    here = [tracks((1, BOX))] * 40 + [Tracks.none()] * 20
    kept, new = [*here, *[tracks((1, BOX))] * 40], [*here, *[tracks((2, BOX))] * 40]
    assert reacquisition(aloft(kept), params=PARAMS) == {"events": 1, "correct": 1, "wrong": 0, "missed": 0}
    assert reacquisition(aloft(new), params=PARAMS) == {"events": 1, "correct": 0, "wrong": 0, "missed": 1}
    scores, difficulty = score(aloft(kept))
    assert scores["reacquisition"]["correct"] == difficulty["disappearances"]["count"] == 1
    assert "identification" not in scores
    assert scores["recall"] == scores["idf1"] == 1.0


def test_what_is_not_confirmed_or_lies_elsewhere_is_on_nothing():
    coasting = [tracks((1, BOX), status=Status.COASTING)] * 100
    assert reacquisition(aloft(coasting), params=PARAMS)["missed"] == 1
    beside = [tracks((1, (25.0, 10.0, 45.0, 20.0)))] * 100
    assert reacquisition(aloft(beside), params=PARAMS)["missed"] == 1


def test_without_boxes_nothing_is_judged():
    log = replace(aloft([Tracks.none()] * 100), has_boxes=False)
    assert reacquisition(log, params=PARAMS) == {"events": 1, "correct": None, "wrong": None, "missed": None}
