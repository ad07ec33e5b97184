"""The hidden vehicles of one flight: where they were expected, by whom, and how far that was off."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from numpy.typing import NDArray

from scenarios.log import EpisodeLog
from scenarios.report.annotate import annotate, draw_ellipse
from scenarios.report.flight import KeptFrame, Path, Return
from scenarios.report.mosaic import Mosaic, compose, draw_way
from scenarios.report.palette import SERIES, identity, rgb
from scenarios.report.pictures import Picture, jpeg
from scenarios.report.plots import Share, shares
from scenarios.report.svg import draw_svg
from scenarios.score.prediction import LEADS, PredictedEvent
from tracker.aerial.motion_context import ContextForecast
from tracker.aerial.stabilisation import transform
from tracker.aerial.trajectories import Trajectories

Floats = NDArray[np.float64]

SCALE = 2
"""Frames are drawn so many times as large."""
DEVIATIONS = 2.4477
"""Standard deviations of an ellipse that holds 95 % in the plane."""
ROOM = 90.0
"""Mosaic px around the ways that are shown of a vehicle and its predictors."""
FEWEST = 3
"""Events that a mean error is drawn of."""
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def fullest(frames: Sequence[KeptFrame], width: int, height: int) -> KeptFrame | None:
    """Return the frame in which most hidden vehicles are expected inside the picture, if any are."""
    best, most = None, 0
    for frame in frames:
        if frame.predictions is None:
            continue
        centres = frame.predictions.centres
        count = int(((centres > 0) & (centres < [width, height])).all(1).sum())
        if count > most:
            best, most = frame, count
    return best


def expectations(frame: KeptFrame, log: EpisodeLog | None, rate: float) -> Picture:
    """Draw where the hidden vehicles are expected, with ellipses of 95 %, and crosses where vehicles are."""
    canvas = annotate(
        frame.image(),
        tracks=frame.tracks,
        traces=None,
        truth_boxes=None,
        caption=f"{frame.index / rate:.2f} s",
        scale=SCALE,
        strip=0,
    )
    if log is not None:
        truth = log.truth[frame.index]
        for box in truth.box_amodal[(truth.visible < 0.3) & (truth.in_frame > 0.5)]:
            x, y = (SCALE * box.reshape(2, 2).mean(0)).astype(int).tolist()
            cv2.drawMarker(canvas, (x, y), (255, 255, 255), cv2.MARKER_CROSS, 12, 2, cv2.LINE_AA)
    if frame.predictions is not None:
        shown = frame.predictions
        for track, centre, covariance in zip(shown.ids, shown.centres, shown.covariances, strict=True):
            draw_ellipse(
                canvas,
                SCALE * centre,
                SCALE**2 * covariance,
                rgb(identity(int(track))),
                deviations=DEVIATIONS,
            )
    words = "Dashed: where hidden vehicles are expected, with ellipses of 95 %."
    if log is not None:
        words += " White crosses: where vehicles less than three tenths of which can be seen are."
    return Picture(words, jpeg(canvas), "image/jpeg")


def predictors(
    returns: Sequence[Return], paths: Mapping[int, Path], frames: Sequence[KeptFrame], rate: float
) -> Picture | None:
    """Draw the predictors that the motion context takes for the first vehicle of ``returns`` that has some.

    They are those of a forecast made anew from the tracks' paths.
    """
    for each in returns:
        own = paths[each.track]
        forecast, ways, taken = rehearse(each, paths)
        if forecast is None or not taken:
            continue
        known = own.ticks <= each.last
        since = own.ticks >= each.first
        shown = np.concatenate([own.points[known][-90:], ways, own.points[since][:30]])
        mosaic = compose(frames, np.array([shown.min(0) - ROOM, shown.max(0) + ROOM]))
        canvas = mosaic.image.copy()
        for track in taken:
            draw_way(canvas, mosaic, paths[track].points, rgb(identity(track)), thickness=1)
            _name(canvas, mosaic, paths[track].points, track)
        white = (255, 255, 255)
        draw_way(canvas, mosaic, own.points[known], white, thickness=3)
        draw_way(canvas, mosaic, ways, white, dashed=True)
        draw_way(canvas, mosaic, own.points[since], white, thickness=3)
        names = ", ".join(str(track) for track in taken)
        words = (
            f"White: track {each.track}, hidden for {(each.first - each.last) / rate:.1f} s; dashed its"
            f" forecast by motion context. Its predictors in colour: {names}."
        )
        return Picture(words, jpeg(canvas), "image/jpeg")
    return None


def rehearse(each: Return, paths: Mapping[int, Path]) -> tuple[ContextForecast | None, Floats, list[int]]:
    """Forecast a track by motion context from what was seen of all tracks up to each frame.

    Returns:
        The forecast, None where the track was hardly seen; its ways (K, 2), px of the mosaic, until the track
        came back; and the ids of all predictors that it used.
    """
    by_tick: dict[int, list[tuple[int, Floats]]] = {}
    for track, path in paths.items():
        for tick, point, seen in zip(path.ticks.tolist(), path.points, path.seen, strict=True):
            if seen and tick < each.first:
                by_tick.setdefault(tick, []).append((track, point))
    known, forecast = Trajectories(), None
    ways: list[Floats] = []
    taken: dict[int, None] = {}
    for tick in sorted(by_tick):
        for track, point in by_tick[tick]:
            known.append(track, tick, point)
        if tick == each.last and each.track in known:
            forecast = ContextForecast(known, each.track)
        elif forecast is not None:
            forecast.step(tick)
        if forecast is not None:
            ways.append(forecast.point.copy())
            taken |= dict.fromkeys(guide.track for guide in forecast.guides)
    return forecast, np.array(ways).reshape(-1, 2), list(taken)


def error_curves(predicted: Sequence[PredictedEvent]) -> Markup | None:
    """Draw MPE_n over n: the mean of the events that were predicted for n frames, `FEWEST` or more."""
    longest = max((len(p.errors) for p in predicted), default=0)
    known = [_known(p.errors) for p in predicted]
    drawn = {
        "this tracker": _mean_curve([p.errors for p in predicted], known, longest),
        "linear": _mean_curve([p.plain["linear"] for p in predicted], known, longest),
        "Kalman": _mean_curve([p.plain["kalman"] for p in predicted], known, longest),
    }
    if not np.isfinite(drawn["this tracker"]).any():
        return None

    def draw(axes: Axes) -> None:
        for (name, values), colour in zip(drawn.items(), SERIES, strict=False):
            axes.plot(np.arange(1, longest + 1), values, label=name, color=colour)
        for lead in LEADS:
            axes.axvline(lead, color="#8d96a5", linewidth=0.6, linestyle=":")
        axes.set(xlim=(0, None), ylim=(0, None), xlabel="n, frames hidden", ylabel="MPE_n, px")
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=5, handlelength=1.2, borderaxespad=0.1)

    return draw_svg(draw, size=(5.0, 2.4), margins=(0.56, 0.16, 0.44, 0.24))[0]


def by_hidden_time(scores: Mapping[str, Mapping[str, Mapping[str, int | None]]]) -> Markup | None:
    """Draw the share of events that were re-acquired, by how long the vehicle was hidden.

    Args:
        scores: ``reacquisition_by_hidden_s`` by tracker.
    """
    bins = next(iter(scores.values()), {})
    names = [*bins]
    if not any(bins[name]["events"] for name in names):
        return None
    labels = [f"{a}–{b} s" for a, b in itertools.pairwise(names)] + [f"≥ {names[-1]} s"]
    rows: list[tuple[str, list[Share | None]]] = []
    for k, own in enumerate(scores.values()):
        counts = [(own[name]["events"], own[name]["correct"]) for name in names]
        found = [(c / n, str(c)) if n and c is not None else None for n, c in counts]
        rows.append((SERIES[k % len(SERIES)], found))
    beneath = [f"{words}\nn = {bins[n]['events']}" for words, n in zip(labels, names, strict=True)]
    return shares(beneath, rows, label="share correct")


def _mean_curve(errors: Sequence[Floats], known: Sequence[int], longest: int) -> Floats:
    """Return (longest,) the mean over events of the mean of their first n errors; see `error_curves`."""
    curve = np.full(longest, np.nan)
    for n in range(1, longest + 1):
        parts = [own[:n].mean() for own, count in zip(errors, known, strict=True) if count >= n]
        if len(parts) >= FEWEST:
            curve[n - 1] = np.mean(parts)
    return curve


def _known(errors: Floats) -> int:
    """Return how many of the first errors are known, without a gap."""
    gaps = np.flatnonzero(~np.isfinite(errors))
    return int(gaps[0]) if len(gaps) else len(errors)


def _name(canvas: NDArray[np.uint8], mosaic: Mosaic, points: Floats, track: int) -> None:
    """Write a track's id where its way is in the picture for the first time."""
    places = transform(mosaic.from_mosaic, points)
    height, width = canvas.shape[:2]
    inside = ((places > 12) & (places < [width - 24, height - 12])).all(1)
    if inside.any():
        x, y = places[int(np.flatnonzero(inside)[0])].astype(int).tolist()
        cv2.putText(canvas, str(track), (x + 4, y - 4), _FONT, 0.4, rgb(identity(track)), 1, cv2.LINE_AA)
