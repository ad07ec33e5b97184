"""The platform that carries the camera: where it aims, how it turns and climbs, and how it shakes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.camera import Pose
from sim.params import AerialCameraParams, PlatformParams
from sim.rng import stream

Floats = NDArray[np.float64]

_SHAKES = 14
"""Waves that the shake of one axis is made of."""


class Platform:
    """A camera in the air, as a function of time and of the place that it is to look at."""

    def __init__(
        self, params: PlatformParams, camera: AerialCameraParams, *, across: float, seed: int
    ) -> None:
        """Draw one flight.

        Args:
            params: How it flies.
            camera: Focal length and tilt.
            across: Heading, radians, with which a road runs across the picture from left to right.
            seed: The episode's.
        """
        rng = stream(seed, "platform")
        self._params, self._camera = params, camera
        self._heading = across + rng.uniform(-0.5, 0.5) + (np.pi if rng.random() < 0.5 else 0.0)
        self._swing = _Waves(rng, (11.0, 23.0), 3)
        self._roam = [_Waves(rng, (9.0, 21.0), 3) for _ in range(2)]
        self._climb = _Waves(rng, (10.0, 22.0), 2)
        self._lean = _Waves(rng, (8.0, 17.0), 2)
        self._sway = rng.uniform(7.5, 9.5), rng.uniform(0, 2 * np.pi)
        self._shake = [_Shake(rng) for _ in range(3)]

    def sway(self, time: float) -> float:
        """Return how far ahead along the road the aim is swung at ``time`` seconds, metres."""
        period, phase = self._sway
        return float(self._params.sway * np.sin(2 * np.pi * time / period + phase))

    def heading(self, time: float) -> float:
        """Return where it heads of its own, before it shakes, radians."""
        return self._heading + self._params.turn * self._swing.at(time)

    def pose(self, time: float, aim: Floats, turn: float = 0.0) -> Pose:
        """Return the camera's pose.

        Args:
            time: Seconds.
            aim: (2,) the place on the ground that it is to look at, before it roams.
            turn: Radians by which it is steered to the left of its own heading.
        """
        p = self._params
        heading = self.heading(time) + turn
        height = p.altitude * (1 + p.climb * self._climb.at(time))
        tilt = max(self._camera.tilt + 0.035 * self._lean.at(time), 0.0)
        away = height * np.tan(tilt)
        ahead = np.array([np.cos(heading), np.sin(heading)])
        middle = aim + p.roam * np.array([wave.at(time) for wave in self._roam]) - away * ahead
        shake = [p.jitter / self._camera.focal * shake.at(time) for shake in self._shake]
        return Pose.looking(
            [*middle, height],
            yaw=heading + shake[0] / max(np.sin(tilt), 0.2),
            pitch=-np.pi / 2 + tilt + shake[1],
            roll=shake[2],
        )


class _Waves:
    """A sum of slow sines that stays within one."""

    def __init__(self, rng: np.random.Generator, periods: tuple[float, float], count: int) -> None:
        self._rates = 2 * np.pi / rng.uniform(*periods, count)
        self._phases = rng.uniform(0, 2 * np.pi, count)

    def at(self, time: float) -> float:
        return float(np.sin(self._rates * time + self._phases).mean())


class _Shake:
    """A sum of quick sines of unit variance: wind, rotors and the gimbal that works against them."""

    def __init__(self, rng: np.random.Generator) -> None:
        rates = 2 * np.pi * np.exp(rng.uniform(np.log(0.25), np.log(9.0), _SHAKES))
        strength = rates**-0.6
        self._rates, self._phases = rates, rng.uniform(0, 2 * np.pi, _SHAKES)
        self._strength = strength * np.sqrt(2 / (strength**2).sum())

    def at(self, time: float) -> float:
        return float((self._strength * np.sin(self._rates * time + self._phases)).sum())
