"""What changes from frame to frame in an episode, read from its log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scenarios.log import EpisodeLog, TraceLog
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.preprocess import box_sequence, select
from sim.truth.types import FrameTruth
from sim.world import FIRST_VEHICLE_ID, Role

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """T frames of an episode in numbers.

    Attributes:
        scored: (T,) objects that count.
        matched: (T,) of them that a confirmed track lies on.
        false: (T,) confirmed tracks that lie on none.
        overlap: (T,) mean IoU of the matches, not a number where there are none.
        classes: True class of each trace by its id (scoring.md 8).
    """

    scored: Floats
    matched: Floats
    false: Floats
    overlap: Floats
    classes: dict[int, str]


def scored_boxes(truth: FrameTruth, width: int, height: int) -> Floats:
    """Return the boxes (N, 4) of a frame's scored objects."""
    selection = select(truth, width=width, height=height, params=ScoringParams())
    return np.asarray(selection.boxes[selection.scored], float)


def measure(log: EpisodeLog, *, boxes: Boxes = "amodal") -> Series:
    """Compute what is plotted over time from an episode's log.

    Args:
        log: Of the episode.
        boxes: Which truth is scored.
    """
    params = ScoringParams()
    sequence = box_sequence(log, boxes=boxes, params=params)
    rows = np.zeros((len(log.truth), 4))
    for frame, similarity in enumerate(sequence.similarities):
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
        classes={} if log.traces is None else trace_classes(log.traces, log.truth),
    )


def trace_classes(traces: TraceLog, truths: tuple[FrameTruth, ...]) -> dict[int, str]:
    """Return what each trace truly is: that on which most of its support points lay over its life."""
    roles = {
        int(vehicle): Role(int(role))
        for truth in truths
        for vehicle, role in zip(truth.ids, truth.roles, strict=True)
    }
    names = {Role.SAME_WAY: "car", Role.ONCOMING: "oncoming", Role.CROSSING: "ignored"}
    votes: dict[int, dict[str, int]] = {}
    for trace, thing, count in zip(
        traces.vote_ids.tolist(), traces.vote_objects.tolist(), traces.vote_counts.tolist(), strict=True
    ):
        role = roles.get(thing, Role.PARKED) if thing >= FIRST_VEHICLE_ID else Role.NONE
        tally = votes.setdefault(trace, {})
        name = names.get(role, "background")
        tally[name] = tally.get(name, 0) + count
    return {
        trace: max(tally, key=lambda name: (tally[name], name))
        if max(tally.values()) >= ScoringParams().majority * sum(tally.values())
        else "ignored"
        for trace, tally in votes.items()
    }
