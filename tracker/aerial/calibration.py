"""How far to trust a forecast: vehicles that are seen are forecast as if they were hidden, and compared."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tracker.aerial.forecasts import Forecast, Forecaster
from tracker.aerial.trajectories import Trajectories

Floats = NDArray[np.float64]

LEADS = (10, 20, 40, 60)
"""Frames after which a rehearsal is compared with the truth."""
SHARES = (0.5, 0.95)
"""Shares of the truth that are to lie inside the ellipses of these shares."""
MEMORY = 60
"""Rehearsals that are remembered."""
BELIEF = 10
"""Rehearsals that the growth as it is set counts for."""
LEAST, MOST = 0.1, 10.0


def quantile(share: ArrayLike) -> Floats:
    """Return the squared distance inside which a share of a Gaussian in the plane lies.

    >>> float(quantile(0.95).round(3))
    5.991
    """
    return np.asarray(-2.0 * np.log1p(-np.asarray(share, float)))


@dataclass(slots=True)
class Rehearsal:
    """A seen track's forecast, and the tick at which it was made."""

    track: int
    since: int
    forecast: Forecast


class Calibration:
    """Learns by how much the covariances of forecasts have to be multiplied.

    A rehearsal sees what a forecast of a hidden vehicle would: the tracks up to each frame, and never its
    own.
    """

    def __init__(self, forecaster: Forecaster, *, every: int = 15) -> None:
        """Begin an episode.

        Args:
            forecaster: What is calibrated.
            every: Frames between two rehearsals' beginnings.
        """
        self._forecaster, self._every = forecaster, every
        self._running: list[Rehearsal] = []
        self._measures: dict[int, deque[float]] = {lead: deque(maxlen=MEMORY) for lead in LEADS}
        self._scales = np.ones(len(LEADS))
        self._turn = 0

    def step(self, trajectories: Trajectories, tick: int, seen: list[int]) -> None:
        """Go on by a frame.

        Args:
            trajectories: With the seen tracks' points of this tick in them.
            tick: Of the frame.
            seen: Tracks that are seen and move, with a history long enough to be forecast.
        """
        visible = set(seen)
        for rehearsal in self._running:
            rehearsal.forecast.step(tick)
            lead = tick - rehearsal.since
            if lead in self._measures and rehearsal.track in visible:
                apart = trajectories.at(rehearsal.track, [tick])[0] - rehearsal.forecast.point
                measure = float(apart @ np.linalg.solve(rehearsal.forecast.covariance, apart))
                self._measures[lead].append(measure)
        if tick % self._every == 0:
            self._scales = np.array([scale(measures) for measures in self._measures.values()])
        self._running = [r for r in self._running if tick - r.since < LEADS[-1] and r.track in visible]
        busy = {rehearsal.track for rehearsal in self._running}
        free = [track for track in seen if track not in busy]
        if tick % self._every == 0 and free:
            # Each in its turn.
            track = min(free, key=lambda t: (t <= self._turn, t))
            self._turn = track
            self._running.append(Rehearsal(track, tick, self._forecaster(trajectories, track)))

    def scale(self, lead: int) -> float:
        """Return the factor for covariances of forecasts ``lead`` frames ahead."""
        return float(np.interp(lead, LEADS, self._scales))


def scale(measures: ArrayLike) -> float:
    """Return the factor that puts the wanted shares of squared distances (K,) inside the ellipses.

    The shares are traded off evenly; where few distances are known the factor is near 1.
    """
    measures = np.asarray(measures, float)
    if not len(measures):
        return 1.0
    ratios = np.log(np.maximum(np.quantile(measures, SHARES), 1e-9) / quantile(SHARES))
    trust = len(measures) / (len(measures) + BELIEF)
    return float(np.clip(np.exp(trust * ratios.mean()), LEAST, MOST))
