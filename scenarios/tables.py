"""Tables for people, on stdout."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
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


def print_replay(document: Mapping[str, Any]) -> None:
    """Print what `scenarios.replay.describe` returns: what differs first, after what was changed since."""
    for name, value in document["environment_changed"].items():
        print(f"{name} was {value['then']}, is {value['now']}", file=sys.stderr)
    if document["agree"]:
        print(f"all agree: {document['episodes']} episodes, {document['frames']} frames")
    else:
        print("seed {seed}, frame {frame} diverges first: {stage}".format(**document["diverges"]))


def print_scores(document: Mapping[str, Any]) -> None:
    """Print what `scenarios.runs.execute` returns: a column for each tracker, then their differences."""
    runs: Sequence[Mapping[str, Any]] = document.get("runs", [document])
    first = runs[0]
    seeds = first["seeds"]
    which = f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"
    title = f"{first['scenario']}, {which}, {first['frames']} frames"
    table = _table(title, "", *(run["tracker"] for run in runs))
    for section in ("scores", "difficulty", "timing_ms"):
        table.add_section()
        _add_rows(table, [run[section] for run in runs], prefix="" if section == "scores" else section)
    table.add_section()
    for key in ("fps", "peak_rss_mb", *(("dropped_frames",) if first["realtime"] else ())):
        table.add_row(key, *(_text(run[key]) for run in runs))
    _console().print(table)
    _print_details([run["details"] for run in runs], [run["tracker"] for run in runs])
    for pair in document.get("paired", ()):
        name = f"{pair['tracker']} less {pair['against']}, on the same frames"
        table = _table(name, "", "difference", "n")
        for key, difference in _flat(pair["difference"]).items():
            table.add_row(key, _text(difference), str(difference["n"]))
        if table.row_count:
            _console().print(table)


def _print_details(details: Sequence[Mapping[str, Any]], trackers: Sequence[str]) -> None:
    """Print what a closer look finds: how much is convention, where boxes are found, what covariances say."""
    table = _table("either truth, amodal / visible boxes", "", *trackers)
    for key in details[0]["conventions"]["amodal"]:
        both = ([_text(one["conventions"][which][key]) for which in ("amodal", "visible")] for one in details)
        table.add_row(key, *(" / ".join(pair) for pair in both))
    _console().print(table)
    table = _table("recall by stratum", "", "boxes", *trackers)
    for quantity, strata in details[0]["strata"].items():
        table.add_section()
        table.add_row(f"[bold]{quantity}[/]")
        for name, first in strata.items():
            recalls = (_text(one["strata"][quantity][name]["recall"]) for one in details)
            table.add_row(f"  {name}", str(first["boxes"]), *recalls)
    _console().print(table)
    if any(one["consistency"] for one in details):
        table = _table("covariances of the position", "", *trackers)
        _add_rows(table, [one["consistency"] or {} for one in details], prefix="")
        _console().print(table)


def print_recording(document: Mapping[str, Any]) -> None:
    """Print what `scenarios.recording.follow` returns."""
    table = _table(document["video"], "", document["method"])
    shown = {key: value for key, value in document.items() if key not in ("video", "method", "hashes")}
    for key, value in _flat(shown).items():
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


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    for k, column in enumerate(columns):
        table.add_column(column, no_wrap=k == 0, overflow="fold", justify="right" if k else "left")
    return table


def _add_rows(table: Table, columns: Sequence[Mapping[str, Any]], prefix: str) -> None:
    """Add a row for each key that any column has; nested ones go below a row of their own, indented."""
    if prefix:
        table.add_row(f"[bold]{prefix}[/]")
    for key in dict.fromkeys(key for column in columns for key in column):
        values = [column.get(key) for column in columns]
        indent = "  " if prefix else ""
        nested = [value if isinstance(value, Mapping) and "ci95" not in value else {} for value in values]
        if any(nested):
            table.add_section()
            table.add_row(f"[bold]{indent}{key}[/]")
            flat = [_flat(value) for value in nested]
            for inner in dict.fromkeys(inner for column in flat for inner in column):
                table.add_row(f"{indent}  {inner}", *(_text(column.get(inner)) for column in flat))
        else:
            table.add_row(f"{indent}{key}", *map(_text, values))


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
