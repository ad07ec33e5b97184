"""Hand-made episodes."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scenarios.log import EpisodeLog, TraceLog
from scenarios.shown import ShownLog
from sim.truth.types import FrameTruth
from sim.world import Kind, Role
from tracker.types import Label, Status, Tracks

CAR = 1 << 20
NOTHING_SHOWN = ShownLog(detections=None, flags=None, mask_px=None, object_px=None)
RATE = 10


@dataclass(kw_only=True)
class Car:
    """A vehicle in one frame."""

    id: int
    box: Sequence[float] = (100, 100, 140, 130)
    role: Role = Role.SAME_WAY
    distance: float = 20.0
    visible: float = 1.0
    in_frame: float = 1.0
    occluder: int = 0
    speed: float = 8.0


def frame_truth(tick: int, cars: Sequence[Car]) -> FrameTruth:
    n = len(cars)
    boxes = np.array([car.box for car in cars], float).reshape(n, 4)
    visible = np.array([round(1000 * car.visible) for car in cars], np.int64)
    return FrameTruth(
        tick=tick,
        ids=np.array([car.id for car in cars], np.uint32),
        kinds=np.full(n, Kind.CAR, np.uint8),
        roles=np.array([car.role for car in cars], np.uint8),
        visible_px=visible,
        amodal_px=np.array([round(1000 * car.in_frame) for car in cars], np.int64),
        amodal_px_full=np.full(n, 1000, np.int64),
        box_visible=np.where(visible[:, None] > 0, boxes, np.nan),
        box_amodal=boxes,
        occluder_ids=np.array([car.occluder for car in cars], np.uint32),
        distances=np.array([car.distance for car in cars], float),
        positions=np.zeros((n, 3)),
        velocities=np.array([(0.0, 0.0, car.speed) for car in cars], float).reshape(n, 3),
    )


def tracks(*boxes: tuple[int, Sequence[float]], status: Status = Status.CONFIRMED) -> Tracks:
    return Tracks(
        ids=np.array([number for number, _ in boxes], np.int64),
        boxes=np.array([box for _, box in boxes], float).reshape(-1, 4),
        status=np.full(len(boxes), status, np.uint8),
    )


@dataclass(kw_only=True)
class Trace:
    """A trace: its first frame, a label a frame, and votes: (object, count) in every frame."""

    first: int = 0
    labels: Sequence[Label]
    votes: Sequence[tuple[int, int]]
    depth: float | None = None


@dataclass
class _Rows:
    columns: dict[str, list[Any]] = field(default_factory=dict)

    def add(self, **values: Any) -> None:
        for name, value in values.items():
            self.columns.setdefault(name, []).append(value)

    def of(self, name: str, kind: Any) -> np.ndarray:
        return np.array(self.columns.get(name, []), kind)


def trace_log(traces: dict[int, Trace]) -> TraceLog:
    rows = _Rows()
    for number, trace in traces.items():
        for k, label in enumerate(trace.labels):
            rows.add(ticks=trace.first + k, ids=number, labels=label)
            for thing, count in trace.votes:
                rows.add(
                    vote_ticks=trace.first + k,
                    vote_ids=number,
                    vote_objects=thing,
                    vote_counts=count,
                    vote_depths=np.nan if trace.depth is None else trace.depth,
                )
    n = len(rows.of("ids", np.int64))
    depths = rows.of("vote_depths", float)
    return TraceLog(
        ticks=rows.of("ticks", np.int64),
        ids=rows.of("ids", np.int64),
        x=np.zeros(n),
        v=np.zeros(n),
        labels=rows.of("labels", np.uint8),
        p_car=np.zeros(n),
        owners=np.zeros(n, np.int64),
        vote_ticks=rows.of("vote_ticks", np.int64),
        vote_ids=rows.of("vote_ids", np.int64),
        vote_objects=rows.of("vote_objects", np.uint32),
        vote_counts=rows.of("vote_counts", np.int64),
        vote_depths=None if np.isnan(depths).any() else depths,
    )


def episode(
    cars: Sequence[Sequence[Car]],
    found: Sequence[Tracks] | None = None,
    *,
    traces: TraceLog | None = None,
    has_boxes: bool = True,
    speed: float | Sequence[float] = 20.0,
    scene: str = "in-car",
    shown: ShownLog = NOTHING_SHOWN,
    light: Sequence[float] | None = None,
) -> EpisodeLog:
    n = len(cars)
    return EpisodeLog(
        scenario="hand-made",
        scene=scene,
        spec_id="0",
        seed=0,
        tracker="hand",
        rate=RATE,
        width=640,
        height=480,
        has_boxes=has_boxes,
        truth=tuple(frame_truth(tick, here) for tick, here in enumerate(cars)),
        tracks=tuple(found) if found is not None else (Tracks.none(),) * n,
        traces=traces,
        shown=shown,
        light=np.ones(n) if light is None else np.asarray(light, float),
        ego_speed=np.broadcast_to(np.asarray(speed, float), n).copy(),
        hashes={},
        timing_ms={},
    )
