"""What changes from frame to frame in an episode, read from its log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scenarios.log import EpisodeLog
from scenarios.score.foreground import mask_counts
from scenarios.score.frames import box_sequence, scored_frames
from scenarios.score.identification import judge_traces
from scenarios.score.lane import on_riders
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.preprocess import select, select_riders
from sim.truth.types import FrameTruth

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """T frames of an episode in numbers.

    A frame of a lane's training, in which nothing is scored, has no numbers.

    Attributes:
        scored: (T,) objects that count.
        matched: (T,) of them that a confirmed track lies on.
        false: (T,) confirmed tracks that lie on none.
        overlap: (T,) mean IoU of the matches, not a number where there are none.
        classes: What each trace truly is, by its id.
    """

    scored: Floats
    matched: Floats
    false: Floats
    overlap: Floats
    classes: dict[int, str]


def scored_boxes(truth: FrameTruth, width: int, height: int, scene: str) -> Floats:
    """Return the boxes (N, 4) of a frame's scored objects; of a lane also of riders that have long stood."""
    params = ScoringParams()
    selection = (
        select_riders(truth, np.zeros(len(truth)), width=width, height=height, params=params)
        if scene == "motorcycle-lane"
        else select(truth, width=width, height=height, params=params)
    )
    return np.asarray(selection.boxes[selection.scored], float)


@dataclass(frozen=True, slots=True)
class FollowedRider:
    """A rider, the F frames in which it was scored, and the id of the track on it in each, 0 for none."""

    rider: int
    frames: NDArray[np.int64]
    tracks: NDArray[np.int64]


def follow_riders(log: EpisodeLog, *, boxes: Boxes = "amodal") -> list[FollowedRider]:
    """Say which confirmed track was on each scored rider of a lane; riders stand in the order they came."""
    found: dict[int, list[tuple[int, int]]] = {}
    if not log.has_boxes:
        return []
    params = ScoringParams()
    for frame in scored_frames(log, boxes=boxes, params=params):
        track = dict(on_riders(frame, log, params))
        for rider in frame.truth.ids[frame.selection.scored].tolist():
            found.setdefault(rider, []).append((frame.index, track.get(rider, 0)))
    return [FollowedRider(rider, *np.array(rows, np.int64).T) for rider, rows in found.items()]


def foreground_series(log: EpisodeLog) -> dict[str, Floats] | None:
    """Return precision and recall (T,) of the foreground mask in each frame; None without masks."""
    params = ScoringParams()
    rows = np.full((2, len(log.truth)), np.nan)
    for frame in scored_frames(log, params=params):
        counts = mask_counts(log, frame, params)
        if counts is not None:
            hits, marked, wanted = counts
            rows[:, frame.index] = hits / marked if marked else np.nan, hits / wanted if wanted else np.nan
    return {"precision": rows[0], "recall": rows[1]} if np.isfinite(rows).any() else None


def measure(log: EpisodeLog, *, boxes: Boxes = "amodal") -> Series:
    """Compute what is plotted over time from an episode's log.

    Args:
        log: Of the episode.
        boxes: Which truth is scored.
    """
    params = ScoringParams()
    sequence = box_sequence(log, boxes=boxes, params=params)
    rows = np.full((len(log.truth), 4), np.nan)
    training = len(log.truth) - len(sequence.similarities)
    for frame, similarity in enumerate(sequence.similarities, start=training):
        scored, tracks = similarity.shape
        worth = np.where(similarity >= params.match_iou, similarity, 0.0)
        first, second = linear_sum_assignment(worth, maximize=True)
        overlaps = worth[first, second]
        matched = int((overlaps > 0).sum())
        rows[frame] = scored, matched, tracks - matched, overlaps.sum() / matched if matched else np.nan
    return Series(
        scored=rows[:, 0],
        matched=rows[:, 1],
        false=rows[:, 2],
        overlap=rows[:, 3],
        classes={trace.id: trace.truth for trace in judge_traces(log, params)},
    )
