"""The tracks of riders: joint association, existence, births and deaths.

Each track carries the probability that its rider exists (Musicki, Evans, Joint integrated probabilistic data
association: JIPDA, IEEE T-AES 40(3), 2004): a rider that may not exist claims less of a measurement, and a
miss speaks against it as far as it could have been seen.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tracker.boxes import box_area, intersection, iou
from tracker.filtering import coalescence, jpda, planar
from tracker.motorcycle_lane import colour
from tracker.motorcycle_lane.clutter import ClutterMap
from tracker.motorcycle_lane.measuring import Expected, Measurements
from tracker.motorcycle_lane.sizes import SizeModel
from tracker.types import Status

Floats = NDArray[np.float64]

DETECTION = 0.75
"""P_D of a rider in full view. A miss is seldom alone, so it is lower than the share of frames with one."""
LEAST_DETECTION = 0.1
HIDDEN, SHOWN = 0.2, 0.6
"""Shares of a rider in view at which P_D is least, and full."""
GATE = 0.999
CLUTTER = 0.5
"""False measurements a frame."""
ACCELERATION = 1.0
"""Square root of the white acceleration's power spectral density, rider heights / s^1.5."""
SPEED = 5.0
"""Standard deviation of a new track's velocity, rider heights / s."""
ALONE_NOISE, JOINED_NOISE = 0.05, 0.12
"""Standard deviation of a measured centre, as a share of the rider's size."""
SURVIVAL = 0.998
BIRTH, BORDER_BIRTH = 0.15, 0.5
"""Existence of a new track inside the picture, and at its border."""
MOST_SURE = 0.9999
GONE, NEVER_CAME = 0.002, 0.05
"""Existence below which a confirmed track ends, and one that is not."""
SMALLEST_HEIGHT = 14.0
"""Height that a smaller track is taken to have when its way is judged, px: specks jump by their own size."""
STILL = 0.15
"""Rider heights a second below which a track stands. In a rush hour riders go a third of their height a
second, and none of those who ride must be taken for what was left of the training."""
PARKED, GHOST = 3.0, 0.5
"""Seconds of standing after which a rider is parked; and after which what has never gone a rider's height is
what was left of the training's traffic in the background."""
LONGEST_MISS = 1.0
"""Seconds after which a track that was not measured ends, hidden or not."""
SAME = 0.6
"""IoU from which a track that is not confirmed, or was missed, is the other's double."""
CONFIRMED, CONFIRMING_HITS = 0.9, 3
MOVED, ENTERED = 0.2, 0.12
"""Rider heights that a track must have gone to be confirmed: leaves sway, and lights flicker, in place. Less
is asked of one that began at the border, where riders come from."""
IN_FRAME, ENOUGH_IN_FRAME = 0.15, 0.3
"""Share of its box in the picture below which a track ends, and below which it is only presumed."""
SIZE_RATE, COLOUR_RATE = 0.1, 0.1
USUAL_RATE = 0.01
"""How fast a rider's size becomes the usual one of its row while it is not measured."""
COASTING_MISSES = 3
LONG_TENTATIVE = 15
"""Frames in which a track was measured after which it should have been confirmed, were it a rider."""


@dataclass(slots=True, kw_only=True)
class TrackArrays:
    """The N tracks, one after another as they were born.

    Attributes:
        ids: (N,) int64.
        mean: (N, 4) x, vx, y, vy of the box's centre, px and px/s.
        covariance: (N, 4, 4).
        sizes: (N, 2) width and height, px.
        references: (N, 2, BINS) colours.
        existence: (N,) probability.
        hits: (N,) int64 frames in which it was measured.
        misses: (N,) int64 successive frames in which it was not.
        confirmed: (N,) bool.
        sized: (N,) int64 frames in which its size was measured.
        stood: (N,) int64 successive frames in which it stood still.
        origins: (N, 2) where each was first seen, px.
        asked: (N,) rider heights that it must go to be confirmed.
    """

    ids: NDArray[np.int64]
    mean: Floats
    covariance: Floats
    sizes: Floats
    references: Floats
    existence: Floats
    hits: NDArray[np.int64]
    misses: NDArray[np.int64]
    confirmed: NDArray[np.bool_]
    sized: NDArray[np.int64]
    stood: NDArray[np.int64]
    origins: Floats
    asked: Floats

    def __len__(self) -> int:
        return len(self.ids)

    @classmethod
    def none(cls) -> TrackArrays:
        """Return no tracks."""
        return cls(
            ids=np.zeros(0, np.int64),
            mean=np.zeros((0, 4)),
            covariance=np.zeros((0, 4, 4)),
            sizes=np.zeros((0, 2)),
            references=np.zeros((0, colour.REGIONS, colour.BINS)),
            existence=np.zeros(0),
            hits=np.zeros(0, np.int64),
            misses=np.zeros(0, np.int64),
            confirmed=np.zeros(0, np.bool_),
            sized=np.zeros(0, np.int64),
            stood=np.zeros(0, np.int64),
            origins=np.zeros((0, 2)),
            asked=np.zeros(0),
        )

    def keep(self, kept: NDArray[np.bool_]) -> None:
        """Drop all but some."""
        if kept.all():
            return
        for field in fields(self):
            setattr(self, field.name, getattr(self, field.name)[kept])

    def append(self, more: TrackArrays) -> None:
        """Add others at the end."""
        for field in fields(self):
            setattr(self, field.name, np.concatenate([getattr(self, field.name), getattr(more, field.name)]))

    @property
    def centres(self) -> Floats:
        """(N, 2) x, y."""
        return self.mean[:, ::2]

    @property
    def velocities(self) -> Floats:
        """(N, 2) vx, vy."""
        return self.mean[:, 1::2]

    @property
    def boxes(self) -> Floats:
        """(N, 4), reaching beyond the picture where the rider does."""
        return np.concatenate([self.centres - 0.5 * self.sizes, self.centres + 0.5 * self.sizes], 1)

    def moved(self, heights: float | Floats) -> NDArray[np.bool_]:
        """Tell which tracks (N,) are so many rider heights away from where they began."""
        gone = np.hypot(*(self.centres - self.origins).T)
        return np.asarray(gone > heights * np.maximum(self.sizes[:, 1], SMALLEST_HEIGHT))


class TrackStore:
    """Follows the riders of one episode.

    Attributes:
        tracks: Those of now.
        beta: (N, M + 1) association probabilities of the last frame, of the tracks that it began with.
        believed: (M,) which of its measurements are riders: a confirmed track's, or where others were.
    """

    def __init__(self, width: int, height: int, rate: float) -> None:
        self.tracks = TrackArrays.none()
        self.beta: Floats = np.zeros((0, 1))
        self.believed = np.zeros(0, np.bool_)
        self._clutter = ClutterMap(width, height)
        self._frame = np.array([[0.0, 0.0, width, height]])
        self._step = 1.0 / rate
        self._next = 1
        # Colours of riders that are not in the picture any more.
        self._others: Floats = np.full((1, colour.REGIONS, colour.BINS), 1.0 / colour.BINS)

    def predict(self, sizes: SizeModel) -> None:
        """Advance all tracks by a frame; a rider's size changes as the row does."""
        t = self.tracks
        if not len(t):
            return
        before = sizes.sizes(t.mean[:, 2])
        intensity = (ACCELERATION * t.sizes[:, 1]) ** 2
        t.mean, t.covariance = planar.predict(t.mean, t.covariance, self._step, intensity[:, None, None])
        usual = sizes.sizes(t.mean[:, 2])
        t.sizes = t.sizes * usual / before
        rate = np.where(sizes.known(t.mean[:, 2]), np.maximum(USUAL_RATE, 1.0 / (1.0 + t.sized)), 0.0)
        t.sizes = t.sizes + rate[:, None] * (usual - t.sizes)
        t.existence = SURVIVAL * t.existence

    def expected(self) -> tuple[NDArray[np.int64], Expected]:
        """Return the tracks that may claim a part of a region, and what they expect."""
        t = self.tracks
        at = np.flatnonzero(t.existence >= 0.3)
        return at, Expected(
            centres=t.centres[at], sizes=t.sizes[at], references=t.references[at], moved=t.moved(1.0)[at]
        )

    def status(self) -> NDArray[np.uint8]:
        """Return (N,) a `tracker.types.Status` of each track."""
        t = self.tracks
        stood = t.stood * self._step
        ghost = (stood > GHOST) & ~t.moved(1.0)
        inside = intersection(t.boxes, self._frame)[:, 0] / np.maximum(box_area(t.boxes), 1e-9)
        resting = (t.misses > COASTING_MISSES) | (stood > PARKED) | (inside < ENOUGH_IN_FRAME)
        found = np.where(resting, Status.COASTING, Status.CONFIRMED)
        return np.where(t.confirmed & ~ghost, found, Status.TENTATIVE).astype(np.uint8)

    def in_view(self) -> Floats:
        """Return (N,) the share of each track's box in the picture and not behind a nearer rider's."""
        t = self.tracks
        boxes = t.boxes
        areas = np.maximum(box_area(boxes), 1e-9)
        inside = intersection(boxes, self._frame)[:, 0] / areas
        shared = intersection(boxes, boxes) * (t.existence > 0.5)
        nearer = boxes[None, :, 3] > boxes[:, None, 3]
        hidden = np.minimum((shared * nearer).sum(1) / areas, 1.0)
        return np.asarray(inside * (1.0 - hidden))

    def update(self, seen: Measurements, joined: NDArray[np.bool_]) -> None:
        """Correct the tracks by what is seen; begin some and end others.

        Args:
            seen: The measurements.
            joined: (N,) whether a track's region had to be explained by silhouettes.
        """
        t = self.tracks
        free = np.ones(len(seen))
        clutter = self._clutter.share(seen.centres)
        self.believed = clutter < 0.5
        if len(t):
            free = self._associate(seen, joined)
            self.believed |= self.beta[t.confirmed, 1:].sum(0) > 0.5
        self._end()
        self._begin(seen, free, 1.0 - clutter)

    def _associate(self, seen: Measurements, joined: NDArray[np.bool_]) -> Floats:
        """Associate and update; returns (M,) the probability that a measurement is no track's."""
        t = self.tracks
        spread = np.where(joined, JOINED_NOISE, ALONE_NOISE)[:, None] * t.sizes + 0.5
        noise = np.zeros((len(t), 2, 2))
        noise[:, 0, 0], noise[:, 1, 1] = spread.T**2
        found = jpda.innovations(t.mean, t.covariance, seen.centres, planar.POSITION, noise)
        view = np.clip((self.in_view() - HIDDEN) / (SHOWN - HIDDEN), 0.0, 1.0)
        detection = np.maximum(DETECTION * view, LEAST_DETECTION)
        clutter = CLUTTER / self._frame[0, 2:].prod()
        weights = jpda.likelihoods(found, detection=detection * t.existence, gate=GATE, clutter=clutter)
        if len(seen):
            population = np.concatenate([t.references, self._others])
            ratios = colour.likelihood_ratios(seen.histograms, t.references, population)
            weights[:, 1:] *= ratios**seen.shares
        beta = jpda.associate(coalescence.keep_apart(weights)).beta
        t.mean, t.covariance = jpda.update(t.mean, t.covariance, found, beta)
        missed = (1.0 - detection * GATE) * t.existence / (1.0 - detection * GATE * t.existence)
        t.existence = np.minimum(beta[:, 0] * missed + 1.0 - beta[:, 0], MOST_SURE)
        hit = beta[:, 0] < 0.5
        t.hits = t.hits + hit
        t.misses = np.where(hit, 0, t.misses + 1)
        t.confirmed = t.confirmed | (
            (t.existence > CONFIRMED) & (t.hits >= CONFIRMING_HITS) & t.moved(t.asked)
        )
        still = np.hypot(*t.velocities.T) < STILL * t.sizes[:, 1]
        t.stood = np.where(still, t.stood + 1, 0)
        self._learn(seen, beta)
        self.beta = beta
        return np.asarray(1.0 - beta[:, 1:].sum(0))

    def _learn(self, seen: Measurements, beta: Floats) -> None:
        """Take in sizes and colours of measurements that surely are a track's."""
        t = self.tracks
        if not len(seen):
            return
        own = beta[:, 1:].argmax(1)
        sure = beta[np.arange(len(t)), own + 1]
        sized = (sure > 0.8) & seen.alone[own]
        t.sized = t.sized + (sized & seen.sized[own])
        rate = np.maximum(SIZE_RATE, 1.0 / (t.sized + 1.0))[:, None]
        t.sizes[sized] += (rate * (seen.sizes[own] - t.sizes))[sized]
        blend = np.where((sure > 0.5) & (seen.shares[own] > 0.7), COLOUR_RATE * sure, 0.0)
        t.references = t.references + blend[:, None, None] * (seen.histograms[own] - t.references)

    def _end(self) -> None:
        t = self.tracks
        if not len(t):
            return
        boxes = t.boxes
        inside = intersection(boxes, self._frame)[:, 0] / np.maximum(box_area(boxes), 1e-9)
        ended = (t.existence < np.where(t.confirmed, GONE, NEVER_CAME)) | (inside < IN_FRAME)
        ended |= t.misses > LONGEST_MISS / self._step
        # Of two at one place the one that was measured more often is right.
        doubtful = ~t.confirmed | (t.misses > COASTING_MISSES)
        better = t.hits[None, :] > t.hits[:, None]
        self._learn_places(ended)
        ended |= doubtful & ((iou(boxes, boxes) > SAME) & better).any(1)
        left = t.references[ended & t.confirmed]
        self._others = np.concatenate([self._others, left])[-32:]
        t.keep(~ended)

    def _learn_places(self, ended: NDArray[np.bool_]) -> None:
        """Learn where riders are, and where what ends unconfirmed, or should long have been, was seen."""
        t, hit = self.tracks, self.tracks.misses == 0
        self._clutter.add_riders(t.boxes[t.confirmed & hit & t.moved(1.0)])
        late = ~t.confirmed & hit & (t.hits > LONG_TENTATIVE)
        self._clutter.add_nothing(t.centres[late], np.ones(int(late.sum())))
        never = ended & ~t.confirmed
        self._clutter.add_nothing(t.centres[never], np.minimum(t.hits[never], LONG_TENTATIVE).astype(float))

    def _begin(self, seen: Measurements, free: Floats, trust: Floats) -> None:
        """Begin tracks of measurements that are free, ``trust`` (M,) in them being 1 less their clutter."""
        at = np.flatnonzero(free > 0.5)
        if not len(at):
            return
        boxes, sizes = seen.boxes[at], seen.sizes[at]
        border = (boxes[:, :2] < 2.0).any(1) | (boxes[:, 2:] > self._frame[0, 2:] - 2.0).any(1)
        count = len(at)
        mean = np.zeros((count, 4))
        mean[:, ::2] = seen.centres[at]
        covariance = np.zeros((count, 4, 4))
        spread = np.where(seen.alone[at], ALONE_NOISE, JOINED_NOISE)[:, None] * sizes + 0.5
        covariance[:, 0, 0], covariance[:, 2, 2] = spread.T**2
        covariance[:, 1, 1] = covariance[:, 3, 3] = (SPEED * sizes[:, 1]) ** 2
        self.tracks.append(
            TrackArrays(
                ids=np.arange(self._next, self._next + count),
                mean=mean,
                covariance=covariance,
                sizes=sizes,
                references=seen.histograms[at],
                existence=np.where(border, BORDER_BIRTH, BIRTH) * free[at] * trust[at],
                hits=np.ones(count, np.int64),
                misses=np.zeros(count, np.int64),
                confirmed=np.zeros(count, np.bool_),
                sized=seen.sized[at].astype(np.int64),
                stood=np.zeros(count, np.int64),
                origins=seen.centres[at],
                asked=np.where(border, ENTERED, MOVED),
            )
        )
        self._next += count
