"""What the report shows of a lane."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.report.moment import TRAINED, Moment, MomentChooser, association, doubt, pictures
from scenarios.report.recorder import Recorder
from scenarios.report.results import lane_tables
from scenarios.report.series import follow_riders, foreground_series, measure
from scenarios.report.tables import DASH
from scenarios.score.params import ScoringParams
from scenarios.shown import NO_MASK, ShownLog
from tests.scenarios.score.episodes import CAR, Car, episode, tracks
from tracker.types import Association, Diagnostics, Predictions

BOX = (100, 100, 140, 140)
TRAINING = ScoringParams().training_frames
BOXES = np.array([[10.0, 10, 30, 40], [50, 10, 70, 40], [90, 10, 110, 40]])
IMAGE = np.full((60, 120, 3), 90, np.uint8)


def shown(beta, ids):
    beta = np.array(beta, float)
    return Diagnostics(
        detections=BOXES.copy(),
        mask=np.zeros(IMAGE.shape[:2], bool),
        background=IMAGE.copy(),
        association=Association(ids=np.array(ids, np.int64), beta=beta),
        predictions=Predictions(
            ids=np.array(ids, np.int64),
            centres=np.full((len(ids), 2), 25.0),
            covariances=np.tile(4.0 * np.eye(2), (len(ids), 1, 1)),
        ),
    )


SURE = shown([[0, 1, 0, 0]], [4])
UNSURE = shown([[0.1, 0, 0.9, 0], [0.2, 0.6, 0.2, 0]], [7, 4])


def test_doubt_is_nothing_where_all_is_certain_and_greatest_where_all_is_alike():
    certain, alike, between = doubt(np.array([[1.0, 0, 0], [1 / 3, 1 / 3, 1 / 3], [0.5, 0.5, 0]]))
    assert certain == pytest.approx(0.0, abs=1e-9)
    assert alike == pytest.approx(np.log(3))
    assert between == pytest.approx(np.log(2))


def test_the_least_certain_frame_after_the_training_is_kept_whatever_is_done_to_its_arrays_later():
    chooser = MomentChooser()
    image = IMAGE.copy()
    chooser.consider(TRAINED - 1, image, tracks((1, BOX)), UNSURE)
    assert chooser.chosen is None
    for index, diagnostics in enumerate((SURE, UNSURE, SURE), start=TRAINED):
        chooser.consider(index, image, tracks((1, BOX)), diagnostics)
    image[:] = 0
    assert chooser.chosen is not None
    assert chooser.chosen.index == TRAINED + 1
    assert (chooser.chosen.image == IMAGE).all()


def test_without_associations_the_fullest_frame_is_kept():
    chooser = MomentChooser()
    plain = Diagnostics(detections=BOXES, mask=np.zeros(IMAGE.shape[:2], bool))
    for index, count in enumerate((1, 3, 2), start=TRAINED):
        chooser.consider(index, IMAGE, tracks(*((k + 1, BOX) for k in range(count))), plain)
    assert chooser.chosen is not None
    assert chooser.chosen.index == TRAINED + 1
    assert association(chooser.chosen) is None
    assert [picture.title for picture in pictures(chooser.chosen, None, 2.0)][1:] == [
        "Foreground, and the detections in it",
        "Tracks",
    ]


def test_the_table_of_associations_has_tracks_by_id_and_only_detections_that_are_somebodys():
    found = association(Moment(61, IMAGE, tracks((4, BOX)), UNSURE))
    assert found is not None
    table = found[1]
    assert [row.track for row in table.rows] == [4, 7]
    assert [number for number, _ in table.detections] == [1, 2]
    assert [[cell.text for cell in row.cells] for row in table.rows] == [
        [".20", ".60", ".20"],
        [".10", "", ".90"],
    ]


def test_tracks_on_riders_are_followed_through_the_scored_frames():
    rider = [Car(id=CAR, box=BOX)]
    found = [tracks((1, BOX))] * (TRAINING + 5) + [tracks()] * 2 + [tracks((2, BOX))] * 3
    log = episode([rider] * (TRAINING + 10), found, scene="motorcycle-lane")
    (followed,) = follow_riders(log)
    assert followed.rider == CAR
    assert followed.frames.tolist() == list(range(TRAINING, TRAINING + 10))
    assert followed.tracks.tolist() == [1] * 5 + [0] * 2 + [2] * 3


def test_series_of_a_lane_begin_after_its_training():
    rider = [Car(id=CAR, box=BOX)]
    log = episode([rider] * (TRAINING + 4), [tracks((1, BOX))] * (TRAINING + 4), scene="motorcycle-lane")
    series = measure(log)
    assert np.isnan(series.scored[:TRAINING]).all()
    assert series.matched[TRAINING:].tolist() == [1.0] * 4


def test_foreground_over_time():
    rider = [Car(id=CAR, box=BOX)]
    frames = TRAINING + 2
    mask_px = np.full(frames, NO_MASK, np.int64)
    mask_px[TRAINING] = 1600
    masks = ShownLog(
        detections=None,
        flags=None,
        mask_px=mask_px,
        object_px=tuple(np.array([800], np.int64) for _ in range(frames)),
    )
    found = foreground_series(episode([rider] * frames, scene="motorcycle-lane", shown=masks))
    assert found is not None
    assert found["precision"][TRAINING] == 0.5
    assert found["recall"][TRAINING] == 0.8
    assert np.isnan(found["recall"][TRAINING + 1])


def test_tables_like_the_papers():
    scores = {
        "detection": {
            "riders": 20,
            "correct": 15,
            "false": 5,
            "missed": 5,
            "precision": 0.75,
            "recall": 0.75,
        },
        "full_tracks": {"total": 8, "correct": 4, "lost": 1},
    }
    nothing = {
        "detection": dict.fromkeys(scores["detection"]),
        "full_tracks": {"total": None, "correct": None},
    }
    detections, full = lane_tables([("a", scores), ("b", nothing)])
    assert detections.rows[0] == ("a", ["20", "15", "5", "5", "0.750", "0.750"])
    assert full.rows == [("a", ["8", "4", "3", "1", "0.500"]), ("b", [DASH] * 5)]
    assert lane_tables([("in-car", {"identification": {}})]) == []


def test_the_page_of_a_lane_shows_its_moment_and_no_traces(tmp_path):
    with Recorder(tmp_path, width=120, height=60, rate=30, title="lane", scene="motorcycle-lane") as recorder:
        for _ in range(TRAINED + 3):
            recorder.frame(IMAGE, tracks((4, (10, 10, 30, 40))), UNSURE)
        page = recorder.finish(None, None, None).read_text("utf-8")
    for words in ("Learnt background", "Foreground, and the detections in it", "Association probabilities"):
        assert words in page
    assert "trace:" not in page
