"""Latency turns into dropped frames, on a clock of the test's own."""

import numpy as np
import pytest

from scenarios.bridge import tracker_frame
from scenarios.detections import Fed, Perfect
from scenarios.realtime import Realtime
from tests.scenarios.fakes import observations
from tracker.base import check_tracker
from tracker.types import Detections, Frame, Info, Tracks

INFO = Info(width=64, height=48, rate=30.0, intrinsics=None)


class Clock:
    """Seconds that pass only when somebody takes them."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class SlowTracker:
    """Takes so many seconds a step, and numbers its one track by the frame."""

    def __init__(self, clock: Clock, latencies: list[float]) -> None:
        self.clock, self.latencies = clock, latencies

    def start(self, info: Info) -> None:  # noqa: ARG002
        self.left = [*self.latencies]

    def step(self, frame: Frame) -> Tracks:
        self.clock.now += self.left.pop(0) if self.left else 0.0
        return Tracks.confirmed([1 + frame.tick], [[0, 0, 5, 5]])

    def follow(self, detections: Detections) -> Tracks:
        self.clock.now += self.left.pop(0) if self.left else 0.0
        return Tracks.confirmed(1 + np.arange(len(detections)), detections.boxes)


def shown(latencies: list[float], frames: int = 10, rate: int = 30) -> tuple[list[int], int]:
    """Which frame's tracks stand in each frame, and how many frames were dropped."""
    clock = Clock()
    realtime = Realtime(SlowTracker(clock, latencies), clock=clock)
    realtime.start(INFO)
    image = np.zeros((48, 64, 3), np.uint8)
    ids = [
        int(realtime.step(Frame(image=image, tick=tick, time=tick / rate)).ids[0]) - 1
        for tick in range(frames)
    ]
    return ids, realtime.dropped


@pytest.mark.parametrize(
    ("latencies", "stand", "dropped"),
    [
        ([0.001] * 10, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], 0),
        ([9.0, 0.03, 0.03], [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], 0),  # the first is waited for
        ([0.0] + [0.05] * 9, [0, 1, 1, 3, 3, 5, 5, 7, 7, 9], 4),
        ([0.0, 0.11], [0, 1, 1, 1, 1, 5, 6, 7, 8, 9], 3),
        ([0.0, 9.0], [0, *[1] * 9], 8),
    ],
)
def test_what_comes_while_the_tracker_is_busy_is_dropped(latencies, stand, dropped):
    assert shown(latencies) == (stand, dropped)


def test_an_episode_begins_anew():
    clock = Clock()
    realtime = Realtime(SlowTracker(clock, [0.0, 9.0]), clock=clock)
    check_tracker(Realtime(SlowTracker(clock, []), clock=clock))
    for _ in range(2):
        realtime.start(INFO)
        image = np.zeros((48, 64, 3), np.uint8)
        for tick in range(4):
            realtime.step(Frame(image=image, tick=tick, time=tick / 30))
        assert realtime.dropped == 2


def test_a_tracker_that_is_fed_sees_detections_of_the_frames_that_it_gets():
    clock = Clock()
    realtime = Realtime(Fed(SlowTracker(clock, [0.0, 0.05]), Perfect(), "in-car", 30), clock=clock)
    realtime.start(INFO)
    boxes = []
    for seen in observations(4):
        frame = tracker_frame(seen, odometry=False)
        realtime.look(frame, seen)
        boxes.append(realtime.step(frame).boxes[0, 0] - seen.truth.box_amodal[0, 0])
    assert boxes == [0, 0, -1, 0]
