"""supervision's ByteTrack (Zhang et al. 2022)."""

from __future__ import annotations

import importlib

import numpy as np

from tracker.types import Detections, Info, Tracks


class ByteTrack:
    """Passes detections on to ``supervision.ByteTrack``, at its own settings.

    Raises:
        ImportError: If supervision is not installed.
    """

    def __init__(self) -> None:
        self._supervision = importlib.import_module("supervision")

    def start(self, info: Info) -> None:
        """Make another one."""
        self._tracker = self._supervision.ByteTrack(frame_rate=max(1, round(info.rate)))

    def follow(self, detections: Detections) -> Tracks:
        """Return the detections that it has on a track; it shows no other boxes."""
        given = self._supervision.Detections(
            xyxy=detections.boxes.copy(),
            confidence=detections.scores.copy(),
            class_id=np.zeros(len(detections), np.int64),
        )
        found = self._tracker.update_with_detections(given)
        return Tracks.confirmed(found.tracker_id, found.xyxy)
