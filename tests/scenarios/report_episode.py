"""A small made-up episode: what a tracker might have shown, with a log, scores and a scenario."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog, TraceLog
from scenarios.report.recorder import Recorder
from scenarios.shown import ShownLog
from sim.truth.types import FrameTruth
from sim.world import FIRST_VEHICLE_ID, Kind, Role
from tracker.types import Diagnostics, Label, Status, Traces, Tracks

WIDTH, HEIGHT, RATE, FRAMES = 160, 120, 30, 45
FOCAL = WIDTH * 1.25
SPEED = 20.0

Step = tuple[NDArray[np.uint8], Tracks, Diagnostics, FrameTruth]


def steps(frames: int = FRAMES, width: int = WIDTH, height: int = HEIGHT) -> list[Step]:
    """One car ahead that weaves, with three traces; six static objects that stream outward."""
    rng = np.random.default_rng(5)
    focal = width * 1.25
    lateral = np.array([-12.0, -9.0, -6.0, 5.0, 8.0, 14.0])
    start = np.array([90.0, 60.0, 110.0, 80.0, 50.0, 100.0])
    found = []
    for tick in range(frames):
        time = tick / RATE
        centre = width / 2 + 0.12 * width * np.sin(time)
        car_x = centre + np.array([-0.06, 0.0, 0.06]) * width
        depth = start - (SPEED * time) % 45
        static_x = width / 2 + focal * lateral / depth
        static_v = SPEED * focal * lateral / depth**2
        x = np.concatenate([car_x, static_x]) + rng.normal(0, 0.4, 9)
        v = np.concatenate([np.full(3, 0.12 * width * np.cos(time)), static_v])
        evidence = min(1.0, time / 1.0)
        p_car = np.clip(np.array([0.5 + 0.48 * evidence] * 3 + [0.5 - 0.47 * evidence] * 6), 0, 1)
        labels = np.where(p_car > 0.7, Label.CAR, np.where(p_car < 0.3, Label.BACKGROUND, Label.UNDECIDED))
        box = np.array([centre - 0.08 * width, 0.5 * height, centre + 0.08 * width, 0.66 * height])
        inside = (x > 0) & (x < width)
        ids = np.arange(1, 10)
        traces = Traces(
            ids=ids[inside],
            x=x[inside],
            v=v[inside],
            labels=labels[inside].astype(np.uint8),
            p_car=p_car[inside],
            owners=np.where(ids <= 3, 1, 0)[inside].astype(np.int64),
            points=np.column_stack([x[inside], np.full(inside.sum(), 0.6 * height)]),
            point_traces=ids[inside],
        )
        profile = np.exp(-0.5 * ((np.arange(width)[:, None] - x[inside]) / (0.01 * width)) ** 2).sum(1)
        profile += rng.random(width) * 0.3
        yy, xx = np.mgrid[:height, :width]
        channels = [90 + xx * 60 // width, 110 + yy * 50 // height, np.full_like(xx, 120)]
        image = np.stack(channels, axis=-1).astype(np.uint8)
        status = Status.TENTATIVE if tick < 5 else Status.COASTING if tick % 40 > 34 else Status.CONFIRMED
        tracks = Tracks(
            ids=np.array([1]), boxes=(box + rng.normal(0, 1, 4))[None], status=np.array([status], np.uint8)
        )
        truth = FrameTruth(
            tick=tick,
            ids=np.array([FIRST_VEHICLE_ID], np.uint32),
            kinds=np.array([Kind.CAR], np.uint8),
            roles=np.array([Role.SAME_WAY], np.uint8),
            visible_px=np.array([400]),
            amodal_px=np.array([440]),
            amodal_px_full=np.array([440]),
            box_visible=box[None],
            box_amodal=box[None],
            occluder_ids=np.zeros(1, np.uint32),
            distances=np.array([22.0]),
            positions=np.array([[0.0, 0.5, 24.0]]),
            velocities=np.zeros((1, 3)),
        )
        diagnostics = Diagnostics(traces=traces, profiles={"segments": profile.astype(np.float32)})
        found.append((image, tracks, diagnostics, truth))
    return found


def episode_log(found: list[Step]) -> EpisodeLog:
    """The log of these steps."""
    rng = np.random.default_rng(6)
    traces = [step[2].traces for step in found]
    ticks = np.concatenate([np.full(len(t.ids), k) for k, t in enumerate(traces)])

    def column(pick: Callable[[Traces], NDArray[Any]]) -> NDArray[Any]:
        return np.concatenate([pick(t) for t in traces])

    ids = column(lambda t: t.ids)
    height, width = found[0][0].shape[:2]
    return EpisodeLog(
        scene="in-car",
        shown=ShownLog(detections=None, flags=None, mask_px=None, object_px=None),
        light=np.ones(len(found)),
        scenario="made-up",
        spec_id="0123abcd",
        seed=7,
        tracker="in-car",
        rate=RATE,
        width=width,
        height=height,
        has_boxes=True,
        truth=tuple(step[3] for step in found),
        tracks=tuple(step[1] for step in found),
        traces=TraceLog(
            ticks=ticks,
            ids=ids,
            x=column(lambda t: t.x),
            v=column(lambda t: t.v),
            labels=column(lambda t: t.labels),
            p_car=column(lambda t: t.p_car),
            owners=column(lambda t: t.owners),
            vote_ticks=ticks,
            vote_ids=ids,
            vote_objects=np.where(ids <= 3, FIRST_VEHICLE_ID, 2).astype(np.uint32),
            vote_counts=np.ones(len(ids), np.int64),
        ),
        ego_speed=SPEED + np.sin(np.arange(len(found)) / RATE),
        hashes={"truth": "aa" * 32, "frames": "bb" * 32, "tracks": "cc" * 32},
        timing_ms={
            stage: rng.gamma(9, mean / 9, len(found))
            for stage, mean in {"world": 1, "render": 7, "sensor": 5, "truth": 2, "track": 6}.items()
        },
    )


def scores() -> dict[str, Any]:
    """A document as ``--json`` prints it."""
    return {
        "scenario": "made-up",
        "tracker": "in-car",
        "frames": FRAMES,
        "scores": {
            "hota": 0.612345, "deta": 0.58, "assa": 0.655, "mota": 0.71, "idf1": 0.8123, "id_switches": 3,
            "precision": 0.9, "recall": 0.85,
            "identification": {
                "car_recall": 0.9312, "background_recall": 0.957, "accuracy": 0.944,
                "confusion": {
                    "car": {"car": 41, "background": 2, "undecided": 1},
                    "background": {"car": 3, "background": 93, "undecided": 4},
                },
                "median_seconds_to_identify": None,
                "vehicle_coverage": 0.92,
                "traces_per_10s": {"car": 22.4, "background": 49.9},
                "oncoming_as_car": 0.18,
            },
        },
        "details": {
            "conventions": {
                "amodal": {"hota": 0.6123, "mota": 0.7112, "id_switches": 4},
                "visible": {"hota": 0.5534, "mota": 0.6521, "id_switches": 6},
            },
            "strata": {
                "visible": {
                    "0.3 to 0.5": {"boxes": 211, "recall": 0.3141, "iou": 0.6271, "id_switches": 2},
                    "0.9 to 1": {"boxes": 1777, "recall": 0.9732, "iou": 0.8371, "id_switches": 1},
                },
                "distance_m": {"10 to 20": {"boxes": 1988, "recall": 0.9042, "iou": None, "id_switches": 5}},
                "speed_px_s": {},
            },
            "consistency": {"nees": 2.345, "within_95": 0.9321, "errors": 1611},
        },
        "difficulty": {"scored_objects": 13, "traces": {"car": 44, "background": 100}, "pairs": 777},
        "fps": 43.21,
        "peak_rss_mb": 512.0,
    }  # fmt: skip


def scenario() -> dict[str, Any]:
    """A resolved scenario."""
    return {
        "name": "made-up",
        "description": "Nothing but a car that weaves.",
        "seconds": FRAMES / RATE,
        "rate": RATE,
        "params": {"camera": {"width": WIDTH, "focal": FOCAL}, "light": {"time": "day", "haze": 0.0012}},
    }


def record(recorder: Recorder, found: list[Step]) -> None:
    """Show all steps to a recorder."""
    for image, tracks, diagnostics, truth in found:
        recorder.frame(image, tracks, diagnostics, truth)
