"""How fast the place and the time allow one to drive: slow before curves, and stop in the waves of a jam."""

from __future__ import annotations

import math

import numpy as np

from sim.roads import InCarRoad

CURVE_GRIP = 2.4
"""M/s^2 sideways that drivers accept on an arc; steering adds to it for moments."""
APPROACH = 1.2
"""M/s^2 of the braking before a curve."""
STEP = 2.0
"""Metres between the table's places."""
WAVE_SPEED = 5.0
"""M/s at which the waves of a jam run against the traffic."""
WAVE_LENGTH = (170.0, 230.0)
"""Metres between two waves, shortest and longest."""
WAVE_STOP = 40.0
"""Metres of each wave in which all stand."""
WAVE_BRAKING = 60.0
"""Metres before them over which the allowed speed falls."""
WAVE_STARTING = 25.0
"""Metres behind them over which it rises."""
WAVE_CRUISE = 13.0
"""M/s that nobody exceeds between the waves."""


class Pace:
    """The allowed speed along a road."""

    def __init__(self, road: InCarRoad, rng: np.random.Generator, *, waves: bool) -> None:
        """Tabulate the road.

        Args:
            road: The road.
            rng: Draws length and phase of the waves.
            waves: Whether stop-and-go waves run through the ego's way.
        """
        self._first = road.pieces[0].start
        places = np.arange(self._first, road.length + STEP, STEP)
        reach = max(abs(road.paved[0]), road.paved[1])
        bend = np.abs(road.curvature(places))
        radius = 1 / np.maximum(bend, 1e-9) - np.where(bend > 0, reach, 0.0)
        square = CURVE_GRIP * np.maximum(radius, 1.0)
        slack = 2 * APPROACH * places
        forward = np.minimum.accumulate((square + slack)[::-1])[::-1] - slack
        backward = np.minimum.accumulate(square - slack) + slack
        self._tables = [np.sqrt(table).tolist() for table in (backward, forward)]
        self._last = len(places) - 1
        self._waves = waves
        self._wave_length = rng.uniform(*WAVE_LENGTH)
        self._phase = rng.uniform(0, self._wave_length)

    def allowed(self, s: float, t: float, *, same_way: bool) -> float:
        """Return the allowed speed, m/s, at arc length ``s`` and ``t`` seconds."""
        index = min(max(int((s - self._first) / STEP), 0), self._last)
        speed: float = self._tables[same_way][index]
        return min(speed, self._wave(s, t)) if self._waves and same_way else speed

    def _wave(self, s: float, t: float) -> float:
        """The waves' allowed speed: they run toward smaller s."""
        into = (s + WAVE_SPEED * t + self._phase) % self._wave_length
        if into < WAVE_STOP:
            return 0.0
        starting = (into - WAVE_STOP) / WAVE_STARTING
        braking = (self._wave_length - into) / WAVE_BRAKING
        return WAVE_CRUISE * min(1.0, starting, math.sqrt(braking))
