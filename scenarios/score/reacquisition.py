"""Whether a vehicle that vanished from a camera in the air came back under its old id (scoring.md 10)."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

import numpy as np

from scenarios.log import EpisodeLog
from scenarios.score.disappearances import Disappearance, disappearances
from scenarios.score.frames import scored_frames
from scenarios.score.lane import matches
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.preprocess import confirmed
from sim.truth.types import AerialTruth

BEFORE, AFTER = 15, 30
"""Scored frames before a vehicle vanishes, and after it is back, that tell its id."""

Outcome = Literal["correct", "wrong", "missed"]


def reacquisition(
    log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams
) -> dict[str, int | None]:
    """Count the events of an episode and how they ended; all but ``events`` are None without boxes."""
    truths = [truth for truth in log.truth if isinstance(truth, AerialTruth)]
    events = disappearances(truths, log.rate, params)
    counts: dict[str, int | None] = {"events": len(events), "correct": None, "wrong": None, "missed": None}
    if log.has_boxes:
        judged = Counter(outcomes(events, ids_on_vehicles(log, boxes=boxes, params=params)))
        counts |= {name: judged[name] for name in ("correct", "wrong", "missed")}
    return counts


def ids_on_vehicles(
    log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams
) -> dict[int, dict[int, int]]:
    """Give, by tick and scored vehicle, the id of the confirmed track on it (Hungarian, `match_iou`)."""
    found = {}
    for frame in scored_frames(log, boxes=boxes, params=params):
        ids, shown = confirmed(frame.tracks, log.width, log.height)
        chosen = np.flatnonzero(frame.selection.scored)
        rows, columns = matches(frame.selection.boxes[chosen], shown, params.match_iou)
        vehicles = frame.truth.ids[chosen[rows]].tolist()
        found[frame.truth.tick] = dict(zip(vehicles, ids[columns].tolist(), strict=True))
    return found


def outcomes(events: Sequence[Disappearance], on: Mapping[int, Mapping[int, int]]) -> list[Outcome]:
    """Judge events.

    Where no track was on the vehicle before it vanished, or none is after, the event is missed.

    Args:
        events: Of one episode.
        on: By tick and vehicle, the id of the track on it.

    Returns:
        Of each event: ``correct`` if the id after is the one before; ``wrong`` if, until the vehicle came
        back, it had been on another one for most of its frames; else ``missed``.
    """
    found: list[Outcome] = []
    for event in events:
        before = majority(on, event.vehicle, event.before[-BEFORE:])
        after = majority(on, event.vehicle, event.after[:AFTER])
        if after is None:
            found.append("missed")
        elif after == before:
            found.append("correct")
        else:
            found.append(
                "wrong" if owner(on, after, event.after[0]) not in (None, event.vehicle) else "missed"
            )
    return found


def majority(on: Mapping[int, Mapping[int, int]], vehicle: int, ticks: Iterable[int]) -> int | None:
    """Return the id that was most often on a vehicle at these ticks, the smaller of equals, if any was."""
    counts = Counter(on[tick][vehicle] for tick in ticks if vehicle in on.get(tick, {}))
    return min(counts, key=lambda number: (-counts[number], number)) if counts else None


def owner(on: Mapping[int, Mapping[int, int]], number: int, until: int) -> int | None:
    """Return the vehicle that a track was on most often before the tick ``until``; None if on none."""
    counts: dict[int, int] = defaultdict(int)
    for tick, pairs in on.items():
        for vehicle, track in pairs.items():
            if track == number and tick < until:
                counts[vehicle] += 1
    return min(counts, key=lambda vehicle: (-counts[vehicle], vehicle)) if counts else None
