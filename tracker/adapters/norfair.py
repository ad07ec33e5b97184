"""Tryolabs' norfair: Kalman-filtered corners, matched greedily by their boxes' overlap."""

from __future__ import annotations

import importlib

import numpy as np

from tracker.types import Detections, Info, Status, Tracks

LEAST_IOU = 0.3
"""Of a match."""


class Norfair:
    """Passes detections on to ``norfair.Tracker`` with its IoU distance, at its own settings otherwise.

    Raises:
        ImportError: If norfair is not installed.
    """

    def __init__(self) -> None:
        self._norfair = importlib.import_module("norfair")

    def start(self, info: Info) -> None:  # noqa: ARG002
        """Make another one."""
        self._tracker = self._norfair.Tracker(distance_function="iou", distance_threshold=1 - LEAST_IOU)

    def follow(self, detections: Detections) -> Tracks:
        """Return its estimates; those without a detection in this frame are coasting."""
        given = [
            self._norfair.Detection(points=box.reshape(2, 2).copy(), scores=np.full(2, score))
            for box, score in zip(detections.boxes, detections.scores, strict=True)
        ]
        now = {id(detection) for detection in given}
        found = [o for o in self._tracker.update(given) if (o.estimate[1] > o.estimate[0]).all()]
        seen = np.array([id(o.last_detection) in now for o in found], bool)
        return Tracks(
            ids=np.array([o.id for o in found], np.int64),
            boxes=np.array([o.estimate for o in found], np.float64).reshape(-1, 4),
            status=np.where(seen, Status.CONFIRMED, Status.COASTING).astype(np.uint8),
        )
