"""An episode begun anew, and what is shown of its last frame: what the three trackers share."""

from __future__ import annotations

from abc import ABC, abstractmethod

from tracker.types import Diagnostics, Info


class EpisodeTracker(ABC):
    """A tracker that remembers nothing from one episode to the next."""

    def __init__(self) -> None:
        """Build the tracker; `start` begins an episode."""
        self._diagnostics = Diagnostics()

    def start(self, info: Info) -> None:
        """Forget everything and get ready for an episode."""
        self._info = info
        self._diagnostics = Diagnostics()
        self._begin()

    @abstractmethod
    def _begin(self) -> None:
        """Make what the episode needs."""

    @property
    def diagnostics(self) -> Diagnostics:
        """What there is to show of the last frame."""
        return self._diagnostics
