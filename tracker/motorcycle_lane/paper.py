"""The motorcycle-lane tracker as paper 3 prints it (registry name ``motorcycle-lane:paper``).

Regions are measurements as they are; a track always takes some measurement, eqs. (28), (29); a measurement
far from all tracks begins one, eq. (30); colours are added to positions, eq. (33); four misses end a track.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.filtering import jpda, planar
from tracker.motorcycle_lane import colour
from tracker.motorcycle_lane.background import PAPER, BackgroundModel
from tracker.motorcycle_lane.episode import EpisodeTracker
from tracker.motorcycle_lane.front_end import look
from tracker.types import Diagnostics, Frame, Status, Tracks

Floats = NDArray[np.float64]

DETECTION, GATE = 0.98, 0.99
FALSE_ALARMS = 1.0
"""mu_F of eq. (24): weight of a false measurement."""
SPATIAL = 0.7
"""a of eq. (33), in which the spatial term is exp(-d^2 / 2): a density cannot be added to a pure number."""
SHARPNESS = 20.0
"""lambda_c of eq. (32)."""
APART = 0.06
"""epsilon of eq. (30), as a share of the picture's width."""
MOST_MISSES = 3
NOISE = 2.0
"""Standard deviation of a measured centre, px."""
ACCELERATION = 40.0
"""Square root of the white acceleration's power spectral density, px / s^1.5."""
SPEED = 120.0
"""Standard deviation of a new track's velocity, px / s."""
REFERENCE_RATE = 1.0
"""The reference of a track's colours is its last accepted state."""


@dataclass(slots=True)
class PaperTrack:
    """A track: (4,) mean, (4, 4) covariance, box, (2, BINS) colours, frames missed, whether new."""

    id: int
    mean: Floats
    covariance: Floats
    box: Floats
    reference: Floats
    misses: int = 0
    new: bool = True


class PaperTracker(EpisodeTracker):
    """Follows what moves before a static camera by the printed rules."""

    def _begin(self) -> None:
        self._background = BackgroundModel(self._info.width, self._info.height, PAPER)
        self._tracks: list[PaperTrack] = []
        self._ids = itertools.count(1)

    def step(self, frame: Frame) -> Tracks:
        """Return the tracks of this frame; what was returned is final."""
        sight = look(frame.image, self._background.apply(frame.image))
        blobs = sight.blobs
        bins = colour.bin_pixels(sight.image, blobs.labels)
        histograms = colour.histograms(bins, blobs.labels, np.arange(1, len(blobs) + 1), blobs.boxes)
        centres = 0.5 * (blobs.boxes[:, :2] + blobs.boxes[:, 2:])
        # Eq. (30) compares with where the tracks were.
        before = np.array([track.mean[::2] for track in self._tracks]).reshape(-1, 2)
        away = np.hypot(*(centres[:, None] - before[None]).transpose(2, 0, 1))
        new = (away > APART * self._info.width).all(1)
        if self._tracks:
            self._associate(centres, histograms, blobs.boxes)
        self._tracks = [track for track in self._tracks if not self._ended(track)]
        for j in np.flatnonzero(new):
            mean = np.array([centres[j, 0], 0.0, centres[j, 1], 0.0])
            covariance = np.diag([NOISE**2, SPEED**2, NOISE**2, SPEED**2])
            self._tracks.append(PaperTrack(next(self._ids), mean, covariance, blobs.boxes[j], histograms[j]))
        self._diagnostics = Diagnostics(detections=blobs.boxes, mask=sight.mask)
        return self._shown()

    def _associate(self, centres: Floats, histograms: Floats, boxes: Floats) -> None:
        tracks = self._tracks
        mean, covariance = planar.predict(
            np.array([track.mean for track in tracks]),
            np.array([track.covariance for track in tracks]),
            1.0 / self._info.rate,
            ACCELERATION**2,
        )
        found = jpda.innovations(mean, covariance, centres, planar.POSITION, NOISE**2 * np.eye(2))
        references = np.array([track.reference for track in tracks])
        alike = np.exp(-SHARPNESS * colour.distances(histograms, references))
        likely = SPATIAL * np.exp(-0.5 * found.distances) + (1.0 - SPATIAL) * alike
        inside = found.distances <= jpda.gate_distance(GATE)
        weights = np.empty((len(tracks), len(centres) + 1))
        weights[:, 0] = 1.0 - DETECTION
        weights[:, 1:] = np.where(inside, DETECTION * likely / FALSE_ALARMS, 0.0)
        beta = jpda.without_misses(jpda.associate(weights).beta)
        mean, covariance = jpda.update(mean, covariance, found, beta)
        for i, track in enumerate(tracks):
            track.mean, track.covariance = mean[i], covariance[i]
            if beta[i, 0] == 1.0:
                track.misses += 1
                continue
            track.misses, own = 0, int(beta[i, 1:].argmax())
            track.box = boxes[own]
            track.reference = track.reference + REFERENCE_RATE * (histograms[own] - track.reference)

    def _ended(self, track: PaperTrack) -> bool:
        """Tell whether a track was missed too often, or has come to the end of the area and is not new."""
        x, y = track.mean[::2]
        inside = 0.0 <= x <= self._info.width and 0.0 <= y <= self._info.height
        new, track.new = track.new, track.new and not inside
        return track.misses > MOST_MISSES or (not inside and not new)

    def _shown(self) -> Tracks:
        tracks = self._tracks
        mean = np.array([track.mean for track in tracks]).reshape(-1, 4)
        size = np.array([track.box[2:] - track.box[:2] for track in tracks]).reshape(-1, 2)
        centres = mean[:, ::2]
        return Tracks(
            ids=np.array([track.id for track in tracks], np.int64),
            boxes=np.concatenate([centres - 0.5 * size, centres + 0.5 * size], 1),
            status=np.full(len(tracks), Status.CONFIRMED, np.uint8),
            state=mean[:, [0, 2, 1, 3]],
        )
