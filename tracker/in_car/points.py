"""Corner points followed from frame to frame by optical flow, and their recent past."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car.features import corner_response, find_corners

Floats = NDArray[np.float64]

WINDOW = (11, 11)
LEVELS = 1
# Rows beyond the outermost points that are looked at.
MARGIN = 24


@njit(cache=True)
def _apart(position):  # type: ignore[no-untyped-def]
    """Tell which points have no older one (they come in order of age) within three pixels: (N,) bool."""
    count = position.shape[0]
    kept = np.ones(count, np.bool_)
    for i in range(count):
        for j in range(i):
            if (
                kept[j]
                and abs(position[i, 0] - position[j, 0]) < 3.0
                and abs(position[i, 1] - position[j, 1]) < 3.0
            ):
                kept[i] = False
                break
    return kept


class PointStore:
    """Follows corners. Working px, pixel centres at +0.5.

    Attributes:
        ids: (N,) int64, never used again.
        position: (N, 2).
        flow: (N, 2) of the last frame, px; zero for a new point.
        age: (N,) frames since the point was found.
        evidence: (N,) log odds that the point is on a vehicle that goes the ego's way.
        owner: (N,) id of the vehicle that the point moves with, 0 for none.
    """

    def __init__(self, *, memory: int) -> None:
        """Start empty.

        Args:
            memory: Frames of past positions that are kept.
        """
        self._memory = memory
        self._last: NDArray[np.uint8] | None = None
        self._next_id = 1
        self._turn = 1
        self.ids = np.zeros(0, np.int64)
        self.position = np.zeros((0, 2))
        self.flow = np.zeros((0, 2))
        self.age = np.zeros(0, np.int64)
        self.evidence = np.zeros(0)
        self.owner = np.zeros(0, np.int64)
        # Rings of the last positions and of the rotation's part in them, `_now` the latest.
        self._now = 0
        self._past = np.zeros((0, memory, 2))
        self._turned = np.zeros((0, memory, 2))

    def __len__(self) -> int:
        return len(self.ids)

    def follow(self, grey: NDArray[np.uint8], *, residual: float = 18.0) -> None:
        """Follow the points into the next picture; those that are lost are dropped.

        Args:
            grey: (h, w).
            residual: Greatest mean difference of the two windows, grey levels.
        """
        if len(self) and self._last is not None:
            height, width = grey.shape
            # Only the rows where points are.
            top = max(0, int(self.position[:, 1].min()) - MARGIN)
            bottom = min(height, int(self.position[:, 1].max()) + MARGIN)
            corner = np.array([0.5, 0.5 + top])
            start = (self.position - corner).astype(np.float32)[:, None]
            guess = start + self.flow.astype(np.float32)[:, None]
            moved, found, error = cv2.calcOpticalFlowPyrLK(
                self._last[top:bottom],
                grey[top:bottom],
                start,
                guess,
                winSize=WINDOW,
                maxLevel=LEVELS,
                criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 8, 0.03),
                flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
                minEigThreshold=1e-4,
            )
            place = moved[:, 0].astype(np.float64) + corner
            inside = (place > 3.0).all(1) & (place[:, 0] < width - 3.0) & (place[:, 1] < height - 3.0)
            good = (found[:, 0] == 1) & inside & (error[:, 0] < residual)
            # A flow that jumps is a window that slipped onto something else.
            change = np.abs(place - self.position - self.flow).max(1)
            good &= (self.age < 1) | (change < 3.0 + 0.3 * np.abs(self.flow).max(1))
            self.flow = place - self.position
            self.position = place
            good[good] = _apart(place[good])
            self._keep(good)
            self.age += 1
        self._last = grey

    def remember(self, turned: Floats) -> None:
        """Store the positions of this frame.

        With the flow that the camera's rotation caused since the last one (N, 2).
        """
        total = self._turned[:, self._now] + turned
        self._now = (self._now + 1) % self._memory
        self._past[:, self._now] = self.position
        self._turned[:, self._now] = total

    def displacement(self) -> tuple[Floats, Floats]:
        """Return how far each point moved over its remembered past, rotation removed (N, 2).

        And in how many frames (N,).
        """
        span = np.minimum(self.age, self._memory - 1)
        rows = np.arange(len(self))
        then = (self._now - span) % self._memory
        moved = self._past[:, self._now] - self._past[rows, then]
        turned = self._turned[:, self._now] - self._turned[rows, then]
        return moved - turned, span.astype(float)

    def frozen(self, *, play: float = 0.4) -> NDArray[np.bool_]:
        """Tell which points (N,) have not moved in the picture at all over their remembered past."""
        moved = np.abs(self._past - self.position[:, None]).max(axis=(1, 2))
        return np.asarray((moved < play) & (self.age >= 4))

    def refill(self, grey: NDArray[np.uint8], horizon: float) -> None:
        """Add corners where there are none.

        Sparsely above the horizon, densely where far vehicles lie, then the road.
        """
        height, width = grey.shape
        top = int(np.clip(horizon - 0.10 * width, 0, height - 24))
        near = int(np.clip(horizon - 0.025 * width, top + 8, height - 16))
        road = int(np.clip(horizon + 0.09 * width, near + 8, height - 8))
        bottom = int(np.clip(horizon + 0.30 * width, road + 8, height))
        # The middle every other frame, the others in between by turns: a search costs more than to follow.
        self._turn = (self._turn + 1) % 4
        if self._turn % 2 == 0:
            self._search(grey, near, road, 7, 180)
        elif self._turn == 1:
            self._search(grey, road, bottom, 18, 90)
        else:
            self._search(grey, top, near, 24, 50)

    def _search(self, grey: NDArray[np.uint8], first: int, last: int, cell: int, quota: int) -> None:
        """Add the best corners of free cells in rows [first, last) until there are ``quota`` points."""
        places = self.position.astype(np.int64) - np.array([0, first])
        held = places[(places[:, 1] >= 0) & (places[:, 1] < last - first)]
        room = quota - len(held)
        if room <= 0:
            return
        response = corner_response(grey, first, last)
        # A corner has to stand out from the noise and the texture of its part of the picture: its median.
        sample = response[::4, ::4].ravel()
        middle = np.partition(sample, sample.size // 2)[sample.size // 2]
        least = float(np.clip(6.0 * middle, 1e-4, 4e-4))
        corners = find_corners(response, held, cell, least, 4 * quota)
        if len(corners) > room:
            # The strongest of those there is room for.
            strength = response[corners[:, 1].astype(np.int64), corners[:, 0].astype(np.int64)]
            corners = corners[np.sort(np.argsort(-strength, kind="stable")[:room])]
        self._add(corners.astype(np.float64) + np.array([0.5, 0.5 + first]))

    def drop(self, gone: NDArray[np.bool_]) -> None:
        """Give up points (N,)."""
        self._keep(~gone)

    def _add(self, places: Floats) -> None:
        count = len(places)
        self.ids = np.concatenate([self.ids, self._next_id + np.arange(count)])
        self._next_id += count
        self.position = np.concatenate([self.position, places])
        self.flow = np.concatenate([self.flow, np.zeros((count, 2))])
        self.age = np.concatenate([self.age, np.zeros(count, np.int64)])
        self.evidence = np.concatenate([self.evidence, np.zeros(count)])
        self.owner = np.concatenate([self.owner, np.zeros(count, np.int64)])
        past = np.repeat(places[:, None], self._memory, 1)
        self._past = np.concatenate([self._past, past])
        self._turned = np.concatenate([self._turned, np.zeros_like(past)])

    def _keep(self, chosen: NDArray[np.bool_]) -> None:
        self.ids, self.position, self.flow = self.ids[chosen], self.position[chosen], self.flow[chosen]
        self.age, self.evidence, self.owner = self.age[chosen], self.evidence[chosen], self.owner[chosen]
        self._past, self._turned = self._past[chosen], self._turned[chosen]
