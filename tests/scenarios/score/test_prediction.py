"""Predictions of a hidden vehicle whose errors are plain, made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.log import EpisodeLog
from scenarios.score.disappearances import disappearances
from scenarios.score.params import ScoringParams
from scenarios.score.prediction import by_hidden_time, mean_error, prediction, true_centres
from scenarios.score.summary import score
from scenarios.shown import ShownLog
from tests.scenarios.score.episodes import episode, tracks
from tests.scenarios.score.test_disappearances import episode as seen_from_above
from tests.scenarios.score.test_disappearances import passing
from tracker.types import Predictions, Status, Tracks

PARAMS = ScoringParams()
FRAMES = 140
FIRST, HIDDEN = 40, 20


def shift(tick: int) -> float:
    """How far the platform has flown, px: faster and faster."""
    return 0.02 * tick**2


def box(tick: int, up: float = 0.0) -> tuple[float, float, float, float]:
    """A vehicle that goes 2 px a frame over the ground, as the platform sees it."""
    left = 100.0 + 2.0 * tick - shift(tick)
    return left, 100.0 - up, left + 20.0, 110.0 - up


def log(
    *, ups: list[float], lost: tuple[int, ...] = (), variance: float = 100.0, flown: bool = True
) -> EpisodeLog:
    """A tracker that is right, but ``ups`` px too high while the vehicle is hidden."""
    truth = seen_from_above({9: (passing(FIRST, HIDDEN, 40), [10.0] * FRAMES, (1, 1, 1))})
    truth = [
        replace(frame, box_amodal=np.array([box(tick)]), box_visible=np.array([box(tick)]))
        for tick, frame in enumerate(truth)
    ]
    shown, predictions = [], []
    for tick in range(FRAMES):
        hidden = 0 <= tick - FIRST < HIDDEN
        up = ups[tick - FIRST] if hidden else 0.0
        status = Status.COASTING if hidden else Status.CONFIRMED
        there = Tracks.none() if tick in lost else tracks((1, box(tick, up)), status=status)
        shown.append(there)
        count = int(hidden and len(there) > 0)
        predictions.append(
            Predictions(
                ids=np.ones(count, np.int64),
                centres=there.boxes[:count].reshape(-1, 2, 2).mean(1),
                covariances=np.tile(variance * np.eye(2), (count, 1, 1)),
            )
        )
    moves = np.tile(np.eye(3), (FRAMES, 1, 1))
    moves[:, 0, 2] = [shift(tick) for tick in range(FRAMES)]
    inner = ShownLog(
        detections=None,
        flags=None,
        mask_px=None,
        object_px=None,
        predictions=tuple(predictions),
        homographies=moves if flown else None,
    )
    made = episode([[] for _ in shown], found=shown, scene="aerial", shown=inner)
    return replace(made, truth=tuple(truth), rate=30)


def test_mean_errors_and_their_variance_by_the_length_of_the_prediction():
    errors = [np.arange(1.0, 21.0), np.full(12, 4.0), np.array([1.0, np.nan, 3.0])]
    # Of 1, ..., 10 the mean is 5.5 and the variance 8.25; of the twelve fours 4 and 0.
    assert mean_error(errors, 10) == (pytest.approx(4.75), pytest.approx(4.125))
    assert mean_error(errors, 20) == (pytest.approx(10.5), pytest.approx(33.25))
    assert mean_error(errors, 1) == (pytest.approx(2.0), 0.0)
    assert mean_error(errors, 30) == (None, None)


def test_errors_by_hand():
    found = prediction(log(ups=[float(k) for k in range(1, 21)]), params=PARAMS)
    assert found["prediction_error_px"] == {"10": pytest.approx(5.5), "30": None, "60": None}
    assert found["prediction_variance_px2"] == {"10": pytest.approx(8.25), "30": None, "60": None}
    assert found["predicted_events"] == {"10": 1, "30": 0, "60": 0}
    # Half a second is 15 frames.
    assert found["prediction_error_at_px"] == {"0.5": pytest.approx(15.0), "1": None, "2": None, "4": None}
    # k^2 / 100 is at most 1.386 up to k = 11, and at most 5.99 for all of them.
    assert found["prediction_inside"] == {"50": pytest.approx(11 / 20), "95": 1.0}
    assert found["reacquisition_by_hidden_s"]["0.5"] == {"events": 1, "correct": 1}
    assert found["reacquisition_by_hidden_s"]["1"] == {"events": 0, "correct": 0}


def test_plain_predictions_know_how_the_platform_moves():
    found = prediction(log(ups=[7.0] * HIDDEN), params=PARAMS)
    assert found["prediction_error_px"]["10"] == pytest.approx(7.0)
    assert found["linear_prediction_error_px"]["10"] == pytest.approx(0.0, abs=1e-9)
    assert found["kalman_prediction_error_px"]["10"] < 0.2


def test_without_a_mosaic_there_are_no_plain_predictions():
    found = prediction(log(ups=[7.0] * HIDDEN, flown=False), params=PARAMS)
    assert found["prediction_error_px"]["10"] == pytest.approx(7.0)
    assert found["linear_prediction_error_px"] == {"10": None, "30": None, "60": None}


def test_an_event_that_was_not_predicted_throughout_does_not_count():
    ups = [1.0] * HIDDEN
    assert prediction(log(ups=ups, lost=(FIRST + 9,)), params=PARAMS)["predicted_events"]["10"] == 0
    late = prediction(log(ups=ups, lost=(FIRST + 10,)), params=PARAMS)
    assert late["predicted_events"]["10"] == 1
    never_followed = prediction(log(ups=ups, lost=tuple(range(FIRST))), params=PARAMS)
    assert never_followed["prediction_error_px"]["10"] is None
    assert never_followed["reacquisition_by_hidden_s"]["0.5"] == {"events": 1, "correct": 0}


def test_where_the_vehicle_is_not_in_the_truth_nothing_is_compared():
    whole = log(ups=[1.0] * HIDDEN)
    (event,) = disappearances(whole.truth, 30, PARAMS)
    gone = list(whole.truth)
    gone[FIRST + 3] = replace(gone[FIRST + 3], ids=np.array([8], np.uint32))
    centres = true_centres(gone, event)
    assert np.isnan(centres[3]).all()
    assert centres[4] == pytest.approx([110.0 + 2.0 * 44 - shift(44), 105.0])


def test_events_by_how_long_they_last():
    whole = log(ups=[1.0] * HIDDEN)
    (event,) = disappearances(whole.truth, 30, PARAMS)
    events = [replace(event, last=event.first + frames - 1) for frames in (15, 29, 30, 60, 119, 120, 400)]
    judged = ["correct", "missed", "wrong", "correct", "correct", "missed", "correct"]
    assert by_hidden_time(events, judged, 30) == {
        "0.5": {"events": 2, "correct": 1},
        "1": {"events": 1, "correct": 0},
        "2": {"events": 2, "correct": 2},
        "4": {"events": 2, "correct": 1},
    }


def test_without_boxes_all_is_null_but_the_events():
    scores, _ = score(replace(log(ups=[1.0] * HIDDEN), has_boxes=False))
    assert scores["prediction_error_px"] == {"10": None, "30": None, "60": None}
    assert scores["predicted_events"] == {"10": None, "30": None, "60": None}
    assert scores["reacquisition_by_hidden_s"]["0.5"] == {"events": 1, "correct": None}
