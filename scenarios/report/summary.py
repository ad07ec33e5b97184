"""One HTML page about several runs: trackers beside each other, over seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any
from urllib.parse import quote

from markupsafe import Markup

from scenarios.files import moved_in
from scenarios.report import hidden, plots
from scenarios.report.closer import closer_look
from scenarios.report.page import confusion, environment
from scenarios.report.palette import SERIES
from scenarios.report.results import aerial_tables, lane_tables
from scenarios.report.tables import (
    AERIAL_SCORES,
    DASH,
    FRACTIONS,
    MEANINGS,
    flat,
    number,
    words,
)

_LOWER = ("id_switches", "median_seconds_to_identify", "never_identified", "oncoming_as_car", "wrong")
"""Scores of which less is better, beside the prediction errors."""


@dataclass(frozen=True, slots=True)
class _Cell:
    """A number of a table, its interval, and whether it is the better or the worse for it."""

    text: str
    interval: str = ""
    tone: str = ""


@dataclass(frozen=True, slots=True)
class _Line:
    """A row of a table: one score."""

    name: str
    note: str
    cells: list[_Cell]


def write_summary(
    directory: Path,
    document: Mapping[str, Any],
    reports: Mapping[str, Mapping[int, Path]],
    *,
    description: str = "",
) -> Path:
    """Write ``summary.html``.

    Args:
        directory: Where to write.
        document: What ``--json`` prints: one run, or ``runs`` and ``paired``.
        reports: The reports within ``directory``, by tracker and seed; they are linked relatively.
        description: Of the scenario.

    Returns:
        The path of the page.
    """
    runs: Sequence[Mapping[str, Any]] = document.get("runs") or [document]
    scores = [dict(flat(run["scores"])) for run in runs]
    trackers = [str(run["tracker"]) for run in runs]
    seeds = list(dict.fromkeys(seed for run in runs for seed in run["seeds"]))
    html = (
        environment()
        .get_template("summary.html.j2")
        .render(
            title=str(runs[0]["scenario"]),
            description=description,
            chips=[
                ("seeds", f"{seeds[0]} to {seeds[-1]}" if len(seeds) > 1 else str(seeds[0])),
                ("trackers", str(len(runs))),
                ("frames", str(runs[0]["frames"])),
            ],
            trackers=list(zip(trackers, (SERIES * len(trackers))[: len(trackers)], strict=True)),
            chart=_chart(trackers, scores),
            lane_tables=lane_tables([(str(run["tracker"]), run["scores"]) for run in runs]),
            aerial_tables=aerial_tables([(str(run["tracker"]), run["scores"]) for run in runs]),
            by_hidden_time=hidden.by_hidden_time(
                {
                    name: run["scores"]["reacquisition_by_hidden_s"]
                    for name, run in zip(trackers, runs, strict=True)
                    if "reacquisition_by_hidden_s" in run["scores"]
                }
            ),
            closer=closer_look([(str(run["tracker"]), run.get("details")) for run in runs]),
            lines=_lines(scores, len(seeds)),
            paired=[
                {
                    "title": f"{pair['tracker']} less {pair['against']}",
                    "lines": _differences(pair["difference"], len(seeds)),
                }
                for pair in document.get("paired") or ()
            ],
            confusions=[
                {"title": name, "matrix": matrix}
                for name, run in zip(trackers, runs, strict=True)
                if (matrix := confusion(run["scores"])) is not None
            ],
            difficulty=[
                _Line(" · ".join(words(key) for key in keys), "", [_cell(value, len(seeds))])
                for keys, value in flat(runs[0].get("difficulty") or {})
            ],
            seeds=[
                (seed, [_link(directory, reports.get(name, {}).get(seed)) for name in trackers])
                for seed in seeds
            ],
            version=metadata.version("testtrack"),
        )
    )
    path = directory / "summary.html"
    with moved_in(path) as part:
        part.write_text(html, encoding="utf-8")
    return path


def _link(directory: Path, report: Path | None) -> str:
    return "" if report is None else quote(report.relative_to(directory).as_posix())


def _lines(scores: Sequence[Mapping[tuple[str, ...], Any]], seeds: int) -> list[_Line]:
    keys = [
        key
        for key in dict.fromkeys(key for run in scores for key in run)
        if "confusion" not in key and key[0] not in AERIAL_SCORES
    ]
    return [
        _Line(_name(key), MEANINGS.get(key[-1], ""), [_cell(run.get(key), seeds) for run in scores])
        for key in keys
    ]


def _differences(difference: Mapping[str, Any], seeds: int) -> list[_Line]:
    """Return the rows of a comparison; where the interval leaves out 0, the sign stands out."""
    lines = []
    for key, value in flat(difference):
        cell = _cell(value, seeds)
        bounds = value["ci95"]
        if bounds is not None and (bounds[0] > 0 or bounds[1] < 0):
            good = (bounds[0] > 0) != _lower_is_better(key)
            cell = _Cell(cell.text, cell.interval, "" if _neutral(key) else "better" if good else "worse")
        sign = "+" if value["mean"] > 0 else ""
        lines.append(_Line(_name(key), "", [_Cell(sign + cell.text, cell.interval, cell.tone)]))
    return lines


def _lower_is_better(key: tuple[str, ...]) -> bool:
    return "prediction" in key[0] or key[-1] in _LOWER


def _neutral(key: tuple[str, ...]) -> bool:
    """Say whether more is neither better nor worse."""
    return key[0] in ("predicted_events", "prediction_inside") or "traces_per_10s" in key


def _name(key: tuple[str, ...]) -> str:
    """Return a score's name, without that of the group which holds most of them."""
    return " · ".join(words(part) for part in key if part != "identification")


def _cell(value: Any, seeds: int) -> _Cell:
    if isinstance(value, Mapping):
        bounds = value["ci95"]
        parts = [f"{number(bounds[0])} to {number(bounds[1])}"] if bounds else []
        if value["n"] < seeds or not bounds:
            parts.append(f"n = {value['n']}")
        return _Cell(number(value["mean"]), ", ".join(parts))
    return _Cell(number(value))


def _chart(trackers: Sequence[str], scores: Sequence[Mapping[tuple[str, ...], Any]]) -> Markup | None:
    """Draw the scores that are fractions: a dot and an interval for each tracker."""
    names = [
        key
        for key in dict.fromkeys(key for run in scores for key in run)
        if key[-1] in FRACTIONS and "moving" not in key
    ]
    rows: dict[str, list[plots.Estimate | None]] = {}
    for key in names:
        found = [_estimate(run.get(key)) for run in scores]
        if any(item is not None for item in found):
            rows[_name(key)] = found
    return plots.estimates(rows, trackers) if rows else None


def _estimate(value: Any) -> plots.Estimate | None:
    if number(value) == DASH:
        return None
    if isinstance(value, Mapping):
        low, high = value["ci95"] or (value["mean"], value["mean"])
        return float(value["mean"]), float(low), float(high)
    return float(value), float(value), float(value)
