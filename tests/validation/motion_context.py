"""Paper 2's protocol (section 5): observe a vehicle for F frames, hide it, predict, and compare.

``python -m tests.validation.motion_context [--recorded DIR]`` prints MPE_n and its variance (methods.md 2.6)
of the motion context and of straight continuation by a line and by a Kalman filter, on traffic that the
simulator drives on straight and on winding roads, and on recorded traffic where that is at hand; and how much
of the truth lies inside the predicted ellipses of 50 and 95 %. Positions are seen from above with noise;
other vehicles are seen all the time, as far as they are not being hidden themselves.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim import meshes
from sim.params import EgoParams, RoadParams, TrafficParams
from sim.recorded import read, resample
from sim.rng import stream
from sim.roads import build_road
from sim.traffic import Traffic
from tracker.aerial.calibration import SHARES, Calibration, quantile
from tracker.aerial.forecasts import WINDOW, Forecast, Forecaster, KalmanForecast, LinearForecast
from tracker.aerial.motion_context import PRINTED, ContextForecast
from tracker.aerial.trajectories import Trajectories

Floats = NDArray[np.float64]

SCALE = 6.0
"""Px a metre: a car is some 27 px long."""
NOISE = 0.7
"""Standard deviation of a seen coordinate, px."""
LEADS = (10, 30, 60)
RATE = 30
EVERY = 10
"""Frames between two vehicles' being hidden."""
TURNED = np.radians(15.0)
"""A way is curved if the vehicle's heading turns by more while it is hidden."""
FORECASTERS: dict[str, Forecaster] = {
    "context": ContextForecast,
    "as printed": lambda known, track: ContextForecast(known, track, parameters=PRINTED),
    "linear": LinearForecast,
    "Kalman": KalmanForecast,
}

RECORDINGS = {
    "drone": "geotrax/vehicles.csv",
    "US-101": "commonroad/USA_US101-4_1_T-1.xml",
    "Lankershim": "commonroad/USA_Lanker-1_1_T-1.xml",
}
"""Files of the folder with recorded traffic: 5, 10 and 4 seconds."""
REPEATS = 8
"""Times that a recording is gone through, other vehicles hidden each time: it is short."""

Ways = Mapping[int, tuple[int, Floats]]
"""Of each vehicle the first tick, and its positions from then on, (K, 2) px."""


@dataclass(frozen=True, slots=True)
class Event:
    """One vehicle hidden for n frames.

    Attributes:
        curved: Whether its way turned.
        errors: (n,) distances, px, of the truth from each forecast.
        inside: (n, 2) whether the truth lies inside the forecast's ellipses of 50 and 95 %.
        predictors: Mean number of predictors that the motion context had.
    """

    curved: bool
    errors: dict[str, Floats]
    inside: dict[str, NDArray[np.bool_]]
    predictors: float


def simulated(seed: int, *, curved: bool, seconds: float = 40.0) -> Ways:
    """Drive traffic along a road, and look at 300 m of it from above."""
    road_params = RoadParams(curved=curved, min_radius=35.0, max_radius=70.0)
    road = build_road(road_params, 1500.0, stream(seed, "road"))
    drivers = TrafficParams(
        density=18.0, oncoming_density=14.0, speed=13.0 if curved else 20.0, vans=0, lorries=0, buses=0
    )
    traffic = Traffic(road, drivers, EgoParams(speed=drivers.speed), meshes.catalogue(), seed=seed, rate=RATE)
    ways: dict[int, tuple[int, list[Floats]]] = {}
    for tick in range(round(seconds * RATE)):
        bodies = traffic.vehicles()
        s, _ = road.locate(bodies.positions[:, 0], bodies.positions[:, 1])
        for k in np.flatnonzero((s > 250.0) & (s < 550.0)):
            way = ways.setdefault(int(bodies.ids[k]), (tick, []))[1]
            way.append(SCALE * bodies.positions[k, :2] * [1.0, -1.0])
        traffic.step(None)
    return {vehicle: (begin, np.array(way)) for vehicle, (begin, way) in ways.items()}


def recorded(path: Path) -> Ways:
    """Read a recording's vehicles, as they would be seen from above."""
    recording = read(path)
    sampled = resample(recording, RATE, start=0.0, ticks=int(recording.seconds * RATE) + 1)
    ways = {}
    for k in np.flatnonzero(sampled.present.any(0)).tolist():
        ticks = np.flatnonzero(sampled.present[:, k])
        ways[k] = (int(ticks[0]), SCALE * sampled.positions[ticks, k] * [1.0, -1.0])
    return ways


def hide(ways: Ways, *, seed: int = 0, frames: int = max(LEADS)) -> list[Event]:
    """Let the vehicles drive, hide some of them in turn, and forecast these."""
    rng = stream(seed, "hide")
    last = max(begin + len(way) for begin, way in ways.values())
    seen = {vehicle: way + rng.normal(0.0, NOISE, way.shape) for vehicle, (_, way) in ways.items()}
    known, hidden, events = Trajectories(), dict[int, tuple[int, dict[str, list[Floats]]]](), []
    models: dict[int, dict[str, Forecast]] = {}
    guides: dict[int, list[int]] = {}
    calibrations = {name: Calibration(make) for name, make in FORECASTERS.items()}
    for tick in range(last):
        here = [v for v, (begin, way) in ways.items() if begin <= tick < begin + len(way)]
        for vehicle in here:
            if vehicle not in hidden:
                known.append(vehicle, tick, seen[vehicle][tick - ways[vehicle][0]])
        for vehicle, (since, found) in list(hidden.items()):
            begin, way = ways[vehicle]
            truth = way[tick - begin]
            for name, forecast in models[vehicle].items():
                forecast.step(tick)
                apart = truth - forecast.point
                covariance = calibrations[name].covariance(forecast, tick - since)
                measure = float(apart @ np.linalg.solve(covariance, apart))
                found[name].append(np.array([np.hypot(*apart), *(measure <= quantile(SHARES))]))
            guides[vehicle].append(len(models[vehicle]["context"].guides))
            if tick == since + frames:
                turned = _turns(way[since - begin : tick - begin + 1])
                events.append(_event(turned, found, float(np.mean(guides.pop(vehicle)))))
                del hidden[vehicle]
        moving = [v for v in here if v not in hidden and _moves(known, v, tick)]
        for calibration in calibrations.values():
            calibration.step(known, tick, moving)
        if tick % EVERY == 0:
            ready = [v for v in moving if ways[v][0] + len(ways[v][1]) > tick + frames]
            if ready:
                chosen = int(rng.choice(ready))
                models[chosen] = {name: make(known, chosen) for name, make in FORECASTERS.items()}
                hidden[chosen] = (tick, {name: [] for name in FORECASTERS})
                guides[chosen] = []
    return events


def _moves(known: Trajectories, vehicle: int, tick: int) -> bool:
    """Tell whether a vehicle is seen, has been for F frames, and has gone more than 10 px in them."""
    first, last = known.extent(vehicle)
    if last < tick or tick - first < WINDOW:
        return False
    return bool(np.hypot(*np.diff(known.at(vehicle, [tick - WINDOW, tick]), axis=0)[0]) > 10.0)


def _turns(way: Floats) -> bool:
    """Tell whether a way (K, 2) turns by more than `TURNED`."""
    steps = way[5::5] - way[:-5:5]
    moving = steps[np.hypot(*steps.T) > 2.0]
    headings = np.unwrap(np.arctan2(moving[:, 1], moving[:, 0]))
    return len(headings) > 1 and float(np.ptp(headings)) > TURNED


def _event(curved: bool, found: Mapping[str, list[Floats]], predictors: float) -> Event:
    values = {name: np.array(rows) for name, rows in found.items()}
    return Event(
        curved,
        {name: rows[:, 0] for name, rows in values.items()},
        {name: rows[:, 1:] > 0 for name, rows in values.items()},
        predictors,
    )


def mean_errors(events: list[Event], name: str, lead: int) -> tuple[float, float]:
    """Return MPE_n, px, and Variance_n, px^2, means over the events."""
    parts = np.array([event.errors[name][:lead] for event in events])
    return float(parts.mean()), float(parts.var(axis=1).mean())


def coverage(events: list[Event], name: str) -> Floats:
    """Return (2,) shares of frames whose truth lies inside, see `Event.inside`."""
    return np.asarray(np.concatenate([event.inside[name] for event in events]).mean(0))


def report(title: str, events: list[Event]) -> str:
    """Return the table of one kind of traffic."""
    if not events:
        return f"{title}: no events\n"
    predictors = np.mean([event.predictors for event in events])
    lines = [f"{title}: {len(events)} events, {predictors:.1f} predictors in the mean"]
    head = "".join(f"{f'MPE_{n} px':>11s}{f'var_{n} px2':>12s}" for n in LEADS)
    lines.append(f"  {'forecast':12s}{head}{'in 50 %':>9s}{'in 95 %':>9s}")
    for name in FORECASTERS:
        cells = "".join(f"{m:11.2f}{v:12.2f}" for m, v in (mean_errors(events, name, n) for n in LEADS))
        half, most = coverage(events, name)
        lines.append(f"  {name:12s}{cells}{half:9.2f}{most:9.2f}")
    return "\n".join(lines) + "\n"


def run(seeds: range, folder: Path | None = None) -> dict[str, list[Event]]:
    """Return the events by kind of traffic."""
    found: dict[str, list[Event]] = {"straight": [], "curved": []}
    for seed in seeds:
        for curved in (False, True):
            for event in hide(simulated(seed, curved=curved), seed=seed):
                found["curved" if event.curved else "straight"].append(event)
    if folder is not None:
        for name, path in RECORDINGS.items():
            ways = recorded(folder / path)
            for repeat in range(REPEATS):
                for event in hide(ways, seed=seeds[0] + repeat):
                    kind = f"{name}, {'curved' if event.curved else 'straight'}"
                    found.setdefault(kind, []).append(event)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", default="500:503", help="half-open range of simulated drives")
    parser.add_argument("--recorded", type=Path, help="folder with geotrax/ and commonroad/")
    given = parser.parse_args()
    first, last = map(int, given.seeds.split(":"))
    for title, events in run(range(first, last), given.recorded).items():
        print(report(title, events))


if __name__ == "__main__":
    main()
