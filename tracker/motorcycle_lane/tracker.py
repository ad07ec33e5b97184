"""The motorcycle-lane tracker: paper 3's idea with its limits mended (registry name ``motorcycle-lane``).

A statistical background model gives the foreground; learnt trees tell what of it are riders and what their
shadows; its regions give a measurement of each rider, also where riders touch or hide one another; joint
probabilistic data association follows them, each with a probability that it exists.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracker.boosting import learnt
from tracker.motorcycle_lane.background import BackgroundModel
from tracker.motorcycle_lane.episode import EpisodeTracker
from tracker.motorcycle_lane.flow import Flow
from tracker.motorcycle_lane.foreground import weigh
from tracker.motorcycle_lane.front_end import Sight, look
from tracker.motorcycle_lane.ground import Ground
from tracker.motorcycle_lane.measuring import Measurer
from tracker.motorcycle_lane.sizes import guessed
from tracker.motorcycle_lane.tracks import TrackStore
from tracker.types import Association, Diagnostics, Frame, Predictions, Status, Tracks

# Of the filter's state (x, vx, y, vy) the order that is shown: cx, cy, vx, vy.
SHOWN = np.array([0, 2, 1, 3])


class MotorcycleLaneTracker(EpisodeTracker):
    """Follows the riders of a lane before a static camera."""

    def _begin(self) -> None:
        self._background = BackgroundModel(self._info.width, self._info.height)
        self._ground = Ground()
        self._trees, *self._size_trees = (
            learnt("tracker.motorcycle_lane", name) for name in ("foreground", "widths", "heights")
        )
        self._measurer = Measurer(self._info.width, self._info.height)
        self._store = TrackStore(self._info.width, self._info.height, self._info.rate)
        self._flow = Flow(self._info.width, self._info.height, self._info.rate)

    @property
    def background(self) -> BackgroundModel:
        """The background model of the episode."""
        return self._background

    @property
    def store(self) -> TrackStore:
        """The tracks, with their association probabilities."""
        return self._store

    def step(self, frame: Frame) -> Tracks:
        """Return the tracks of this frame; what was returned is final."""
        store = self._store
        store.predict(self._measurer.sizes)
        tracks = store.tracks
        predictions = Predictions(
            ids=tracks.ids, centres=tracks.centres.copy(), covariances=tracks.covariance[:, ::2, ::2].copy()
        )
        at, expected = store.expected()
        sight = self._look(frame.image)
        seen = self._measurer.measure(sight, expected)
        joined = np.zeros(len(tracks), np.bool_)
        joined[at] = seen.joined
        store.update(seen, joined)
        association = None
        if len(predictions.ids):
            # Who is where nothing is detected is missed.
            own = store.beta[:, 1:][:, store.believed]
            missed = 1.0 - own.sum(1, keepdims=True)
            association = Association(ids=predictions.ids, beta=np.concatenate([missed, own], 1))
        tracks = store.tracks
        status = store.status()
        gone = (status == Status.CONFIRMED) & tracks.moved(1.0)
        flags = self._flow.step(
            tracks.ids[gone], tracks.centres[gone], tracks.velocities[gone], tracks.sizes[gone, 1]
        )
        self._diagnostics = Diagnostics(
            detections=self._clip(seen.boxes[store.believed]),
            mask=sight.mask,
            background=self._background.background,
            association=association,
            predictions=predictions,
            flags=flags,
        )
        return Tracks(
            ids=tracks.ids.copy(),
            boxes=self._clip(tracks.boxes),
            status=status,
            score=tracks.existence.copy(),
            state=tracks.mean[:, SHOWN],
            covariance=tracks.covariance[:, SHOWN[:, None], SHOWN],
        )

    def _look(self, image: NDArray[np.uint8]) -> Sight:
        """Return what of the picture is a vehicle, and learn what the road and how large vehicles are."""
        raw = self._background.apply(image)
        ground = self._ground.image(self._background.background)
        sizes = self._measurer.sizes
        heights = sizes.sizes(np.arange(len(raw), dtype=float))[:, 1]
        weighed = weigh(image, ground, raw, heights, self._trees)
        sight = look(image, raw, weighed.vehicles)
        if not sizes.settled:
            sizes.learn(guessed(weighed, sight.blobs.labels, heights, self._size_trees), travelled=False)
        self._ground.learn(image, raw, sight.mask)
        return sight

    def _clip(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        limits = np.array([self._info.width, self._info.height] * 2, float)
        return np.clip(boxes, 0.0, limits)
