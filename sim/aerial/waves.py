"""Waves in dense traffic: stretches that run against a stream and in which all drive slower."""

from __future__ import annotations

import math

import numpy as np

SPEED = 4.5
"""M/s at which waves run against the traffic."""
LENGTH = (95.0, 140.0)
"""Metres between two waves, shortest and longest."""


class Waves:
    """How much slower than free traffic a stream is, by place and time; each stream has waves of its own."""

    def __init__(self, depth: float, streams: int, rng: np.random.Generator) -> None:
        """Draw the waves.

        Args:
            depth: Part of the free speed that is lost in the trough, 0 to 1.
            streams: How many streams there are.
            rng: Draws lengths and phases.
        """
        self._depth = depth
        self._lengths = rng.uniform(*LENGTH, streams).tolist()
        self._phases = rng.uniform(0, 2 * np.pi, streams).tolist()

    def factor(self, stream: int, s: float, t: float) -> float:
        """Return the part of the free speed that is driven ``s`` metres along at ``t`` seconds."""
        if self._depth == 0:
            return 1.0
        turn = 2 * math.pi * (s + SPEED * t) / self._lengths[stream] + self._phases[stream]
        # Troughs are narrow: most of the stream is faster than their mean.
        trough = (0.5 + 0.5 * math.sin(turn)) ** 2
        return 1.0 - self._depth * trough
