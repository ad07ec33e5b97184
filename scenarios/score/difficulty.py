"""What was there to be got wrong (scoring.md 17)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from scenarios.log import EpisodeLog
from scenarios.score.disappearances import disappearances, summary
from scenarios.score.frames import scored_frames
from scenarios.score.identification import CLASSES, JudgedTrace
from scenarios.score.params import Boxes, ScoringParams
from sim.truth.events import occlusion_events
from sim.truth.types import AerialTruth
from tracker.boxes import intersection

PARTLY = 0.3
"""Share of what lies in the frame from which on a rider is partly hidden."""


def difficulty(
    log: EpisodeLog, traces: Iterable[JudgedTrace], *, boxes: Boxes = "amodal", params: ScoringParams
) -> dict[str, Any]:
    """Count what makes an episode hard.

    Args:
        log: The episode.
        traces: What `scenarios.score.identification.judge_traces` gave of it.
        boxes: Which boxes are scored.
        params: Thresholds.

    Returns:
        ``scored_objects`` and ``scored_boxes`` (those objects' in all frames); in-car ``traces`` by their
        true class, null if the tracker shows none, on the lane ``riders_in_view``, and ``partly_hidden``, the
        share of its scored boxes behind others by more than `PARTLY`; ``overlapping_pairs`` of scored
        objects whose boxes meet in some frame; and ``events`` by kind: how often an object was hidden
        that had been scored within the second before, how often it was seen again, and the median of the
        seconds it then had been hidden. From the air, ``disappearances`` too: the events that re-acquisition
        is scored by (`scenarios.score.disappearances.summary`).
    """
    scored_at: dict[int, list[int]] = defaultdict(list)
    pairs: set[tuple[int, int]] = set()
    in_view = []
    behind = 0
    for frame in scored_frames(log, boxes=boxes, params=params):
        selection = frame.selection
        ids, found = frame.truth.ids[selection.scored], selection.boxes[selection.scored]
        in_view.append(len(ids))
        behind += int((frame.truth.visibility_in_frame[selection.scored] < 1.0 - PARTLY).sum())
        for vehicle in ids.tolist():
            scored_at[vehicle].append(frame.truth.tick)
        for a, b in np.argwhere(np.triu(intersection(found, found) > 0, k=1)):
            pairs.add((min(int(ids[a]), int(ids[b])), max(int(ids[a]), int(ids[b]))))
    counts = {"scored_objects": len(scored_at), "scored_boxes": sum(in_view)}
    hidden = {"overlapping_pairs": len(pairs), "events": _events(log, scored_at)}
    if log.scene == "motorcycle-lane":
        view = {"mean": float(np.mean(in_view)), "most": float(max(in_view))} if in_view else None
        share = behind / sum(in_view) if any(in_view) else None
        return counts | {"riders_in_view": view, "partly_hidden": share} | hidden
    if log.scene == "aerial":
        truth = [frame for frame in log.truth if isinstance(frame, AerialTruth)]
        return (
            counts | hidden | {"disappearances": summary(disappearances(truth, log.rate, params), log.rate)}
        )
    classes = [trace.truth for trace in traces]
    by_class = {name: classes.count(name) if log.traces is not None else None for name in CLASSES}
    return counts | {"traces": by_class} | hidden


def _events(log: EpisodeLog, scored_at: Mapping[int, Sequence[int]]) -> dict[str, Any]:
    events = [
        event
        for event in occlusion_events(log.truth, log.rate)
        if any(event.first - log.rate <= tick < event.first for tick in scored_at.get(event.hidden, ()))
    ]
    kinds = {
        "occluded": [event for event in events if event.occluder],
        "out_of_view": [event for event in events if not event.occluder],
    }
    found = {}
    for kind, chosen in kinds.items():
        back = [(event.last - event.first + 1) / log.rate for event in chosen if event.returned is not None]
        found[kind] = {
            "count": len(chosen),
            "returned": len(back),
            "median_hidden_s": float(np.median(back)) if back else None,
        }
    return found
