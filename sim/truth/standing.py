"""Which vehicles stand still, and since when: what has stood long enough is part of the background."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.truth.types import FrameTruth

STILL = 0.1
"""M/s below which a vehicle stands."""


class Standing:
    """Follows how long each vehicle has stood before a camera that does not move; give it every frame."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._since: dict[int, int] = {}

    def seconds(self, truth: FrameTruth) -> NDArray[np.float64]:
        """Take in the next frame; return (N,) seconds that each vehicle has stood, 0 while it moves."""
        still = np.sqrt((truth.velocities**2).sum(axis=1)) < STILL
        since = {
            vehicle: self._since.get(vehicle, truth.tick)
            for vehicle, stands in zip(truth.ids.tolist(), still.tolist(), strict=True)
            if stands
        }
        self._since = since
        now = truth.tick
        return np.array([(now - since.get(row, now)) / self._rate for row in truth.ids.tolist()], float)
