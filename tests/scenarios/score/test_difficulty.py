"""What was there to be got wrong, by hand."""

from scenarios.score.summary import score
from sim.world import Role
from tests.scenarios.score.episodes import CAR, Car, Trace, episode, trace_log
from tracker.types import Label


def test_objects_pairs_and_events() -> None:
    a, b = Car(id=CAR), Car(id=CAR + 1, box=(130, 100, 160, 130))
    apart = Car(id=CAR + 1, box=(200, 100, 240, 130))
    hidden = Car(id=CAR + 1, box=(110, 100, 130, 130), visible=0.0, occluder=CAR)
    gone = Car(id=CAR, visible=0.0, in_frame=0.0)
    oncoming = Car(id=CAR + 2, role=Role.ONCOMING)
    cars = (
        [[a, b, oncoming]] * 5
        + [[a, hidden]] * 10
        + [[a, apart]] * 5
        + [[gone, apart]] * 4
        + [[a, apart]] * 2
    )
    traces = trace_log(
        {
            1: Trace(labels=[Label.CAR] * 10, votes=[(CAR, 1)]),
            2: Trace(labels=[Label.CAR] * 10, votes=[(3, 1)]),
            3: Trace(labels=[Label.CAR] * 2, votes=[(3, 1)]),
        }
    )
    difficulty = score(episode(cars, traces=traces))[1]
    assert difficulty == {
        "scored_objects": 2,
        "scored_boxes": 22 + 16,
        "traces": {"car": 1, "background": 1, "oncoming": 0},
        "overlapping_pairs": 1,
        "events": {
            "occluded": {"count": 1, "returned": 1, "median_hidden_s": 1.0},
            "out_of_view": {"count": 1, "returned": 1, "median_hidden_s": 0.4},
        },
    }


def test_what_was_hidden_far_away_is_no_event() -> None:
    far = Car(id=CAR, distance=200)
    cars = [[far]] * 5 + [[Car(id=CAR, distance=150, visible=0.0, occluder=9)]] * 10 + [[Car(id=CAR)]] * 5
    difficulty = score(episode(cars))[1]
    assert difficulty["scored_objects"] == 1
    assert difficulty["events"]["occluded"]["count"] == 0


def test_nothing_there() -> None:
    difficulty = score(episode([[]] * 3))[1]
    assert difficulty["scored_objects"] == difficulty["overlapping_pairs"] == 0
    assert difficulty["events"]["occluded"] == {"count": 0, "returned": 0, "median_hidden_s": None}
