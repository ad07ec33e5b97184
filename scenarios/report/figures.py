"""Chooses what is drawn of a run, and draws it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog
from scenarios.report import plots
from scenarios.report.history import TraceSamples
from scenarios.report.palette import CLASSES, LABELS
from scenarios.report.plots import Plot
from scenarios.report.series import Series, follow_riders, foreground_series, measure
from scenarios.score.params import Boxes
from tracker.types import Status

if TYPE_CHECKING:
    from scenarios.report.page import Recording

Floats = NDArray[np.float64]

DEFAULT_FOCAL = 800.0
"""Of the maps where no focal length is known, px a 640 px wide frame."""
MAX_SPEED = 120.0
"""The maps go so far to either side, px/s."""
MAX_DOTS = 1200
"""Samples on a map; more hide it."""
MAX_PROFILES = 3
_WINDOW = 0.5  # seconds over which the traces' probabilities are summed up


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """The plots of a page, by section.

    Attributes:
        profiles: Over x and time.
        maps: Likelihoods over x and v.
        maps_note: What they show.
        classes: Names of the classes whose samples are on the maps.
        times: Over time.
        riders: Which track was on each rider of a lane, or None.
    """

    profiles: list[Plot]
    maps: list[Plot]
    maps_note: str
    classes: list[str]
    times: list[Plot]
    riders: Plot | None


def draw(recording: Recording, *, log: EpisodeLog | None, boxes: Boxes, scenario: Mapping[str, Any]) -> Drawn:
    """Draw all plots that a run gives data for."""
    samples = recording.history.traces()
    series = measure(log, boxes=boxes) if log is not None else None
    by_class = _by_class(samples, series)
    maps, note = _maps(recording, samples, by_class, log, scenario)
    return Drawn(
        profiles=_profiles(recording, samples),
        maps=maps,
        maps_note=note,
        classes=list(by_class),
        times=_times(recording, samples, log, series),
        riders=_riders(log, boxes) if log is not None and log.scene == "motorcycle-lane" else None,
    )


def _riders(log: EpisodeLog, boxes: Boxes) -> Plot | None:
    """Draw which track was on each rider, frame by frame."""
    followed = follow_riders(log, boxes=boxes)
    if not followed:
        return None
    svg, time = plots.lives(followed, rate=log.rate, seconds=len(log.truth) / log.rate)
    return Plot(title="", caption="", svg=svg, time=time)


def _profiles(recording: Recording, samples: TraceSamples) -> list[Plot]:
    images = {name: image for name, image in recording.history.profiles().items() if image.any()}
    names = sorted(images, key=lambda name: name != "segments")[:MAX_PROFILES]
    drawn = []

    def add(name: str | None, colour: str | None, title: str, caption: str) -> None:
        image = images[name] if name is not None else np.zeros((0, 0), np.uint8)
        svg, time = plots.profile(
            image,
            samples,
            rate=recording.rate,
            stride=recording.history.stride,
            width=recording.width,
            colour=colour,
        )
        drawn.append(Plot(title=title, caption=caption, svg=svg, time=time))

    main = names[0] if names else None
    if len(samples.ids):
        add(main, "identity", "Traces by identity", "The colours are those of the boxes in the video.")
        add(main, "label", "Traces by label", "What the tracker takes each trace for, as it goes.")
    for name in names:
        add(name, None, f"Profile: {name}", "Brighter where more was found in the column.")
    return drawn


def _by_class(samples: TraceSamples, series: Series | None) -> dict[str, NDArray[np.bool_]]:
    """Return which samples are of each true class, or where the truth is not known, of each label."""
    if series is None:
        masks = {label.name.lower(): samples.labels == label for label in LABELS}
    else:
        names = np.array([series.classes.get(int(trace)) for trace in samples.ids], dtype=object)
        masks = {name: names == name for name in CLASSES}
    return {name: mask for name, mask in masks.items() if mask.any()}


def _maps(
    recording: Recording,
    samples: TraceSamples,
    by_class: Mapping[str, NDArray[np.bool_]],
    log: EpisodeLog | None,
    scenario: Mapping[str, Any],
) -> tuple[list[Plot], str]:
    if not len(samples.ids):
        return [], ""
    from tracker.in_car.likelihood import MotionModel, MotionPriors  # compiles kernels

    camera = (scenario.get("params") or {}).get("camera") or {}
    focal = recording.focal or camera.get("focal")
    focal_said = "" if focal else " (assumed)"
    focal = focal or DEFAULT_FOCAL * recording.width / 640
    priors, speed_said = MotionPriors(), " (assumed)"
    if log is not None and np.isfinite(log.ego_speed).any():
        priors, speed_said = MotionPriors(speed=max(float(np.nanmedian(log.ego_speed)), 1.0)), ""
    model = MotionModel(focal, priors)
    x = np.linspace(-recording.width / 2, recording.width / 2, 129)
    v = np.linspace(-MAX_SPEED, MAX_SPEED, 121)
    grid_x, grid_v = np.meshgrid(x, v)
    dots: dict[str, tuple[Floats, Floats]] = {}
    for name, mask in by_class.items():
        chosen = np.flatnonzero(mask)
        chosen = chosen[:: max(1, len(chosen) * len(by_class) // MAX_DOTS)]
        dots[name] = (samples.x[chosen].astype(float) - recording.width / 2, samples.v[chosen].astype(float))
    drawn = plots.likelihoods(
        model.background(grid_x, grid_v), model.car(grid_x, grid_v), x=x, v=v, samples=dots
    )
    captions = (
        "Static things stream outward from the middle, the faster the farther out.",
        "Vehicles ahead keep their place: slow at any x.",
        "Red-violet speaks for a car, green for background; on the line they are equally likely.",
    )
    note = (
        "Densities of image place and image speed, without yaw, at a focal length of"
        f" {focal:.0f} px{focal_said} and {priors.speed:.1f} m/s{speed_said}. The dots are samples of this"
        " run's traces, coloured by" + (" what they truly are." if log is not None else " their label.")
    )
    return [
        Plot(title=title, caption=caption, svg=svg)
        for (title, svg), caption in zip(drawn, captions, strict=True)
    ], note


def _times(
    recording: Recording, samples: TraceSamples, log: EpisodeLog | None, series: Series | None
) -> list[Plot]:
    drawn: list[Plot] = []
    seconds = max(recording.frames, 2) / recording.rate
    times: Floats = np.asarray((np.arange(recording.frames) + 0.5) / recording.rate, float)

    def add(title: str, caption: str, drawing: tuple[Any, plots.TimeAxis]) -> None:
        drawn.append(Plot(title=title, caption=caption, svg=drawing[0], time=drawing[1]))

    if series is not None and log is not None and log.has_boxes and len(series.scored) == len(times):
        most = max(np.nanmax(counts, initial=1) for counts in (series.scored, series.false))
        counts = {"scored": series.scored, "matched": series.matched, "false": series.false}
        add(
            "Objects",
            "Scored objects, those that a confirmed track lies on, and confirmed tracks that lie on none.",
            plots.lines(
                {name: (times, values) for name, values in counts.items()},
                seconds=seconds,
                label="objects",
                limits=(0, float(most) + 0.5),
                colours=("#8d96a5", "#3b82f6", "#ef4444"),
                steps=True,
            ),
        )
    if series is not None and np.isfinite(series.overlap).any() and len(series.overlap) == len(times):
        add(
            "Overlap of matches",
            "Mean IoU of matched boxes.",
            plots.lines({"IoU": (times, series.overlap)}, seconds=seconds, label="mean IoU", limits=(0, 1)),
        )
    if log is not None and (foreground := foreground_series(log)) is not None:
        add(
            "Foreground",
            "Precision and recall of the foreground mask's pixels, shadows apart; the training is left out.",
            plots.lines(
                {name: (times, values) for name, values in foreground.items()},
                seconds=seconds,
                label="share",
                limits=(0, 1.02),
            ),
        )
    if len(samples.ids):
        add(*_traces(samples, recording, seconds))
        if series is not None:
            add(*_belief(samples, series, recording, seconds))
    if series is None and recording.history.track_counts().any():
        add(*_tracks(recording, seconds))
    if log is not None and np.isfinite(log.ego_speed).any() and len(log.ego_speed) == len(times):
        add(
            "Speed of the camera car",
            "At a standstill nothing streams outward, and motion cannot tell cars from background.",
            plots.lines(
                {"speed": (times, log.ego_speed)},
                seconds=seconds,
                label="m/s",
                limits=(0, max(float(np.nanmax(log.ego_speed)) * 1.1, 1.0)),
            ),
        )
    if log is not None and log.timing_ms:
        stages = {name: ms for name, ms in log.timing_ms.items() if len(ms) == len(times) and ms.any()}
        if stages:
            total = np.sum(list(stages.values()), axis=0)
            medians = ", ".join(f"{name} {np.median(ms):.1f}" for name, ms in stages.items())
            add(
                "Processing time",
                f"Medians in ms: {medians}; {np.median(total):.1f} in all.",
                plots.stacked(
                    stages,
                    times,
                    seconds=seconds,
                    label="ms a frame",
                    top=1.3 * float(np.quantile(total, 0.98)),
                ),
            )
    return drawn


def _tracks(recording: Recording, seconds: float) -> tuple[str, str, tuple[Any, plots.TimeAxis]]:
    """Draw how many tracks of each status there are in a frame."""
    counts = recording.history.track_counts().astype(float)
    times: Floats = np.asarray(
        (np.arange(len(counts)) * recording.history.stride + 0.5) / recording.rate, float
    )
    drawing = plots.lines(
        {status.name.lower(): (times, counts[:, status]) for status in Status},
        seconds=seconds,
        label="tracks",
        limits=(0, None),
        colours=("#9aa0aa", "#3b82f6", "#f59e0b"),
        steps=True,
    )
    return "Tracks", "Tracks in a frame, by how sure the tracker is of them.", drawing


def _traces(
    samples: TraceSamples, recording: Recording, seconds: float
) -> tuple[str, str, tuple[Any, plots.TimeAxis]]:
    """Draw how many traces of each label there are in a frame."""
    kept = np.arange(0, max(recording.frames, 1), recording.history.stride)
    times: Floats = np.asarray((kept + 0.5) / recording.rate, float)
    rows = samples.ticks // recording.history.stride
    counts: dict[str, tuple[Floats, Floats]] = {
        label.name.lower(): (
            times,
            np.bincount(rows[samples.labels == label], minlength=len(kept)).astype(float),
        )
        for label in LABELS
    }
    drawing = plots.lines(
        counts, seconds=seconds, label="traces", limits=(0, None), colours=list(LABELS.values()), steps=True
    )
    return "Traces", "Traces in a frame, by what the tracker takes them for.", drawing


def _belief(
    samples: TraceSamples, series: Series, recording: Recording, seconds: float
) -> tuple[str, str, tuple[Any, plots.TimeAxis]]:
    """Draw p(car) of the traces by true class over time, in windows of half a second."""
    masks = _by_class(samples, series)
    edges = np.arange(0.0, seconds + _WINDOW, _WINDOW)
    window = np.digitize(samples.ticks / recording.rate, edges) - 1
    quartiles = {}
    for name, mask in masks.items():
        rows = np.full((3, len(edges) - 1), np.nan)
        for w in range(len(edges) - 1):
            values = samples.p_car[mask & (window == w)]
            if len(values):
                rows[:, w] = np.quantile(values, (0.25, 0.5, 0.75))
        quartiles[name] = ((edges[:-1] + edges[1:]) / 2, rows[0], rows[1], rows[2])
    return (
        "Belief in a car",
        "p(car) of the traces by what they truly are: medians and quartiles over half a second.",
        plots.bands(quartiles, seconds=seconds, label="p(car)", colours=CLASSES),
    )
