"""What paper 3 reports: detections, full tracks, wrong-way riders, and how its background model copes."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scenarios.log import EpisodeLog
from scenarios.score.foreground import absorption_seconds, foreground_f, recovery_seconds
from scenarios.score.frames import ScoredFrame, scored_frames
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.preprocess import clip, confirmed, kept_tracks
from sim.world import Role
from tracker.boxes import iou

Floats = NDArray[np.float64]
Pair = tuple[int, int]
"""A rider's id and that of the track on it."""


def lane_scores(log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams) -> dict[str, Any]:
    """Compute the scores of a lane (scoring.md 13 to 15); None where a score's input is missing."""
    frames = list(scored_frames(log, boxes=boxes, params=params))
    scores: dict[str, Any] = {
        "detection": detection(log, frames, params) | {"foreground_f": foreground_f(log, frames, params)},
        "full_tracks": {"correct": None, "total": None, "lost": None},
        "wrong_way": {"present": None, "flagged": None, "false": None},
        "absorbed_s": absorption_seconds(log, params),
        "recovery_s": recovery_seconds(log, params),
    }
    if log.has_boxes:
        pairs = [on_riders(frame, log, params) for frame in frames]
        life = {vehicle: at for vehicle, at in lives(frames).items() if len(at) >= _least(log, params)}
        correct = full_tracks(life, pairs, params)
        lost = len(lost_riders(life, pairs, params) - correct.keys())
        scores["full_tracks"] = {"correct": len(correct), "total": len(life), "lost": lost}
        scores["wrong_way"] = wrong_way(log, frames, pairs, set(life))
    return scores


def detection(log: EpisodeLog, frames: Sequence[ScoredFrame], params: ScoringParams) -> dict[str, Any]:
    """Count detections; precision and recall are None where there is nothing to divide by."""
    names = ("precision", "recall", "riders", "correct", "false", "missed")
    if log.shown.detections is None:
        return dict.fromkeys(names)
    hits = claimed = wanted = 0
    for frame in frames:
        selection = frame.selection
        scored, ignored = selection.boxes[selection.scored], selection.boxes[selection.ignored]
        found = clip(log.shown.detections[frame.index], log.width, log.height)
        found = found[kept_tracks(found, scored, ignored, params, match=params.detection_iou)]
        hits += len(matches(scored, found, params.detection_iou)[0])
        claimed += len(found)
        wanted += len(scored)
    precision, recall = (hits / count if count else None for count in (claimed, wanted))
    return dict(zip(names, (precision, recall, wanted, hits, claimed - hits, wanted - hits), strict=True))


def matches(scored: Floats, found: Floats, threshold: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Match boxes one to one, for the greatest sum of IoU, none below ``threshold``: rows and columns."""
    overlap = iou(scored, found)
    worth = np.where(overlap >= threshold, overlap, 0.0)
    rows, columns = linear_sum_assignment(worth, maximize=True)
    good = worth[rows, columns] > 0
    return rows[good], columns[good]


def on_riders(frame: ScoredFrame, log: EpisodeLog, params: ScoringParams) -> list[Pair]:
    """Pair a frame's scored riders with the confirmed tracks on them."""
    ids, found = confirmed(frame.tracks, log.width, log.height)
    chosen = np.flatnonzero(frame.selection.scored)
    rows, columns = matches(frame.selection.boxes[chosen], found, params.detection_iou)
    return list(zip(frame.truth.ids[chosen[rows]].tolist(), ids[columns].tolist(), strict=True))


def lives(frames: Sequence[ScoredFrame]) -> dict[int, list[int]]:
    """Give the frames, counted from the first of ``frames``, in which each rider is scored."""
    at: dict[int, list[int]] = defaultdict(list)
    for k, frame in enumerate(frames):
        for vehicle in frame.truth.ids[frame.selection.scored].tolist():
            at[vehicle].append(k)
    return at


def full_tracks(
    life: dict[int, list[int]], pairs: Sequence[Sequence[Pair]], params: ScoringParams
) -> dict[int, int]:
    """Find the riders that one id follows all the way (scoring.md 14).

    Args:
        life: The frames in which each rider is scored, ascending.
        pairs: Of each frame, riders and tracks on them.
        params: Share, longest gap and stray frames allowed.

    Returns:
        The id on each such rider.
    """
    on: dict[int, dict[int, set[int]]] = defaultdict(lambda: defaultdict(set))
    riders_of: dict[int, Counter[int]] = defaultdict(Counter)
    for k, frame in enumerate(pairs):
        for rider, track in frame:
            on[rider][track].add(k)
            riders_of[track][rider] += 1
    found = {}
    for rider, at in life.items():
        for track, frames in on[rider].items():
            strays = max((n for other, n in riders_of[track].items() if other != rider), default=0)
            held = [k in frames for k in at]
            if (
                sum(held) >= params.full_share * len(at)
                and longest_gap(held) <= params.full_gap
                and strays <= params.full_gap
            ):
                found[rider] = track
    return found


def lost_riders(
    life: dict[int, list[int]], pairs: Sequence[Sequence[Pair]], params: ScoringParams
) -> set[int]:
    """Find the riders on whom no single id lies for `ScoringParams.lost_share` of their scored frames."""
    frames = Counter(pair for frame in pairs for pair in frame)
    most: dict[int, int] = defaultdict(int)
    for (rider, _), count in frames.items():
        most[rider] = max(most[rider], count)
    return {rider for rider, at in life.items() if most[rider] < params.lost_share * len(at)}


def longest_gap(held: Sequence[bool]) -> int:
    """Count the longest run of False."""
    longest = run = 0
    for here in held:
        run = 0 if here else run + 1
        longest = max(longest, run)
    return longest


def wrong_way(
    log: EpisodeLog, frames: Sequence[ScoredFrame], pairs: Sequence[Sequence[Pair]], counted: set[int]
) -> dict[str, int | None]:
    """Count riders who come the wrong way, those of them that were flagged, and tracks flagged wrongly.

    A flagged track is the rider's that it lies on in most of its frames; one that lies on none is flagged
    wrongly.

    Args:
        log: Of the episode.
        frames: Those that count.
        pairs: Of each of them, riders and tracks on them.
        counted: Riders scored for long enough.
    """
    strays = {
        vehicle
        for frame in frames
        for vehicle in frame.truth.ids[frame.truth.roles == Role.WRONG_WAY].tolist()
    }
    present = len(strays & counted)
    if log.shown.flags is None:
        return {"present": present, "flagged": None, "false": None}
    flagged = {int(track) for frame in frames for track in log.shown.flags[frame.index]}
    owners: dict[int, Counter[int]] = defaultdict(Counter)
    for frame_pairs in pairs:
        for rider, track in frame_pairs:
            owners[track][rider] += 1
    owner = {
        track: max(owners[track], key=lambda r: (owners[track][r], -r)) for track in flagged & owners.keys()
    }
    return {
        "present": present,
        "flagged": len({owner[track] for track in owner if owner[track] in strays & counted}),
        "false": sum(track not in owner or owner[track] not in strays for track in flagged),
    }


def _least(log: EpisodeLog, params: ScoringParams) -> float:
    """Frames that a rider must be scored for."""
    return params.min_rider_seconds * log.rate
