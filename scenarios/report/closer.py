"""A closer look at trackers: by stratum, under either convention, and whether covariances are right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scenarios.report.palette import SERIES
from scenarios.report.plots import Plot, Share, shares
from scenarios.report.results import ResultTable
from scenarios.report.tables import DASH, number, words

Details = Mapping[str, Any]
"""What `scenarios.score.summary.details` returns, or the same over seeds."""

STRATA = {
    "visible": ("By what can be seen", "how much of a vehicle can be seen"),
    "distance_m": ("By distance", "metres to a vehicle"),
    "speed_px_s": ("By speed in the picture", "px/s at which a box moves"),
}
_STRATUM = {"recall": "recall", "iou": "mean IoU", "id_switches": "ID switches"}
_CONSISTENCY = {
    "nees": "mean NEES",
    "within_95": "in 95 %",
    "errors": "errors",
    "nis": "mean NIS",
    "nis_within_95": "in 95 %",
    "innovations": "innovations",
}


@dataclass(frozen=True, slots=True)
class CloserLook:
    """A section of a page.

    Attributes:
        key: The trackers with their colours in the plots, where there are several.
        plots: Recall by stratum, one a quantity.
        conventions: Scores under both, in one table.
        covariances: A table of the trackers that give some, if any does.
        strata: The numbers behind the plots.
    """

    key: list[tuple[str, str]]
    plots: list[Plot]
    conventions: list[ResultTable]
    covariances: list[ResultTable]
    strata: list[ResultTable]


def closer_look(runs: Sequence[tuple[str, Details | None]]) -> CloserLook | None:
    """Return the section, or None where no tracker has boxes to look at.

    Args:
        runs: Name and details of each tracker.
    """
    known = [(name, details) for name, details in runs if details and _has_boxes(details)]
    if not known:
        return None
    strata = {quantity: bins for quantity, bins in known[0][1]["strata"].items() if bins}
    # Colours are those of the whole page: a tracker without boxes keeps its own.
    colours = {name: SERIES[k % len(SERIES)] for k, (name, _) in enumerate(runs)}
    return CloserLook(
        key=[(name, colours[name]) for name, _ in known] if len(runs) > 1 else [],
        plots=[_plot(quantity, bins, known, colours) for quantity, bins in strata.items()],
        conventions=[_conventions(known)],
        covariances=_covariances(known),
        strata=[_stratum_table(quantity, bins, known) for quantity, bins in strata.items()],
    )


def _has_boxes(details: Details) -> bool:
    return number(details["conventions"]["amodal"].get("hota")) != DASH


def _plot(
    quantity: str, bins: Details, runs: Sequence[tuple[str, Details]], colours: Mapping[str, str]
) -> Plot:
    rows: list[tuple[str, list[Share | None]]] = []
    for tracker, details in runs:
        recalls = [details["strata"][quantity][name]["recall"] for name in bins]
        rows.append((colours[tracker], [(_mean(recall), f"{_mean(recall):.2f}") for recall in recalls]))
    title, unit = STRATA[quantity]
    beneath = [f"{_bounds(name)}\nn = {bins[name]['boxes']}" for name in bins]
    return Plot(
        title=title,
        caption=f"Share of the scored boxes with a track on them, by {unit}; n boxes in all.",
        svg=shares(beneath, rows, label="recall"),
    )


def _stratum_table(quantity: str, bins: Details, runs: Sequence[tuple[str, Details]]) -> ResultTable:
    rows = [("boxes", [number(own["boxes"]) for own in bins.values()])]
    for tracker, details in runs:
        found = details["strata"][quantity]
        rows += [
            (_named(text, tracker, runs), [number(found[name][score]) for name in bins])
            for score, text in _STRATUM.items()
        ]
    title, unit = STRATA[quantity]
    return ResultTable(title, f"Columns: {unit}.", tuple(map(_bounds, bins)), rows)


def _conventions(runs: Sequence[tuple[str, Details]]) -> ResultTable:
    names = tuple(runs[0][1]["conventions"]["amodal"])
    return ResultTable(
        "Whole or visible boxes",
        "The same tracks against boxes of whole vehicles (amodal) and of what can be seen of them: what"
        " differs is convention.",
        tuple(map(words, names)),
        [
            (
                _named(f"{which} boxes", tracker, runs),
                [number(details["conventions"][which][n]) for n in names],
            )
            for tracker, details in runs
            for which in ("amodal", "visible")
        ],
    )


def _covariances(runs: Sequence[tuple[str, Details]]) -> list[ResultTable]:
    """Return a table of the trackers that give covariances, or none."""
    given = [(tracker, details["consistency"]) for tracker, details in runs if details["consistency"]]
    if not given:
        return []
    return [
        ResultTable(
            "Whether covariances are right",
            "Squared errors in units of the tracker's own covariances, of positions against the truth (NEES)"
            " and of the innovations that it shows (NIS). Right: 2 in the mean, 0.95 within the regions of"
            " 95 %. More than 2: it is too sure of itself; less: not sure enough.",
            tuple(_CONSISTENCY.values()),
            [(tracker, [number(found.get(name)) for name in _CONSISTENCY]) for tracker, found in given],
        )
    ]


def _named(text: str, tracker: str, runs: Sequence[object]) -> str:
    return f"{tracker}: {text}" if len(runs) > 1 else text


def _bounds(stratum: str) -> str:
    return stratum.replace(" to ", "–").replace(" and more", "+")


def _mean(value: Any) -> float:
    return float(value["mean"] if isinstance(value, Mapping) else value)
