"""What was there to be got wrong (scoring.md 17, the in-car part)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from scenarios.log import EpisodeLog
from scenarios.score.identification import CLASSES, JudgedTrace
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.preprocess import select
from sim.truth.events import occlusion_events
from tracker.boxes import intersection


def difficulty(
    log: EpisodeLog, traces: Iterable[JudgedTrace], *, boxes: Boxes = "amodal", params: ScoringParams
) -> dict[str, Any]:
    """Count what makes an in-car episode hard.

    Args:
        log: The episode.
        traces: What `scenarios.score.identification.judge_traces` gave of it.
        boxes: Which boxes are scored.
        params: Thresholds.

    Returns:
        ``scored_objects`` and ``scored_boxes`` (those objects' in all frames); ``traces`` by their true
        class, null if the tracker shows none; ``overlapping_pairs`` of scored objects whose boxes meet in
        some frame; and ``events`` by kind: how often an object that is scored at some time was hidden, how
        often it was seen again, and the median of the seconds that it then had been hidden.
    """
    objects: set[int] = set()
    pairs: set[tuple[int, int]] = set()
    scored_boxes = 0
    for truth in log.truth:
        selection = select(truth, width=log.width, height=log.height, boxes=boxes, params=params)
        ids, found = truth.ids[selection.scored], selection.boxes[selection.scored]
        objects.update(ids.tolist())
        scored_boxes += len(ids)
        for a, b in np.argwhere(np.triu(intersection(found, found) > 0, k=1)):
            pairs.add((min(int(ids[a]), int(ids[b])), max(int(ids[a]), int(ids[b]))))
    classes = [trace.truth for trace in traces]
    return {
        "scored_objects": len(objects),
        "scored_boxes": scored_boxes,
        "traces": {name: classes.count(name) if log.traces is not None else None for name in CLASSES},
        "overlapping_pairs": len(pairs),
        "events": _events(log, objects),
    }


def _events(log: EpisodeLog, objects: set[int]) -> dict[str, Any]:
    events = [event for event in occlusion_events(log.truth, log.rate) if event.hidden in objects]
    kinds = {
        "occluded": [event for event in events if event.occluder],
        "out_of_view": [event for event in events if not event.occluder],
    }
    summary = {}
    for kind, chosen in kinds.items():
        back = [(event.last - event.first + 1) / log.rate for event in chosen if event.returned is not None]
        summary[kind] = {
            "count": len(chosen),
            "returned": len(back),
            "median_hidden_s": float(np.median(back)) if back else None,
        }
    return summary
