"""Traces of feature centres in the (x, t) plane: association, slope, pruning (paper 1, section III)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.filtering import kalman
from tracker.filtering.assignment import assign
from tracker.in_car.profile import Centres

Floats = NDArray[np.float64]
Ids = NDArray[np.int64]

# Measurement noise of a centre, px, and the spectral density of its acceleration, px^2/s^3.
NOISE_X, NOISE_Y, AGILITY_X, AGILITY_Y = 1.2, 2.0, 3000.0, 800.0
GATE = 16.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceSet:
    """The N live traces after a frame, in px of the original picture.

    Attributes:
        ids: (N,) >= 1, never used again.
        x: (N,) px from the picture's left edge.
        y: (N,) px.
        v: (N,) px/s: slope of the line through the last centres.
        sigma_v: (N,) its standard deviation, px/s.
        width: (N,) px, of the features behind the trace.
        age: (N,) seconds since the first centre.
        missed: (N,) frames since the last centre; 0 where it was seen in this frame.
        points: (K, 2) support points of this frame, px.
        point_traces: (K,) id of the trace that a point supports.
    """

    ids: Ids
    x: Floats
    y: Floats
    v: Floats
    sigma_v: Floats
    width: Floats
    age: Floats
    missed: Ids
    points: Floats
    point_traces: Ids

    def __len__(self) -> int:
        return len(self.ids)


def slope_error(noise: float, rate: float, count: NDArray[np.int64]) -> Floats:
    """Return the standard deviation of a line's slope through equidistant points.

    Args:
        noise: Standard deviation of a point, px.
        rate: Points a second.
        count: (N,) K, points in the line, at least 2.

    Returns:
        (N,) px/s: sqrt(12 noise^2 rate^2 / (K (K^2 - 1))) (methods.md 1.5).
    """
    number = np.maximum(count, 2).astype(float)
    return np.asarray(np.sqrt(12.0 / (number * (number * number - 1.0))) * noise * rate)


@njit(cache=True)
def _costs(mean, covariance, width, kind, x, y, wide, kinds):  # type: ignore[no-untyped-def]
    """Squared distances (N, M) of N traces and M centres in x, y and log width, infinite beyond the gate."""
    costs = np.full((width.size, x.size), np.inf)
    for i in range(width.size):
        spread_x = min(covariance[i, 0, 0, 0], 9.0) + NOISE_X**2
        spread_row = min(covariance[i, 1, 0, 0], 9.0) + NOISE_Y**2
        for j in range(x.size):
            apart = (mean[i, 0, 0] - x[j]) ** 2 / spread_x
            if apart > GATE or kind[i] != kinds[j]:
                continue
            # Which segments of an object are found changes from frame to frame: its row is less sure
            # than its middle.
            spread_y = spread_row + (0.08 * max(width[i], wide[j])) ** 2
            apart += (mean[i, 1, 0] - y[j]) ** 2 / spread_y
            if apart > GATE:
                continue
            ratio = np.log(max(wide[j], 1.0) / max(width[i], 1.0))
            costs[i, j] = apart + (ratio / 0.35) ** 2
    return costs


class TraceStore:
    """Keeps the traces of an episode."""

    def __init__(self, *, rate: float, fit_seconds: float = 0.4, patience_seconds: float = 0.2) -> None:
        """Start without traces.

        Args:
            rate: Frames a second.
            fit_seconds: Time over which the slope is fitted.
            patience_seconds: A trace without centre for longer ends.
        """
        self._rate = rate
        self._fit = max(4, round(fit_seconds * rate))
        self._patience = max(2, round(patience_seconds * rate))
        self._transition_x, self._noise_x = kalman.constant_velocity(1.0 / rate, AGILITY_X)
        self._transition_y, self._noise_y = kalman.constant_velocity(1.0 / rate, AGILITY_Y)
        self._next_id = 1
        self.ids = np.zeros(0, np.int64)
        self.mean = np.zeros((0, 2, 2))
        self._covariance = np.zeros((0, 2, 2, 2))
        self.width = np.zeros(0)
        self._kind = np.zeros(0, np.uint8)
        self.hits = np.zeros(0, np.int64)
        self.age = np.zeros(0, np.int64)
        self.missed = np.zeros(0, np.int64)
        self._history = np.zeros((0, self._fit))
        self.source = np.zeros(0, np.int64)

    def step(self, centres: Centres, shift: float = 0.0) -> None:
        """Advance by one frame.

        Args:
            centres: Of this frame; `source` afterwards holds the index of each trace's centre, -1 for none.
            shift: Vertical jump of the whole picture since the last frame, px, where it is known (pitch).
        """
        self._predict(shift)
        cost = self._costs(centres)
        rows, columns = assign(cost, GATE)
        self._correct(rows, columns, centres)
        self._prune()
        taken = np.zeros(len(centres.x), bool)
        taken[columns] = True
        self._begin(np.flatnonzero(~taken), centres)

    def slopes(self) -> tuple[Floats, Floats]:
        """Return v and its standard deviation, (N,) each, px/s."""
        times = (np.arange(self._fit) - (self._fit - 1)) / self._rate
        valid = np.isfinite(self._history)
        count = valid.sum(1)
        weight = valid / np.maximum(count, 1)[:, None]
        values = np.where(valid, self._history, 0.0)
        mean_time, mean_value = weight @ times, (weight * values).sum(1)
        offset = np.where(valid, times - mean_time[:, None], 0.0)
        power = (offset * offset).sum(1)
        slope = (offset * (values - mean_value[:, None])).sum(1) / np.maximum(power, 1e-9)
        return np.where(count >= 2, slope, 0.0), slope_error(NOISE_X, self._rate, count)

    def _predict(self, shift: float) -> None:
        self.mean[:, 0], self._covariance[:, 0] = kalman.predict(
            self.mean[:, 0], self._covariance[:, 0], self._transition_x, self._noise_x
        )
        self.mean[:, 1], self._covariance[:, 1] = kalman.predict(
            self.mean[:, 1], self._covariance[:, 1], self._transition_y, self._noise_y
        )
        self.mean[:, 1, 0] += shift
        self.age += 1
        self.missed += 1
        self._history = np.roll(self._history, -1, axis=1)
        self._history[:, -1] = np.nan

    def _costs(self, centres: Centres) -> Floats:
        costs: Floats = _costs(
            self.mean,
            self._covariance,
            self.width,
            self._kind,
            centres.x,
            centres.y,
            centres.width,
            centres.kind,
        )
        return costs

    def _correct(self, rows: Ids, columns: Ids, centres: Centres) -> None:
        self.source = np.full(len(self.ids), -1, np.int64)
        if not len(rows):
            return
        observation = np.array([[1.0, 0.0]])
        for axis, measured, noise in ((0, centres.x, NOISE_X), (1, centres.y, NOISE_Y)):
            self.mean[rows, axis], self._covariance[rows, axis] = kalman.update(
                self.mean[rows, axis],
                self._covariance[rows, axis],
                measured[columns, None],
                observation,
                np.array([[noise**2]]),
            )
        self.width[rows] += 0.2 * (centres.width[columns] - self.width[rows])
        self._history[rows, -1] = centres.x[columns]
        self.hits[rows] += 1
        self.missed[rows] = 0
        self.source[rows] = columns

    def _prune(self) -> None:
        # A trace that has barely begun is given up sooner: most of these are noise.
        alive = self.missed <= np.where(self.hits >= 4, self._patience, 1)
        self._keep(alive)

    def _keep(self, chosen: NDArray[np.bool_]) -> None:
        self.ids, self.mean, self._covariance = self.ids[chosen], self.mean[chosen], self._covariance[chosen]
        self.width, self._kind, self.hits = self.width[chosen], self._kind[chosen], self.hits[chosen]
        self.age, self.missed = self.age[chosen], self.missed[chosen]
        self._history, self.source = self._history[chosen], self.source[chosen]

    def _begin(self, fresh: Ids, centres: Centres) -> None:
        count = len(fresh)
        mean = np.zeros((count, 2, 2))
        mean[:, 0, 0], mean[:, 1, 0] = centres.x[fresh], centres.y[fresh]
        covariance = np.tile(np.diag([NOISE_X**2, 40.0**2]), (count, 2, 1, 1))
        covariance[:, 1] = np.diag([NOISE_Y**2, 20.0**2])
        history = np.full((count, self._fit), np.nan)
        history[:, -1] = centres.x[fresh]
        self.ids = np.concatenate([self.ids, self._next_id + np.arange(count)])
        self._next_id += count
        self.mean = np.concatenate([self.mean, mean])
        self._covariance = np.concatenate([self._covariance, covariance])
        self.width = np.concatenate([self.width, centres.width[fresh]])
        self._kind = np.concatenate([self._kind, centres.kind[fresh]])
        self.hits = np.concatenate([self.hits, np.ones(count, np.int64)])
        self.age = np.concatenate([self.age, np.zeros(count, np.int64)])
        self.missed = np.concatenate([self.missed, np.zeros(count, np.int64)])
        self._history = np.concatenate([self._history, history])
        self.source = np.concatenate([self.source, fresh])
