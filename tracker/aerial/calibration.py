"""How far to trust a forecast: vehicles that are seen are forecast as if they were hidden, and compared.

Along the way and across it that is learnt apart: most keep to their lanes, whatever their speed.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tracker.aerial.forecasts import Forecast, Forecaster, unit
from tracker.aerial.trajectories import Trajectories

Floats = NDArray[np.float64]

LEADS = (10, 20, 40, 60)
"""Frames after which a rehearsal is compared with the truth."""
SHARES = (0.5, 0.95)
"""Shares of the truth that are to lie inside the ellipses of these shares."""
SQUARES = np.array([NormalDist().inv_cdf(0.5 + 0.5 * share) ** 2 for share in SHARES])
"""Squared distances, in variances, inside which these shares of a Gaussian on a line lie."""
MEMORY = 60
"""Rehearsals that are remembered."""
BELIEF = 10
"""Rehearsals that the growth as it is set counts for."""
LEAST, MOST = 0.1, 10.0
IDENTITY = np.eye(2)


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
        self._squares: dict[int, deque[Floats]] = {lead: deque(maxlen=MEMORY) for lead in LEADS}
        self._scales = np.ones((LEADS[-1] + 1, 2))
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
            if lead in self._squares and rehearsal.track in visible:
                apart = trajectories.at(rehearsal.track, [tick])[0] - rehearsal.forecast.point
                along = unit(rehearsal.forecast.velocity)
                axes = np.array([along, [-along[1], along[0]]])
                variances = np.diag(axes @ rehearsal.forecast.covariance @ axes.T)
                self._squares[lead].append((axes @ apart) ** 2 / variances)
        if tick % self._every == 0:
            scales = np.array([scale(squares) for squares in self._squares.values()])
            leads = np.arange(LEADS[-1] + 1)
            self._scales = np.column_stack([np.interp(leads, LEADS, axis) for axis in scales.T])
        self._running = [r for r in self._running if tick - r.since < LEADS[-1] and r.track in visible]
        busy = {rehearsal.track for rehearsal in self._running}
        free = [track for track in seen if track not in busy]
        if tick % self._every == 0 and free:
            # Each in its turn.
            track = min(free, key=lambda t: (t <= self._turn, t))
            self._turn = track
            self._running.append(Rehearsal(track, tick, self._forecaster(trajectories, track)))

    def covariance(
        self, forecast: Forecast, lead: int, bounds: tuple[float, float] = (LEAST, MOST)
    ) -> Floats:
        """Return (2, 2) of a forecast ``lead`` frames ahead, calibrated, px^2.

        Args:
            forecast: Advanced to there.
            lead: Frames.
            bounds: Least and greatest factors of the variances.
        """
        along, across = np.sqrt(np.clip(self._scales[min(lead, LEADS[-1])], *bounds))
        heading = unit(forecast.velocity)
        stretch = across * IDENTITY + (along - across) * heading * heading[:, None]
        return np.asarray(stretch @ forecast.covariance @ stretch)


def scale(squares: ArrayLike) -> Floats:
    """Return the factors (2,) that put the wanted shares of squared distances (K, 2) inside, axis by axis.

    The shares are traded off evenly; where few distances are known the factors are near 1.
    """
    squares = np.asarray(squares, float).reshape(-1, 2)
    if not len(squares):
        return np.ones(2)
    ratios = np.log(np.maximum(np.quantile(squares, SHARES, axis=0), 1e-9) / SQUARES[:, None])
    trust = len(squares) / (len(squares) + BELIEF)
    return np.asarray(np.clip(np.exp(trust * ratios.mean(0)), LEAST, MOST))
