"""The controller of active tracking on points that move, and on the scene itself."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.active_tracking import FULL, Centring, compare
from tracker.types import Tracks

RATE = 30


def drift(velocity: tuple[float, float], *, oncoming: int, seconds: float = 12.0) -> tuple[float, float]:
    """Let five points move, px/s, and some the other way; give how far off they end, steered and not."""
    controller, steered = Centring(640, 480, RATE), np.zeros(2)
    flock = np.array([[320.0, 240.0]]) + np.linspace(-150, 150, 5)[:, None] * [1, 0.2]
    others = np.array([[400.0, 300.0]]) + np.linspace(-200, 200, max(oncoming, 1))[:oncoming, None] * [1, 0.2]
    for tick in range(round(seconds * RATE)):
        gone = tick / RATE * np.array(velocity)
        centres = np.concatenate([flock + gone, others - gone]) - steered
        boxes = np.hstack([centres - 10, centres + 10])
        inside = ((boxes[:, :2] > 0) & (boxes[:, 2:] < [640, 480])).all(axis=1)
        action = controller.act(Tracks.confirmed(1 + np.flatnonzero(inside), boxes[inside]))
        assert (np.abs(action) <= 1).all()
        steered += FULL * action[:2] * [1, -1] / RATE
    end = flock.mean(axis=0) + gone - [320, 240]
    return float(np.hypot(*(end - steered))), float(np.hypot(*end))


@pytest.mark.parametrize("velocity", [(70.0, 0.0), (-40.0, 30.0), (0.0, -50.0)])
@pytest.mark.parametrize("oncoming", [0, 3])
def test_the_flock_stays_in_the_middle(velocity, oncoming):
    centred, alone = drift(velocity, oncoming=oncoming)
    assert centred < 15 < 400 < alone


def test_without_tracks_it_flies_on():
    controller = Centring(640, 480, RATE)
    assert (controller.act(Tracks.none()) == 0).all()
    for tick in range(60):
        action = controller.act(Tracks.confirmed([1], [[300 + tick, 230, 320 + tick, 250]]))
    assert action[0] > 0.1
    later = [controller.act(Tracks.none()) for _ in range(3)]
    assert all((one == later[0]).all() for one in later)
    assert 0 < later[0][0] <= action[0]


@pytest.mark.slow
def test_the_controller_keeps_more_of_the_convoy_in_view_and_followed():
    found = compare(range(500, 503), seconds=14.0, tracker="aerial")
    for name in ("reward", "convoy", "in view"):
        assert (np.subtract(found["centred"][name], found["fixed"][name]) > 0).all()
