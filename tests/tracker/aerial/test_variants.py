"""The relatives of the aerial tracker differ in what they are named for, and in nothing else."""

from __future__ import annotations

import pytest

from tracker.aerial import variants
from tracker.aerial.forecasts import KalmanForecast, LinearForecast
from tracker.aerial.motion_context import ContextForecast
from tracker.aerial.reacquisition import Fusion, Nearest, PrintedStages
from tracker.aerial.tracker import AerialTracker

OWN = AerialTracker()


def test_one_component_is_another():
    for tracker, forecaster, matcher in (
        (variants.motion_only(), ContextForecast, Fusion(looks=0.0)),
        (variants.appearance_only(), ContextForecast, Fusion(motion=False)),
        (variants.linear(), LinearForecast, Fusion()),
        (variants.kalman_nearest(), KalmanForecast, Nearest()),
    ):
        assert tracker._forecaster is forecaster
        assert tracker._matcher == matcher
    assert OWN._forecaster is ContextForecast
    assert OWN._matcher == Fusion()


def test_the_printed_rules_need_three_predictors(monkeypatch):
    tracker = variants.paper()
    assert isinstance(tracker._matcher, PrintedStages)
    asked = {}
    monkeypatch.setattr(variants, "ContextForecast", lambda *_, parameters: asked.update(p=parameters))
    tracker._forecaster(None, 1)
    assert (asked["p"].fewest, asked["p"].ridge, asked["p"].paced) == (3, 0.0, False)
    with pytest.raises(AttributeError):
        asked["p"].fewest = 1
