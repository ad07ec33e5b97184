"""Runs: a scenario over seeds with several trackers, in one process or many, as one JSON document."""

from __future__ import annotations

import hashlib
import resource
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from scenarios import manifest as manifests
from scenarios.detections import make_fed
from scenarios.errors import InputError
from scenarios.log import EpisodeLog, save
from scenarios.loop import run_episode
from scenarios.output import write_json
from scenarios.realtime import Realtime
from scenarios.score.params import Boxes, ScoringParams
from scenarios.spec import Scenario
from scenarios.workers import Progress, ThisProcess, Workers
from tracker.base import Tracker
from tracker.registry import make
from tracker.types import Diagnostics, Tracks

if TYPE_CHECKING:
    from scenarios.report.recorder import Recorder
    from sim.simulation import Observation

SCORING = ScoringParams()
Document = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What to run.

    Attributes:
        scenario: What is driven.
        seeds: Which of its drives.
        trackers: Names, each once.
        boxes: Which truth is scored.
        odometry: Whether the trackers get the car's noisy odometry.
        realtime: Whether frames that come while a tracker is busy are dropped (`scenarios.realtime`). Tracks
            then depend on the machine, so a manifest leaves them out.
        figures: Pictures to show in the reports, such as recorded frames beside simulated ones.
    """

    scenario: Scenario
    seeds: range
    trackers: tuple[str, ...]
    boxes: Boxes = "amodal"
    odometry: bool = False
    realtime: bool = False
    figures: tuple[Path, ...] = ()

    @property
    def frames(self) -> int:
        """Frames to be rendered."""
        return len(self.seeds) * self.scenario.frames

    def seed_folder(self, directory: Path, seed: int) -> Path:
        """Return where one episode is kept: a folder of its own where there are several."""
        return directory / f"seed-{seed}" if len(self.seeds) > 1 else directory

    def folder(self, directory: Path, seed: int, tracker: str) -> Path:
        """Return where one episode of one tracker is kept."""
        folder = self.seed_folder(directory, seed)
        return folder / tracker.replace(":", "-").replace("/", "-") if len(self.trackers) > 1 else folder


MEDIA = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg"}
"""Of the pictures that a report takes, by the end of their names."""


def check_figure(path: Path) -> None:
    """Look whether a picture can go into a report.

    Raises:
        InputError: If it is no PNG or JPEG.
    """
    if path.suffix.lower() not in MEDIA or not path.is_file() or not cv2.haveImageReader(str(path)):
        raise InputError(f"--figure {path}: wanted a picture, PNG or JPEG")


def make_tracker(name: str, scenario: Scenario | None = None, seed: int = 0) -> Tracker:
    """Build a tracker by its name; one that starts at detections is fed with them (`scenarios.detections`).

    Args:
        name: Of a tracker, or ``tracker@detector``.
        scenario: What is driven; None for a recording, which has no truth to make detections of.
        seed: Which of its drives: the errors of detectors with errors are drawn from it.

    Raises:
        InputError: If there is none, or it cannot be built.
    """
    try:
        if scenario is None:
            return make(name)
        return make_fed(name, scenario.scene, rate=scenario.rate, seed=seed)
    except ValueError as error:
        raise InputError(str(error)) from error


def execute(
    run: Run,
    directory: Path | None = None,
    progress: Progress | None = None,
    *,
    workers: Workers | None = None,
) -> Document:
    """Run everything and return the document that ``--json`` prints.

    Args:
        run: What to run.
        directory: Where to write what is kept of the episodes; None keeps nothing.
        progress: Called now and then, in this process.
        workers: Who runs the episodes, this process if None; the scores do not depend on it. All of them must
            see the directory.

    Raises:
        InputError: If there is no such tracker.
        RenderUnavailableError: If there is no off-screen OpenGL here.
    """
    from scenarios.score.statistics import paired

    for name in run.trackers:
        make_tracker(name, run.scenario, run.seeds[0])
    by_seed = dict(
        (workers or ThisProcess()).each(
            partial(run_seed, run, directory),
            run.seeds,
            frames=run.scenario.frames,
            progress=progress,
        )
    )
    episodes = {name: [by_seed[seed][name] for seed in run.seeds] for name in run.trackers}
    runs = [_joined(documents) for documents in episodes.values()]
    document = runs[0]
    if len(runs) > 1:
        scores = {name: [episode["scores"] for episode in found] for name, found in episodes.items()}
        document = {"runs": runs, "paired": paired(scores)}
    if directory is not None:
        write_json(directory / "scores.json", document)
        if len(run.seeds) > 1:
            _join_manifests(run, directory)
        if len(run.seeds) * len(run.trackers) > 1:
            _summarise(run, directory, document)
    return document


def run_seed(
    run: Run, directory: Path | None, seed: int, *, progress: Progress | None = None
) -> dict[str, Document]:
    """Run one episode, write what is kept of it, and return the document of each tracker by its name."""
    from scenarios.score.summary import details, score

    if directory is not None and not directory.is_dir():
        raise InputError(f"--out: a worker does not see {directory.parent}; wanted a folder that all share")
    trackers = {name: make_tracker(name, run.scenario, seed) for name in run.trackers}
    if run.realtime:
        trackers = {name: Realtime(tracker) for name, tracker in trackers.items()}
    documents = {}
    with ExitStack() as stack:
        recorders, chain = {}, manifests.Chain()
        if directory is not None:
            for name in trackers:
                recorder = _recorder(run, seed, name, run.folder(directory, seed, name))
                recorders[name] = stack.enter_context(recorder)

        def on_frame(observation: Observation, shown: Mapping[str, tuple[Tracks, Diagnostics]]) -> None:
            for name, recorder in recorders.items():
                tracks, diagnostics = shown[name]
                recorder.frame(observation.image, tracks, diagnostics, observation.truth)
            if directory is not None:
                repeatable = {} if run.realtime else shown
                chain.add(observation, {name: tracks for name, (tracks, _) in repeatable.items()})
            if progress is not None:
                progress(1)

        logs = run_episode(run.scenario, seed, trackers, odometry=run.odometry, on_frame=on_frame)
        for log in logs:
            scores, difficulty = score(log, boxes=run.boxes, params=SCORING)
            documents[log.tracker] = _document(run, log, scores, difficulty) | {
                "details": details(log, boxes=run.boxes, params=SCORING),
                "dropped_frames": _dropped(trackers[log.tracker]),
            }
            if directory is not None:
                _keep(run, log, documents[log.tracker], recorders[log.tracker])
        if directory is not None:
            made = _manifest(run, seed, chain)
            manifests.write(run.seed_folder(directory, seed) / manifests.NAME, made)
    return documents


def _manifest(run: Run, seed: int, chain: manifests.Chain) -> manifests.Manifest:
    return manifests.Manifest(
        scenario=run.scenario,
        trackers=() if run.realtime else run.trackers,
        odometry=run.odometry,
        environment=manifests.environment(),
        episodes={seed: chain.frames},
    )


def _join_manifests(run: Run, directory: Path) -> None:
    folders = [run.seed_folder(directory, seed) for seed in run.seeds]
    if not all((folder / manifests.NAME).is_file() for folder in folders):
        raise InputError("--out: the workers do not write to the same folder; wanted one that all share")
    made = [manifests.read(folder / manifests.NAME) for folder in folders]
    manifests.write(directory / manifests.NAME, manifests.join(made))


def _summarise(run: Run, directory: Path, document: Document) -> None:
    from scenarios.report.summary import write_summary  # plots: only where a report is wanted

    reports = {
        name: {seed: run.folder(directory, seed, name) / "report.html" for seed in run.seeds}
        for name in run.trackers
    }
    write_summary(directory, document, reports, description=run.scenario.description)


def _recorder(run: Run, seed: int, tracker: str, folder: Path) -> Recorder:
    from scenarios.report.recorder import Recorder  # plots and video: only where a report is wanted

    camera = run.scenario.params.camera
    title = f"{run.scenario.name}, seed {seed}: {tracker}"
    return Recorder(
        folder,
        width=camera.width,
        height=camera.height,
        rate=run.scenario.rate,
        title=title,
        scene=run.scenario.scene,
    )


def _keep(run: Run, log: EpisodeLog, document: Document, recorder: Recorder) -> None:
    from scenarios.export.mot import write_tracks
    from scenarios.report.pictures import Picture

    folder = recorder.directory
    save(log, folder / "log.npz")
    write_tracks(folder / "tracks.txt", log.tracks)
    write_json(folder / "scores.json", document)
    figures = [Picture(path.stem, path.read_bytes(), MEDIA[path.suffix.lower()]) for path in run.figures]
    recorder.finish(log, document, run.scenario.model_dump(mode="json"), figures=figures)


def _document(run: Run, log: EpisodeLog, scores: Document, difficulty: Document) -> Document:
    timing = {stage: float(np.mean(ms)) for stage, ms in log.timing_ms.items()}
    return {
        "scenario": log.scenario,
        "spec_id": log.spec_id,
        "seeds": [log.seed],
        "tracker": log.tracker,
        "boxes": run.boxes,
        "odometry": run.odometry,
        "realtime": run.realtime,
        "frames": len(log.tracks),
        "scores": scores,
        "difficulty": difficulty,
        "thresholds": asdict(SCORING),
        "hashes": log.hashes,
        "timing_ms": timing,
        "fps": 1e3 / sum(timing.values()),
        "peak_rss_mb": peak_rss_mb(),
    }


def _dropped(tracker: Tracker) -> int:
    return tracker.dropped if isinstance(tracker, Realtime) else 0


def peak_rss_mb() -> float:
    """Return the most memory that this process has held so far, megabytes."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1 << 20 if sys.platform == "darwin" else 1 << 10)


def _joined(documents: list[Document]) -> Document:
    """Join one tracker's documents over seeds; one alone stays as it is."""
    from scenarios.score.statistics import over_seeds

    first = documents[0]
    if len(documents) == 1:
        return first
    frames = np.array([d["frames"] for d in documents], float)
    return first | {
        "seeds": [seed for d in documents for seed in d["seeds"]],
        "frames": int(frames.sum()),
        "scores": over_seeds([d["scores"] for d in documents]),
        "difficulty": over_seeds([d["difficulty"] for d in documents]),
        "details": over_seeds([d["details"] for d in documents]),
        "dropped_frames": sum(d["dropped_frames"] for d in documents),
        # In the order of the seeds, whichever process was ready first.
        "hashes": {
            name: hashlib.sha256("".join(d["hashes"][name] for d in documents).encode()).hexdigest()
            for name in first["hashes"]
        },
        "timing_ms": {
            stage: float(np.average([d["timing_ms"][stage] for d in documents], weights=frames))
            for stage in first["timing_ms"]
        },
        "fps": float(frames.sum() / sum(d["frames"] / d["fps"] for d in documents)),
        "peak_rss_mb": max(d["peak_rss_mb"] for d in documents),
    }
