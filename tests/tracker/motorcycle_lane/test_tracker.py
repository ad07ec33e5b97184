"""The three trackers on a drawn lane with known boxes; the contract is checked with all others."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tests.tracker.motorcycle_lane.lane import HEIGHT, RATE, WIDTH, Rider, draw
from tracker import registry
from tracker.blobs import clean
from tracker.boosting import learnt
from tracker.boxes import iou
from tracker.motorcycle_lane.background import PAPER, BackgroundModel
from tracker.motorcycle_lane.foreground import weigh
from tracker.motorcycle_lane.ground import Ground
from tracker.motorcycle_lane.tracker import MotorcycleLaneTracker
from tracker.types import Frame, Info, Status

NAMES = ("motorcycle-lane", "motorcycle-lane:paper", "motorcycle-lane:mog2-nn")
INFO = Info(width=WIDTH, height=HEIGHT, rate=RATE, intrinsics=None)
RED, GREEN, BLUE, YELLOW = (205, 40, 40), (40, 165, 60), (40, 70, 195), (225, 205, 50)
WHITE, VIOLET, ORANGE, BLACK = (230, 230, 230), (150, 60, 160), (230, 130, 40), (45, 45, 50)
LEARNT = 60


def riders():
    """Traffic of which 3 and 4 touch and part again, 5 comes the wrong way, 6 stops and goes."""
    return [
        Rider(across=-60.0, start=-2.0, speed=0.4, colours=(YELLOW, BLACK)),
        Rider(across=70.0, start=-1.2, speed=0.4, colours=(WHITE, RED)),
        Rider(across=10.0, start=-0.3, speed=0.45, colours=(VIOLET, BLUE)),
        Rider(across=(-45.0, -12.0, -12.0, -50.0), start=1.2, speed=0.45, colours=(RED, BLACK)),
        Rider(across=(35.0, 9.0, 9.0, 50.0), start=1.25, speed=0.45, colours=(BLUE, GREEN)),
        Rider(across=-125.0, start=1.5, speed=-0.4, colours=(ORANGE, BLUE)),
        Rider(across=130.0, start=1.6, speed=0.45, colours=(GREEN, WHITE), stop=(2.8, 4.5)),
        Rider(across=-85.0, start=3.4, speed=0.42, colours=(WHITE, BLACK)),
        Rider(across=75.0, start=3.6, speed=0.42, colours=(YELLOW, RED)),
    ]


@pytest.fixture(scope="module")
def video():
    return list(draw(riders(), 8.0, seed=4))


def follow(name, frames):
    tracker = registry.make(name)
    tracker.start(INFO)
    shown = []
    for tick, image in enumerate(frames):
        tracks = tracker.step(Frame(image=image, tick=tick, time=tick / RATE))
        shown.append((tracks, tracker.diagnostics))
    return shown


@pytest.fixture(scope="module")
def followed(video):
    return follow("motorcycle-lane", [image for image, _ in video])


def ids_of(rider, video, followed):
    """The id on a rider in each frame after the training in which it is known; 0 for none."""
    found = []
    for (_, boxes), (tracks, _) in list(zip(video, followed, strict=True))[LEARNT:]:
        if rider not in boxes:
            continue
        sure = tracks.status == Status.CONFIRMED
        box = np.clip(boxes[rider], 0, [WIDTH, HEIGHT] * 2)
        overlaps = iou([box], tracks.boxes[sure])[0]
        hit = len(overlaps) and overlaps.max() >= 0.4
        found.append(int(tracks.ids[sure][overlaps.argmax()]) if hit else 0)
    return np.array(found)


@pytest.mark.parametrize("rider", [3, 4, 6, 7, 8])
def test_riders_keep_their_ids_through_touching_and_stopping(rider, video, followed):
    ids = ids_of(rider, video, followed)
    own = np.bincount(ids[ids > 0]).argmax()
    assert (ids == own).mean() > 0.9
    others = np.concatenate([ids_of(other, video, followed) for other in range(9) if other != rider])
    assert (others == own).sum() <= 3


def test_the_two_do_touch(video):
    """What the test above is worth: the boxes of 3 and 4 overlap in many frames."""
    both = [boxes for _, boxes in video if {3, 4} <= boxes.keys()]
    shared = [iou([boxes[3]], [boxes[4]])[0, 0] > 0.02 for boxes in both]
    assert sum(shared) > 30
    assert not shared[0]
    assert not shared[-1]


def test_few_boxes_are_false(followed):
    total = false = 0
    for tick, (tracks, _) in list(enumerate(followed))[LEARNT:]:
        sure = tracks.boxes[tracks.status == Status.CONFIRMED]
        there = [box for rider in riders() if (box := rider.box(tick / RATE)) is not None]
        truth = np.clip(np.array(there).reshape(-1, 4), 0, [WIDTH, HEIGHT] * 2)
        total += len(sure)
        false += int((iou(sure, truth).max(1, initial=0.0) < 0.2).sum())
    assert total > 500
    assert false < 0.03 * total


def test_each_detection_has_its_probabilities(followed):
    shown = [diagnostics for _, diagnostics in followed if diagnostics.association is not None]
    assert shown
    for diagnostics in shown:
        beta = diagnostics.association.beta
        assert beta.shape == (len(diagnostics.association.ids), len(diagnostics.detections) + 1)
        assert beta.sum(1) == pytest.approx(np.ones(len(beta)))
        assert (beta >= -1e-12).all()


def test_the_wrong_way_rider_is_flagged_and_nobody_else(video, followed):
    ids = ids_of(5, video, followed)
    own = np.bincount(ids[ids > 0]).argmax()
    flagged = {int(i) for _, diagnostics in followed for i in diagnostics.flags}
    assert flagged == {own}


@pytest.mark.parametrize("name", NAMES)
def test_an_episode_again_after_another_is_the_same(name, video):
    frames = [image for image, _ in video[:70]]
    tracker = registry.make(name)

    def run(images):
        tracker.start(INFO)
        return [tracker.step(Frame(image=image, tick=t, time=t / RATE)) for t, image in enumerate(images)]

    first = run(frames)
    run([image[::-1].copy() for image in frames[:40]])
    for one, again in zip(first, run(frames), strict=True):
        assert np.array_equal(one.ids, again.ids)
        assert np.array_equal(one.boxes, again.boxes)
        assert np.array_equal(one.status, again.status)


def test_masks_are_the_background_models(video):
    frames = [image for image, _ in video[:70]]
    ours, printed, ground = BackgroundModel(WIDTH, HEIGHT), BackgroundModel(WIDTH, HEIGHT, PAPER), Ground()
    tracker, trees = MotorcycleLaneTracker(), learnt("tracker.motorcycle_lane", "foreground")
    tracker.start(INFO)
    for k, (image, (_, plain)) in enumerate(zip(frames, follow(NAMES[1], frames), strict=True)):
        raw = ours.apply(image)
        heights = tracker._measurer.sizes.sizes(np.arange(HEIGHT, dtype=float))[:, 1]
        tracker.step(Frame(image=image, tick=k, time=k / RATE))
        mask = clean(weigh(image, ground.image(ours.background), raw, heights, trees).vehicles)
        ground.learn(image, raw, mask)
        assert np.array_equal(tracker.diagnostics.mask, mask)
        assert np.array_equal(plain.mask, clean(printed.apply(image)))


def test_the_baseline_does_not_depend_on_threads(video):
    frames = [image for image, _ in video[:70]]
    threads = cv2.getNumThreads()
    try:
        runs = []
        for count in (1, 4):
            cv2.setNumThreads(count)
            runs.append(follow(NAMES[2], frames))
    finally:
        cv2.setNumThreads(threads)
    for (one, first), (other, second) in zip(*runs, strict=True):
        assert np.array_equal(first.mask, second.mask)
        assert np.array_equal(one.boxes, other.boxes)
