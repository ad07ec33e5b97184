"""An episode frame by frame, as its scene wants it scored."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.preprocess import Selection, confirmed, kept_tracks, select, select_riders
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


def scored_frames(
    log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams
) -> Iterator[ScoredFrame]:
    """Yield the frames that count: all of the in-car scene, those after the training of the lane."""
    lane = log.scene == "motorcycle-lane"
    clock = Standing(log.rate)
    for index, (truth, tracks) in enumerate(zip(log.truth, log.tracks, strict=True)):
        standing = clock.seconds(truth)
        if lane and index < params.training_frames:
            continue
        size = {"width": log.width, "height": log.height}
        selection = (
            select_riders(truth, standing, **size, boxes=boxes, params=params)
            if lane
            else select(truth, **size, boxes=boxes, params=params)
        )
        yield ScoredFrame(index=index, truth=truth, tracks=tracks, selection=selection, standing=standing)


def box_sequence(log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams) -> Sequence:
    """Turn an episode into what CLEAR, identity and HOTA are computed from."""
    truth_ids, track_ids, similarities = [], [], []
    for frame in scored_frames(log, boxes=boxes, params=params):
        selection = frame.selection
        scored = selection.boxes[selection.scored]
        ids, found = confirmed(frame.tracks, log.width, log.height)
        keep = kept_tracks(found, scored, selection.boxes[selection.ignored], params)
        truth_ids.append(frame.truth.ids[selection.scored])
        track_ids.append(ids[keep])
        similarities.append(iou(scored, found[keep]))
    return Sequence.of(truth_ids, track_ids, similarities)
