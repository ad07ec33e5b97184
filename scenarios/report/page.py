"""One self-contained HTML page about one tracker on one episode."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import IO, Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from scenarios.log import EpisodeLog
from scenarios.report import aerial, figures
from scenarios.report.closer import closer_look
from scenarios.report.flight import Flight
from scenarios.report.history import History
from scenarios.report.moment import Moment, association, pictures
from scenarios.report.palette import DOTS, LABELS, NO_TRACK
from scenarios.report.pictures import Picture
from scenarios.report.results import aerial_tables, lane_tables
from scenarios.report.series import scored_boxes
from scenarios.report.tables import (
    AERIAL_SCORES,
    BOX_SCORES,
    MEANINGS,
    PLAIN_TILES,
    TILE_COUNT,
    TILES,
    Row,
    attribute_notes,
    is_group,
    number,
    parameter_rows,
    plain_rows,
    score_row,
    words,
)
from scenarios.score.params import ScoringParams

_FILM_MARKER = "<film>"  # text from outside is escaped, so that it cannot hold this
_CHUNK = 3 << 18


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """What a `scenarios.report.recorder.Recorder` gathered.

    Attributes:
        title: Of the report.
        width: Of the frames, px.
        rate: Frames a second.
        frames: How many there were.
        history: Profiles and traces.
        film: The video, or None where no frame came.
        film_frames: How many frames are in it.
        stills: Single frames.
        moment: A frame of a lane with what its tracker made of it, or None.
        flight: Of a tracker that shows a mosaic; empty of others.
        has_traces: Whether the tracker showed traces.
        figures: More pictures to show.
        focal: Px, or None where it is not known.
    """

    title: str
    width: int
    rate: float
    frames: int
    history: History
    film: Path | None
    film_frames: int
    stills: tuple[Picture, ...]
    moment: Moment | None
    flight: Flight
    has_traces: bool
    figures: tuple[Picture, ...]
    focal: float | None


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under a heading."""

    title: str
    rows: list[Row]
    note: str = ""


def environment() -> Environment:
    """Return the templates; everything from outside is escaped, and a name that is not given is an error."""
    return Environment(
        loader=PackageLoader("scenarios.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def write_page(
    path: Path,
    recording: Recording,
    *,
    log: EpisodeLog | None,
    scores: Mapping[str, Any] | None,
    scenario: Mapping[str, Any] | None,
) -> None:
    """Write the report to ``path``.

    Args:
        path: The file to write.
        recording: Of the run.
        log: Of the episode, or None for a recording.
        scores: The document that ``--json`` prints; of a recording it has no scores in it.
        scenario: As resolved, or None for a recording.
    """
    document = scores or {}
    scenario = scenario or {}
    values: Mapping[str, Any] = document.get("scores") or {}
    has_boxes = log is None or log.has_boxes
    has_traces = log is None or log.traces is not None
    moment = recording.moment
    drawn = figures.draw(recording, log=log, boxes=document.get("boxes", "amodal"), scenario=scenario)
    html = (
        environment()
        .get_template("report.html.j2")
        .render(
            title=recording.title,
            description=scenario.get("description", ""),
            chips=_chips(recording, log, document),
            film=recording.film,
            poster=recording.stills[len(recording.stills) // 2] if recording.stills else None,
            film_marker=Markup(_FILM_MARKER),
            film_note=_film_note(recording),
            has_truth=log is not None,
            label_colours=[(label.name.lower(), colour) for label, colour in LABELS.items()]
            if recording.has_traces
            else [],
            map_colours=[(name, DOTS[name]) for name in drawn.classes],
            no_track=NO_TRACK,
            tiles=_tiles(values, has_boxes=has_boxes, has_traces=has_traces),
            tables=_tables(values, has_boxes=has_boxes, has_traces=has_traces),
            confusion=confusion(values),
            facts=plain_rows(_facts(document)) if not values else [],
            difficulty=plain_rows(document.get("difficulty") or {}),
            lane_tables=lane_tables([(document.get("tracker", ""), values)]),
            aerial_tables=aerial_tables([(document.get("tracker", ""), values)]),
            closer=closer_look([(document.get("tracker", ""), document.get("details"))]),
            moment=_moment_pictures(moment, recording, log) if moment is not None else [],
            association=association(moment) if moment is not None else None,
            flight=aerial.section(
                recording.flight,
                log,
                boxes=document.get("boxes", "amodal"),
                rate=recording.rate,
            ),
            riders=drawn.riders,
            profiles=drawn.profiles,
            maps=drawn.maps,
            maps_note=drawn.maps_note,
            times=drawn.times,
            stills=recording.stills,
            figures=recording.figures,
            thresholds=parameter_rows(asdict(ScoringParams()), attribute_notes(ScoringParams))
            if values
            else [],
            parameters=_parameters(scenario),
            digests=list((log.hashes if log else {}).items()),
            version=metadata.version("testtrack"),
        )
    )
    before, _, after = html.partition(_FILM_MARKER)
    with path.open("w", encoding="utf-8") as file:
        file.write(before)
        if recording.film is not None:
            _write_base64(file, recording.film)
        file.write(after)


def _moment_pictures(moment: Moment, recording: Recording, log: EpisodeLog | None) -> list[Picture]:
    truth = None
    if log is not None:
        truth = scored_boxes(log.truth[moment.index], log.width, log.height, log.scene)
    return pictures(moment, truth, moment.index / recording.rate)


def _write_base64(file: IO[str], source: Path) -> None:
    """Append a file as text, piece by piece: a long video never stands in memory whole."""
    with source.open("rb") as data:
        while piece := data.read(_CHUNK):
            file.write(base64.b64encode(piece).decode())


def _film_note(recording: Recording) -> str:
    if recording.film_frames == recording.frames:
        return ""
    return (
        f"The video shows the first {recording.film_frames / recording.rate:g} s"
        f" of {recording.frames / recording.rate:.1f} s."
    )


def _chips(
    recording: Recording, log: EpisodeLog | None, document: Mapping[str, Any]
) -> list[tuple[str, str]]:
    chips = []
    if log is not None:
        chips = [("scenario", log.scenario), ("seed", str(log.seed)), ("tracker", log.tracker)]
    elif "method" in document:
        chips = [("recording", str(document.get("video", ""))), ("tracker", str(document["method"]))]
    chips.append(("length", f"{recording.frames / recording.rate:.1f} s"))
    chips.append(("frames", f"{recording.frames} at {recording.rate:g} a second"))
    if document.get("fps") is not None:
        chips.append(("processed", f"{number(document['fps'])} frames a second"))
    if document.get("peak_rss_mb") is not None:
        chips.append(("memory", f"{document['peak_rss_mb']:.0f} MB at most"))
    return chips


def _facts(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the document of a recording says of what was found."""
    facts = {name: document[name] for name in ("tracks", "boxes", "focal") if document.get(name) is not None}
    return facts | {f"{stage}, ms a frame": ms for stage, ms in (document.get("timing_ms") or {}).items()}


def _tiles(values: Mapping[str, Any], *, has_boxes: bool, has_traces: bool) -> list[Row]:
    """Return the scores that the page begins with: those of them that this tracker can have."""
    leaves = dict(values) | dict(values.get("identification") or {})
    leaves |= {f"detection_{name}": value for name, value in (values.get("detection") or {}).items()}
    given = {name: has_boxes if name in BOX_SCORES else has_traces for name in TILES}
    leaves |= {f"reacquisition_{name}": value for name, value in (values.get("reacquisition") or {}).items()}
    names = [name for name in TILES if name in leaves and (name in PLAIN_TILES or given[name])]
    return [
        score_row(name, leaves[name], has_boxes=has_boxes, has_traces=has_traces)
        for name in names[:TILE_COUNT]
    ]


def _tables(values: Mapping[str, Any], *, has_boxes: bool, has_traces: bool) -> list[Table]:
    """Return a table of the plain scores, one of each group, and one of each group of scores in a group."""

    def row(name: str, value: object) -> Row:
        return score_row(name, value, has_boxes=has_boxes, has_traces=has_traces)

    plain = {name: value for name, value in values.items() if not is_group(value)}
    tables = [_table("Tracking", [row(name, value) for name, value in plain.items()])] if plain else []
    for name, group in values.items():
        if not is_group(group) or name in AERIAL_SCORES:
            continue
        rows, inner = [], []
        for key, value in group.items():
            if not is_group(value):
                rows.append(row(key, value))
            elif MEANINGS.keys() & value.keys():
                title = f"{words(name).capitalize()}, {words(key)}"
                inner.append(_table(title, [row(*item) for item in value.items()], MEANINGS.get(key, "")))
            elif key != "confusion":
                rows += [
                    replace(row(key, item), name=f"{words(key)}: {words(which)}")
                    for which, item in value.items()
                ]
        tables += [_table(words(name).capitalize(), rows), *inner]
    return tables


def _table(title: str, rows: list[Row], note: str = "") -> Table:
    """Return a table; what is missing throughout for one reason is said once."""
    notes = {row.note for row in rows}
    if rows and all(row.missing for row in rows) and len(notes) == 1:
        return Table(title, [replace(row, note="") for row in rows], f"{notes.pop().capitalize()}.")
    return Table(
        title, [replace(row, note="") for row in rows] if note else rows, note and f"{note.capitalize()}."
    )


@dataclass(frozen=True, slots=True)
class _Cell:
    text: str
    per_cent: str
    share: float


def confusion(values: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the confusion matrix as rows of truth and columns of labels, shaded by the share of its row."""
    matrix = (values.get("identification") or {}).get("confusion")
    if not matrix:
        return None
    columns = list(dict.fromkeys(label for counts in matrix.values() for label in counts))
    rows = []
    for name, counts in matrix.items():
        total = sum(counts.values())
        cells = []
        for label in columns:
            share = counts.get(label, 0) / total if total else 0.0
            per_cent = f"{100 * share:.0f} %" if total else ""
            cells.append(_Cell(number(counts.get(label, 0)), per_cent, 0.75 * share))
        rows.append({"name": words(name), "cells": cells})
    return {"columns": [words(label) for label in columns], "rows": rows}


def _parameters(scenario: Mapping[str, Any]) -> list[Table]:
    """Return a table of the plain parameters and one of each group, groups in groups by their full name."""
    tables: list[Table] = []

    def add(title: str, values: Mapping[str, Any]) -> None:
        plain = {key: value for key, value in values.items() if not isinstance(value, Mapping)}
        if plain:
            tables.append(Table(title, parameter_rows(plain)))
        for key, value in values.items():
            if isinstance(value, Mapping):
                add(words(key).capitalize(), value)

    add("Scenario", {key: value for key, value in scenario.items() if key != "description"})
    return tables
