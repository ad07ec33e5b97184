"""What drives below the platform: the fleet of the roads, with many of one make and paint among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sim.fleet import Draw, Fleet, Surge
from sim.models import Model
from sim.params import AerialTrafficParams
from sim.world import Kind

LIVELY = (1.5, 1.25)
"""How much harder than on an open motorway drivers in dense waves accelerate, and brake."""
SWING = 0.12
"""Amplitude of the swing of a driver's wanted speed, as a part of it."""


class LookalikeFleet(Fleet):
    """A fleet of which a share has one of a few looks: a model and a paint, the same to the last bit."""

    def __init__(
        self, params: AerialTrafficParams, catalogue: Sequence[Model], rng: np.random.Generator
    ) -> None:
        """Draw the looks."""
        super().__init__(params, catalogue)
        self._share, self._sizes = params.lookalikes, [model.size for model in catalogue]
        cars = [k for k, model in enumerate(catalogue) if model.kind == Kind.CAR]
        self.looks = tuple((cars[int(rng.integers(len(cars)))], self.paint(rng)) for _ in range(params.looks))

    def draw(self, rng: np.random.Generator, *, pace: float = 0.0, light: bool = False) -> Draw:
        """Draw one vehicle (see `Fleet.draw`)."""
        draw = super().draw(rng, pace=pace, light=light)
        draw = replace(
            draw,
            acceleration=LIVELY[0] * draw.acceleration,
            braking=LIVELY[1] * draw.braking,
            surge=Surge.draw(rng, strength=SWING, periods=(6.0, 13.0)),
        )
        if draw.kind != Kind.CAR or rng.random() >= self._share:
            return draw
        return self.look(draw, int(rng.integers(len(self.looks))))

    def look(self, draw: Draw, number: int) -> Draw:
        """Return a draw with a look of that number."""
        model, colour = self.looks[number]
        return replace(draw, model=model, kind=Kind.CAR, size=self._sizes[model], colour=colour)
