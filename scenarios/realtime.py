"""Frames that do not wait: what comes while a tracker is still busy is dropped."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from scenarios.detections import Fed
from tracker.base import Tracker
from tracker.types import Diagnostics, Frame, Info, Tracks

if TYPE_CHECKING:
    from sim.simulation import Observation


class Realtime:
    """A tracker that is given only the frames for which it has time.

    A step that takes longer than a frame lasts costs the frames that come meanwhile: for these, the tracks
    that it returned last stand. The first frame is waited for: what loads then, loads before a drive. Where a
    detector feeds the tracker (`scenarios.detections`), the detector's time does not count.
    """

    def __init__(self, tracker: Tracker, *, clock: Callable[[], float] = time.perf_counter) -> None:
        """Wrap a tracker.

        Args:
            tracker: It starts at frames, or is fed with detections.
            clock: Seconds; what passes on it during a step is the step's latency.
        """
        self._tracker, self._clock = tracker, clock
        self.has_boxes: bool = getattr(tracker, "has_boxes", True)

    @property
    def dropped(self) -> int:
        """Frames of this episode that were dropped."""
        return self._dropped

    @property
    def diagnostics(self) -> Diagnostics:
        """What the tracker found in the last frame that it was given."""
        return getattr(self._tracker, "diagnostics", None) or Diagnostics()

    def start(self, info: Info) -> None:
        """Start the tracker, with nothing to do."""
        self._tracker.start(info)
        self._free_at: float | None = None
        self._tracks, self._dropped = Tracks.none(), 0

    def look(self, frame: Frame, observation: Observation) -> None:
        """Let the detector of a tracker that is fed look at a frame, dropped or not."""
        if isinstance(self._tracker, Fed):
            self._tracker.look(frame, observation)

    def step(self, frame: Frame) -> Tracks:
        """Give the frame to the tracker if it is free, and return its last tracks."""
        if self._free_at is not None and frame.time < self._free_at:
            self._dropped += 1
            return self._tracks
        began = self._clock()
        self._tracks = self._tracker.step(frame)
        latency = self._clock() - began
        self._free_at = frame.time + (0.0 if self._free_at is None else latency)
        return self._tracks
