"""The camera car: how its body shakes and dives, what its odometer reads, and how actions drive it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.drivers import Driver
from sim.params import EgoParams
from sim.world import Ego

LENGTH, WIDTH = 4.5, 1.82
"""Of the camera car, metres."""
ACCELERATION = 3.0
"""M/s^2 of a full forward action."""
BRAKING = 7.0
"""M/s^2 of a full backward action."""
YAW_RATE = 0.4
"""Rad/s of a full action to the right."""
GRIP = 6.0
"""M/s^2: sideways acceleration beyond which a yaw action gets no more."""
DIVE = 0.0027
"""Radians of pitch for each m/s^2 along the road: about a degree and a half for one g."""
DIVE_SECONDS = 0.25
"""Time in which the springs follow the brakes."""
HEAVE_PER_PITCH = 4.0
"""Metres of heave for each radian of pitch vibration, as a ratio of standard deviations."""
PITCH_HERTZ, HEAVE_HERTZ, DAMPING = 2.2, 1.5, 0.25
"""Of the body on its springs: what the road excites lies between 1 and 4 Hz."""
FULL_SHAKE_SPEED = 8.0
"""M/s above which the road shakes the car with its full strength; proportionally less below."""


class Resonator:
    """A damped oscillator under white noise, sampled: an AR(2) process of unit standard deviation."""

    def __init__(self, hertz: float, damping: float, rate: int, rng: np.random.Generator) -> None:
        """Start in the stationary state.

        Args:
            hertz: Natural frequency.
            damping: Damping ratio, in (0, 1).
            rate: Samples a second.
            rng: Draws the noise.
        """
        omega = 2 * math.pi * hertz
        decay = math.exp(-damping * omega / rate)
        first = 2 * decay * math.cos(omega * math.sqrt(1 - damping**2) / rate)
        second = -decay * decay
        correlation = first / (1 - second)
        self._weights = first, second
        self._noise = math.sqrt(1 - first * correlation - second * (first * correlation + second))
        self._rng = rng
        before = float(rng.normal())
        self._last = correlation * before + math.sqrt(1 - correlation**2) * float(rng.normal()), before

    def step(self) -> float:
        """Return the next sample."""
        (first, second), (last, before) = self._weights, self._last
        value = first * last + second * before + self._noise * float(self._rng.normal())
        self._last = value, last
        return value


class Body:
    """Pitch and heave of the camera car: the road's vibration, and the dive under the brakes."""

    def __init__(self, params: EgoParams, rate: int, rng: np.random.Generator) -> None:
        """Get ready at rest height.

        Args:
            params: Its ``pitch_vibration`` is the standard deviation at speed.
            rate: Ticks a second.
            rng: A stream of its own.
        """
        self._deviation = params.pitch_vibration
        self._pitch = Resonator(PITCH_HERTZ, DAMPING, rate, rng)
        self._heave = Resonator(HEAVE_HERTZ, DAMPING, rate, rng)
        self._gain = 1 - math.exp(-1 / (DIVE_SECONDS * rate))
        self._dive = 0.0

    def step(self, speed: float, acceleration: float) -> tuple[float, float]:
        """Return pitch (radians, positive raises the nose) and heave (metres) of the next tick."""
        self._dive += self._gain * (DIVE * acceleration - self._dive)
        strength = self._deviation * min(1.0, speed / FULL_SHAKE_SPEED)
        return self._dive + strength * self._pitch.step(), HEAVE_PER_PITCH * strength * self._heave.step()


class ActionDriver(Driver):
    """A camera car that does what it is told, and drives by itself until it is told something.

    The others see it as one of them.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        """Take the arguments of `Driver`."""
        super().__init__(*args, **kwargs)
        self.command: tuple[float, float] | None = None

    def told(self, action: NDArray[np.floating[Any]] | None) -> None:
        """Take an action: (2,) in [-1, 1], acceleration and yaw rate (positive to the right); None rolls."""
        push, turn = (0.0, 0.0) if action is None else (float(a) for a in np.clip(action, -1, 1))
        self.command = (ACCELERATION if push > 0 else BRAKING) * push, YAW_RATE * turn

    def act(self, action: Any = None) -> None:
        """Decide nothing once `told` has decided."""
        if self.command is None:
            super().act(action)
            return
        self.target_lane_index = self.lane_index
        self.target_speed = self.speed
        self.action = {"steering": 0.0, "acceleration": self.command[0]}  # which those behind see

    def step(self, dt: float) -> None:
        """Move for ``dt`` seconds along the mean heading."""
        if self.command is None:
            super().step(dt)
            return
        acceleration, turn = self.command
        if self.crashed:
            acceleration, turn = -BRAKING, 0.0
        most = GRIP / max(self.speed, 1.0) * min(1.0, self.speed)
        step = min(max(turn, -most), most) * dt
        speed = max(self.speed + acceleration * dt, 0.0)
        run, course = (self.speed + speed) / 2 * dt, self.heading + step / 2
        self.position += run * np.array([math.cos(course), math.sin(course)])
        self.heading += step
        self.speed = speed
        self.impact = None
        self.timer += dt
        self.moved()
        self.on_state_update()


class Profile:
    """A speed that swells and sinks, and a slight weave in the lane: a drive that no traffic dictates."""

    def __init__(self, params: EgoParams, rng: np.random.Generator) -> None:
        """Draw the profile.

        Args:
            params: Its ``speed`` is the mean.
            rng: Draws periods and phases.
        """
        self._speed = params.speed
        self._periods = rng.uniform(8.0, 16.0), rng.uniform(6.0, 10.0)
        self._phases = rng.uniform(0, 2 * math.pi), rng.uniform(0, 2 * math.pi)

    def at(self, t: float) -> tuple[float, float, float]:
        """Return wanted speed, m/s, offset to the right of the lane's middle, m, and its rate, m/s."""
        surge, sway = (2 * math.pi / p for p in self._periods)
        speed = self._speed * (1 + 0.12 * math.sin(surge * t + self._phases[0]))
        angle = sway * t + self._phases[1]
        return speed, 0.3 * math.sin(angle), 0.3 * sway * math.cos(angle)


def odometer(ego: Ego, params: EgoParams, rng: np.random.Generator) -> tuple[float, float]:
    """Return the speed (m/s) and yaw rate (rad/s, positive to the right) that the car measures.

    Args:
        ego: The truth.
        params: The standard deviations of the two.
        rng: Draws the errors.
    """
    speed_error, yaw_error = rng.normal(size=2)
    return (
        float(ego.speed + params.speed_noise * speed_error),
        float(ego.yaw_rate + params.yaw_noise * yaw_error),
    )
