"""Whether a tracker's covariances tell how far off it is (Bar-Shalom, Li, Kirubarajan 2001, 5.4)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog
from scenarios.score.frames import scored_frames
from scenarios.score.lane import matches
from scenarios.score.params import Boxes, ScoringParams
from tracker.types import Status

Floats = NDArray[np.float64]

WITHIN = 5.991
"""What 95 % of the squared errors stay below, of two dimensions, where the covariances are right."""


def consistency(log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams) -> dict[str, Any] | None:
    """Compare how far tracks are off with their covariances.

    Args:
        log: The episode.
        boxes: Which boxes are scored; it decides with which vehicle a track is compared, not where that is.
        params: Thresholds.

    Returns:
        ``nees``: the mean normalised estimation error squared of the position, 2 where the covariances are
        right, more where the tracker is too sure of itself; ``within_95``: the share of the errors in the
        covariances' 95 % regions; ``errors``: how many there are. The same of the innovations that it
        shows: ``nis``, ``nis_within_95``, ``innovations``. None where there is nothing of either.
    """
    frames = errors(log, boxes=boxes, params=params)
    squared = {
        ("nees", "within_95", "errors"): np.concatenate([np.zeros(0), *frames]),
        ("nis", "nis_within_95", "innovations"): np.concatenate(
            [np.zeros(0), *(log.shown.innovations or ())]
        ),
    }
    found: dict[str, Any] = {}
    for (mean, within, count), values in squared.items():
        if len(values):
            found |= {
                mean: float(values.mean()),
                within: float((values <= WITHIN).mean()),
                count: len(values),
            }
    return found or None


def errors(log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams) -> list[Floats]:
    """Return each frame's normalised squared errors of the confirmed tracks that are on a scored vehicle.

    A vehicle that the frame cuts off is left out: what a tracker takes for its middle is not the truth's.
    """
    found = []
    for frame in scored_frames(log, boxes=boxes, params=params):
        tracks, truth, selection = frame.tracks, frame.truth, frame.selection
        if tracks.state is None or tracks.covariance is None:
            continue
        scored = np.flatnonzero(selection.scored & (truth.in_frame == 1.0))
        chosen = np.flatnonzero(tracks.status == Status.CONFIRMED)
        rows, columns = matches(selection.boxes[scored], tracks.boxes[chosen], params.match_iou)
        box = truth.box_amodal[scored[rows]]
        middle = (box[:, :2] + box[:, 2:]) / 2
        at = chosen[columns]
        found.append(normalised(tracks.state[at, :2] - middle, tracks.covariance[at, :2, :2]))
    return found


def normalised(error: Floats, covariance: Floats) -> Floats:
    """Return the squared errors in units of the covariance: (N, D) and (N, D, D) give (N,)."""
    return np.asarray((error * np.linalg.solve(covariance, error[..., None])[..., 0]).sum(axis=1))
