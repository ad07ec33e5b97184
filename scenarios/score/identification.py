"""In-car: what traces were found to be, against what they are (scoring.md 7 to 9)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog, TraceLog
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.preprocess import select
from sim.world import Role
from tracker.types import Label

CLASSES = ("car", "background", "oncoming")
"""What a scored trace can be in truth."""
LABELS = {Label.CAR: "car", Label.BACKGROUND: "background", Label.UNDECIDED: "undecided"}
IGNORED = "ignored"
_CLASS_OF_ROLE = {Role.SAME_WAY: "car", Role.ONCOMING: "oncoming"}
_STATIC = 0  # parked cars are background like all else that stands still


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedTrace:
    """One trace over its life.

    Attributes:
        id: The trace.
        first: Frame of its first row.
        last: Frame of its last row.
        owner: Id of the vehicle that it belongs to, 0 for what stands still.
        truth: One of `CLASSES`, or "ignored".
        label: The last one given: one of `LABELS`.
        seconds: From its first frame to the first after which the label stays right; infinite if never.
        metres: How far the camera car went meanwhile; not a number where there is none.
    """

    id: int
    first: int
    last: int
    owner: int
    truth: str
    label: str
    seconds: float
    metres: float

    @property
    def right(self) -> bool:
        """Whether the label is the truth."""
        return self.label == self.truth


def judge_traces(log: EpisodeLog, params: ScoringParams) -> tuple[JudgedTrace, ...]:
    """Say of every trace, by their ids, what it is in truth and what it was found to be."""
    if log.traces is None:
        return ()
    world = _World(log)
    rows = _by_id(log.traces.ids, log.traces.ticks)
    votes = _by_id(log.traces.vote_ids, log.traces.vote_ticks)
    nothing = np.zeros(0, np.intp)
    return tuple(
        _judge(number, log.traces, rows[number], votes.get(number, nothing), world, params)
        for number in sorted(rows)
    )


def _by_id(ids: NDArray[np.int64], ticks: NDArray[np.int64]) -> dict[int, NDArray[np.intp]]:
    """Give the rows of each id, in the order of their ticks."""
    order = np.lexsort((ticks, ids))
    known, starts = np.unique(ids[order], return_index=True)
    return dict(zip(known.tolist(), np.split(order, starts[1:]), strict=True)) if len(known) else {}


class _World:
    """The truth of an episode, looked up by vehicle and frame."""

    def __init__(self, log: EpisodeLog) -> None:
        self.rate = log.rate
        self.roles: dict[int, int] = {}
        self._distances: dict[tuple[int, int], float] = {}
        for truth in log.truth:
            self.roles.update(zip(truth.ids.tolist(), truth.roles.tolist(), strict=True))
            for vehicle, distance in zip(truth.ids.tolist(), truth.distances.tolist(), strict=True):
                self._distances[truth.tick, vehicle] = distance
        self._frame_of = {truth.tick: frame for frame, truth in enumerate(log.truth)}
        self._way = np.concatenate([[0.0], np.cumsum(log.ego_speed / log.rate)])

    def distance(self, vehicle: int, ticks: NDArray[np.int64]) -> float:
        """Give the median distance of a vehicle over those of the frames that have it, metres."""
        known = [
            self._distances[tick, vehicle] for tick in ticks.tolist() if (tick, vehicle) in self._distances
        ]
        return float(np.median(known)) if known else math.inf

    def metres(self, first: int, last: int) -> float:
        """Say how far the camera car went from one frame to another."""
        return float(self._way[self._frame_of[last]] - self._way[self._frame_of[first]])


def _judge(
    number: int,
    traces: TraceLog,
    rows: NDArray[np.intp],
    votes: NDArray[np.intp],
    world: _World,
    params: ScoringParams,
) -> JudgedTrace:
    ticks = traces.ticks[rows]
    labels = [LABELS[Label(label)] for label in traces.labels[rows].tolist()]
    first, last = int(ticks[0]), int(ticks[-1])
    owner, truth = _owner(traces, ticks, votes, world, params)
    if (last - first + 1) / world.rate < params.min_trace_seconds:
        truth = IGNORED
    wrong = [k for k, label in enumerate(labels) if label != truth]
    settled = wrong[-1] + 1 if wrong else 0
    return JudgedTrace(
        id=number,
        first=first,
        last=last,
        owner=owner,
        truth=truth,
        label=labels[-1],
        seconds=(int(ticks[settled]) - first) / world.rate if settled < len(ticks) else math.inf,
        metres=world.metres(first, last),
    )


def _owner(
    traces: TraceLog, ticks: NDArray[np.int64], votes: NDArray[np.intp], world: _World, params: ScoringParams
) -> tuple[int, str]:
    """Find what holds the majority of a trace's support points over its life, and the class that it gives."""
    counts: Counter[int] = Counter()
    for vehicle, count in zip(
        traces.vote_objects[votes].tolist(), traces.vote_counts[votes].tolist(), strict=True
    ):
        counts[_STATIC if world.roles.get(vehicle, Role.PARKED) == Role.PARKED else vehicle] += count
    if not counts:
        return _STATIC, IGNORED
    # The lowest id of equals: nothing here depends on the order of the rows.
    owner = max(counts, key=lambda vehicle: (counts[vehicle], -vehicle))
    if counts[owner] < params.majority * counts.total():
        return owner, IGNORED
    if owner == _STATIC:
        far = _static_depth(traces, votes, world) > params.max_distance
        return owner, IGNORED if far else "background"
    far = world.distance(owner, ticks) > params.max_distance
    return owner, IGNORED if far else _CLASS_OF_ROLE.get(Role(world.roles[owner]), IGNORED)


def _static_depth(traces: TraceLog, votes: NDArray[np.intp], world: _World) -> float:
    """Give the median depth of the support points on what stands still, 0 where depths were not kept."""
    if traces.vote_depths is None:
        return 0.0
    chosen = np.array(
        [
            row
            for row, vehicle in zip(votes, traces.vote_objects[votes].tolist(), strict=True)
            if world.roles.get(vehicle, Role.PARKED) == Role.PARKED
        ],
        np.intp,
    )
    depths, weights = traces.vote_depths[chosen], traces.vote_counts[chosen]
    order = np.argsort(depths)
    half = np.searchsorted(np.cumsum(weights[order]), weights.sum() / 2)
    return float(depths[order][half])


def identification(
    log: EpisodeLog, traces: Iterable[JudgedTrace], *, boxes: Boxes = "amodal", params: ScoringParams
) -> dict[str, Any]:
    """Compute the scores of identification.

    Args:
        log: The episode; a tracker that shows no traces gets null for every score.
        traces: What `judge_traces` gave of it.
        boxes: Which boxes decide on a vehicle's being scored.
        params: Thresholds.

    Returns:
        Fractions, seconds and counts as plain numbers. The median time is null where it would be infinite,
        that is, where half of the car traces or more are never identified; ``never_identified`` is their
        share.
    """
    scored = [trace for trace in traces if trace.truth != IGNORED]
    of = {name: [trace for trace in scored if trace.truth == name] for name in CLASSES}
    seconds = len(log.truth) / log.rate
    given = log.traces is not None
    median = float(np.median([trace.seconds for trace in of["car"]])) if of["car"] else math.inf
    return {
        **_recalls(scored),
        "confusion": {
            name: {label: sum(trace.label == label for trace in of[name]) for label in LABELS.values()}
            for name in CLASSES
        }
        if given
        else None,
        "median_seconds_to_identify": median if math.isfinite(median) else None,
        "never_identified": _share(math.isinf(trace.seconds) for trace in of["car"]),
        "vehicle_coverage": _coverage(log, scored, boxes, params) if given else None,
        "traces_per_10s": {
            name: 10 * len(of[name]) / seconds if given and seconds else None for name in CLASSES
        },
        "oncoming_as_car": _share(trace.label == "car" for trace in of["oncoming"]),
        "moving": _recalls([trace for trace in scored if trace.metres >= params.min_ego_metres]),
    }


def _recalls(scored: list[JudgedTrace]) -> dict[str, float | None]:
    both = [trace for trace in scored if trace.truth != "oncoming"]
    recalls = {
        name: _share(trace.right for trace in both if trace.truth == name) for name in ("car", "background")
    }
    known = [recall for recall in recalls.values() if recall is not None]
    return {
        "car_recall": recalls["car"],
        "background_recall": recalls["background"],
        "accuracy": _share(trace.right for trace in both),
        "balanced_accuracy": sum(known) / 2 if len(known) == 2 else None,
    }


def _coverage(
    log: EpisodeLog, scored: list[JudgedTrace], boxes: Boxes, params: ScoringParams
) -> float | None:
    """Give the share of the vehicles scored long enough that carry a scored trace finally labelled car."""
    frames: Counter[int] = Counter()
    for truth in log.truth:
        chosen = select(truth, width=log.width, height=log.height, boxes=boxes, params=params).scored
        frames.update(truth.ids[chosen].tolist())
    counted = [v for v, count in frames.items() if count >= params.min_vehicle_seconds * log.rate]
    found = [trace.owner for trace in scored if trace.truth == "car" and trace.right]
    return _share(vehicle in found for vehicle in counted)


def _share(answers: Iterable[bool]) -> float | None:
    """Give the share of true ones, None of none."""
    counted = list(answers)
    return sum(counted) / len(counted) if counted else None
