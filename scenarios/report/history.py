"""What the report remembers of a run while it streams by: as much after ten minutes as after two."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.types import Status, Traces, Tracks

MAX_ROWS = 4096
"""Rows kept of a temporal profile; a longer run keeps every second one, then every fourth, ..."""


class Thinned:
    """Tells which frames to keep so that at most ``limit`` are: each one, then every second, fourth, ..."""

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self.stride = 1
        self.kept = 0

    def wants(self, index: int) -> bool:
        """Say whether frame ``index`` is kept."""
        return index % self.stride == 0

    def added(self) -> bool:
        """Count one more; say whether every second of what is kept must now go."""
        self.kept += 1
        if self.kept <= self.limit:
            return False
        self.stride *= 2
        self.kept = (self.kept + 1) // 2
        return True


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceSamples:
    """R samples of traces.

    Attributes:
        ticks: (R,) int64, the frame's number in the run, from 0.
        ids: (R,) int64.
        x: (R,) float32, px from the image's left edge.
        v: (R,) float32, px/s.
        labels: (R,) uint8, a `tracker.types.Label`.
        p_car: (R,) float32.
        owners: (R,) int64, 0 for none.
    """

    ticks: NDArray[np.int64]
    ids: NDArray[np.int64]
    x: NDArray[np.float32]
    v: NDArray[np.float32]
    labels: NDArray[np.uint8]
    p_car: NDArray[np.float32]
    owners: NDArray[np.int64]


class ProfileRows:
    """A temporal profile as bytes, one a pixel, on a scale that doubles whenever a brighter row comes.

    Args:
        width: Of the rows, px.
        empty: Dark rows to begin with, for the frames before the first that had this profile.
    """

    def __init__(self, width: int, empty: int) -> None:
        self._rows: list[NDArray[np.uint8]] = [np.zeros(width, np.uint8) for _ in range(empty)]
        self._width = width
        self._scale = 0.0

    def add(self, profile: NDArray[np.float32] | None) -> None:
        """Append a row, (W,) >= 0; what is no number counts as 0, and None is a dark row."""
        if profile is None:
            self._rows.append(np.zeros(self._width, np.uint8))
            return
        row = np.nan_to_num(np.asarray(profile, np.float64), nan=0.0, posinf=0.0, neginf=0.0)
        peak = float(row.max(initial=0.0))
        if peak > self._scale:
            if self._scale == 0.0:
                self._scale = peak
            while peak > self._scale:
                self._scale *= 2
                self._rows = [np.right_shift(kept, np.uint8(1)) for kept in self._rows]
        gain = 255.0 / self._scale if self._scale > 0 else 0.0
        self._rows.append(np.clip(np.rint(row * gain), 0, 255).astype(np.uint8))

    def halve(self) -> None:
        """Drop every second row."""
        self._rows = self._rows[::2]

    def image(self) -> NDArray[np.uint8]:
        """Return (T, W), one row a kept frame, bright where the profile is high."""
        return np.stack(self._rows)


class History:
    """Profiles and traces of a run."""

    def __init__(self) -> None:
        self._thinned = Thinned(MAX_ROWS)
        self._profiles: dict[str, ProfileRows] = {}
        self._traces: list[TraceSamples] = []
        self._counts: list[NDArray[np.int64]] = []

    @property
    def stride(self) -> int:
        """Frames from one kept row to the next."""
        return self._thinned.stride

    def add(
        self,
        index: int,
        tracks: Tracks,
        profiles: Mapping[str, NDArray[np.float32]],
        traces: Traces | None,
    ) -> None:
        """Take in frame ``index`` of the run, from 0."""
        if not self._thinned.wants(index):
            return
        for name, profile in profiles.items():
            if name not in self._profiles:
                self._profiles[name] = ProfileRows(len(profile), self._thinned.kept)
        for name, rows in self._profiles.items():
            rows.add(profiles.get(name))
        self._traces.append(_samples(index, traces))
        self._counts.append(np.bincount(tracks.status, minlength=len(Status)))
        if self._thinned.added():
            for rows in self._profiles.values():
                rows.halve()
            self._traces = self._traces[::2]
            self._counts = self._counts[::2]

    def profiles(self) -> dict[str, NDArray[np.uint8]]:
        """Return the (T, W) temporal profiles by name."""
        return {name: rows.image() for name, rows in self._profiles.items()}

    def track_counts(self) -> NDArray[np.int64]:
        """Return how many tracks of each `Status` there were: (T, 3), one row a kept frame."""
        return np.array(self._counts, np.int64).reshape(-1, len(Status))

    def traces(self) -> TraceSamples:
        """Return the kept samples, in order of time."""
        parts = self._traces or [_samples(0, None)]
        return TraceSamples(
            ticks=np.concatenate([part.ticks for part in parts]),
            ids=np.concatenate([part.ids for part in parts]),
            x=np.concatenate([part.x for part in parts]),
            v=np.concatenate([part.v for part in parts]),
            labels=np.concatenate([part.labels for part in parts]),
            p_car=np.concatenate([part.p_car for part in parts]),
            owners=np.concatenate([part.owners for part in parts]),
        )


def _samples(index: int, traces: Traces | None) -> TraceSamples:
    count = 0 if traces is None else len(traces.ids)
    return TraceSamples(
        ticks=np.full(count, index, np.int64),
        ids=np.zeros(0, np.int64) if traces is None else traces.ids.astype(np.int64),
        x=np.zeros(0, np.float32) if traces is None else traces.x.astype(np.float32),
        v=np.zeros(0, np.float32) if traces is None else traces.v.astype(np.float32),
        labels=np.zeros(0, np.uint8) if traces is None else traces.labels.astype(np.uint8),
        p_car=np.zeros(0, np.float32) if traces is None else traces.p_car.astype(np.float32),
        owners=np.zeros(0, np.int64) if traces is None else traces.owners.astype(np.int64),
    )
