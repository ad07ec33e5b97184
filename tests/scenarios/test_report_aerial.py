"""What the report shows of a flight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.report import aerial, hidden, mosaic
from scenarios.report.flight import ENLARGED, HIDDEN, PATCH, PATCHES, Flight, Path, Return, cut
from scenarios.report.recorder import Recorder
from scenarios.report.results import aerial_tables
from scenarios.report.returns import OTHER, SAME, UNKNOWN, strip, strips, verdict
from scenarios.score.disappearances import Disappearance
from scenarios.score.prediction import PredictedEvent
from scenarios.score.summary import score
from tests.scenarios.score.test_prediction import log as predicted_log
from tracker.types import Diagnostics, Predictions, Status, Tracks

WIDTH, HEIGHT = 160, 120
GONE, BACK, FRAMES = 40, 70, 120


def place(tick: int) -> np.ndarray:
    """Where the vehicle is on the mosaic."""
    return np.array([30.0 + 1.5 * tick, 60.0])


def seen_from(tick: int) -> np.ndarray:
    """The homography of a camera that follows it."""
    return np.array([[1.0, 0.0, 1.2 * tick], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def frame(tick: int, *, status: Status, covered: bool = True) -> tuple[np.ndarray, Tracks, Diagnostics]:
    x, y = place(tick) - seen_from(tick)[:2, 2]
    image = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
    image[int(y) - 4 : int(y) + 4, int(x) - 8 : int(x) + 8] = (200, 40, 40)
    tracks = Tracks(
        ids=np.array([3], np.int64),
        boxes=np.array([[x - 8, y - 4, x + 8, y + 4]]),
        status=np.array([status], np.uint8),
        state=np.array([[x, y, 9.0, 0.0]]),
    )
    expected = int(status == Status.COASTING and covered)
    predictions = Predictions(
        ids=np.full(expected, 3, np.int64),
        centres=np.tile([x, y - 3.0], (expected, 1)),
        covariances=np.tile(9.0 * np.eye(2), (expected, 1, 1)),
    )
    return image, tracks, Diagnostics(homography=seen_from(tick), predictions=predictions)


def flown(*, back: int = BACK) -> Flight:
    flight = Flight()
    for tick in range(FRAMES):
        away = GONE <= tick < back
        image, tracks, shown = frame(tick, status=Status.COASTING if away else Status.CONFIRMED)
        flight.add(tick, image, tracks, shown)
    return flight


def test_a_flight_keeps_paths_in_the_mosaic_and_who_came_back():
    flight = flown()
    (path,) = flight.paths().values()
    assert path.points == pytest.approx(np.array([place(tick) for tick in range(FRAMES)]))
    assert path.pieces() == [(0, GONE), (BACK, FRAMES)]
    (back,) = flight.returns
    assert (back.track, back.last, back.first) == (3, GONE - 1, BACK)
    # From one frame to the next it goes 0.3 px in the picture: as far is it from where it was last.
    assert back.error == pytest.approx(0.3)
    assert back.distance == pytest.approx(0.1)
    assert len(back.before) == len(back.after) == PATCHES
    assert back.after[0].shape == (ENLARGED * PATCH[1], ENLARGED * PATCH[0], 3)


def test_short_gaps_are_no_returns():
    assert flown(back=GONE + HIDDEN - 1).returns == []
    assert len(flown(back=GONE + HIDDEN).returns) == 1


def test_without_a_mosaic_there_is_nothing_to_show():
    flight = Flight()
    image, tracks, _ = frame(0, status=Status.CONFIRMED)
    flight.add(0, image, tracks, Diagnostics())
    assert aerial.section(flight, None, boxes="amodal", rate=30.0) is None


def test_frames_are_kept_all_along():
    flight = flown()
    kept = [each.index for each in flight.frames]
    assert kept == list(range(0, FRAMES, kept[1]))
    assert 10 < len(kept) <= 41


def test_patches_lie_along_the_heading():
    image = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    image[50:70, 78:82] = 255  # a bar that stands upright
    image[50:53, 78:82] = (255, 0, 0)  # its front, above
    patch = cut(image, np.array([80.0, 60.0]), np.array([0.0, -5.0])).astype(int)
    high, wide = patch.shape[:2]
    assert (patch[high // 2, wide // 2] == 255).all()
    assert patch[2, wide // 2].max() < 40
    front = patch[high // 2, wide // 2 + 9 * ENLARGED]
    assert front[0] > 200
    assert front[1] < 60


def test_the_mosaic_spans_all_frames_and_shows_still_ground_as_it_is():
    flight = flown()
    ground = mosaic.compose(flight.frames)
    high, wide = ground.image.shape[:2]
    last = flight.frames[-1].index
    assert wide / high == pytest.approx((WIDTH + 1.2 * last) / HEIGHT, rel=0.02)
    corner = ground.image[5, wide // 2]
    assert corner == pytest.approx(mosaic.DIM * 90, abs=4)


def test_tracks_before_and_after_the_repair():
    paths = flown().paths()
    ground = mosaic.compose(flown().frames)
    broken, pieces = mosaic.broken(ground, paths)
    whole, count = mosaic.repaired(ground, paths)
    assert (pieces, count) == (2, 1)
    middle = (ground.from_mosaic @ np.append(place((GONE + BACK) // 2), 1.0))[:2].astype(int)
    around = slice(middle[1] - 4, middle[1] + 5), slice(middle[0] - 30, middle[0] + 31)
    assert (broken[around] == ground.image[around]).all()
    assert not (whole[around] == ground.image[around]).all()


def test_a_flicker_is_drawn_as_one_piece():
    ticks = np.arange(100)
    seen = np.ones(100, bool)
    seen[50:54] = False
    path = Path(ticks, np.column_stack([ticks, ticks]).astype(float), seen)
    assert len(path.pieces()) == 2
    assert mosaic.repaired(mosaic.compose(flown().frames), {1: path})[1] == 1
    assert mosaic.broken(mosaic.compose(flown().frames), {1: path})[1] == 1


def following(vehicle: int, begin: int, end: int) -> dict[int, dict[int, int]]:
    """Put track 3 on a vehicle."""
    return {tick: {vehicle: 3} for tick in range(begin, end)}


def test_what_the_truth_says_of_a_return():
    back = Return(track=3, last=39, first=70, error=1.0, distance=np.nan, before=[], after=[], others={})
    before, after = following(7, 20, 40), following(7, 70, 100)
    assert verdict(back, before | after) == SAME
    assert verdict(back, before | following(8, 70, 100)) == OTHER
    assert verdict(back, before) == verdict(back, after) == UNKNOWN


def test_strips_show_the_patches_and_who_else_was_hidden():
    (back,) = flown().returns
    other = np.full_like(back.after[0], 250)
    drawn = strip(replace(back, others={9: other}))
    empty = strip(back)
    assert drawn.shape == empty.shape
    assert (drawn != empty).sum() > 0.5 * other.size
    (picture,) = strips([back], None, "amodal", 30.0)
    assert "hidden for 1.0 s" in picture.title


def test_the_fullest_frame():
    flight = flown()
    best = hidden.fullest(flight.frames, WIDTH, HEIGHT)
    assert best is not None
    assert GONE <= best.index < BACK
    assert hidden.fullest(flight.frames, 1, 1) is None


def leading(gap: float) -> dict[int, Path]:
    """Two vehicles on one way: the second is hidden while the first is not."""
    ticks = np.arange(FRAMES)
    ways = {
        1: np.array([place(tick) + np.array([gap, 0.0]) for tick in ticks]),
        3: np.array([place(t) for t in ticks]),
    }
    seen = (ticks < GONE) | (ticks >= BACK)
    return {1: Path(ticks, ways[1], np.ones(FRAMES, bool)), 3: Path(ticks, ways[3], seen)}


def test_predictors_are_found_from_the_paths_alone():
    back = Return(
        track=3, last=GONE - 1, first=BACK, error=1.0, distance=np.nan, before=[], after=[], others={}
    )
    paths = leading(20.0)
    forecast, ways, taken = hidden.rehearse(back, paths)
    assert forecast is not None
    assert taken == [1]
    assert len(ways) == BACK - GONE + 1
    assert ways[-1] == pytest.approx(place(BACK - 1), abs=1.0)
    flight = flown()
    picture = hidden.predictors([back], paths, flight.frames, 30.0)
    assert picture is not None
    assert "colour: 1." in picture.title
    assert hidden.predictors([back], leading(500.0), flight.frames, 30.0) is None


def predicted(errors: np.ndarray) -> PredictedEvent:
    event = Disappearance(
        vehicle=7,
        occluder=1,
        first=40,
        last=39 + len(errors),
        before=tuple(range(40)),
        after=tuple(range(60, 100)),
        speeds=(10.0, 10.0),
    )
    plain = {"linear": 2 * errors, "kalman": 3 * errors}
    return PredictedEvent(event=event, track=1, errors=errors, measures=errors, plain=plain)


def test_curves_of_prediction_errors_need_some_events():
    few = [predicted(np.arange(1.0, 20.0))] * (hidden.FEWEST - 1)
    assert hidden.error_curves(few) is None
    drawn = hidden.error_curves([*few, predicted(np.arange(1.0, 30.0))])
    assert drawn is not None
    assert "MPE_n, px" in drawn
    gaps = np.arange(1.0, 20.0)
    gaps[0] = np.nan
    assert hidden.error_curves([*few, predicted(gaps)]) is None


def test_bars_by_hidden_time():
    bins = {"0.5": {"events": 4, "correct": 3}, "1": {"events": 0, "correct": 0}}
    drawn = hidden.by_hidden_time({"a": bins, "b": bins})
    assert drawn is not None
    assert "n = 4" in drawn
    assert "0.5–1 s" in drawn
    assert hidden.by_hidden_time({"a": {"0.5": {"events": 0, "correct": 0}}}) is None
    assert hidden.by_hidden_time({}) is None


def test_tables_of_trackers():
    scores, _ = score(predicted_log(ups=[float(k) for k in range(1, 21)]))
    events, errors, while_hidden = aerial_tables([("one", scores), ("two", scores)])
    assert [name for name, _ in events.rows] == ["one", "two"]
    assert events.rows[0][1] == ["1", "1", "0", "0", "1 of 1", "0 of 0", "0 of 0", "0 of 0"]
    assert errors.columns == ("n = 10", "n = 30", "n = 60")
    assert errors.rows[0] == ("one", ["5.500", "–", "–"])
    assert errors.rows[4] == ("one, events", ["1", "0", "0"])
    assert while_hidden.rows[1][1] == ["15.0", "–", "–", "–", "0.550", "1.000"]
    assert aerial_tables([("lane", {"full_tracks": {}})]) == []


def test_a_page_about_a_flight(tmp_path):
    with Recorder(tmp_path, width=WIDTH, height=HEIGHT, rate=30.0, title="t", scene="aerial") as recorder:
        for tick in range(FRAMES):
            away = GONE <= tick < BACK
            recorder.frame(*frame(tick, status=Status.COASTING if away else Status.CONFIRMED))
        page = recorder.finish(None, None, None).read_text()
    for words in ("Before: 2 tracks", "After: 1 tracks", "While hidden", "Track 3 at 2.3 s"):
        assert words in page
