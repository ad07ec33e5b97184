"""Traces of feature centres in the (x, t) plane: association, slope, pruning (paper 1, section III)."""

from __future__ import annotations

from collections.abc import Mapping
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
# Bounds of a trace that has none: x0, y0, x1, y1.
EVERYWHERE = np.array([-np.inf, -np.inf, np.inf, np.inf])


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
def _costs(mean, covariance, width, kind, bounds, x, y, wide, kinds):  # type: ignore[no-untyped-def]
    """Squared distances (N, M) of N traces and M centres in x, y and log width, infinite beyond the gate.

    And outside a trace's bounds (N, 4).
    """
    costs = np.full((width.size, x.size), np.inf)
    for i in range(width.size):
        spread_x = min(covariance[i, 0, 0, 0], 9.0) + NOISE_X**2
        spread_row = min(covariance[i, 1, 0, 0], 9.0) + NOISE_Y**2
        for j in range(x.size):
            apart = (mean[i, 0, 0] - x[j]) ** 2 / spread_x
            if apart > GATE or kind[i] != kinds[j]:
                continue
            x0, y0, x1, y1 = bounds[i]
            if not (x0 < x[j] < x1 and y0 < y[j] < y1 and wide[j] < x1 - x0):
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


@njit(cache=True)
def _slopes(history):  # type: ignore[no-untyped-def]
    """Fit lines through histories (N, K), where not a number is a gap.

    Returns:
        (N,) slopes, px a frame, 0 where there are fewer than two points, and (N,) numbers of points.
    """
    number, length = history.shape
    slopes, counts = np.zeros(number), np.zeros(number, np.int64)
    for i in range(number):
        count, time, value = 0, 0.0, 0.0
        for k in range(length):
            if not np.isnan(history[i, k]):
                count += 1
                time += k
                value += history[i, k]
        counts[i] = count
        if count < 2:
            continue
        time, value = time / count, value / count
        power, product = 0.0, 0.0
        for k in range(length):
            if not np.isnan(history[i, k]):
                power += (k - time) ** 2
                product += (k - time) * (history[i, k] - value)
        slopes[i] = product / power
    return slopes, counts


def _record(fit: int) -> np.dtype[np.void]:
    """Return what is kept of a trace: its state and covariance in x and y, its last x, its bounds."""
    return np.dtype(
        [
            ("id", np.int64),
            ("mean", np.float64, (2, 2)),
            ("covariance", np.float64, (2, 2, 2)),
            ("width", np.float64),
            ("history", np.float64, fit),
            ("hits", np.int64),
            ("age", np.int64),
            ("missed", np.int64),
            ("source", np.int64),
            ("kind", np.uint8),
            ("bounds", np.float64, 4),
        ],
        align=True,
    )


class TraceStore:
    """Keeps the traces of an episode.

    Attributes:
        live: (N,) records, in the order in which they began (`_record`).
    """

    def __init__(self, *, rate: float, fit_seconds: float = 0.4, patience_seconds: float = 0.2) -> None:
        """Start without traces.

        Args:
            rate: Frames a second.
            fit_seconds: Time over which the slope is fitted.
            patience_seconds: A trace without centre for longer ends.
        """
        self._rate = rate
        self._patience = max(2, round(patience_seconds * rate))
        self._next_id = 1
        self.live = np.zeros(0, _record(max(4, round(fit_seconds * rate))))

    def step(self, centres: Centres, shift: float = 0.0) -> None:
        """Advance by one frame.

        Args:
            centres: Of this frame; `source` afterwards holds the index of each trace's centre, -1 for none.
            shift: Vertical jump of the whole picture since the last frame, px, where it is known (pitch).
        """
        self._predict(shift)
        live = self.live
        cost = _costs(
            live["mean"],
            live["covariance"],
            live["width"],
            live["kind"],
            live["bounds"],
            centres.x,
            centres.y,
            centres.width,
            centres.kind,
        )
        rows, columns = assign(cost, GATE)
        self._correct(rows, columns, centres)
        # A trace that has barely begun is given up sooner: most of these are noise.
        patient = live["missed"] <= np.where(live["hits"] >= 4, self._patience, 1)
        taken = np.zeros(len(centres.x), bool)
        taken[columns] = True
        self.live = np.concatenate([live[patient], self._begin(np.flatnonzero(~taken), centres)])

    def bound(self, boxes: Mapping[int, Floats]) -> None:
        """Leave to the traces with these ids only centres in and no wider than their boxes (4,), px.

        To all others every centre.
        """
        live = self.live
        live["bounds"] = EVERYWHERE
        for place in np.flatnonzero(np.isin(live["id"], list(boxes))).tolist():
            live["bounds"][place] = boxes[int(live["id"][place])]

    def slopes(self) -> tuple[Floats, Floats]:
        """Return v and its standard deviation, (N,) each, px/s."""
        slope, count = _slopes(self.live["history"])
        return slope * self._rate, slope_error(NOISE_X, self._rate, count)

    def _predict(self, shift: float) -> None:
        live = self.live
        for axis, agility in enumerate((AGILITY_X, AGILITY_Y)):
            kalman.predict(live["mean"][:, axis], live["covariance"][:, axis], 1.0 / self._rate, agility)
        live["mean"][:, 1, 0] += shift
        live["age"] += 1
        live["missed"] += 1
        live["source"] = -1
        history = live["history"]
        history[:, :-1] = history[:, 1:]
        history[:, -1] = np.nan

    def _correct(self, rows: Ids, columns: Ids, centres: Centres) -> None:
        live = self.live
        for axis, measured, noise in ((0, centres.x, NOISE_X), (1, centres.y, NOISE_Y)):
            kalman.update(
                live["mean"][:, axis], live["covariance"][:, axis], rows, measured[columns], noise**2
            )
        live["width"][rows] += 0.2 * (centres.width[columns] - live["width"][rows])
        live["history"][rows, -1] = centres.x[columns]
        live["hits"][rows] += 1
        live["missed"][rows] = 0
        live["source"][rows] = columns

    def _begin(self, fresh: Ids, centres: Centres) -> NDArray[np.void]:
        begun = np.zeros(len(fresh), self.live.dtype)
        begun["id"] = self._next_id + np.arange(len(fresh))
        self._next_id += len(fresh)
        begun["mean"][:, 0, 0], begun["mean"][:, 1, 0] = centres.x[fresh], centres.y[fresh]
        begun["covariance"] = np.array([np.diag([NOISE_X**2, 40.0**2]), np.diag([NOISE_Y**2, 20.0**2])])
        begun["history"] = np.nan
        begun["history"][:, -1] = centres.x[fresh]
        begun["width"], begun["kind"] = centres.width[fresh], centres.kind[fresh]
        begun["hits"], begun["source"], begun["bounds"] = 1, fresh, EVERYWHERE
        return begun
