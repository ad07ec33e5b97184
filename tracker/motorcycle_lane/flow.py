"""Which way the traffic goes, place by place, and who goes against it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CAPACITY = 400
"""Samples of motion that are kept: the newest."""
SAMPLE_SECONDS = 0.3
"""A track gives a sample so often."""
LEAST_SPEED = 1.0
"""Rider heights a second below which a track has no direction."""
REACH = 0.12
"""Width of the neighbourhood that speaks for a place, as a share of the picture's diagonal."""
LEAST_OTHERS = 2
"""Other tracks that must have passed the neighbourhood."""
AGAINST = -0.5
"""Cosine to the others' mean direction below which a track goes the wrong way."""
AGREED = 0.6
"""Length of the others' mean direction, 1 if all go the same way, from which it is one."""
SURE_SECONDS = 0.3
"""How much longer a track must have been seen against the others than with them."""
WAY = 1.25
"""Rider heights that it must have gone meanwhile, as it goes: one that jumps to another rider goes less."""


class Flow:
    """Remembers the directions of the tracks of an episode."""

    def __init__(self, width: int, height: int, rate: float) -> None:
        self._reach = REACH * float(np.hypot(width, height))
        self._interval = max(1, round(SAMPLE_SECONDS * rate))
        self._limit = SURE_SECONDS * rate
        self._ids = np.zeros(0, np.int64)
        self._places, self._directions = np.zeros((0, 2)), np.zeros((0, 2))
        self._against: dict[int, int] = {}
        # Where each of those tracks was when it was first seen against the others.
        self._since: dict[int, Floats] = {}
        self._frames = 0

    def step(
        self, ids: NDArray[np.int64], places: Floats, velocities: Floats, heights: Floats
    ) -> NDArray[np.int64]:
        """Learn from the tracks of a frame and return the ids of those that go the wrong way.

        Args:
            ids: (N,) tracks that have gone some way.
            places: (N, 2) px.
            velocities: (N, 2) px/s.
            heights: (N,) px.
        """
        speeds = np.hypot(*velocities.T)
        moving = speeds > LEAST_SPEED * heights
        directions = velocities / np.maximum(speeds, 1e-9)[:, None]
        verdict = self._verdict(ids, places, directions)
        now = np.where(moving, verdict, 0)
        self._against = {
            i: min(max(self._against.get(i, 0) + int(v), 0), round(3 * self._limit))
            for i, v in zip(ids.tolist(), now, strict=True)
        }
        if self._frames % self._interval == 0:
            self._ids = np.concatenate([self._ids, ids[moving]])[-CAPACITY:]
            self._places = np.concatenate([self._places, places[moving]])[-CAPACITY:]
            self._directions = np.concatenate([self._directions, directions[moving]])[-CAPACITY:]
        self._frames += 1
        self._since = {
            i: self._since.get(i, place)
            for i, place in zip(ids.tolist(), places, strict=True)
            if self._against[i] > 0
        }
        began = np.array([self._since.get(i, place) for i, place in zip(ids.tolist(), places, strict=True)])
        way = ((places - began.reshape(-1, 2)) * directions).sum(1)
        sure = np.array([self._against[i] >= self._limit for i in ids.tolist()], np.bool_)
        # Who turned back with the others has gone none against them.
        return np.asarray(ids[sure & (verdict >= 0) & (way > WAY * heights)])

    def _verdict(self, ids: NDArray[np.int64], places: Floats, directions: Floats) -> NDArray[np.int64]:
        """Return (N,) 1 for a direction against the others', -1 for one with it, 0 where they say nothing."""
        away = ((places[:, None] - self._places[None]) ** 2).sum(2)
        weights = np.exp(-0.5 * away / self._reach**2) * (ids[:, None] != self._ids[None])
        weights[weights < 0.05] = 0.0
        mean = weights @ self._directions / np.maximum(weights.sum(1), 1e-9)[:, None]
        length = np.hypot(*mean.T)
        # (N, T) which tracks speak for each place at all.
        whose = self._ids[:, None] == np.unique(self._ids)[None]
        others = np.count_nonzero((weights > 0.0).astype(np.float32) @ whose.astype(np.float32), axis=1)
        cosine = (mean * directions).sum(1) / np.maximum(length, 1e-9)
        told = (others >= LEAST_OTHERS) & (length > AGREED)
        return np.where(told, np.where(cosine < AGAINST, 1, -1), 0)
