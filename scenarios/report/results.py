"""Tables with a row for each tracker, as the papers print their results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scenarios.report.tables import DASH, number


@dataclass(frozen=True, slots=True)
class ResultTable:
    """A table with a row for each tracker, as the papers print their results."""

    title: str
    note: str
    columns: tuple[str, ...]
    rows: list[tuple[str, list[str]]]


def lane_tables(runs: Sequence[tuple[str, Mapping[str, Any]]]) -> list[ResultTable]:
    """Return detections and full tracks as in the paper's tables II and III.

    Args:
        runs: Name and scores of each tracker; no tables come of scores that are no lane's.
    """
    if not runs or not all("full_tracks" in scores for _, scores in runs):
        return []
    detections = [(name, scores["detection"]) for name, scores in runs]
    followed = [(name, scores["full_tracks"]) for name, scores in runs]
    return [
        ResultTable(
            "Detections",
            "Riders and detections of all scored frames, matched one to one.",
            ("true riders", "correctly detected", "false", "missed", "precision", "recall"),
            [
                (name, [number(d.get(key)) for key in ("riders", "correct", "false", "missed")] + shares(d))
                for name, d in detections
            ],
        ),
        ResultTable(
            "Full tracks",
            "Full: one id all the way. Lost: no one id for a fifth of the way. Partial: between the two.",
            ("riders", "full", "partial", "lost", "share full"),
            [(name, _followed(t)) for name, t in followed],
        ),
    ]


_PREDICTED = {
    "": "prediction_error_px",
    ", variance": "prediction_variance_px2",
    ", a line": "linear_prediction_error_px",
    ", Kalman": "kalman_prediction_error_px",
    ", events": "predicted_events",
}


def aerial_tables(runs: Sequence[tuple[str, Mapping[str, Any]]]) -> list[ResultTable]:
    """Return re-acquisitions, and prediction errors as paper 2 defines them.

    Args:
        runs: Name and scores of each tracker; no tables come of scores that are no aerial scene's.
    """
    if not runs or not all("reacquisition" in scores for _, scores in runs):
        return []
    leads = tuple(runs[0][1]["prediction_error_px"])
    times = tuple(runs[0][1]["prediction_error_at_px"])
    return [
        ResultTable(
            "Re-acquisition",
            "Vehicles that vanish and come back. Correct: under the old id. Wrong: under another vehicle's."
            " By seconds hidden: correct ones of how many.",
            ("events", "correct", "wrong", "missed", *(f"≥ {s} s" for s in times)),
            [(name, _reacquired(scores)) for name, scores in runs],
        ),
        ResultTable(
            "Prediction errors",
            "Mean distance, px, of the first n predictions of a hidden vehicle from the truth; its variance"
            " within an event. A line and a Kalman filter go on from the same tracker's last points.",
            tuple(f"n = {n}" for n in leads),
            [
                (f"{name}{words}", [number(scores[key].get(n)) for n in leads])
                for name, scores in runs
                for words, key in _PREDICTED.items()
            ],
        ),
        ResultTable(
            "While hidden",
            "Error, px, after so many seconds, and the share of the truth inside ellipses of 50 and 95 %.",
            (*(f"{s} s" for s in times), "in 50 %", "in 95 %"),
            [
                (
                    name,
                    [number(scores["prediction_error_at_px"].get(s)) for s in times]
                    + [number(scores["prediction_inside"].get(share)) for share in ("50", "95")],
                )
                for name, scores in runs
            ],
        ),
    ]


def _reacquired(scores: Mapping[str, Any]) -> list[str]:
    counts = [number(scores["reacquisition"].get(key)) for key in ("events", "correct", "wrong", "missed")]
    by_time = scores["reacquisition_by_hidden_s"].values()
    return counts + [f"{number(own['correct'])} of {number(own['events'])}" for own in by_time]


def shares(detection: Mapping[str, Any]) -> list[str]:
    """Print precision and recall."""
    return [number(detection.get("precision")), number(detection.get("recall"))]


def _followed(tracks: Mapping[str, Any]) -> list[str]:
    total, full, lost = (tracks.get(key) for key in ("total", "correct", "lost"))
    if total is None or full is None or lost is None:
        return [DASH] * 5
    share = full / total if total else None
    return [number(value) for value in (total, full, total - full - lost, lost, share)]
