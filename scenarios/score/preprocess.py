"""Which objects and which tracks are scored (scoring.md 1, 4, 5, 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scenarios.score.params import Boxes, ScoringParams
from sim.truth.types import FrameTruth
from sim.world import Role
from tracker.boxes import box_area, intersection, iou
from tracker.types import Status, Tracks

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """What becomes of the N vehicles of a frame.

    A vehicle is scored, or ignored (a box on it is neither right nor wrong), or background (a box on it is
    false): a parked one, and one without a box in the frame.

    Attributes:
        boxes: (N, 4) in the frame, not a number where there is none.
        scored: (N,).
        ignored: (N,).
    """

    boxes: Floats
    scored: Mask
    ignored: Mask


def select(
    truth: FrameTruth, *, width: int, height: int, boxes: Boxes = "amodal", params: ScoringParams
) -> Selection:
    """Decide which vehicles of an in-car frame are scored, and by which boxes."""
    clipped, present = _in_frame(truth, width, height, boxes)
    scored = (
        present
        & (truth.roles == Role.SAME_WAY)
        & (truth.distances <= params.max_distance)
        & (truth.visible >= params.min_visible)
        & (clipped[:, 3] - clipped[:, 1] >= params.min_height)
    )
    return Selection(boxes=clipped, scored=scored, ignored=present & ~scored & (truth.roles != Role.PARKED))


def select_from_above(
    truth: FrameTruth, *, width: int, height: int, boxes: Boxes = "amodal", params: ScoringParams
) -> Selection:
    """Decide which vehicles of a frame from the air are scored, and by which boxes."""
    clipped, present = _in_frame(truth, width, height, boxes)
    scored = present & (truth.visible >= params.min_visible)
    return Selection(boxes=clipped, scored=scored, ignored=present & ~scored)


def select_riders(
    truth: FrameTruth,
    standing: Floats,
    *,
    width: int,
    height: int,
    boxes: Boxes = "amodal",
    params: ScoringParams,
) -> Selection:
    """Decide which riders of a frame of the lane are scored, and by which boxes.

    Args:
        truth: Of the frame.
        standing: (N,) seconds that each rider has stood; after a while it is ignored (scoring.md 15).
        width: Of the frame, px.
        height: Of the frame, px.
        boxes: Which boxes are scored.
        params: Thresholds.
    """
    clipped, present = _in_frame(truth, width, height, boxes)
    scored = (
        present
        & (truth.visible >= params.min_visible)
        & (clipped[:, 3] - clipped[:, 1] >= params.min_rider_height)
        & (standing < params.standing_seconds)
    )
    return Selection(boxes=clipped, scored=scored, ignored=present & ~scored)


def _in_frame(truth: FrameTruth, width: int, height: int, boxes: Boxes) -> tuple[Floats, Mask]:
    """Return (N, 4) the boxes in the frame, not a number where there is none, and (N,) whether there is."""
    clipped = clip(truth.box_amodal if boxes == "amodal" else truth.box_visible, width, height)
    present = box_area(clipped) > 0
    return np.where(present[:, None], clipped, np.nan), present


def clip(boxes: Floats, width: int, height: int) -> Floats:
    """Cut boxes (N, 4) off at the frame's border; not a number stays what it is."""
    return np.clip(boxes, 0.0, np.array([width, height, width, height], float))


def kept_tracks(
    boxes: Floats,
    scored: Floats,
    ignored: Floats,
    params: ScoringParams,
    *,
    match: float | None = None,
) -> Mask:
    """Tell which of a frame's P track boxes are scored: all but the unmatched ones on ignored vehicles.

    Args:
        boxes: (P, 4) of the tracks.
        scored: (G, 4) of scored vehicles.
        ignored: (I, 4) of ignored vehicles.
        params: Thresholds.
        match: Least IoU of a match, if another than `ScoringParams.match_iou`.

    Returns:
        (P,) bool.
    """
    keep = np.ones(len(boxes), bool)
    if not len(ignored) or not len(boxes):
        return keep
    overlap = iou(scored, boxes)
    worth = np.where(overlap >= (params.match_iou if match is None else match), overlap, 0.0)
    rows, columns = linear_sum_assignment(worth, maximize=True)
    matched = np.zeros(len(boxes), bool)
    matched[columns[worth[rows, columns] > 0]] = True
    for k in np.flatnonzero(~matched):
        on_one = iou(boxes[k], ignored).max() >= params.ignore_iou
        area = float(box_area(boxes[k]))
        keep[k] = not (on_one or (area > 0 and covered_area(boxes[k], ignored) >= params.ignore_cover * area))
    return keep


def covered_area(box: Floats, others: Floats) -> float:
    """Give the area of ``box`` (4,) that ``others`` (N, 4) cover together, px^2, counting nothing twice."""
    inner = np.concatenate([np.maximum(others[:, :2], box[:2]), np.minimum(others[:, 2:], box[2:])], axis=1)
    inner = inner[(intersection(box, others)[0] > 0)]
    if not len(inner):
        return 0.0
    # Between neighbouring edges every cell is wholly inside or wholly outside each box.
    x, y = np.unique(inner[:, [0, 2]]), np.unique(inner[:, [1, 3]])
    in_x = (inner[:, None, 0] <= x[None, :-1]) & (x[None, 1:] <= inner[:, None, 2])
    in_y = (inner[:, None, 1] <= y[None, :-1]) & (y[None, 1:] <= inner[:, None, 3])
    covered = (in_y[:, :, None] & in_x[:, None, :]).any(axis=0)
    return float(np.diff(y) @ covered @ np.diff(x))


def confirmed(tracks: Tracks, width: int, height: int) -> tuple[NDArray[np.int64], Floats]:
    """Give ids (P,) and boxes (P, 4), cut off at the frame's border, of the confirmed tracks."""
    chosen = tracks.status == Status.CONFIRMED
    return tracks.ids[chosen], clip(tracks.boxes[chosen], width, height)
