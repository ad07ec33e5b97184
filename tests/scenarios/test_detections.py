"""Detections from truth, and the rungs of the ladder."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.bridge import tracker_frame, tracker_info
from scenarios.detections import Fed, Mask, Noisy, Perfect, Sight, make_fed
from scenarios.score.preprocess import Selection
from tests.scenarios.fakes import CAMERA, observations
from tracker.boxes import iou
from tracker.types import Detections, Info, Tracks

INFO = tracker_info(CAMERA, 30)
BOXES = np.array([[20.0, 20.0, 30.0, 40.0], [40.0, 10.0, 60.0, 20.0], [2.0, 2.0, 22.0, 12.0]])


class Counting:
    """Follows nothing twice: an id for each detection."""

    def start(self, info: Info) -> None:  # noqa: ARG002
        self.seen: list[Detections] = []
        self._last = 0

    def follow(self, detections: Detections) -> Tracks:
        self.seen.append(detections)
        first, self._last = self._last, self._last + len(detections)
        return Tracks.confirmed(np.arange(first, self._last) + 1, detections.boxes)


def sight(tick: int = 0) -> Sight:
    (*_, seen) = observations(tick + 1)
    scored = np.array([True, True, False])
    return Sight(
        frame=tracker_frame(seen, odometry=False),
        observation=seen,
        selection=Selection(boxes=BOXES, scored=scored, ignored=~scored),
    )


def noisy(seed: int = 3, **errors: float) -> Noisy:
    found = Noisy(seed, **{"misses": 0.0, "clutter": 0.0, "jitter": 0.0, **errors})
    found.start(INFO)
    return found


def test_perfect_detections_are_the_scored_boxes():
    boxes, scores = Perfect().detect(sight())
    np.testing.assert_array_equal(boxes, BOXES[:2])
    assert (scores == 1).all()


def test_without_errors_the_noisy_detector_is_perfect():
    np.testing.assert_array_equal(noisy().detect(sight())[0], BOXES[:2])


def test_errors_depend_on_seed_and_tick_alone():
    errors = {"misses": 0.3, "clutter": 2.0, "jitter": 0.1}
    one, other = noisy(**errors), noisy(**errors)
    later = one.detect(sight(5))
    for _ in range(3):
        other.detect(sight(1))
    again = other.detect(sight(5))
    np.testing.assert_array_equal(later[0], again[0])
    np.testing.assert_array_equal(later[1], again[1])
    assert not np.array_equal(later[0], noisy(4, **errors).detect(sight(5))[0])
    assert not np.array_equal(later[0], one.detect(sight(6))[0])


def test_misses_clutter_and_jitter_are_as_many_as_said():
    ticks = [sight(k % 8) for k in range(8)]
    missing, false, moved = [], [], []
    for seed in range(150):
        for at in ticks:
            missing.append(2 - len(noisy(seed, misses=0.25).detect(at)[0]))
            false.append(len(noisy(seed, clutter=1.5).detect(at)[0]) - 2)
            boxes = noisy(seed, jitter=0.02).detect(at)[0]
            moved.append((boxes - BOXES[:2]) / np.tile(BOXES[:2, 2:] - BOXES[:2, :2], 2))
    assert np.mean(missing) == pytest.approx(2 * 0.25, abs=0.06)
    assert np.mean(false) == pytest.approx(1.5, abs=0.15)
    assert np.mean(moved) == pytest.approx(0.0, abs=0.002)
    assert np.std(moved) == pytest.approx(0.02, rel=0.05)


def test_boxes_stay_whole_and_within_the_frame():
    for seed in range(30):
        boxes, scores = noisy(seed, clutter=5.0, jitter=0.6).detect(sight())
        assert (boxes[:, :2] < boxes[:, 2:]).all()
        assert ((boxes >= 0) & (boxes <= [64, 48, 64, 48])).all()
        assert ((scores > 0) & (scores <= 1)).all()


def test_the_mask_joins_what_touches():
    at = sight()
    car = at.observation.truth.ids[0]
    ids = np.zeros((48, 64), np.uint32)
    ids[20:40, 8:20] = car
    ids[20:40, 20:32] = car + 1
    ids[5:15, 44:60] = car + 2
    object.__setattr__(at.observation, "ids", ids)
    object.__setattr__(at.observation.truth, "ids", np.array([car, car + 1, car + 3], np.uint32))
    boxes, _ = Mask().detect(at)
    np.testing.assert_allclose(boxes, [[8, 20, 32, 40]], atol=1)


def test_a_tracker_of_detections_is_fed_and_shows_what_it_was_fed():
    tracker = Counting()
    fed = Fed(tracker, Perfect(), "in-car", 30)
    for _ in range(2):
        fed.start(INFO)
        for seen in observations(3):
            frame = tracker_frame(seen, odometry=False)
            fed.look(frame, seen)
            tracks = fed.step(frame)
            np.testing.assert_array_equal(tracks.boxes, seen.truth.box_amodal)
            np.testing.assert_array_equal(fed.diagnostics.detections, tracks.boxes)
        assert tracks.ids.tolist() == [3]
        assert [d.tick for d in tracker.seen] == [0, 1, 2]


def test_true_association_keeps_the_truths_ids_and_gives_false_boxes_new_ones():
    fed = make_fed("association@noisy", "in-car", rate=30, seed=7)
    fed.start(INFO)
    on_car, false = set(), []
    for seen in observations(20):
        frame = tracker_frame(seen, odometry=False)
        fed.look(frame, seen)
        tracks = fed.step(frame)
        overlap = iou(seen.truth.box_amodal, tracks.boxes)[0]
        for k, number in enumerate(tracks.ids.tolist()):
            if overlap[k] >= 0.5 and overlap[k] == overlap.max():
                on_car.add(number)
            else:
                false.append(number)
    assert len(on_car) == 1
    assert false
    assert len(set(false)) == len(false)
    assert not on_car & set(false)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("in-car@perfect", "InCarTracker, without start\\(info\\) and follow\\(detections\\)"),
        ("nobody", "no tracker 'nobody'"),
        ("association@nothing", "no tracker 'nothing'"),
        ("builtins:dict", "step\\(frame\\) or follow\\(detections\\)"),
    ],
)
def test_what_cannot_be_fed_is_refused(name, message):
    with pytest.raises(ValueError, match=message):
        make_fed(name, "in-car", rate=30, seed=0)


def test_the_detections_of_a_tracker_feed_another():
    fed = make_fed("association@tests.scenarios.fakes:BrightTracker", "in-car", rate=30, seed=0)
    fed.start(INFO)
    for seen in observations(3):
        frame = tracker_frame(seen, odometry=False)
        fed.look(frame, seen)
        np.testing.assert_array_equal(fed.step(frame).boxes, seen.truth.box_amodal)
