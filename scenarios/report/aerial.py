"""What the report shows of a flight alone: repaired tracks, forecasts of the hidden, who came back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scenarios.log import EpisodeLog
from scenarios.report import hidden, mosaic
from scenarios.report.flight import Flight, Return
from scenarios.report.pictures import Picture, jpeg
from scenarios.report.plots import Plot
from scenarios.report.returns import SAME, strips, verdict
from scenarios.score.disappearances import disappearances
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.prediction import by_hidden_time, predicted_events
from scenarios.score.reacquisition import ids_on_vehicles, outcomes
from sim.truth.types import AerialTruth


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightSection:
    """The pictures and plots of one flight.

    Attributes:
        mosaics: Before and after the repair.
        expected: Of hidden vehicles.
        plots: Of prediction errors and re-acquisitions.
        strips: Of those who came back.
        returns: How many came back.
    """

    mosaics: list[Picture]
    expected: list[Picture]
    plots: list[Plot]
    strips: list[Picture]
    returns: int


def section(flight: Flight, log: EpisodeLog | None, *, boxes: Boxes, rate: float) -> FlightSection | None:
    """Draw a flight; None where its tracker showed no mosaic."""
    if not flight.frames:
        return None
    paths = flight.paths()
    ground = mosaic.compose(flight.frames)
    before, pieces = mosaic.broken(ground, paths)
    after, whole = mosaic.repaired(ground, paths)
    mosaics = [
        Picture(f"Before: {pieces} tracks, as they were seen", jpeg(before), "image/jpeg"),
        Picture(f"After: {whole} tracks, dashed where they were hidden", jpeg(after), "image/jpeg"),
    ]
    height, width = flight.frames[0].image().shape[:2]
    expected = []
    frame = hidden.fullest(flight.frames, width, height)
    if frame is not None:
        expected.append(hidden.expectations(frame, log, rate))
    shown = hidden.predictors(_telling(flight.returns, log, boxes), paths, flight.frames, rate)
    if shown is not None:
        expected.append(shown)
    return FlightSection(
        mosaics=mosaics,
        expected=expected,
        plots=_plots(log, boxes) if log is not None and log.has_boxes else [],
        strips=strips(flight.returns, log, boxes, rate),
        returns=len(flight.returns),
    )


def _telling(returns: Sequence[Return], log: EpisodeLog | None, boxes: Boxes) -> list[Return]:
    """Put first who came back rightly, as far as that is known, and of those who was hidden longest."""
    on = ids_on_vehicles(log, boxes=boxes, params=ScoringParams()) if log is not None else None

    def order(each: Return) -> tuple[bool, int, int]:
        wrong = on is not None and verdict(each, on) != SAME
        return wrong, each.last - each.first, each.track

    return sorted(returns, key=order)


def _plots(log: EpisodeLog, boxes: Boxes) -> list[Plot]:
    params = ScoringParams()
    truths = [truth for truth in log.truth if isinstance(truth, AerialTruth)]
    events = disappearances(truths, log.rate, params)
    on = ids_on_vehicles(log, boxes=boxes, params=params)
    found = []
    curves = hidden.error_curves(predicted_events(log, events, on))
    if curves is not None:
        found.append(
            Plot(
                title="Prediction errors",
                caption="Mean distance of the first n predictions from the truth, events of n frames or more;"
                " a line and a Kalman filter go on from the same tracker's last points.",
                svg=curves,
            )
        )
    bars = hidden.by_hidden_time({log.tracker: by_hidden_time(events, outcomes(events, on), log.rate)})
    if bars is not None:
        found.append(
            Plot(
                title="Re-acquisition by hidden time",
                caption="Share of the events after which the vehicle has its id again.",
                svg=bars,
            )
        )
    return found
