"""An episode frame by frame, as its scene wants it scored."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.preprocess import (
    Selection,
    confirmed,
    kept_tracks,
    select,
    select_from_above,
    select_riders,
)
from scenarios.score.sequence import Sequence
from sim.truth.standing import Standing
from sim.truth.types import FrameTruth
from tracker.boxes import iou
from tracker.types import Tracks


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoredFrame:
    """One frame that counts.

    Attributes:
        index: Its place in the log.
        truth: Of its N vehicles.
        tracks: Of the frame.
        selection: What becomes of the vehicles.
        standing: (N,) seconds that each of them has stood still.
    """

    index: int
    truth: FrameTruth
    tracks: Tracks
    selection: Selection
    standing: NDArray[np.float64]


class Selector:
    """Decides frame by frame what is scored; it is given every frame of an episode, in order."""

    def __init__(
        self,
        scene: str,
        *,
        rate: int,
        width: int,
        height: int,
        boxes: Boxes = "amodal",
        params: ScoringParams,
    ) -> None:
        """Begin an episode.

        Args:
            scene: Its name; it decides what counts.
            rate: Frames a second.
            width: Of the frame, px.
            height: Of the frame, px.
            boxes: Which boxes are scored.
            params: Thresholds.
        """
        self._lane = scene == "motorcycle-lane"
        self._select_vehicles = select_from_above if scene == "aerial" else select
        self._size, self._boxes, self._params = (width, height), boxes, params
        self._clock = Standing(rate)
        self._next = 0

    def select(self, truth: FrameTruth) -> Selection:
        """Take the truth of the next frame, whether the frame counts or not."""
        return self._select(truth)[1]

    def take(self, truth: FrameTruth, tracks: Tracks) -> ScoredFrame | None:
        """Take the next frame; None if it does not count."""
        standing, selection = self._select(truth)
        index = self._next - 1
        if self._lane and index < self._params.training_frames:
            return None
        return ScoredFrame(index=index, truth=truth, tracks=tracks, selection=selection, standing=standing)

    def _select(self, truth: FrameTruth) -> tuple[NDArray[np.float64], Selection]:
        self._next += 1
        standing = self._clock.seconds(truth)
        width, height = self._size
        how: dict[str, Any] = {
            "width": width,
            "height": height,
            "boxes": self._boxes,
            "params": self._params,
        }
        return standing, select_riders(truth, standing, **how) if self._lane else self._select_vehicles(
            truth, **how
        )

    def compare(
        self, frame: ScoredFrame
    ) -> tuple[NDArray[np.uint32], NDArray[np.int64], NDArray[np.float64]]:
        """Give the ids (G,) of a frame's scored objects, (P,) of its scored tracks, and their IoU (G, P)."""
        selection = frame.selection
        scored = selection.boxes[selection.scored]
        ids, found = confirmed(frame.tracks, *self._size)
        keep = kept_tracks(found, scored, selection.boxes[selection.ignored], self._params)
        return frame.truth.ids[selection.scored], ids[keep], iou(scored, found[keep])


def scored_frames(
    log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams
) -> Iterator[ScoredFrame]:
    """Yield the frames that count: all, but of the lane those after the training."""
    selector = _selector(log, boxes, params)
    for truth, tracks in zip(log.truth, log.tracks, strict=True):
        frame = selector.take(truth, tracks)
        if frame is not None:
            yield frame


def box_sequence(log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams) -> Sequence:
    """Turn an episode into what CLEAR, identity and HOTA are computed from."""
    selector = _selector(log, boxes, params)
    compared = [selector.compare(frame) for frame in scored_frames(log, boxes=boxes, params=params)]
    return Sequence.of(*([frame[part] for frame in compared] for part in range(3)))


def _selector(log: EpisodeLog, boxes: Boxes, params: ScoringParams) -> Selector:
    return Selector(log.scene, rate=log.rate, width=log.width, height=log.height, boxes=boxes, params=params)
