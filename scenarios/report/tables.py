"""Scores and parameters as rows of tables: the words, the digits, and why a number is missing."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

MEANINGS = {
    "hota": "detection and association together, over all overlaps",
    "deta": "detection accuracy of HOTA",
    "assa": "association accuracy of HOTA",
    "mota": "1 − (misses + false boxes + switches) / objects; below 0 where errors outnumber objects",
    "idf1": "frames in which the right identity is on the object",
    "id_switches": "an object's track is another than before",
    "precision": "boxes that are on a scored object",
    "recall": "scored objects with a box on them",
    "car_recall": "car traces finally labelled car",
    "background_recall": "background traces finally labelled background",
    "accuracy": "scored traces finally labelled right",
    "balanced_accuracy": "mean of the two recalls",
    "median_seconds_to_identify": "from a car trace's first frame until its label stays right",
    "never_identified": "car traces whose label never stayed right",
    "vehicle_coverage": "same-way vehicles, seen for 2 s or more, that carry a trace labelled car",
    "traces_per_10s": "how much was dared",
    "oncoming_as_car": "oncoming traces labelled car",
    "foreground_f": "foreground masks against the riders' pixels, shadows apart",
    "riders": "riders to be detected, in all frames together",
    "correct": "found, or followed by one id all the way",
    "missed": "riders without a detection",
    "total": "riders scored for 1 s or more",
    "lost": "riders on whom no one id is for a fifth of their frames",
    "present": "riders who come the wrong way",
    "flagged": "of them, flagged",
    "false": "detections on no rider; tracks flagged that are on no such rider",
    "absorbed_s": "from a rider's standstill until it has left the mask",
    "recovery_s": "from a sudden change of light until the mask is calm again",
    "reacquisition_correct": "vehicles that vanished and came back under their old id",
    "reacquisition_wrong": "that came back under another vehicle's",
    "reacquisition_missed": "that came back under a new one, or under none",
    "moving": "traces during which the camera car went 10 m or more",
}
"""What each score says, in a line."""

TILES = (
    "hota",
    "idf1",
    "mota",
    "detection_precision",
    "detection_recall",
    "detection_foreground_f",
    "reacquisition_correct",
    "reacquisition_wrong",
    "reacquisition_missed",
    "car_recall",
    "background_recall",
    "median_seconds_to_identify",
    "balanced_accuracy",
    "vehicle_coverage",
    "never_identified",
)
TILE_COUNT = 6
"""The page begins with the first so many of these scores that a tracker can have."""

BOX_SCORES = ("hota", "deta", "assa", "mota", "idf1", "id_switches", "precision", "recall")
LANE_SCORES = (
    *("detection_precision", "detection_recall", "detection_foreground_f"),
    *("foreground_f", "riders", "correct", "missed", "total", "lost", "present", "flagged", "false"),
    *("absorbed_s", "recovery_s"),
)
PLAIN_TILES = (*LANE_SCORES, "reacquisition_correct", "reacquisition_wrong", "reacquisition_missed")
"""Tiles that need neither traces nor a share of 1."""
AERIAL_SCORES = (
    *("reacquisition", "reacquisition_by_hidden_s", "predicted_events", "prediction_inside"),
    *("prediction_error_px", "prediction_variance_px2", "prediction_error_at_px"),
    *("linear_prediction_error_px", "kalman_prediction_error_px"),
)
"""Groups of scores that stand in tables of their own."""
_TRACES = ("car_recall", "background_recall", "accuracy", "balanced_accuracy", "vehicle_coverage")
_DETECTION = ("foreground_f", "detection_precision", "detection_recall", "detection_foreground_f")
FRACTIONS = frozenset((*BOX_SCORES, *_TRACES, *_DETECTION)) - {"id_switches"}
"""The scores that a bar is drawn for."""

DASH = "–"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A line of a table.

    Attributes:
        name: In words.
        text: The value as printed.
        exact: The value in full, for whoever points at it.
        note: What it means or, where it is missing, why.
        missing: Whether it is null.
        share: The value as a share of 1 to draw a bar with, or None.
    """

    name: str
    text: str
    exact: str = ""
    note: str = ""
    missing: bool = False
    share: float | None = None


def number(value: object) -> str:
    """Print a value: a count as it is, another number to 3 decimals (1 from 10 on), null as a dash."""
    if value is None:
        return DASH
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value}"
    if isinstance(value, float):
        if not isfinite(value):
            return DASH
        return (f"{value:.3f}" if abs(value) < 10 else f"{value:.1f}").replace("-", "−")
    if isinstance(value, Mapping):
        return number(value["mean"])
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(number(item) for item in value) or DASH
    return str(value)


def words(name: str) -> str:
    """Turn a key into words: the measures' own names in capitals, others spaced."""
    if name in ("hota", "mota", "motp"):
        return name.upper()
    special = {
        "detection_foreground_f": "foreground F",
        "foreground_f": "foreground F",
        "deta": "DetA",
        "assa": "AssA",
        "idf1": "IDF1",
        "id_switches": "ID switches",
    }
    if name.endswith("_s"):
        return f"{words(name[:-2])}, s"
    return special.get(name) or name.replace("_", " ").replace("-", " ")


def is_group(value: object) -> bool:
    """Tell several scores under one name from a score, which over several seeds is a mapping too."""
    return isinstance(value, Mapping) and "ci95" not in value


def flat(values: Mapping[str, Any], prefix: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the leaves of nested mappings with the keys that lead there."""
    for key, value in values.items():
        if is_group(value):
            yield from flat(value, (*prefix, str(key)))
        else:
            yield (*prefix, str(key)), value


def score_row(name: str, value: object, *, has_boxes: bool, has_traces: bool) -> Row:
    """Return the row of a score."""
    missing = number(value) == DASH
    share = float(value) if name in FRACTIONS and isinstance(value, (int, float)) and not missing else None
    return Row(
        name=words(name),
        text=number(value),
        exact="" if missing else repr(value),
        note=_why_null(name, has_boxes=has_boxes, has_traces=has_traces)
        if missing
        else MEANINGS.get(name, ""),
        missing=missing,
        share=None if share is None else min(max(share, 0.0), 1.0),
    )


def _why_null(name: str, *, has_boxes: bool, has_traces: bool) -> str:
    if name in BOX_SCORES:
        return "nothing to score" if has_boxes else "this tracker gives no boxes"
    if name in LANE_SCORES:
        return "nothing to score, or this tracker does not show what it takes"
    if not has_traces:
        return "this tracker shows no traces"
    if name == "median_seconds_to_identify":
        return "half of the car traces or more were never identified, or there were none"
    return "nothing to score"


def plain_rows(values: Mapping[str, Any]) -> list[Row]:
    """Return the leaves of nested mappings as rows."""
    return [
        Row(name=" · ".join(words(key) for key in keys), text=number(value), missing=value is None)
        for keys, value in flat(values)
    ]


def parameter_rows(values: Mapping[str, Any], notes: Mapping[str, str] | None = None) -> list[Row]:
    """Return parameters as rows: what was set is printed in full.

    Args:
        values: By name.
        notes: What they mean, by name.
    """
    return [
        Row(
            name=words(name),
            text=f"{value:g}" if isinstance(value, float) else number(value),
            note=(notes or {}).get(name, ""),
        )
        for name, value in values.items()
    ]


def attribute_notes(documented: type) -> dict[str, str]:
    """Return what a class says of its attributes, by their names: the lines of its docstring."""
    return dict(re.findall(r"^ +(\w+): (.+)$", documented.__doc__ or "", re.MULTILINE))
