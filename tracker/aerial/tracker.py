"""The aerial tracker: paper 2's idea with its limits mended (registry name ``aerial``).

The picture is laid onto a mosaic; what differs from the ground and moves is followed by Kalman filters. A
vehicle that vanishes is forecast by its motion context; what appears anew is compared with the forecasts by
place and looks, all at once, before it gets its id.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.aerial import appearance, tracks
from tracker.aerial.background import Background
from tracker.aerial.daylight import Daylight
from tracker.aerial.forecasts import WINDOW, Forecaster, leads_to, went_until
from tracker.aerial.foreground import vehicles
from tracker.aerial.ghosts import contrast
from tracker.aerial.hidden import HiddenVehicles
from tracker.aerial.measuring import corners, free_outlines, outline
from tracker.aerial.motion_context import ContextForecast
from tracker.aerial.reacquisition import Fusion, Matcher
from tracker.aerial.stabilisation import Floats, Stabiliser, inverse, jacobian, transform
from tracker.aerial.tracks import Track
from tracker.aerial.trajectories import Trajectories
from tracker.blobs import Blobs, clean, find_blobs
from tracker.types import Diagnostics, Frame, Info, Predictions, Status, Tracks

LEAST_AREA = 30
"""Smallest region that begins a track, px."""
BORDER = 3.0
"""Px from the picture's border within which an outline is cut off."""
MOVED = 0.5
"""Lengths, its own or usual ones, that a track must have gone to be confirmed: what only seems to move
does not go far."""
SLOW, BUDGED = 10, 0.2
"""Frames, and lengths gone in them, after which a new track may be a hidden vehicle that comes out slowly."""
COMPACT = 0.6
"""Share of a rectangle that is foreground where a track begins: what is less may be two vehicles."""
GHOST, CLEAR = -0.4, 0.3
"""Log ratio of gradients along an outline (`tracker.aerial.ghosts`) below which nothing is there, and above
which a track begins."""
ENOUGH, MEMORY = 5, 600
"""Sizes of vehicles from which on, and up to which, their median is the usual one."""
SMALLEST = np.array([0.5, 0.5])
"""Length and width, in usual ones, from which on a region may be a vehicle's."""
LARGEST = np.array([1.4, 1.5])
"""Length and width of a region, in usual ones, up to which it is one vehicle's."""
HUGE = np.array([3.5, 2.2])
"""The same of the largest lorry: what is more is the light, or a bridge's edge, or many vehicles."""
LEAST_HISTORY = 20
"""Frames that a track must have been measured to be forecast once it vanishes."""
GOES = 8.0
"""Px in `WINDOW` frames from which on a track is rehearsed."""


class AerialTracker:
    """Follows vehicles from above, also where they cannot be seen."""

    def __init__(self, *, forecaster: Forecaster = ContextForecast, matcher: Matcher | None = None) -> None:
        """Build the tracker; `start` begins an episode.

        Args:
            forecaster: How hidden vehicles are forecast.
            matcher: How new vehicles are compared with the hidden.
        """
        self._forecaster, self._matcher = forecaster, matcher or Fusion()
        self._diagnostics = Diagnostics()

    def start(self, info: Info) -> None:
        """Forget everything and get ready for an episode."""
        self._info = info
        self._stabiliser, self._daylight = Stabiliser(), Daylight()
        self._background = Background()
        self._trajectories = Trajectories()
        self._tracks: list[Track] = []
        self._hidden = HiddenVehicles(self._forecaster, self._matcher, info.width, info.height, info.rate)
        self._ids = itertools.count(1)
        self._tick = -1
        self._sizes: deque[Floats] = deque(maxlen=MEMORY)
        self._usual = np.zeros(2)
        self._diagnostics = Diagnostics()

    @property
    def diagnostics(self) -> Diagnostics:
        """Detections, predictions of hidden vehicles, and the homography of the last frame."""
        return self._diagnostics

    def step(self, frame: Frame) -> Tracks:
        """Return the tracks of this frame; what was returned is final."""
        self._tick += 1
        image = np.ascontiguousarray(frame.image)
        to_mosaic = self._stabiliser.step(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
        tracks.predict(self._tracks)
        before = self._tracks
        seen = self._look(image, to_mosaic)
        self._remember(image, to_mosaic)
        self._hide(before)
        self._hidden.step(self._tick, to_mosaic, [track for track in self._tracks if not track.confirmed])
        self._decide(to_mosaic)
        return self._shown(to_mosaic, seen)

    def _look(self, image: NDArray[np.uint8], to_mosaic: Floats) -> Floats:
        """Measure the tracks, begin new ones; return the boxes (M, 4) of all outlines in the picture."""
        kept = _box(_corners([track for track in self._tracks if track.went()]))
        raw = self._background.apply(image, to_mosaic, kept)
        blobs = find_blobs(clean(vehicles(self._background, raw), window=3), LEAST_AREA // 2)
        origin = self._background.origin + np.array(self._background.view[:2])
        places = np.array([track.state[:, 0] for track in self._tracks]).reshape(-1, 2) - origin
        headings = np.array([track.heading for track in self._tracks]).reshape(-1, 2)
        sizes = np.array([track.size for track in self._tracks]).reshape(-1, 2)
        senior = np.array([track.confirmed for track in self._tracks], np.bool_)
        own, beaten, left = outline(
            blobs.labels, self._single(blobs, places), senior, places, headings, sizes
        )
        rest = find_blobs(left > 0, LEAST_AREA)
        sharper = contrast(rest, self._background)
        if (ghosts := sharper < GHOST).any():
            self._background.adopt(np.append(False, ghosts)[rest.labels])
        free = free_outlines(rest.labels, len(rest))
        to_picture = inverse(to_mosaic)
        cut = self._cut_off(transform(to_picture, own.corners() + origin))
        for k, track in enumerate(self._tracks):
            track.misses += 1
            if own.pixels[k]:
                tracks.measure(
                    track,
                    own.centres[k] + origin,
                    own.sizes[k],
                    self._tick,
                    bool(cut[k]),
                    self._usual * LARGEST,
                )
        # Two tracks were on one vehicle; two that are known may have gone under a bridge side by side.
        self._tracks = [
            track for track, gone in zip(self._tracks, beaten, strict=True) if not gone or self._known(track)
        ]
        missed = [track for track in self._tracks if track.misses]
        free.centres[:] += origin
        cut = self._cut_off(transform(to_picture, free.corners()))
        rows, columns = tracks.take_free(missed, free)
        for i, j in zip(rows.tolist(), columns.tolist(), strict=True):
            tracks.measure(missed[i], free.centres[j], free.sizes[j], self._tick, bool(cut[j]))
        compact = free.pixels >= COMPACT * free.sizes.prod(1)
        fitting = ((free.sizes >= SMALLEST * self._usual) & (free.sizes <= self._most())).all(1)
        clear = (sharper > CLEAR) & (free.pixels > 0)
        for j in np.setdiff1d(np.flatnonzero(compact & fitting & clear), columns).tolist():
            self._tracks.append(tracks.begin(next(self._ids), free, j, self._tick))
        double = {track.id for track in tracks.doubles(self._tracks, self._usual)}
        self._tracks = [
            track for track in self._tracks if track.id not in double and (track.size <= self._most()).all()
        ]
        found = np.concatenate([own.corners()[own.pixels > 0] + origin, free.corners()])
        return _boxes(transform(to_picture, found))

    def _most(self) -> Floats:
        """Return (2,) the length and width, px, of the largest vehicle, a lorry, as far as that is known."""
        return HUGE * self._usual if self._usual.any() else np.full(2, np.inf)

    def _single(self, blobs: Blobs, places: Floats) -> NDArray[np.bool_]:
        """Tell which labels (R + 1,) can be one vehicle at most, by the usual size of those below the known.

        Of the known at ``places`` (N, 2) themselves the sizes would tell less: two may be parts of one.
        """
        sizes = free_outlines(blobs.labels, len(blobs)).sizes
        known = np.array([track.confirmed and track.whole for track in self._tracks], np.bool_)
        height, width = blobs.labels.shape
        columns, rows = np.clip(places[known].astype(int), 0, [width - 1, height - 1]).T
        below = np.unique(blobs.labels[rows, columns])
        self._sizes.extend(sizes[below[below > 0] - 1])
        if len(self._sizes) > ENOUGH:
            self._usual = np.median(np.array(self._sizes), axis=0)
        usual = self._usual if self._usual.any() or not len(sizes) else np.median(sizes, axis=0)
        return np.append(False, (sizes <= usual * LARGEST).all(1))

    def _remember(self, image: NDArray[np.uint8], to_mosaic: Floats) -> None:
        """Keep paths and pictures of what is in full view."""
        to_picture = inverse(to_mosaic)
        corner = self._background.origin + np.array(self._background.view[:2])
        whole = [track for track in self._tracks if track.whole and track.misses == 0 and track.hits > 3]
        for track in whole:
            if track.confirmed:
                self._trajectories.append(track.path, self._tick, track.centre)
            if track.hits % tracks.PICTURE_EVERY == 0 or len(track.pictures) < 2:
                middle = transform(to_picture, track.centre)
                turn = jacobian(to_picture, track.centre)
                across = track.heading[::-1] * np.array([-1.0, 1.0])
                half = 0.5 * track.size
                sides = half[0] * track.heading, half[1] * across
                picture = appearance.cut(image, middle, *(turn @ side for side in sides))
                ground = appearance.cut(self._background.ground, track.centre - corner, *sides)
                track.pictures.append(self._daylight.restore(picture, ground))
                track.pictured = track.heading.copy()
        if whole:
            self._hidden.occluders.see(
                np.array([track.centre for track in whole]), np.array([track.heading for track in whole])
            )
        known = [track.path for track in whole if track.confirmed and self._goes(track.path)]
        self._hidden.rehearse(self._trajectories, self._tick, known)

    def _goes(self, path: int) -> bool:
        """Tell whether a track has a history long enough to be forecast, and moves."""
        first, last = self._trajectories.extent(path)
        if last < self._tick or last - first < WINDOW:
            return False
        way = np.diff(self._trajectories.at(path, [last - WINDOW, last]), axis=0)[0]
        return float(np.hypot(*way)) > GOES

    def _hide(self, before: list[Track]) -> None:
        """End what was not found again; of what was a vehicle for sure a forecast is begun.

        Args:
            before: The tracks of the last frame.
        """
        lost = [track for track in self._tracks if track.misses >= tracks.MOST_MISSES]
        self._tracks = [track for track in self._tracks if track.misses < tracks.MOST_MISSES]
        going = {track.id for track in self._tracks}
        for track in before:
            if track.id not in going and track.path in self._trajectories:
                track.since = went_until(self._trajectories, track.path, float(track.size[0]))
                self._trajectories.cut(track.path, track.since)
        for track in lost:
            if self._known(track):
                self._hidden.add(track, self._trajectories)
        for track in before:
            old = track.hidden
            if track.id not in going and old is not None and not self._known(track):
                # It was seen too briefly to have been that one for sure.
                if old.path in self._trajectories:
                    self._trajectories.cut(old.path, old.since)
                self._hidden.restore(old)

    def _known(self, track: Track) -> bool:
        """Tell whether a track is a vehicle for sure, and can be forecast."""
        return track.confirmed and track.hits >= LEAST_HISTORY and track.path in self._trajectories

    def _decide(self, to_mosaic: Floats) -> None:
        """Confirm new tracks, and give those that are hidden vehicles their ids back."""
        new = [
            track
            for track in self._tracks
            if not track.confirmed
            and track.whole
            and track.hits >= tracks.CONFIRMING_HITS
            and track.pictures
            and (self._moved(track) or (track.hits >= SLOW and track.went(BUDGED)))
        ]
        known = self._hidden.reacquire(new, to_mosaic)
        for old, track in known:
            self._join(old, track)
        for track in new:
            if self._moved(track) or any(track is other for _, other in known):
                track.confirmed = True
                self._trajectories.append(track.path, self._tick, track.centre)

    def _moved(self, track: Track) -> bool:
        """Tell whether a new track has gone so far that it must be a vehicle."""
        return track.went(MOVED * max(1.0, self._usual[0] / track.size[0]))

    def _join(self, old: Track, track: Track) -> None:
        """Let a new track go on as an old one; the way between them is learnt."""
        assert old.forecast is not None
        ticks = np.arange(old.since + 1, self._tick)
        last = self._trajectories.at(old.path, [self._tick])[0]
        share = np.linspace(0.0, 1.0, len(ticks) + 2)[1:-1, None]
        self._hidden.occluders.miss(last + share * (track.origin - last), track.origin - last)
        if leads_to(self._trajectories, old.path, track.origin):
            # Straight on is where it went, and may show others the way.
            track.path = old.path
        track.id = old.id
        track.size = np.maximum(track.size, 0.9 * old.size)
        track.hidden = old
        track.pictures = deque([*old.pictures, *track.pictures], old.pictures.maxlen)

    def _cut_off(self, shown: Floats) -> NDArray[np.bool_]:
        """Tell which rectangles (N, 4, 2) of the picture touch its border."""
        limits = np.array([self._info.width, self._info.height], float) - BORDER
        return np.asarray(((shown < BORDER) | (shown > limits)).any((1, 2)))

    def _shown(self, to_mosaic: Floats, seen: Floats) -> Tracks:
        hidden = self._hidden.tracks
        to_picture = inverse(to_mosaic)
        everyone = [*self._tracks, *hidden]
        if not everyone:
            self._diagnostics = Diagnostics(detections=seen, predictions=None, homography=to_mosaic)
            return Tracks.none()
        boxes = _boxes(transform(to_picture, _corners(everyone)))
        centres = np.array([track.centre for track in everyone])
        middles, turns = transform(to_picture, centres), jacobian(to_picture, centres)
        velocity = (turns @ np.array([track.velocity for track in everyone])[..., None])[..., 0]
        status = [_status(track) for track in everyone]
        unseen = [k for k, track in enumerate(everyone) if status[k] == Status.COASTING]
        covariances = [
            turns[k]
            @ (
                everyone[k].covariance
                if everyone[k].forecast is None
                else self._hidden.covariance(everyone[k])
            )
            @ turns[k].T
            for k in unseen
        ]
        self._diagnostics = Diagnostics(
            detections=seen,
            predictions=Predictions(
                ids=np.array([everyone[k].id for k in unseen], np.int64),
                centres=middles[unseen],
                covariances=np.array(covariances).reshape(-1, 2, 2),
            ),
            homography=to_mosaic,
        )
        return Tracks(
            ids=np.array([track.id for track in everyone], np.int64),
            boxes=boxes,
            status=np.array(status, np.uint8),
            state=np.concatenate([middles, self._info.rate * velocity], 1),
        )


def _status(track: Track) -> Status:
    if not track.confirmed:
        return Status.TENTATIVE
    return Status.COASTING if track.misses or track.forecast is not None else Status.CONFIRMED


def _corners(vehicles: Sequence[Track]) -> Floats:
    """Return (N, 4, 2) of their rectangles in the mosaic."""
    places = [(*track.centre, *track.heading, *track.size) for track in vehicles]
    centres, headings, sizes = np.array(places).reshape(-1, 3, 2).swapaxes(0, 1)
    return corners(centres, headings, sizes)


def _box(points: Floats) -> Floats:
    return np.concatenate([points.min(-2), points.max(-2)], -1)


def _boxes(points: Floats) -> Floats:
    """Return the boxes (N, 4) around points (N, 4, 2)."""
    return _box(points.reshape(-1, 4, 2))
