"""Where a tracker expects a vehicle while it is hidden (scoring.md 11): mean prediction errors, paper 2, 5.

MPE_n is the mean distance of the first n predictions of an event from the truth, Variance_n the variance of
these distances. Linear and Kalman predictions of the same events start from what the same tracker knew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog
from scenarios.score.disappearances import Disappearance, disappearances
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.reacquisition import BEFORE, Outcome, ids_on_vehicles, majority, outcomes
from sim.truth.types import AerialTruth
from tracker.aerial.calibration import quantile
from tracker.aerial.forecasts import WINDOW, Forecaster, KalmanForecast, LinearForecast
from tracker.aerial.stabilisation import inverse, transform
from tracker.aerial.trajectories import Trajectories

Floats = NDArray[np.float64]

LEADS = (10, 30, 60)
"""Frames over which prediction errors are averaged."""
TIMES = (0.5, 1.0, 2.0, 4.0)
"""Seconds hidden at which errors are looked up, and from which on events are counted apart."""
SHARES = (0.5, 0.95)
"""Shares of the truth that ought to lie inside the predicted ellipses of these shares."""
WHOLE = 0.95
"""A vehicle of which less can be seen is not a point of a history."""
PLAIN: Mapping[str, Forecaster] = {"linear": LinearForecast, "kalman": KalmanForecast}
"""What predictions are compared with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictedEvent:
    """What was predicted of a vehicle in the K frames in which it was hidden.

    Attributes:
        event: Which.
        track: Id of the track that had been on the vehicle.
        errors: (K,) px from the truth, not a number where nothing was predicted.
        measures: (K,) the same as squared Mahalanobis distances, where covariances were shown.
        plain: (K,) errors likewise, of each of `PLAIN`, all not numbers where no homographies were shown.
    """

    event: Disappearance
    track: int
    errors: Floats
    measures: Floats
    plain: dict[str, Floats]


def prediction(log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams) -> dict[str, Any]:
    """Score the predictions of hidden vehicles.

    Returns:
        By number of frames ``prediction_error_px`` (mean of MPE_n over the events predicted for n frames),
        ``prediction_variance_px2``, ``linear_prediction_error_px`` and ``kalman_prediction_error_px`` of the
        same events, and ``predicted_events``, how many these are; by seconds hidden
        ``prediction_error_at_px``; ``prediction_inside``, the share of truths inside the ellipses of 50 and
        95 %; and ``reacquisition_by_hidden_s``: ``events`` and ``correct`` ones, hidden for so long or
        longer, up to the next.
    """
    truths = [truth for truth in log.truth if isinstance(truth, AerialTruth)]
    events = disappearances(truths, log.rate, params)
    on = ids_on_vehicles(log, boxes=boxes, params=params) if log.has_boxes else {}
    predicted = predicted_events(log, events, on)
    of = {n: [p for p in predicted if _whole(p.errors, n)] for n in LEADS}
    ours = {str(n): mean_error([p.errors for p in of[n]], n) for n in LEADS}
    return {
        "prediction_error_px": {n: mean for n, (mean, _) in ours.items()},
        "prediction_variance_px2": {n: variance for n, (_, variance) in ours.items()},
        **{
            f"{name}_prediction_error_px": {
                str(n): mean_error([p.plain[name] for p in of[n]], n)[0] for n in LEADS
            }
            for name in PLAIN
        },
        "predicted_events": {str(n): len(of[n]) if log.has_boxes else None for n in LEADS},
        "prediction_error_at_px": {f"{s:g}": _error_at(predicted, round(s * log.rate)) for s in TIMES},
        "prediction_inside": {f"{100 * share:g}": _inside(predicted, share) for share in SHARES},
        "reacquisition_by_hidden_s": by_hidden_time(
            events, outcomes(events, on) if log.has_boxes else None, log.rate
        ),
    }


def predicted_events(
    log: EpisodeLog, events: Sequence[Disappearance], on: Mapping[int, Mapping[int, int]]
) -> list[PredictedEvent]:
    """Gather what a tracker predicted in those of the events whose vehicle it had followed.

    Args:
        log: Of an aerial episode.
        events: Of its truth.
        on: By tick and vehicle, the id of the track on it.
    """
    truths = [truth for truth in log.truth if isinstance(truth, AerialTruth)]
    found = []
    for event in events:
        track = majority(on, event.vehicle, event.before[-BEFORE:])
        if track is None:
            continue
        ticks = range(event.first, event.last + 1)
        centres = true_centres(truths, event)
        apart = np.array([_said(log, track, tick) for tick in ticks]) - centres
        history = _history(log, truths, event, track, on)
        found.append(
            PredictedEvent(
                event=event,
                track=track,
                errors=np.hypot(*apart.T),
                measures=_measures(log, track, event.first, apart),
                plain={
                    name: _errors_of(make, history, track, log, event, centres)
                    for name, make in PLAIN.items()
                },
            )
        )
    return found


def true_centres(truths: Sequence[AerialTruth], event: Disappearance) -> Floats:
    """Return (K, 2) the middles of the hidden vehicle's box, px, in or out of the frame.

    They are not numbers in frames in which it is out of the extended frame, too.
    """
    centres = np.full((event.frames, 2), np.nan)
    for k, truth in enumerate(truths[event.first : event.last + 1]):
        for row in np.flatnonzero(truth.ids == event.vehicle):
            centres[k] = truth.box_amodal[row].reshape(2, 2).mean(0)
    return centres


def mean_error(errors: Sequence[Floats], lead: int) -> tuple[float | None, float | None]:
    """Return the means of MPE_n and Variance_n over the events that have ``lead`` errors at least.

    An event in which one of the first ``lead`` errors is not a number does not count.

    >>> mean_error([np.array([1.0, 3.0, 9.0]), np.array([5.0])], 2)
    (2.0, 1.0)
    """
    parts = [each[:lead] for each in errors if _whole(each, lead)]
    if not parts:
        return None, None
    table = np.array(parts)
    return float(table.mean()), float(table.var(axis=1).mean())


def by_hidden_time(
    events: Sequence[Disappearance], judged: Sequence[Outcome] | None, rate: int
) -> dict[str, dict[str, int | None]]:
    """Count events, and correct ones if they were judged, by how long the vehicle was hidden (`TIMES`)."""
    found: dict[str, dict[str, int | None]] = {}
    for begin, end in zip(TIMES, (*TIMES[1:], np.inf), strict=True):
        own = [k for k, event in enumerate(events) if begin <= event.frames / rate < end]
        correct = None if judged is None else sum(judged[k] == "correct" for k in own)
        found[f"{begin:g}"] = {"events": len(own), "correct": correct}
    return found


def _whole(errors: Floats, lead: int) -> bool:
    """Tell whether all of the first ``lead`` errors are known."""
    return len(errors) >= lead and bool(np.isfinite(errors[:lead]).all())


def _said(log: EpisodeLog, track: int, tick: int) -> Floats:
    """Return (2,) where a track is said to be in a frame, not numbers where it is not there."""
    tracks = log.tracks[tick]
    rows = np.flatnonzero(tracks.ids == track)
    if not len(rows):
        return np.full(2, np.nan)
    row = int(rows[0])
    return tracks.boxes[row].reshape(2, 2).mean(0) if tracks.state is None else tracks.state[row, :2]


def _measures(log: EpisodeLog, track: int, first: int, apart: Floats) -> Floats:
    measures = np.full(len(apart), np.nan)
    if log.shown.predictions is None:
        return measures
    for k, predictions in enumerate(log.shown.predictions[first : first + len(apart)]):
        for row in np.flatnonzero(predictions.ids == track):
            measures[k] = float(apart[k] @ np.linalg.solve(predictions.covariances[row], apart[k]))
    return measures


def _history(
    log: EpisodeLog,
    truths: Sequence[AerialTruth],
    event: Disappearance,
    track: int,
    on: Mapping[int, Mapping[int, int]],
) -> Trajectories | None:
    """Return the last F points that a track had of a vehicle, px of the mosaic; None without a mosaic."""
    if log.shown.homographies is None:
        return None
    known = [tick for tick in event.before if on.get(tick, {}).get(event.vehicle) == track]
    history = Trajectories()
    for tick in [tick for tick in known if _share_seen(truths[tick], event.vehicle) >= WHOLE][-WINDOW:]:
        history.append(track, tick, transform(log.shown.homographies[tick], _said(log, track, tick)))
    return history if track in history else None


def _errors_of(
    make: Forecaster,
    history: Trajectories | None,
    track: int,
    log: EpisodeLog,
    event: Disappearance,
    centres: Floats,
) -> Floats:
    """Return (K,) the errors, px, of a forecaster that knows a track's history alone."""
    if history is None or log.shown.homographies is None:
        return np.full(event.frames, np.nan)
    forecast = make(history, track)
    places = np.empty((event.frames, 2))
    for k, tick in enumerate(range(event.first, event.last + 1)):
        forecast.step(tick)
        places[k] = transform(inverse(log.shown.homographies[tick]), forecast.point)
    return np.asarray(np.hypot(*(places - centres).T))


def _share_seen(truth: AerialTruth, vehicle: int) -> float:
    return float(truth.visible[truth.ids == vehicle].max(initial=0.0))


def _error_at(predicted: Sequence[PredictedEvent], frames: int) -> float | None:
    """Return the mean error in the frame after which a vehicle has been hidden for ``frames``."""
    values = [p.errors[frames - 1] for p in predicted if len(p.errors) >= frames]
    known = [float(value) for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else None


def _inside(predicted: Sequence[PredictedEvent], share: float) -> float | None:
    measures = np.concatenate([np.zeros(0), *(p.measures for p in predicted)])
    known = measures[np.isfinite(measures)]
    return float(np.mean(known <= quantile(share))) if len(known) else None
