"""The plots of the report: SVG that goes into the page and takes its colours from there."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import TwoSlopeNorm
from numpy.typing import NDArray

from scenarios.report.history import TraceSamples
from scenarios.report.palette import DOTS, LABELS, NO_TRACK, SERIES, identity
from scenarios.report.series import FollowedRider
from scenarios.report.svg import draw_svg
from tracker.types import Label

Floats = NDArray[np.float64]

Estimate = tuple[float, float, float]
"""A value, and where its 95 % interval begins and ends."""

Share = tuple[float, str]
"""A share of 1, and what is written above it."""
_MOST_WRITTEN = 18
"""Bars of one plot above which there is room for a number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeAxis:
    """Where time runs in a plot, so that the page can join it to the video.

    Attributes:
        vertical: Whether it runs downward; else to the right.
        low: Where it begins, as a share of the plot's height or width.
        high: Where it ends.
        seconds: The time from the one to the other.
    """

    vertical: bool
    low: float
    high: float
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """One drawing and the words beneath it."""

    title: str
    caption: str
    svg: Markup
    time: TimeAxis | None = None


def profile(
    image: NDArray[np.uint8],
    samples: TraceSamples,
    *,
    rate: float,
    stride: int,
    width: int,
    colour: str | None,
) -> tuple[Markup, TimeAxis]:
    """Draw a temporal profile, time downward, with the traces upon it.

    Args:
        image: (T, W) bytes; without rows the traces stand on a plain ground.
        samples: Of the traces.
        rate: Frames a second.
        stride: Frames from one row of ``image`` to the next.
        width: Of the frames, px.
        colour: "identity" (by track, else by trace), "label", or None for no traces.
    """
    last = int(samples.ticks.max(initial=0)) + 1
    seconds = max(len(image) * stride, last, 2) / rate

    def draw(axes: Axes) -> None:
        axes.grid(visible=False)
        axes.set_facecolor("#101216")
        if image.size:
            dark, bright = np.quantile(image, (0.01, 0.995))
            shades = np.clip((image - dark) / max(float(bright - dark), 1.0), 0.0, 1.0)
            extent = (0.0, float(width), len(image) * stride / rate, 0.0)
            axes.imshow(
                shades**0.8,
                cmap="gray",
                vmin=0,
                vmax=1.6 if colour else 1,
                extent=extent,
                aspect="auto",
                interpolation="antialiased",
            )
        if colour is not None and len(samples.ids):
            segments, colours = _paths(samples, rate, stride, by_label=colour == "label")
            axes.add_collection(
                LineCollection(segments, colors=colours, linewidths=1.3, rasterized=True, capstyle="round")
            )
        axes.set(xlim=(0, width), ylim=(seconds, 0), xlabel="x, px", ylabel="time, s")

    svg, (_, y0, _, y1) = draw_svg(draw, size=(3.7, 4.5), margins=(0.58, 0.12, 0.44, 0.08))
    return svg, TimeAxis(vertical=True, low=1 - y1, high=1 - y0, seconds=seconds)


def _paths(
    samples: TraceSamples, rate: float, stride: int, *, by_label: bool
) -> tuple[list[Floats], list[str]]:
    """Cut the samples into polylines of one colour each."""
    order = np.lexsort((samples.ticks, samples.ids))
    ids, ticks, x = samples.ids[order], samples.ticks[order], samples.x[order].astype(float)
    times = (ticks + 0.5) / rate
    key = samples.labels[order].astype(np.int64) if by_label else samples.owners[order]
    new = np.flatnonzero((ids[1:] != ids[:-1]) | (ticks[1:] - ticks[:-1] > 5 * stride)) + 1
    turn = np.flatnonzero((key[1:] != key[:-1]) & (ids[1:] == ids[:-1])) + 1
    breaks = set(new.tolist())
    bounds = [0, *sorted(breaks | set(turn.tolist())), len(ids)]
    segments, colours = [], []
    for begin, end in itertools.pairwise(bounds):
        # Where only the colour turns, the line goes on from the last point of the old one.
        first = begin - 1 if begin and begin not in breaks else begin
        if end - first < 2:
            continue
        segments.append(np.column_stack([x[first:end], times[first:end]]))
        if by_label:
            colours.append(LABELS[Label(int(key[begin]))])
        else:
            colours.append(identity(int(key[begin])) if key[begin] else NO_TRACK)
    return segments, colours


def likelihoods(
    background: Floats,
    car: Floats,
    *,
    x: Floats,
    v: Floats,
    samples: Mapping[str, tuple[Floats, Floats]],
) -> tuple[tuple[str, Markup], ...]:
    """Draw p(x,v|B), p(x,v|C) and the log of their ratio as maps, with an episode's samples upon them.

    Args:
        background: (V, X) density, per px and px/s.
        car: (V, X) likewise.
        x: (X,) px from the principal point.
        v: (V,) px/s.
        samples: x and v of the traces, by their true class.
    """
    floor = 1e-9
    ratio = np.log10(np.maximum(car, floor)) - np.log10(np.maximum(background, floor))
    extent = (float(x[0]), float(x[-1]), float(v[0]), float(v[-1]))

    def density(values: Floats) -> Callable[[Axes], None]:
        def draw(axes: Axes) -> None:
            logs = np.log10(np.maximum(values, floor))
            image = axes.imshow(
                logs,
                origin="lower",
                extent=extent,
                aspect="auto",
                cmap="cividis",
                vmin=-7.5,
                vmax=logs.max(),
                interpolation="bilinear",
            )
            _finish_map(axes, image, "log₁₀ density", samples, extent)

        return draw

    def draw_ratio(axes: Axes) -> None:
        image = axes.imshow(
            np.clip(ratio, -3, 3),
            origin="lower",
            extent=extent,
            aspect="auto",
            cmap="PiYG_r",
            norm=TwoSlopeNorm(0, -3, 3),
            interpolation="bilinear",
        )
        axes.contour(x, v, ratio, levels=[0.0], colors="#222", linewidths=1.0)
        _finish_map(axes, image, "log₁₀ ratio", samples, extent)

    return (
        (
            "Background: p(x, v | B)",
            draw_svg(density(background), size=(3.7, 3.1), margins=(0.55, 0.62, 0.44, 0.08))[0],
        ),
        ("Car: p(x, v | C)", draw_svg(density(car), size=(3.7, 3.1), margins=(0.55, 0.62, 0.44, 0.08))[0]),
        (
            "Car against background: log ratio",
            draw_svg(draw_ratio, size=(3.7, 3.1), margins=(0.55, 0.62, 0.44, 0.08))[0],
        ),
    )


def _finish_map(
    axes: Axes,
    image: object,
    label: str,
    samples: Mapping[str, tuple[Floats, Floats]],
    extent: tuple[float, float, float, float],
) -> None:
    for name, (x, v) in samples.items():
        # White beneath the colour: a dot has to be seen on every shade of the map.
        axes.scatter(x, v, s=5, color="white", linewidths=0, rasterized=True, zorder=3)
        axes.scatter(x, v, s=2.5, color=DOTS[name], linewidths=0, rasterized=True, zorder=4)
    axes.grid(visible=False)
    axes.set(xlim=extent[:2], ylim=extent[2:], xlabel="x from the principal point, px", ylabel="v, px/s")
    bar = axes.figure.colorbar(image, ax=axes, pad=0.03, fraction=0.06)  # type: ignore[arg-type]
    bar.set_label(label)
    bar.outline.set_visible(False)


def lines(
    series: Mapping[str, tuple[Floats, Floats]],
    *,
    seconds: float,
    label: str,
    limits: tuple[float | None, float | None] = (None, None),
    colours: Sequence[str] = SERIES,
    steps: bool = False,
) -> tuple[Markup, TimeAxis]:
    """Draw values over time.

    Args:
        series: Seconds and values, by name; what is no number leaves a gap.
        seconds: Length of the episode.
        label: Of the axis of values.
        limits: Of it, None where the values decide.
        colours: One a series.
        steps: Whether values are counts, which jump.
    """

    def draw(axes: Axes) -> None:
        for (name, (times, values)), colour in zip(series.items(), colours, strict=False):
            axes.plot(times, values, label=name, color=colour, drawstyle="steps-mid" if steps else "default")
        _finish_lines(axes, seconds, label, limits, legend=len(series) > 1)

    return _over_time(draw, seconds)


def lives(riders: Sequence[FollowedRider], *, rate: float, seconds: float) -> tuple[Markup, TimeAxis]:
    """Draw a line for each rider, coloured by the track on it, with the id where a track begins.

    Args:
        riders: In the order in which they came.
        rate: Frames a second.
        seconds: Length of the episode.
    """
    height = 0.75 + 0.135 * len(riders)

    def draw(axes: Axes) -> None:
        for row, rider in enumerate(riders):
            cuts = np.flatnonzero((np.diff(rider.tracks) != 0) | (np.diff(rider.frames) > 1)) + 1
            bounds = [0, *cuts.tolist(), len(rider.tracks)]
            told = 0
            for begin, end in itertools.pairwise(bounds):
                track = int(rider.tracks[begin])
                start, stop = rider.frames[begin] / rate, (rider.frames[end - 1] + 1) / rate
                colour = identity(track) if track else NO_TRACK
                bar = 0.72 if track else 0.16
                axes.broken_barh([(start, stop - start)], (row - bar / 2, bar), color=colour, linewidth=0)
                if track and track != told and stop - start > 0.02 * seconds:
                    axes.text(
                        start + 0.003 * seconds,
                        row + 0.02,
                        str(track),
                        color="#0a0a0e",
                        fontsize=5.5,
                        va="center",
                    )
                    told = track
        axes.grid(visible=False, axis="y")
        axes.set(
            xlim=(0, seconds), ylim=(len(riders) - 0.3, -0.7), xlabel="time, s", ylabel="riders, as they came"
        )
        axes.set_yticks([])

    svg, (x0, _, x1, _) = draw_svg(draw, size=(10.4, height), margins=(0.34, 0.16, 0.44, 0.06))
    return svg, TimeAxis(vertical=False, low=x0, high=x1, seconds=seconds)


def bands(
    series: Mapping[str, tuple[Floats, Floats, Floats, Floats]],
    *,
    seconds: float,
    label: str,
    colours: Mapping[str, str],
) -> tuple[Markup, TimeAxis]:
    """Draw medians over time within their quartiles.

    Args:
        series: Seconds, lower quartiles, medians and upper quartiles, by name.
        seconds: Length of the episode.
        label: Of the axis of values, which go from 0 to 1.
        colours: By name.
    """

    def draw(axes: Axes) -> None:
        for name, (times, low, middle, high) in series.items():
            axes.fill_between(times, low, high, color=colours[name], alpha=0.22, linewidth=0)
            axes.plot(times, middle, color=colours[name], label=name)
        _finish_lines(axes, seconds, label, (-0.02, 1.02), legend=True)

    return _over_time(draw, seconds)


def stacked(
    series: Mapping[str, Floats], times: Floats, *, seconds: float, label: str, top: float
) -> tuple[Markup, TimeAxis]:
    """Draw parts of a sum over time, one upon the other.

    Args:
        series: (T,) parts by name.
        times: (T,) seconds.
        seconds: Length of the episode.
        label: Of the axis of values.
        top: Its upper end: single slow frames may reach out of the plot.
    """

    def draw(axes: Axes) -> None:
        colours = SERIES[: len(series)]
        axes.stackplot(times, *series.values(), labels=list(series), colors=colours, linewidth=0, alpha=0.85)
        _finish_lines(axes, seconds, label, (0, top), legend=True)

    return _over_time(draw, seconds)


def estimates(rows: Mapping[str, Sequence[Estimate | None]], names: Sequence[str]) -> Markup:
    """Draw fractions with their intervals, a row a score and a dot for each of ``names``.

    Args:
        rows: Value, low and high, or None, in the order of ``names``, by score.
        names: Of what is compared.
    """
    spread = 0.52 / max(1, len(names))

    def draw(axes: Axes) -> None:
        for k in range(len(names)):
            found = [(row, items[k]) for row, items in enumerate(rows.values())]
            colour = SERIES[k % len(SERIES)]
            for row, item in found:
                if item is None:
                    continue
                y = row + (k - (len(names) - 1) / 2) * spread
                axes.plot(item[1:], [y, y], color=colour, linewidth=1.6, solid_capstyle="round")
                axes.plot([item[0]], [y], marker="o", markersize=4.5, color=colour)
        lows = [item[1] for items in rows.values() for item in items if item is not None]
        # What is far below 0 is cut off: it would press all else together.
        axes.set(xlim=(max(min(0.0, *lows), -0.2) - 0.01, 1.02), ylim=(len(rows) - 0.4, -0.6))
        axes.set_yticks(range(len(rows)), list(rows))
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
        axes.spines["left"].set_visible(False)

    return draw_svg(draw, size=(4.6, 0.5 + 0.34 * len(rows)), margins=(1.25, 0.1, 0.3, 0.05))[0]


def shares(bins: Sequence[str], rows: Sequence[tuple[str, Sequence[Share | None]]], *, label: str) -> Markup:
    """Draw shares of 1 as bars: a group for each bin, in it one for each of the rows.

    Args:
        bins: What stands beneath the groups.
        rows: A colour, and a share for each bin, None where there is none.
        label: Of the axis of values.
    """
    spread = 0.8 / max(1, len(rows))
    written = len(rows) * len(bins) <= _MOST_WRITTEN

    def draw(axes: Axes) -> None:
        for k, (colour, row) in enumerate(rows):
            for place, (value, text) in ((n, item) for n, item in enumerate(row) if item is not None):
                at = place + (k - (len(rows) - 1) / 2) * spread
                axes.bar(at, value, 0.9 * spread, color=colour, linewidth=0)
                if written:
                    axes.text(at, value + 0.015, text, ha="center", fontsize=6.5, color=colour)
        axes.set_xticks(range(len(bins)), bins)
        axes.set(xlim=(-0.6, len(bins) - 0.4), ylim=(0, 1.02), ylabel=label)
        axes.grid(visible=False, axis="x")

    return draw_svg(draw, size=(4.3, 2.3), margins=(0.56, 0.1, 0.5, 0.24))[0]


def _finish_lines(
    axes: Axes, seconds: float, label: str, limits: tuple[float | None, float | None], *, legend: bool
) -> None:
    axes.set(xlim=(0, seconds), xlabel="time, s", ylabel=label)
    axes.set_ylim(*limits)
    if legend and axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=5, handlelength=1.2, borderaxespad=0.1)


def _over_time(draw: Callable[[Axes], None], seconds: float) -> tuple[Markup, TimeAxis]:
    svg, (x0, _, x1, _) = draw_svg(draw, size=(5.0, 2.1), margins=(0.56, 0.16, 0.44, 0.24))
    return svg, TimeAxis(vertical=False, low=x0, high=x1, seconds=seconds)
