"""Recorded traffic below the platform: the land and the bridges around it, and its vehicles as bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.aerial.networks import Network, Strip
from sim.aerial.overpass import Overpass
from sim.fleet import Fleet
from sim.models import Model
from sim.params import AerialRoadParams, AerialTrafficParams
from sim.recorded import Recording, RecordingError, Sampled, resample
from sim.rng import stream
from sim.world import FIRST_VEHICLE_ID, Bodies, Kind, Role

Floats = NDArray[np.float64]

LANE = 3.9
"""Metres of asphalt around each way that was driven, where the recording has no lanes."""
DECK = 420.0
"""Metres of a bridge's deck: its ends are out of sight."""
LEAD_ON = 160.0
"""Metres by which a map's outermost lanes are led on."""
SPACING = 70.0
"""Metres between bridges."""


class RecordedTraffic:
    """The vehicles of a recording, dressed in models and paints of ours."""

    collided = False

    def __init__(
        self,
        recording: Recording,
        params: AerialTrafficParams,
        models: Sequence[Model],
        *,
        start: float,
        seconds: float,
        seed: int,
        rate: int,
    ) -> None:
        """Take up a recording.

        Args:
            recording: What drove.
            params: How many are to look alike.
            models: Of the scene.
            start: Seconds into the recording.
            seconds: How long the run may last.
            seed: The episode's: it draws models and paints.
            rate: Ticks a second.

        Raises:
            RecordingError: If the recording ends before the run.
        """
        ticks = round(seconds * rate)
        if start + (ticks - 1) / rate > recording.seconds + 1e-6:
            raise RecordingError(
                f"the recording ends after {recording.seconds:.2f} s; "
                f"a run of {seconds:g} s from {start:g} s on is longer"
            )
        self._sampled: Sampled = resample(recording, rate, start=start, ticks=ticks)
        self._tick = 0
        count, fleet = len(recording.ways), Fleet(params, models)
        looks = [fleet.paint(stream(seed, "aerial", "looks", k)) for k in range(params.looks)]
        models_of, sizes, colours = [], [], []
        for k, way in enumerate(recording.ways):
            rng = stream(seed, "aerial", "recorded", k)
            fitting = [m for m, model in enumerate(models) if model.kind == way.kind]
            lengths = np.array([abs(models[m].size[0] - way.size[0]) for m in fitting])
            model = fitting[int(lengths.argmin())]
            alike = way.kind == Kind.CAR and rng.random() < params.lookalikes
            paint = looks[int(rng.integers(len(looks)))] if alike else fleet.paint(rng)
            models_of.append(model)
            sizes.append((*way.size, models[model].size[2]))
            colours.append(paint)
        self._bodies = Bodies(
            ids=np.arange(FIRST_VEHICLE_ID, FIRST_VEHICLE_ID + count, dtype=np.uint32),
            kinds=np.array([way.kind for way in recording.ways], np.uint8),
            roles=np.full(count, Role.NONE, np.uint8),
            models=np.array(models_of, np.int32),
            positions=np.zeros((count, 3)),
            yaws=np.zeros(count),
            velocities=np.zeros((count, 3)),
            sizes=np.array(sizes, float),
            colours=np.array(colours, np.float32),
            lamps=np.zeros(count, np.uint8),
            leans=np.zeros((count, 2)),
        )

    def step(self) -> None:
        """Advance one tick; after the last, all stand where they are."""
        self._tick = min(self._tick + 1, len(self._sampled.present) - 1)

    def convoy_at(self) -> None:
        """Return nothing: no convoy is known."""

    def vehicles(self) -> Bodies:
        """Return those who are there now."""
        here = self._sampled.present[self._tick]
        bodies = self._bodies.take(here)
        bodies.positions[:, :2] = self._sampled.positions[self._tick, here]
        bodies.velocities[:, :2] = self._sampled.velocities[self._tick, here]
        bodies.yaws[:] = self._sampled.yaws[self._tick, here]
        return bodies


def surroundings(recording: Recording) -> Network:
    """Return the asphalt below a recording: its lanes, or else the ways that were driven."""
    strips = []
    for left, right in recording.lanes:
        count = min(len(left), len(right))
        if count < 2:
            continue
        left, right = left[:count], right[:count]
        width = float(np.median(np.hypot(*(left - right).T)))
        strips.append(_strip((left + right) / 2, width / 2, (width / 2, -width / 2)))
    strips += _continued(strips)
    if not strips:
        for way in recording.ways:
            away = np.hypot(*(way.positions - way.positions[0]).T)
            if away.max() > 6.0:
                keep = np.concatenate([[True], np.diff(np.floor(away / 1.5)) != 0])
                if keep.sum() > 2:
                    strips.append(_strip(way.positions[keep], LANE / 2, ()))
    nothing = np.zeros((0, 2, 2))
    return Network(lanes=None, entries=(), strips=tuple(strips), stop_lines=nothing, crossings=nothing)


def _continued(strips: Sequence[Strip]) -> list[Strip]:
    """Lead lanes on that end where no other begins: a recording's map ends sooner than the road."""
    ends = np.array([strip.line[k] for strip in strips for k in (0, -1)]).reshape(-1, 2)
    more = []
    for n, strip in enumerate(strips):
        for k, sign in ((0, -1.0), (-1, 1.0)):
            away = np.hypot(*(ends - strip.line[k]).T)
            away[2 * n + (k == -1)] = np.inf
            if away.min() > 1.0:
                heading = float(strip.headings[k])
                ahead = sign * np.array([np.cos(heading), np.sin(heading)])
                line = strip.line[k] + np.arange(0.0, LEAD_ON, 4.0)[:, None] * ahead
                more.append(_strip(line, strip.paved[1], strip.edges.tolist()))
    return more


def middle_and_heading(recording: Recording) -> tuple[Floats, float]:
    """Return where most of the traffic moves, (2,), and the axis along which it does, radians."""
    moving = [way for way in recording.ways if np.hypot(*np.ptp(way.positions, axis=0)) > 15.0]
    ways = moving or list(recording.ways)
    points = np.concatenate([way.positions for way in ways])
    double = 2 * np.concatenate([way.yaws for way in ways])
    axis = 0.5 * float(np.arctan2(np.sin(double).mean(), np.cos(double).mean()))
    return np.median(points, axis=0), axis


def decks(
    params: AerialRoadParams, middle: Floats, heading: float, rng: np.random.Generator
) -> tuple[Overpass, ...]:
    """Put bridges across the traffic, around the middle of it."""
    ahead = np.array([np.cos(heading), np.sin(heading)])
    found = []
    for k in range(params.bridges):
        x, y = middle + (k - 0.5 * (params.bridges - 1)) * SPACING * ahead
        found.append(
            Overpass(
                name=f"overpass-{k}",
                x=float(x),
                y=float(y),
                heading=heading + np.pi / 2 + float(rng.uniform(-0.2, 0.2)),
                span=DECK,
                width=params.bridge_width,
                carries="road",
                ramps=False,
            )
        )
    return tuple(found)


def _strip(line: Floats, half: float, edges: Sequence[float]) -> Strip:
    step = np.gradient(line, axis=0)
    return Strip(
        line=line,
        headings=np.arctan2(step[:, 1], step[:, 0]),
        s=np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))]),
        paved=(-half, half),
        edges=np.array(edges, float),
        styles=np.full(len(edges), 2, np.uint8),
    )
