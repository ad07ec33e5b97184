"""Where a track that is not seen is expected: what all ways to predict share, and the two plain ones."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tracker.aerial.trajectories import Trajectories
from tracker.filtering import planar

Floats = NDArray[np.float64]

WINDOW = 30
"""F: last points of a track that its forecast is made from."""
STRAIGHT = 0.99
"""Cosine of the angle between two ways above which the road between them is straight."""

LINGER, BRAKED = 0.5, 0.4
"""Lengths from a path's end within which a track may have come to a standstill, and the share of its speed
before that below which it did."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Growth:
    """How a forecast's standard deviation grows, px.

    Attributes:
        start: Of the last seen position.
        along: Share of the way since then by which a vehicle may be ahead or behind: it speeds up and brakes
            unseen.
        across: Share of the way by which it may lie beside.
        idle: Px a frame that even a standing vehicle may have gone.
    """

    start: float = 2.0
    along: float = 0.2
    across: float = 0.05
    idle: float = 0.1

    def covariance(self, heading: Floats, way: float, lead: float) -> Floats:
        """Return (2, 2), px^2, after ``way`` px and ``lead`` frames, given the heading's (2,) unit vector."""
        along = self.start**2 + (self.along * way) ** 2 + (self.idle * lead) ** 2
        across = self.start**2 + (self.across * way) ** 2 + (0.2 * self.idle * lead) ** 2
        return np.asarray(across * np.eye(2) + (along - across) * np.outer(heading, heading))


class Forecast(Protocol):
    """The forecast of one track, made from what was known at its last point.

    Attributes:
        point: (2,) where it is expected, px of the mosaic.
        velocity: (2,) px a frame.
        covariance: (2, 2) px^2.
    """

    point: Floats
    velocity: Floats
    covariance: Floats

    def step(self, tick: int) -> None:
        """Go on to the frame ``tick``."""


class Forecaster(Protocol):
    """Makes forecasts."""

    def __call__(self, trajectories: Trajectories, track: int) -> Forecast:
        """Forecast a track that has just been seen for the last time."""


def last_section(trajectories: Trajectories, track: int, window: int) -> tuple[Floats, int]:
    """Return a track's last points, at most ``window`` of them (K, 2), and the tick of the last."""
    first, last = trajectories.extent(track)
    return trajectories.at(track, np.arange(max(first, last - window + 1), last + 1)), last


def unit(vector: Floats) -> Floats:
    """Return a vector (2,) of length 1, to the right where it has no direction."""
    length = float(np.hypot(vector[0], vector[1]))
    return vector / length if length > 1e-9 else np.array([1.0, 0.0])


def drift(section: Floats) -> tuple[Floats, Floats]:
    """Fit a straight line to points (K, 2) of successive frames: (2,) its end, (2,) velocity a frame."""
    count = len(section)
    if count < 2:
        return section[-1].copy(), np.zeros(2)
    end, slope = line(count)
    return end @ section, slope @ section


@functools.cache
def line(count: int) -> tuple[Floats, Floats]:
    """Return the weights (K,) of K successive points in the end and the slope of the line through them."""
    time = np.linspace(-0.5, 0.5, count) * (count - 1)
    slope = np.asarray(time / (time @ time))
    return np.asarray(1.0 / count + time[-1] * slope), slope


def leads_to(trajectories: Trajectories, track: int, place: Floats) -> bool:
    """Tell whether a place (2,) lies straight ahead of a track's last points."""
    section, _ = last_section(trajectories, track, WINDOW)
    end, velocity = drift(section)
    return bool(unit(velocity) @ unit(place - end) > STRAIGHT)


def went_until(trajectories: Trajectories, track: int, length: float) -> int:
    """Return the last tick at which a track whose path ends in the picture was on its vehicle.

    What stands does not go out of sight. Where a path comes to a standstill before it ends, its vehicle has
    gone on below something, and what came after it, or the rest of a lorry, was taken for it.

    Args:
        trajectories: With the track in them.
        track: Id.
        length: Of the vehicle, px.
    """
    first, last = trajectories.extent(track)
    points = trajectories.at(track, np.arange(first, last + 1))
    left = np.hypot(*(points - points[-1]).T)
    away = np.flatnonzero(left > LINGER * length)
    if not len(away) or away[-1] < WINDOW:
        return last
    near = int(away[-1])
    usual = float(np.hypot(*(points[near] - points[near - WINDOW]))) / WINDOW
    lingering = float(left[near]) / (last - first - near) < BRAKED * usual
    return first + near if lingering else last


class LinearForecast:
    """Straight on, as the last points went."""

    def __init__(
        self, trajectories: Trajectories, track: int, *, window: int = WINDOW, growth: Growth | None = None
    ) -> None:
        section, self._last = last_section(trajectories, track, window)
        self._begin, self.velocity = drift(section)
        self._growth = growth or Growth()
        self.point = self._begin
        self.covariance = self._growth.covariance(unit(self.velocity), 0.0, 0.0)

    def step(self, tick: int) -> None:
        """Go on to the frame ``tick``."""
        lead = tick - self._last
        self.point = self._begin + lead * self.velocity
        way = lead * float(np.hypot(*self.velocity))
        self.covariance = self._growth.covariance(unit(self.velocity), way, lead)


class KalmanForecast:
    """A Kalman filter for constant velocity over the last points, then its prediction.

    Args:
        trajectories: With the track in it.
        track: Id.
        window: Last points that are filtered.
        noise: Standard deviation of a point's coordinate, px.
        intensity: Power spectral density of the white acceleration, px^2 / frame^3.
    """

    def __init__(
        self,
        trajectories: Trajectories,
        track: int,
        *,
        window: int = WINDOW,
        noise: float = 1.5,
        intensity: float = 0.01,
    ) -> None:
        section, self._tick = last_section(trajectories, track, window)
        self._intensity = intensity
        self._mean = np.array([section[0, 0], 0.0, section[0, 1], 0.0])
        self._spread = np.diag([noise**2, 100.0, noise**2, 100.0])
        for measured in section[1:]:
            self._advance()
            h = planar.POSITION
            inner = h @ self._spread @ h.T + noise**2 * np.eye(2)
            gain = np.linalg.solve(inner, h @ self._spread).T
            self._mean = self._mean + gain @ (measured - h @ self._mean)
            self._spread = self._spread - gain @ inner @ gain.T
        self._show()

    def step(self, tick: int) -> None:
        """Go on to the frame ``tick``."""
        self._advance(float(tick - self._tick))
        self._tick = tick
        self._show()

    def _advance(self, frames: float = 1.0) -> None:
        self._mean, self._spread = planar.predict(self._mean, self._spread, frames, self._intensity)

    def _show(self) -> None:
        self.point, self.velocity = self._mean[::2], self._mean[1::2]
        self.covariance = self._spread[::2, ::2]
