"""What drives: kinds, models, paints and temperaments, drawn for one vehicle at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.models import Model
from sim.params import TrafficParams
from sim.world import Kind

PAINTS = (
    (0.22, (0.93, 0.93, 0.92), 0.02),  # white
    (0.20, (0.50, 0.51, 0.53), 0.08),  # grey
    (0.19, (0.06, 0.06, 0.07), 0.02),  # black
    (0.16, (0.72, 0.73, 0.75), 0.04),  # silver
    (0.09, (0.14, 0.24, 0.45), 0.05),  # blue
    (0.08, (0.58, 0.09, 0.09), 0.05),  # red
    (0.03, (0.45, 0.38, 0.30), 0.05),  # brown, beige
    (0.03, (0.15, 0.30, 0.20), 0.05),  # green
)
"""Shares of the paints on the roads, their sRGB, and how far single vehicles stray from it."""
LORRY_SPEED = 23.0
"""M/s that no lorry exceeds."""
WITHIN_LANE = 0.5
"""Standard deviation of desired speeds within a lane, as a part of that of all lanes together."""


@dataclass(frozen=True, slots=True)
class Surge:
    """A slow swing of the wanted speed: nobody keeps a speed to the decimal.

    Attributes:
        strength: Amplitude, as a part of the speed.
        period: Seconds.
        phase: Radians at t = 0.
    """

    strength: float
    period: float
    phase: float

    def at(self, t: float) -> float:
        """Factor of the wanted speed at ``t`` seconds."""
        return 1.0 + self.strength * math.sin(2 * math.pi * t / self.period + self.phase)

    @classmethod
    def draw(cls, rng: np.random.Generator, *, strength: float, periods: tuple[float, float]) -> Surge:
        """Draw period and phase."""
        return cls(strength, float(rng.uniform(*periods)), float(rng.uniform(0, 2 * math.pi)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """One vehicle before it enters the road.

    Attributes:
        model: Index into the catalogue.
        kind: Its kind.
        size: Length, width, height, metres.
        colour: sRGB paint in [0, 1].
        speed: Desired speed, m/s.
        headway: Desired time gap, seconds.
        jam_gap: Bumper to bumper at standstill, metres.
        acceleration: Comfortable, m/s^2.
        braking: Comfortable, m/s^2, positive.
        politeness: MOBIL's, in [0, 1].
        surge: How the speed that it wants swells and sinks.
    """

    model: int
    kind: Kind
    size: tuple[float, float, float]
    colour: tuple[float, float, float]
    speed: float
    headway: float
    jam_gap: float
    acceleration: float
    braking: float
    politeness: float
    surge: Surge

    @property
    def limit(self) -> float:
        """M/s that its kind does not exceed."""
        return LORRY_SPEED if self.heavy else np.inf

    @property
    def heavy(self) -> bool:
        """Whether it keeps to the right lane."""
        return self.kind in (Kind.LORRY, Kind.BUS)


class Fleet:
    """Draws vehicles out of a catalogue."""

    def __init__(self, params: TrafficParams, catalogue: Sequence[Model]) -> None:
        """Sort the catalogue by kind.

        Args:
            params: Shares of the kinds, and speeds.
            catalogue: All models of the scene; those that are no vehicles are passed over.

        Raises:
            ValueError: If there is no car among them, or the shares add up to more than 1.
        """
        self._params = params
        self._models = {
            kind: [i for i, m in enumerate(catalogue) if m.kind == kind]
            for kind in (Kind.CAR, Kind.VAN, Kind.LORRY, Kind.BUS)
        }
        self._catalogue = catalogue
        if not self._models[Kind.CAR]:
            raise ValueError("traffic needs at least one model of a car; the catalogue has none")
        if params.vans + params.lorries + params.buses > 1:
            raise ValueError("traffic.vans, traffic.lorries and traffic.buses add up to more than 1")
        weights = np.array([share for share, _, _ in PAINTS])
        self._paint_edges = np.cumsum(weights / weights.sum())

    def draw(self, rng: np.random.Generator, *, pace: float = 0.0, light: bool = False) -> Draw:
        """Draw one vehicle.

        Args:
            rng: Its own stream.
            pace: How much faster its lane is than the mean, in standard deviations of all desired speeds.
            light: Leave out lorries and buses, for lanes that they do not use.
        """
        p = self._params
        share = rng.random()
        kind = Kind.CAR
        for candidate, part in ((Kind.VAN, p.vans), (Kind.LORRY, p.lorries), (Kind.BUS, p.buses)):
            if share < part:
                kind = candidate
                break
            share -= part
        if (light and kind in (Kind.LORRY, Kind.BUS)) or not self._models[kind]:
            kind = Kind.CAR
        choices = self._models[kind]
        model = choices[int(rng.integers(len(choices)))]
        heavy = kind in (Kind.LORRY, Kind.BUS)
        speed = p.speed + p.speed_spread * (pace + WITHIN_LANE * float(np.clip(rng.normal(), -2, 2)))
        if heavy:
            speed = min(0.88 * speed, LORRY_SPEED)
        return Draw(
            model=model,
            kind=kind,
            size=self._catalogue[model].size,
            colour=self.paint(rng),
            speed=max(speed, 0.0),
            headway=float(rng.uniform(1.2, 1.8) if heavy else rng.uniform(0.7, 1.3)),
            jam_gap=float(rng.uniform(1.8, 3.0)),
            acceleration=float(rng.uniform(0.8, 1.1) if heavy else rng.uniform(1.3, 2.0)),
            braking=float(rng.uniform(1.6, 2.4)),
            politeness=float(rng.uniform(0.0, 0.3)),
            surge=Surge.draw(rng, strength=0.07, periods=(15.0, 40.0)),
        )

    @staticmethod
    def lane_pace(lane: int, lanes: int) -> float:
        """Return the ``pace`` of a lane, from the left: even steps from fast to slow.

        With `WITHIN_LANE` the desired speeds of all lanes together have unit standard deviation.
        """
        if lanes == 1:
            return 0.0
        steps = np.linspace(1.0, -1.0, lanes)
        return float(steps[lane] / np.std(steps) * math.sqrt(1 - WITHIN_LANE**2))

    def paint(self, rng: np.random.Generator) -> tuple[float, float, float]:
        """Draw a paint, sRGB."""
        index = int(np.searchsorted(self._paint_edges, rng.random(), side="right"))
        _, colour, spread = PAINTS[min(index, len(PAINTS) - 1)]
        shade = spread * rng.normal() + 0.3 * spread * rng.normal(size=3)
        red, green, blue = np.clip(np.array(colour) + shade, 0.02, 0.97).tolist()
        return red, green, blue
