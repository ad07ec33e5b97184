"""How trackers hold out as a lane fills: IDF1 and full tracks against riders in view, from 2 to 30.

Run with ``python -m tests.validation.riders_in_view --out DIR [--seeds A:B]``. Finished drives are kept in
DIR, so a run that was broken off goes on where it stopped; at the end a table is printed, and
``riders_in_view.svg`` and ``.png`` are written.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from scenarios import spec
from scenarios.output import write_json
from scenarios.report.palette import SERIES
from scenarios.runs import Run, run_seed
from scenarios.score.statistics import interval

SCENARIO = "lane-day"
TRACKERS = ("motorcycle-lane", "motorcycle-lane:paper", "motorcycle-lane:mog2-nn")
TRAFFIC = {
    3: (8.0, 5.0),
    6: (8.0, 5.0),
    9: (8.0, 5.0),
    13: (8.0, 5.0),
    20: (7.5, 5.5),
    32: (6.5, 6.0),
    48: (5.0, 7.0),
    72: (3.2, 7.6),
}
"""Riders between entry and far end: their speed, m/s, and the lane's width, m. A lane at full speed holds no
more than 17 in view, so it gets slower and wider; all else stays as it is."""
MEASURES = {"idf1": "IDF1", "full": "full tracks, share of riders"}


def drive(riders: int, seed: int, directory: Path) -> dict[str, Any]:
    """Return the numbers of one drive: read where they were kept, else driven and kept."""
    path = directory / f"riders-{riders}-seed-{seed}.json"
    speed, width = TRAFFIC[riders]
    overrides = [f"riders.riders={riders}", f"riders.speed={speed}", f"lane.width={width}"]
    scenario = spec.load(SCENARIO, overrides)
    wanted = {"spec_id": spec.spec_id(scenario), "trackers": list(TRACKERS)}
    if path.is_file():
        kept: dict[str, Any] = json.loads(path.read_text("utf-8"))
        if wanted.items() <= kept.items():
            return kept
    run = Run(scenario=scenario, seeds=range(seed, seed + 1), trackers=TRACKERS)
    documents = run_seed(run, None, seed)
    view = documents[TRACKERS[0]]["difficulty"]["riders_in_view"]
    found = wanted | {"in_view": view["mean"]}
    found["scores"] = {name: measured(documents[name]["scores"]) for name in TRACKERS}
    write_json(path, found)
    return found


def measured(scores: dict[str, Any]) -> dict[str, float | None]:
    """Return the measures of one tracker on one drive."""
    full = scores["full_tracks"]
    return {"idf1": scores["idf1"], "full": full["correct"] / full["total"] if full["total"] else None}


def summed_up(drives: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return means and bootstrap intervals over the seeds of one density."""
    found: dict[str, Any] = {"in_view": interval([drive["in_view"] for drive in drives])}
    for name in TRACKERS:
        for measure in MEASURES:
            values = [drive["scores"][name][measure] for drive in drives]
            known = [value for value in values if value is not None]
            found[name, measure] = interval(known) if known else None
    return found


def lines(rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Lay the rows out as a table."""
    width = max(map(len, TRACKERS))
    yield f"{'in view':>8}  {'tracker':{width}}  {'IDF1':>20}  {'full tracks':>20}"
    for row in rows:
        for name in TRACKERS:
            cells = "  ".join(f"{_words(row[name, measure]):>20}" for measure in MEASURES)
            yield f"{row['in_view']['mean']:8.1f}  {name:{width}}  {cells}"


def _words(value: dict[str, Any] | None) -> str:
    if value is None:
        return "-"
    low, high = value["ci95"] or (value["mean"], value["mean"])
    return f"{value['mean']:.2f} [{low:.2f}, {high:.2f}]"


def draw(rows: Sequence[dict[str, Any]], directory: Path) -> None:
    """Write the plot: a panel a measure, a line with its interval a tracker."""
    figure = Figure(figsize=(9.6, 3.9), layout="constrained")
    panels = figure.subplots(1, len(MEASURES), sharey=True)
    for axes, (measure, label) in zip(panels, MEASURES.items(), strict=True):
        for name, colour in zip(TRACKERS, SERIES, strict=False):
            known = [row for row in rows if row[name, measure] is not None]
            x = [row["in_view"]["mean"] for row in known]
            mean = [row[name, measure]["mean"] for row in known]
            bounds = np.array(
                [row[name, measure]["ci95"] or [m, m] for row, m in zip(known, mean, strict=True)]
            )
            axes.fill_between(x, *bounds.reshape(-1, 2).T, color=colour, alpha=0.18, linewidth=0)
            axes.plot(x, mean, marker="o", markersize=3.5, color=colour, label=name)
        axes.set(xlabel="riders in view, mean", title=label, ylim=(0, 1.02), xlim=(0, None))
        axes.grid(color="#d9dde4", linewidth=0.5)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].legend(frameon=False, loc="center right", fontsize=8.5)
    for suffix in ("svg", "png"):
        figure.savefig(directory / f"riders_in_view.{suffix}", dpi=160)


def main(argv: Sequence[str] | None = None) -> None:
    """Drive, print the table, write the plot."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="where drives and plots are kept"
    )
    parser.add_argument("--seeds", default="0:5", metavar="A:B", help="half-open; 0:5 by default")
    parser.add_argument(
        "--riders",
        type=int,
        nargs="+",
        choices=TRAFFIC,
        default=tuple(TRAFFIC),
        metavar="N",
        help=f"between entry and far end: {', '.join(map(str, TRAFFIC))}",
    )
    given = parser.parse_args(argv)
    begin, _, end = given.seeds.partition(":")
    seeds = range(int(begin), int(end))
    given.out.mkdir(parents=True, exist_ok=True)
    drives: dict[int, list[dict[str, Any]]] = {riders: [] for riders in given.riders}
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns) as progress:
        task = progress.add_task("drives", total=len(seeds) * len(drives))
        # Seed by seed: whoever breaks it off has whole curves.
        for seed in seeds:
            for riders, found in drives.items():
                progress.update(task, description=f"{riders} riders, seed {seed}")
                found.append(drive(riders, seed, given.out))
                progress.advance(task)
    rows = [summed_up(found) for found in drives.values()]
    print("\n".join(lines(rows)))
    draw(rows, given.out)


if __name__ == "__main__":
    main()
