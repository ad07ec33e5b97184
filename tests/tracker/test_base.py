"""The contract of a tracker, run on ours and on broken ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tracker.base import ContractError, check_tracker
from tracker.registry import TRACKERS, make
from tracker.types import Association, Diagnostics, Frame, Info, Tracks


class Fixed:
    """Returns one track, and keeps the contract; the broken ones below change one thing."""

    def start(self, _info: Info) -> None:
        self.count = 0

    def step(self, _frame: Frame) -> Tracks:
        self.count += 1
        return Tracks(
            ids=np.array([1], np.int64),
            boxes=np.array([[1.0, 2.0, 3.0 + self.count, 4.0]]),
            status=np.array([1], np.uint8),
        )


class Narrow(Fixed):
    def step(self, frame):
        return replace(super().step(frame), ids=np.array([1], np.int32))


class Zero(Fixed):
    def step(self, frame):
        return replace(super().step(frame), ids=np.array([0], np.int64))


class Infinite(Fixed):
    def step(self, frame):
        return replace(super().step(frame), boxes=np.array([[1.0, 2.0, np.inf, 4.0]]))


class Flipped(Fixed):
    def step(self, frame):
        return replace(super().step(frame), boxes=np.array([[5.0, 2.0, 3.0, 4.0]]))


class Short(Fixed):
    def step(self, frame):
        return replace(super().step(frame), status=np.zeros(0, np.uint8))


class Twice(Fixed):
    def step(self, _frame):
        return Tracks(
            ids=np.ones(2, np.int64), boxes=np.tile([0.0, 0.0, 1.0, 1.0], (2, 1)), status=np.ones(2, np.uint8)
        )


class Unsure(Fixed):
    def step(self, frame):
        return replace(super().step(frame), score=np.array([1.5]))


class Forgetless(Fixed):
    def __init__(self):
        self.count = 0

    def start(self, info):
        pass


class Painter(Fixed):
    def step(self, frame):
        frame.image[0, 0] = 0
        return super().step(frame)


class Rewriter(Fixed):
    def start(self, info):
        super().start(info)
        self.last = None

    def step(self, frame):
        if self.last is not None:
            self.last.boxes[:] += 1
        self.last = super().step(frame)
        return self.last


class Unshown(Fixed):
    """Shows probabilities of more detections than it shows."""

    columns, own = 3, 0.5

    @property
    def diagnostics(self):
        beta = np.full((1, self.columns), self.own)
        association = Association(ids=np.array([1]), beta=beta)
        return Diagnostics(detections=np.array([[0.0, 0.0, 5.0, 5.0]]), association=association)


class Uneven(Unshown):
    columns, own = 2, 0.6


class Listing(Fixed):
    def step(self, _frame):
        return [1]


class Raising(Fixed):
    def step(self, _frame):
        raise RuntimeError("no scenario given")


def test_a_tracker_that_keeps_the_contract_passes():
    check_tracker(Fixed())


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (Narrow, "ids: int32, wanted int64"),
        (Zero, "ids: 0 is below 1"),
        (Infinite, "boxes: not finite"),
        (Flipped, "boxes: x1 <= x0"),
        (Short, r"status: shape \(0,\), wanted \(1,\)"),
        (Twice, "ids: one id twice"),
        (Unsure, r"score: outside \[0, 1\]"),
        (Forgetless, "start must reset everything"),
        (Painter, "writes into the frame's image"),
        (Rewriter, "what was returned is final"),
        (Unshown, r"association.beta: shape \(1, 3\), wanted \(1, 2\)"),
        (Uneven, "association.beta: rows do not sum to 1"),
        (Listing, "returns a list"),
        (Raising, "no scenario given"),
    ],
)
def test_each_broken_rule_is_named(broken, message):
    with pytest.raises(ContractError, match=message):
        check_tracker(broken())


def test_what_has_no_step_is_refused():
    with pytest.raises(ContractError, match="no start"):
        check_tracker(object())


@pytest.mark.parametrize("name", sorted(TRACKERS))
def test_our_trackers_keep_the_contract(name):
    check_tracker(make(name))
