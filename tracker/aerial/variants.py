"""The aerial tracker's relatives: printed rules, ablations of one component, and the baseline."""

from __future__ import annotations

from tracker.aerial.forecasts import Forecast, KalmanForecast, LinearForecast
from tracker.aerial.motion_context import PRINTED, ContextForecast
from tracker.aerial.reacquisition import Fusion, Nearest, PrintedStages
from tracker.aerial.tracker import AerialTracker
from tracker.aerial.trajectories import Trajectories


def paper() -> AerialTracker:
    """Return the printed rules: three predictors or more, a hard distance, appearance in two stages."""
    return AerialTracker(forecaster=_printed, matcher=PrintedStages())


def motion_only() -> AerialTracker:
    """Return the tracker without appearance context."""
    return AerialTracker(matcher=Fusion(looks=0.0))


def appearance_only() -> AerialTracker:
    """Return the tracker without the place in its decision, beyond the gate."""
    return AerialTracker(matcher=Fusion(motion=False))


def linear() -> AerialTracker:
    """Return the tracker with straight forecasts in place of the motion context."""
    return AerialTracker(forecaster=LinearForecast)


def kalman_nearest() -> AerialTracker:
    """Return what a user would try first: constant velocity, nearest neighbour."""
    return AerialTracker(forecaster=KalmanForecast, matcher=Nearest())


def _printed(trajectories: Trajectories, track: int) -> Forecast:
    return ContextForecast(trajectories, track, parameters=PRINTED)
