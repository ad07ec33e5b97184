"""One episode: step, render, track, log. No files are read or written here."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scenarios import bridge, digest
from scenarios.detections import Fed
from scenarios.errors import InputError
from scenarios.log import EpisodeLog, TraceLog
from scenarios.realtime import Realtime
from scenarios.shown import ShownRows
from scenarios.spec import Scenario, spec_id
from tracker.base import Tracker
from tracker.types import Diagnostics, Frame, Info, Traces, Tracks

if TYPE_CHECKING:
    from sim.simulation import Observation, Scene

OnFrame = Callable[["Observation", Mapping[str, tuple[Tracks, Diagnostics]]], None]
"""Is shown each frame with what every tracker made of it, by the tracker's name."""

_Arrays = TypeVar("_Arrays", Tracks, Traces)
_SHARED_STAGES = ("world", "render", "sensor", "truth")


def run_episode(
    scenario: Scenario,
    seed: int,
    trackers: Mapping[str, Tracker],
    *,
    odometry: bool = False,
    on_frame: OnFrame | None = None,
) -> list[EpisodeLog]:
    """Simulate one drive and let trackers follow it: each frame is rendered once, every tracker steps on it.

    Args:
        scenario: What is driven.
        seed: Which of its drives, >= 0.
        trackers: By name.
        odometry: Whether the trackers get the car's noisy odometry.
        on_frame: Called after every frame; its time is counted in no stage.

    Returns:
        A log for each tracker, in the order of ``trackers``.

    Raises:
        RenderUnavailableError: If there is no off-screen OpenGL here.
    """
    from sim.simulation import Simulation

    scene = make_scene(scenario, seed)
    with Simulation(scene, scenario.params.sensor, seed=seed) as simulation:
        return track_observations(
            simulation.run(scenario.frames),
            scenario,
            seed,
            trackers,
            info=bridge.tracker_info(scene.camera, scenario.rate),
            odometry=odometry,
            on_frame=on_frame,
        )


def make_scene(scenario: Scenario, seed: int) -> Scene:
    """Populate the world of a scenario for one seed.

    Raises:
        InputError: If its recording is missing or too short.
    """
    from sim import scenes
    from sim.recorded import RecordingError

    try:
        return scenes.make_scene(scenario.params, seed=seed, rate=scenario.rate, seconds=scenario.seconds)
    except RecordingError as error:
        raise InputError(str(error)) from error


def track_observations(
    observations: Iterable[Observation],
    scenario: Scenario,
    seed: int,
    trackers: Mapping[str, Tracker],
    *,
    info: Info,
    odometry: bool = False,
    on_frame: OnFrame | None = None,
) -> list[EpisodeLog]:
    """Let trackers follow observations, wherever these come from; see `run_episode`.

    Observations are taken one by one and not kept: memory grows by the logs alone.
    """
    truths, ego_speed, light = [], [], []
    shared_ms: dict[str, list[float]] = {stage: [] for stage in _SHARED_STAGES}
    truth_hash, frames_hash = hashlib.sha256(), hashlib.sha256()
    logs = {name: TrackerLog(tracker) for name, tracker in trackers.items()}
    for tracker in trackers.values():
        tracker.start(info)

    for observation in observations:
        started = time.perf_counter()
        ego = observation.state.ego
        truths.append(observation.truth)
        ego_speed.append(np.nan if ego is None else ego.speed)
        light.append(bridge.light_level(observation.state.lighting))
        digest.add(truth_hash, observation.truth)
        digest.add(frames_hash, observation.image)
        for stage in _SHARED_STAGES:
            shared_ms[stage].append(observation.timing_ms[stage])
        shared_ms["truth"][-1] += _milliseconds_since(started)

        shown = {
            name: log.step(bridge.tracker_frame(observation, odometry=odometry), observation)
            for name, log in logs.items()
        }
        if on_frame is not None:
            on_frame(observation, shown)

    hashes = {"truth": truth_hash.hexdigest(), "frames": frames_hash.hexdigest()}
    return [
        EpisodeLog(
            scenario=scenario.name,
            scene=scenario.scene,
            spec_id=spec_id(scenario),
            seed=seed,
            tracker=name,
            rate=scenario.rate,
            width=info.width,
            height=info.height,
            has_boxes=getattr(log.tracker, "has_boxes", True),
            truth=tuple(truths),
            tracks=tuple(log.tracks),
            traces=log.traces.finish(),
            shown=log.shown.finish(),
            ego_speed=np.array(ego_speed, float),
            light=np.array(light, float),
            hashes={**hashes, "tracks": log.digest.hexdigest()},
            timing_ms={
                stage: np.array(ms, float)
                for stage, ms in {
                    **shared_ms,
                    # To log a tracker is part of the loop; most of it looks up the truth of its traces.
                    "truth": np.add(shared_ms["truth"], log.log_ms),
                    "track": log.track_ms,
                }.items()
            },
        )
        for name, log in logs.items()
    ]


class TrackerLog:
    """Steps one tracker and keeps what it returns.

    Attributes:
        tracker: Started by whoever made this.
        tracks: Of each frame.
        traces: Rows of a `TraceLog`, where the truth is known.
        shown: What else it shows, likewise.
        digest: SHA-256 of all tracks and traces.
        track_ms: Milliseconds that each step took.
        log_ms: Milliseconds that it took to keep each.
    """

    def __init__(self, tracker: Tracker) -> None:
        self.tracker = tracker
        self.tracks: list[Tracks] = []
        self.traces = _TraceRows()
        self.shown = ShownRows()
        self.digest = hashlib.sha256()
        self.track_ms: list[float] = []
        self.log_ms: list[float] = []

    def step(self, frame: Frame, observation: Observation | None = None) -> tuple[Tracks, Diagnostics]:
        """Let the tracker take a frame.

        Args:
            frame: What it is given.
            observation: With the truth that its traces are scored by; None for a recording.
        """
        if isinstance(self.tracker, Fed | Realtime) and observation is not None:
            self.tracker.look(frame, observation)
        started = time.perf_counter()
        tracks = self.tracker.step(frame)
        self.track_ms.append(_milliseconds_since(started))

        started = time.perf_counter()
        diagnostics = getattr(self.tracker, "diagnostics", None) or Diagnostics()
        tracks = _copied(tracks)
        self.tracks.append(tracks)
        digest.add(self.digest, tracks)
        if observation is not None:
            self.shown.add(diagnostics, observation.ids, observation.truth)
        if diagnostics.traces is not None:
            traces = _copied(diagnostics.traces)
            digest.add(self.digest, traces)
            if observation is not None:
                votes = bridge.votes(traces, observation.ids, observation.depth, observation.truth)
                self.traces.add(frame.tick, traces, votes)
        self.log_ms.append(_milliseconds_since(started))
        return tracks, diagnostics


class _TraceRows:
    """Gathers the rows of a `TraceLog` frame by frame."""

    def __init__(self) -> None:
        self._columns: dict[str, list[NDArray[Any]]] = {}

    def add(self, tick: int, traces: Traces, votes: bridge.Votes) -> None:
        columns: dict[str, NDArray[Any]] = {
            "ticks": np.full(len(traces.ids), tick, np.int64),
            "ids": traces.ids,
            "x": traces.x,
            "v": traces.v,
            "labels": traces.labels,
            "p_car": traces.p_car,
            "owners": traces.owners,
            "vote_ticks": np.full(len(votes.ids), tick, np.int64),
            "vote_ids": votes.ids,
            "vote_objects": votes.objects,
            "vote_counts": votes.counts,
            "vote_depths": votes.depths,
        }
        for name, column in columns.items():
            self._columns.setdefault(name, []).append(column)

    def finish(self) -> TraceLog | None:
        """Return all rows; None of a tracker that never showed traces."""
        if not self._columns:
            return None
        return TraceLog(**{name: np.concatenate(parts) for name, parts in self._columns.items()})


def _copied(value: _Arrays) -> _Arrays:
    """Return a dataclass of arrays with copies of them: a tracker may go on writing into its own."""
    arrays: dict[str, Any] = {f.name: getattr(value, f.name) for f in fields(value)}
    return replace(value, **{name: array.copy() for name, array in arrays.items() if array is not None})


def _milliseconds_since(started: float) -> float:
    return 1e3 * (time.perf_counter() - started)
