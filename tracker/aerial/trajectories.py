"""The paths of all tracks, in the mosaic: one table that is searched as a whole."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class Trajectories:
    """Paths without gaps, one point a tick.

    Tracks that have long ended make room for others, and very long paths forget their beginnings.

    Attributes:
        most: Tracks that are kept.
        longest: Points that are kept of each.
    """

    def __init__(self, *, most: int = 1000, longest: int = 1024) -> None:
        self.most, self.longest = most, longest
        self._points: Floats = np.zeros((16, 64, 2))
        self._counts = np.zeros(16, np.int64)
        self._begins = np.zeros(16, np.int64)
        # Rows by track id, in the order in which the tracks were last added to.
        self._rows: dict[int, int] = {}

    def __len__(self) -> int:
        return len(self._rows)

    def __contains__(self, track: int) -> bool:
        return track in self._rows

    @property
    def ids(self) -> list[int]:
        """The tracks' ids in the order of the rows of `table`."""
        return sorted(self._rows, key=self._rows.__getitem__)

    @property
    def table(self) -> tuple[Floats, NDArray[np.int64]]:
        """(N, T, 2) points and (N,) how many of them each track has."""
        return self._points[: len(self)], self._counts[: len(self)]

    def append(self, track: int, tick: int, point: ArrayLike) -> None:
        """Add a track's point; where ticks were left out its path goes straight between them.

        Raises:
            ValueError: If the track has a point of this tick or a later one.
        """
        row = self._rows.pop(track) if track in self._rows else self._new_row(tick)
        self._rows[track] = row
        point = np.asarray(point, float)
        count = int(self._counts[row])
        added = tick + 1 - (int(self._begins[row]) + count)
        if added < 1:
            raise ValueError(f"track {track} has a point of tick {tick} already")
        if count + added > self.longest:
            count = self._forget(row, added)
            added = tick + 1 - (int(self._begins[row]) + count)
        while count + added > self._points.shape[1]:
            self._points = np.concatenate([self._points, np.zeros_like(self._points)], 1)
        before = self._points[row, count - 1] if count else point
        share = np.arange(1, added + 1)[:, None] / added
        self._points[row, count : count + added] = before + share * (point - before)
        self._counts[row] = count + added

    def extent(self, track: int) -> tuple[int, int]:
        """Return the ticks [first, last] of which a track has points."""
        row = self._rows[track]
        first = int(self._begins[row])
        return first, first + int(self._counts[row]) - 1

    def at(self, track: int, ticks: ArrayLike) -> Floats:
        """Return where a track was at K ticks, which need not be whole: (K, 2), held at both ends."""
        row = self._rows[track]
        count = int(self._counts[row])
        places = np.clip(np.asarray(ticks, float) - self._begins[row], 0, count - 1)
        below = np.minimum(places.astype(np.int64), max(count - 2, 0))
        share = (places - below)[..., None]
        path = self._points[row]
        return np.asarray((1.0 - share) * path[below] + share * path[np.minimum(below + 1, count - 1)])

    def replace(self, track: int, begin: int, points: ArrayLike) -> None:
        """Let a track's path be (K, 2) ``points`` from tick ``begin`` on."""
        self.remove(track)
        for tick, point in enumerate(np.asarray(points, float), begin):
            self.append(track, tick, point)

    def cut(self, track: int, last: int) -> None:
        """Forget a track's points after a tick that it has one of."""
        row = self._rows[track]
        self._counts[row] = last + 1 - int(self._begins[row])

    def remove(self, track: int) -> None:
        """Forget a track, if it is known; the last row takes its place."""
        if track not in self._rows:
            return
        row, last = self._rows.pop(track), len(self._rows)
        for other, its_row in self._rows.items():
            if its_row == last:
                self._rows[other] = row
                for array in (self._points, self._counts, self._begins):
                    array[row] = array[last]
                break

    def _new_row(self, tick: int) -> int:
        if len(self) == self.most:
            self.remove(next(iter(self._rows)))
        row = len(self)
        if row == len(self._counts):
            self._points = np.concatenate([self._points, np.zeros_like(self._points)])
            self._counts = np.concatenate([self._counts, np.zeros_like(self._counts)])
            self._begins = np.concatenate([self._begins, np.zeros_like(self._begins)])
        self._counts[row], self._begins[row] = 0, tick
        return row

    def _forget(self, row: int, added: int) -> int:
        """Drop the older half of a path, or more if so much is added; return what is left."""
        count = int(self._counts[row])
        dropped = min(max(self.longest // 2, count + added - self.longest), count - 1)
        kept = count - dropped
        self._points[row, :kept] = self._points[row, dropped:count]
        self._counts[row] = kept
        self._begins[row] += dropped
        return kept
