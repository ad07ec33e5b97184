"""Paper 2's protocol (section 5): observe a vehicle for F frames, hide it, predict, and compare.

``python -m tests.validation.motion_context [--recorded DIR]`` prints MPE_n and its variance (methods.md 2.6)
of the motion context and of straight continuation by a line and by a Kalman filter, on traffic that the
simulator drives on straight and on winding roads, and on recorded traffic where that is at hand; and how much
of the truth lies inside the predicted 50 % and 95 % ellipses. Positions are seen from above with noise; other
vehicles are seen all the time, as far as they are not being hidden themselves.
"""

from __future__ import annotations

import argparse
import csv
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from sim.params import EgoParams, RoadParams, TrafficParams
from sim.rng import stream
from sim.roads import build_road
from sim.traffic import Traffic
from tracker.aerial.calibration import Calibration, quantile
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

Ways = Mapping[int, tuple[int, Floats]]
"""Of each vehicle the first tick, and its positions from then on, (K, 2) px."""


@dataclass(frozen=True, slots=True)
class Event:
    """One vehicle hidden: whether its way turned, and of each frame the truth inside the ellipses' measure.

    Attributes:
        curved: Whether it turned.
        errors: (n,) distances, px, of each forecast.
        measures: (n,) squared Mahalanobis distances likewise.
    """

    curved: bool
    errors: dict[str, Floats]
    measures: dict[str, Floats]


def simulated(seed: int, *, curved: bool, seconds: float = 40.0) -> Ways:
    """Drive traffic along a road, and look at 300 m of it from above."""
    road_params = RoadParams(curved=curved, min_radius=35.0, max_radius=70.0)
    road = build_road(road_params, 1500.0, stream(seed, "road"))
    drivers = TrafficParams(
        density=18.0, oncoming_density=14.0, speed=13.0 if curved else 20.0, vans=0, lorries=0, buses=0
    )
    from sim import meshes

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


def drone(path: Path) -> Ways:
    """Read geo-trax's vehicles: positions in metres, 30 a second."""
    rows: dict[int, list[tuple[int, float, float]]] = defaultdict(list)
    with path.open() as file:
        for row in csv.DictReader(file):
            rows[int(row["Vehicle_ID"])].append(
                (int(row["Frame_Number"]), float(row["Local_X"]), float(row["Local_Y"]))
            )
    return {vehicle: _even(np.array(way), 1.0) for vehicle, way in rows.items()}


def commonroad(path: Path) -> Ways:
    """Read the recorded vehicles of a CommonRoad scenario: ten positions a second, three frames each."""
    ways = {}
    for vehicle in ElementTree.parse(path).getroot().iter("dynamicObstacle"):
        rows = []
        states = [vehicle.find("initialState"), *vehicle.iter("state")]
        for state in (state for state in states if state is not None):
            tick, x, y = (state.findtext(at) for at in ("time/exact", ".//point/x", ".//point/y"))
            if tick is not None and x is not None and y is not None:
                rows.append((float(tick), float(x), float(y)))
        ways[int(vehicle.attrib["id"])] = _even(np.array(rows), RATE / 10)
    return ways


def _even(rows: Floats, frames: float) -> tuple[int, Floats]:
    """Turn rows of time step, x, y (metres) into the first tick and a position (px) for every tick."""
    ticks = np.round(rows[:, 0] * frames)
    all_ticks = np.arange(ticks[0], ticks[-1] + 1)
    way = np.stack([np.interp(all_ticks, ticks, SCALE * rows[:, k]) for k in (1, 2)], 1)
    return int(ticks[0]), way


def hide(ways: Ways, *, seed: int = 0, frames: int = max(LEADS)) -> list[Event]:
    """Let the vehicles drive, hide some of them in turn, and forecast these."""
    rng = stream(seed, "hide")
    last = max(begin + len(way) for begin, way in ways.values())
    seen = {vehicle: way + rng.normal(0.0, NOISE, way.shape) for vehicle, (_, way) in ways.items()}
    known, hidden, events = Trajectories(), dict[int, tuple[int, dict[str, list[Floats]]]](), []
    models: dict[int, dict[str, Forecast]] = {}
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
                covariance = calibrations[name].scale(tick - since) * forecast.covariance
                measure = float(apart @ np.linalg.solve(covariance, apart))
                found[name].append(np.array([np.hypot(*apart), measure]))
            if tick == since + frames:
                events.append(_event(way[since - begin : tick - begin + 1], found))
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
    return events


def _moves(known: Trajectories, vehicle: int, tick: int) -> bool:
    """Tell whether a vehicle is seen, has been for F frames, and has gone more than 10 px in them."""
    first, last = known.extent(vehicle)
    if last < tick or tick - first < WINDOW:
        return False
    return bool(np.hypot(*np.diff(known.at(vehicle, [tick - WINDOW, tick]), axis=0)[0]) > 10.0)


def _event(way: Floats, found: Mapping[str, list[Floats]]) -> Event:
    steps = way[5::5] - way[:-5:5]
    moving = steps[np.hypot(*steps.T) > 2.0]
    headings = np.unwrap(np.arctan2(moving[:, 1], moving[:, 0]))
    curved = len(headings) > 1 and float(np.ptp(headings)) > TURNED
    values = {name: np.array(rows) for name, rows in found.items()}
    return Event(
        curved, {name: v[:, 0] for name, v in values.items()}, {name: v[:, 1] for name, v in values.items()}
    )


def mean_errors(events: list[Event], name: str, lead: int) -> tuple[float, float]:
    """Return MPE_n, px, and Variance_n, px^2, means over the events."""
    parts = np.array([event.errors[name][:lead] for event in events])
    return float(parts.mean()), float(parts.var(axis=1).mean())


def coverage(events: list[Event], name: str, share: float) -> float:
    """Return the share of frames whose truth lies inside the ellipse of ``share``."""
    return float(np.mean([np.mean(event.measures[name] <= quantile(share)) for event in events]))


def report(title: str, events: list[Event]) -> str:
    """Return the table of one kind of traffic."""
    if not events:
        return f"{title}: no events\n"
    lines = [f"{title}: {len(events)} events"]
    head = "".join(f"{f'MPE_{n} px':>11s}{f'var_{n} px2':>12s}" for n in LEADS)
    lines.append(f"  {'forecast':12s}{head}{'in 50 %':>9s}{'in 95 %':>9s}")
    for name in FORECASTERS:
        cells = "".join(f"{m:11.2f}{v:12.2f}" for m, v in (mean_errors(events, name, n) for n in LEADS))
        lines.append(
            f"  {name:12s}{cells}{coverage(events, name, 0.5):9.2f}{coverage(events, name, 0.95):9.2f}"
        )
    return "\n".join(lines) + "\n"


def run(seeds: range, recorded: Path | None = None) -> dict[str, list[Event]]:
    """Return the events by kind of traffic."""
    found: dict[str, list[Event]] = {"straight": [], "curved": []}
    for seed in seeds:
        for curved in (False, True):
            for event in hide(simulated(seed, curved=curved), seed=seed):
                found["curved" if event.curved else "straight"].append(event)
    if recorded is not None:
        readers: tuple[tuple[str, str, Callable[[Path], Ways]], ...] = (
            ("drone", "geotrax/vehicles.csv", drone),
            ("US-101", "commonroad/USA_US101-4_1_T-1.xml", commonroad),
        )
        for name, path, read in readers:
            for event in hide(read(recorded / path), seed=seeds[0]):
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
