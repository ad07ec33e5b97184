"""What scoring depends on: every threshold by its name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Boxes = Literal["amodal", "visible"]
"""Which truth is scored: the whole object, clipped to the frame, or what can be seen of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoringParams:
    """The thresholds of the scores, with their documented defaults.

    Attributes:
        max_distance: Metres along the axis to a vehicle's nearest point: beyond, it is not scored.
        min_visible: Least share of a vehicle that can be seen.
        min_height: Least height of its scored box, px.
        match_iou: Least IoU of a track's box with a vehicle that it is on: in CLEAR, identity and ignoring.
        ignore_iou: Unmatched boxes with this IoU with an ignored vehicle are dropped.
        ignore_cover: As are those of which ignored vehicles together cover this share.
        min_trace_seconds: Shorter traces are not scored.
        majority: Least share of a trace's support points that lie on what it belongs to.
        min_vehicle_seconds: Vehicles scored for less do not count in the coverage.
        min_ego_metres: Under ``moving`` stand only traces during which the camera car went as far.
        training_frames: First frames of a lane, which are not scored.
        min_rider_height: `min_height` of riders, px.
        standing_seconds: A rider that has stood still for so long is ignored until it moves.
        detection_iou: Least IoU of a detection, or of a track, with a rider that it is on.
        min_rider_seconds: Riders scored for less do not count in the full tracks.
        full_share: Least share of a rider's scored frames in which a full track is on it.
        full_gap: Most frames in a row that it may miss, and that its id may be on other riders.
        lost_share: A rider on whom no one id is for this share of its scored frames is lost.
        absorbed_share: A rider that stands is absorbed once no more of it is in the mask.
        flash_change: Least change of the light from one frame to the next, as a part of it, that is sudden.
        min_hidden_frames: Least frames for which a vehicle below the platform is hidden in an event ...
        min_scored_frames: ... and for which it is scored before it, and after.
        recovered_share: A mask has recovered once no more of the background is in it ...
        recovered_seconds: ... for so long.
    """

    max_distance: float = 60.0
    min_visible: float = 0.3
    min_height: float = 12.0
    match_iou: float = 0.5
    ignore_iou: float = 0.5
    ignore_cover: float = 0.5
    min_trace_seconds: float = 1.0
    majority: float = 0.6
    min_vehicle_seconds: float = 2.0
    min_ego_metres: float = 10.0
    training_frames: int = 30
    min_rider_height: float = 14.0
    standing_seconds: float = 3.0
    detection_iou: float = 0.4
    min_rider_seconds: float = 1.0
    full_share: float = 0.95
    full_gap: int = 3
    lost_share: float = 0.2
    absorbed_share: float = 0.2
    flash_change: float = 0.1
    min_hidden_frames: int = 15
    min_scored_frames: int = 30
    recovered_share: float = 0.05
    recovered_seconds: float = 0.5
