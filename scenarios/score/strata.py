"""Scores by how much of a vehicle can be seen, how far it is, and how fast it goes through the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog
from scenarios.score.frames import scored_frames
from scenarios.score.lane import matches
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.preprocess import confirmed
from sim.truth.types import FrameTruth
from tracker.boxes import iou

Floats = NDArray[np.float64]

EDGES = {
    "visible": (0.3, 0.5, 0.7, 0.9, 1.0),
    "distance_m": (0.0, 10.0, 20.0, 40.0, 80.0, 160.0, np.inf),
    "speed_px_s": (0.0, 5.0, 20.0, 80.0, 320.0, np.inf),
}
"""Bounds of the strata; a stratum holds its lower one, the last one its upper one too."""
COLUMNS = ("visible", "distance_m", "speed_px_s", "overlap", "switch")


def strata(log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams) -> dict[str, Any]:
    """Score the boxes of each stratum.

    Args:
        log: The episode.
        boxes: Which boxes are scored.
        params: Thresholds.

    Returns:
        By quantity and stratum: ``boxes`` of the truth, the ``recall`` of them, the mean ``iou`` of those
        that were found, and ``id_switches``: found ones whose vehicle was last found by another track. A
        vehicle's first box has no speed and is left out there, as is a stratum without boxes; of a tracker
        without boxes only the truth's number is known.
    """
    table = scored_boxes(log, boxes=boxes, params=params)
    found: dict[str, Any] = {}
    for quantity, edges in EDGES.items():
        column = table[:, COLUMNS.index(quantity)]
        known = np.isfinite(column)
        number = np.clip(np.searchsorted(edges, column, side="right") - 1, 0, len(edges) - 2)
        found[quantity] = {
            _name(edges[k], edges[k + 1]): _stratum(rows, log)
            for k in range(len(edges) - 1)
            if len(rows := table[known & (number == k)])
        }
    return found


def scored_boxes(log: EpisodeLog, *, boxes: Boxes, params: ScoringParams) -> Floats:
    """Return a row for each scored box, in the order of the frames: see `COLUMNS`.

    ``overlap`` is the IoU with the track on it, 0 where there is none; ``switch`` is 1 or 0.
    """
    last: dict[int, int] = {}
    speeds = apparent_speeds(log.truth, log.rate)
    parts = [np.zeros((0, len(COLUMNS)))]
    for frame in scored_frames(log, boxes=boxes, params=params):
        scored = frame.selection.scored
        ids, claimed = confirmed(frame.tracks, log.width, log.height)
        wanted = frame.selection.boxes[scored]
        overlap, switch = np.zeros(len(wanted)), np.zeros(len(wanted))
        rows, columns = matches(wanted, claimed, params.match_iou)
        overlap[rows] = iou(wanted, claimed)[rows, columns]
        vehicles, tracks = frame.truth.ids[scored][rows].tolist(), ids[columns].tolist()
        for row, vehicle, track in zip(rows, vehicles, tracks, strict=True):
            switch[row] = last.get(vehicle, track) != track
            last[vehicle] = track
        truth = frame.truth
        known = truth.visible, truth.distances, speeds[frame.index]
        parts.append(np.column_stack([*(values[scored] for values in known), overlap, switch]))
    return np.concatenate(parts)


def apparent_speeds(truth: tuple[FrameTruth, ...], rate: float) -> list[Floats]:
    """Return (N,) px/s of the middles of the amodal boxes by frame, not a number in a vehicle's first."""
    before: dict[int, Floats] = {}
    speeds = []
    for frame in truth:
        middles = (frame.box_amodal[:, :2] + frame.box_amodal[:, 2:]) / 2
        here = dict(zip(frame.ids.tolist(), middles, strict=True))
        unknown = np.full(2, np.nan)
        moved = [middle - before.get(vehicle, unknown) for vehicle, middle in here.items()]
        speeds.append(rate * np.hypot(*np.reshape(moved, (-1, 2)).T))
        before = here
    return speeds


def _stratum(rows: Floats, log: EpisodeLog) -> dict[str, Any]:
    if not log.has_boxes:
        return {"boxes": len(rows), "recall": None, "iou": None, "id_switches": None}
    overlap, switch = rows[:, COLUMNS.index("overlap")], rows[:, COLUMNS.index("switch")]
    hit = overlap > 0
    return {
        "boxes": len(rows),
        "recall": float(hit.mean()),
        "iou": float(overlap[hit].mean()) if hit.any() else None,
        "id_switches": int(switch.sum()),
    }


def _name(low: float, high: float) -> str:
    return f"{low:g} and more" if np.isinf(high) else f"{low:g} to {high:g}"
