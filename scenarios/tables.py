"""Tables for people, on stdout."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from scenarios.doctor import Check


def print_names(scenarios: Mapping[str, str], trackers: Iterable[str]) -> None:
    """Print the scenarios with what they are about, and the trackers."""
    table = Table("scenario", "what it is about", box=None, pad_edge=False)
    for name, description in scenarios.items():
        table.add_row(name, description)
    console = _console()
    console.print(table)
    console.print()
    table = Table("tracker", box=None, pad_edge=False)
    for name in trackers:
        table.add_row(name)
    console.print(table)


def print_scores(document: Mapping[str, Any]) -> None:
    """Print what `scenarios.runs.execute` returns: a column for each tracker, then their differences."""
    runs: Sequence[Mapping[str, Any]] = document.get("runs", [document])
    first = runs[0]
    seeds = first["seeds"]
    which = f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"
    title = f"{first['scenario']}, {which}, {first['frames']} frames"
    table = Table("", *(run["tracker"] for run in runs), title=title, title_justify="left")
    for section in ("scores", "difficulty", "timing_ms"):
        _add_section(table, section, [_flat(run[section]) for run in runs])
    table.add_row("fps", *(_text(run["fps"]) for run in runs))
    table.add_row("peak_rss_mb", *(_text(run["peak_rss_mb"]) for run in runs))
    _console().print(table)
    if document.get("paired"):
        _print_paired(document["paired"])


def print_recording(document: Mapping[str, Any]) -> None:
    """Print what `scenarios.recording.follow` returns."""
    table = Table("", document["method"], title=document["video"], title_justify="left")
    for key, value in _flat(
        {k: v for k, v in document.items() if k not in ("video", "method", "hashes")}
    ).items():
        table.add_row(key, _text(value))
    _console().print(table)


def print_checks(checks: Iterable[Check]) -> None:
    """Print what the doctor found, and beneath each fault the command that mends it."""
    console = _console()
    for check in checks:
        sign = "[green]ok [/]" if check.ok else "[red]not[/]"
        console.print(f"{sign} {check.name}:", check.detail, highlight=False, soft_wrap=True)
        if check.remedy:
            console.print("    ", check.remedy, highlight=False, markup=False, soft_wrap=True)


def _print_paired(paired: Sequence[Mapping[str, Any]]) -> None:
    table = Table(
        "difference",
        "score",
        "mean and 95 %",
        "n",
        title="paired: same frames, same seeds",
        title_justify="left",
    )
    for pair in paired:
        what = " - ".join(str(pair[side]) for side in ("tracker", "against"))
        for score, difference in _flat(pair["difference"]).items():
            table.add_row(what, score, _text(difference), str(difference["n"]))
    _console().print(table)


def _add_section(table: Table, name: str, columns: Sequence[Mapping[str, Any]]) -> None:
    keys = list(dict.fromkeys(key for column in columns for key in column))
    for key in keys:
        table.add_row(key if name == "scores" else f"{name}.{key}", *(_text(c.get(key)) for c in columns))
    table.add_section()


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Join nested keys by dots; a number over seeds stays one value."""
    flat: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, Mapping) and "ci95" not in value:
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def _text(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, Mapping):
        if value["mean"] is None:
            return "-"
        interval = value["ci95"]
        return _text(value["mean"]) + (
            "" if interval is None else f" [{_text(interval[0])}, {_text(interval[1])}]"
        )
    if isinstance(value, float):
        return f"{value:.3f}" if abs(value) < 10 else f"{value:.1f}"
    return str(value)


def _console() -> Console:
    return Console(highlight=False)
