"""Our trackers and those of others, scene by scene, on the same frames and the same detections.

Run with ``python -m tests.validation.trackers_table [--seeds A:B] [--jobs J] [--set KEY=VALUE]...`` in the
environment that `tracker.adapters` describes. Others' trackers start at the detections that ours makes, and
once more at true boxes with errors (``noisy``); ``association`` is what the truth would make of either. It
prints a Markdown table with means over the seeds and their bootstrap intervals.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from scenarios import spec
from scenarios.runs import Run, execute
from scenarios.workers import open_workers
from tracker.registry import DETECTION_TRACKERS

SCENES = {"in-car": "in-car-day", "aerial": "aerial-bridge", "motorcycle-lane": "lane-day"}
"""A scenario of each scene; its tracker has the scene's name."""
MEASURES = {"hota": "HOTA", "assa": "AssA", "mota": "MOTA", "idf1": "IDF1"}
HEADER = ("scenario", "tracker", *MEASURES.values(), "id switches", "IDF1 less that of ours")


def competitors(own: str) -> tuple[str, ...]:
    """Return who runs in a scene: its own tracker first."""
    fed = [
        f"{name}@{detector}" for detector in (own, "noisy") for name in (*DETECTION_TRACKERS, "association")
    ]
    return (own, *fed)


def rows(document: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield the cells of a scenario's trackers, one after another."""
    ours = document["runs"][0]["tracker"]
    less = {
        pair["against"]: pair["difference"].get("idf1")
        for pair in document["paired"]
        if pair["tracker"] == ours
    }
    for run in document["runs"]:
        difference = less.get(run["tracker"])
        yield (
            f"`{run['scenario']}`",
            f"`{run['tracker']}`",
            *(cell(run["scores"][name]) for name in MEASURES),
            str(run["scores"]["id_switches"]),
            "" if difference is None else cell(difference, sign=-1),
        )


def cell(value: Mapping[str, Any] | float | None, *, sign: int = 1) -> str:
    """Write a number over seeds with its interval, or the number of a single seed."""
    if value is None:
        return "-"
    if not isinstance(value, Mapping):
        return f"{sign * value:.2f}"
    bounds = sorted(sign * bound for bound in value["ci95"] or ())
    within = f" [{bounds[0]:.2f}, {bounds[1]:.2f}]" if bounds else ""
    return f"{sign * value['mean']:.2f}{within}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run every scene, and print its part of the table when it is done."""
    parser = argparse.ArgumentParser(prog="python -m tests.validation.trackers_table")
    parser.add_argument("--seeds", default="0:10", metavar="A:B", help="the drives A, A+1, ... B-1")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--scene", dest="scenes", action="append", choices=list(SCENES))
    chosen = parser.parse_args(arguments)
    first, end = map(int, chosen.seeds.split(":"))
    print("| " + " | ".join(HEADER) + " |\n" + "| --- " * len(HEADER) + "|")
    for scene in chosen.scenes or SCENES:
        scenario = spec.load(SCENES[scene], chosen.overrides)
        run = Run(scenario=scenario, seeds=range(first, end), trackers=competitors(scene))
        with open_workers(chosen.jobs, None) as workers:
            document = execute(run, workers=workers)
        for cells in rows(document):
            print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
