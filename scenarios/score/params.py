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
