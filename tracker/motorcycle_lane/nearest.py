"""The baseline that a user would try first (registry name ``motorcycle-lane:mog2-nn``).

OpenCV's MOG2 (Zivkovic, Improved adaptive Gaussian mixture model for background subtraction, ICPR 2004) with
the same clean-up and regions as ours; each track takes the nearest region to where constant velocity has
brought it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.filtering.assignment import assign
from tracker.motorcycle_lane.episode import EpisodeTracker
from tracker.motorcycle_lane.front_end import look
from tracker.types import Diagnostics, Frame, Status, Tracks

Floats = NDArray[np.float64]

SHADOW = 127
"""MOG2's mark of a shadow; foreground is above."""
REACH = 0.06
"""Farthest region that a track takes, as a share of the picture's width."""
VELOCITY_RATE = 0.3
CONFIRMING_HITS, MOST_MISSES = 3, 5


@dataclass(slots=True)
class NearestTrack:
    """A track: (2,) centre and velocity in px and px a frame, (4,) box, frames measured and missed."""

    id: int
    centre: Floats
    velocity: Floats
    box: Floats
    hits: int = 1
    misses: int = 0


class NearestTracker(EpisodeTracker):
    """MOG2, nearest neighbours, constant velocity."""

    def _begin(self) -> None:
        self._background = cv2.createBackgroundSubtractorMOG2()
        self._tracks: list[NearestTrack] = []
        self._ids = itertools.count(1)

    def step(self, frame: Frame) -> Tracks:
        """Return the tracks of this frame; what was returned is final."""
        sight = look(frame.image, self._background.apply(frame.image) > SHADOW)
        boxes = sight.blobs.boxes
        centres = 0.5 * (boxes[:, :2] + boxes[:, 2:])
        tracks = self._tracks
        expected = np.array([track.centre + track.velocity for track in tracks]).reshape(-1, 2)
        away = np.hypot(*(expected[:, None] - centres[None]).transpose(2, 0, 1))
        rows, columns = assign(away, REACH * self._info.width)
        for i, track in enumerate(tracks):
            track.centre = expected[i]
            track.misses += 1
        for i, j in zip(rows.tolist(), columns.tolist(), strict=True):
            track = tracks[i]
            track.velocity = track.velocity + VELOCITY_RATE * (centres[j] - expected[i])
            track.centre, track.box = centres[j], boxes[j]
            track.hits, track.misses = track.hits + 1, 0
        self._tracks = [track for track in tracks if track.misses <= MOST_MISSES]
        for j in np.setdiff1d(np.arange(len(centres)), columns):
            self._tracks.append(NearestTrack(next(self._ids), centres[j], np.zeros(2), boxes[j]))
        self._diagnostics = Diagnostics(detections=boxes, mask=sight.mask)
        return self._shown()

    def _shown(self) -> Tracks:
        tracks = self._tracks
        centres = np.array([track.centre for track in tracks]).reshape(-1, 2)
        sizes = np.array([track.box[2:] - track.box[:2] for track in tracks]).reshape(-1, 2)
        velocity = self._info.rate * np.array([track.velocity for track in tracks]).reshape(-1, 2)
        status = [
            Status.TENTATIVE
            if track.hits < CONFIRMING_HITS
            else (Status.COASTING if track.misses else Status.CONFIRMED)
            for track in tracks
        ]
        return Tracks(
            ids=np.array([track.id for track in tracks], np.int64),
            boxes=np.concatenate([centres - 0.5 * sizes, centres + 0.5 * sizes], 1),
            status=np.array(status, np.uint8),
            state=np.concatenate([centres, velocity], 1),
        )
