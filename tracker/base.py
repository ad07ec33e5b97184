"""The contract of a tracker."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from tracker.types import Diagnostics, Frame, Info, Tracks


@runtime_checkable
class Tracker(Protocol):
    """Takes the frames of one episode in order and returns the tracks of each.

    A tracker without boxes (paper 1's printed rules label traces only) sets ``has_boxes = False`` on its class
    and returns `Tracks.none()`; its box scores are null.
    """

    def start(self, info: Info) -> None:
        """Forget everything and get ready for an episode."""

    def step(self, frame: Frame) -> Tracks:
        """Return the tracks of this frame; what was returned is final."""


@runtime_checkable
class Diagnosable(Protocol):
    """A tracker that shows its inner state."""

    @property
    def diagnostics(self) -> Diagnostics:
        """What was found in the last step."""
