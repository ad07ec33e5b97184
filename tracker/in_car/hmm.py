"""The two-state hidden Markov model of paper 1, eqs. (20)-(22), and accumulators that remember longer.

Everything works on arrays of N traces at once. ``log_ratio`` is ln p(x, v | C) - ln p(x, v | B); only that
ratio matters, as the paper normalises P(C) + P(B) to 1 after each step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import expit

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Transitions:
    """Probabilities of the hidden state from one frame to the next, eq. (20).

    Attributes:
        car_to_car: P(C_t | C_{t-1}).
        background_to_car: P(C_t | B_{t-1}).
    """

    car_to_car: float = 0.8
    background_to_car: float = 0.5

    def __post_init__(self) -> None:
        for name in ("car_to_car", "background_to_car"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name} must lie in [0, 1], got {getattr(self, name)}")

    @classmethod
    def sticky(cls, dt: float, time_constant: float) -> Transitions:
        """Return those that leave a state after ``time_constant`` seconds, at ``dt`` seconds a frame."""
        change = min(0.5, dt / time_constant)
        return cls(car_to_car=1 - change, background_to_car=change)


PAPER = Transitions()
"""Eq. (20) as printed."""


def predict_max(p_car: ArrayLike, transitions: Transitions = PAPER) -> Floats:
    """Return the odds P(C) / P(B) that eqs. (21), (22) hold before they see the frame.

    Each state comes from its better predecessor.

    Args:
        p_car: (N,) P(C_{t-1}).
        transitions: Eq. (20).
    """
    car = np.asarray(p_car, float)
    background = 1 - car
    to_car = np.maximum(background * transitions.background_to_car, car * transitions.car_to_car)
    to_background = np.maximum(
        background * (1 - transitions.background_to_car), car * (1 - transitions.car_to_car)
    )
    with np.errstate(divide="ignore"):
        return np.asarray(to_car / to_background)


def predict_sum(p_car: ArrayLike, transitions: Transitions = PAPER) -> Floats:
    """Return the odds P(C) / P(B) before the frame in the forward algorithm: both predecessors summed.

    Args:
        p_car: (N,) P(C_{t-1}).
        transitions: Eq. (20).
    """
    car = np.asarray(p_car, float)
    to_car = (1 - car) * transitions.background_to_car + car * transitions.car_to_car
    with np.errstate(divide="ignore"):
        return np.asarray(to_car / (1 - to_car))


def update_max(p_car: ArrayLike, log_ratio: ArrayLike, transitions: Transitions = PAPER) -> Floats:
    """Advance P(C) by one frame with eqs. (21), (22): max-product, normalised.

    With eq. (20) as printed the odds before the frame are multiplied by at most 4, whatever came before: the
    rule is nearly a test of one frame.

    Args:
        p_car: (N,) P(C_{t-1}); 0.5 for a new trace.
        log_ratio: (N,) ln p(x, v | C) - ln p(x, v | B).
        transitions: Eq. (20).

    Returns:
        (N,) P(C_t).
    """
    return _posterior(predict_max(p_car, transitions), log_ratio)


def update_sum(p_car: ArrayLike, log_ratio: ArrayLike, transitions: Transitions = PAPER) -> Floats:
    """Advance P(C) by one frame with the forward algorithm: as `update_max`, but sum-product."""
    return _posterior(predict_sum(p_car, transitions), log_ratio)


def _posterior(odds: Floats, log_ratio: ArrayLike) -> Floats:
    with np.errstate(divide="ignore"):
        return np.asarray(expit(np.log(odds) + np.asarray(log_ratio, float)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """Accumulates tempered log ratios.

    Successive frames of a trace are far from independent, so each counts for little.

    Attributes:
        correlation_time: Seconds in which a trace brings one independent observation; raising it slows
            decisions down and makes single bad frames matter less.
        memory: Seconds after which evidence has faded by 1/e, or inf: a trace that turns from car to
            background would otherwise never be corrected.
        limit: Bound of the accumulated log odds: how long it takes to change a firm opinion.
    """

    correlation_time: float = 0.4
    memory: float = np.inf
    limit: float = 12.0

    def __post_init__(self) -> None:
        for name in ("correlation_time", "memory", "limit"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")

    def update(self, log_odds: ArrayLike, log_ratio: ArrayLike, dt: float) -> Floats:
        """Advance the log odds of N traces by a frame.

        Args:
            log_odds: (N,) before; 0 for new traces.
            log_ratio: (N,) of this frame.
            dt: Seconds since the last frame.

        Returns:
            (N,) log odds; `scipy.special.expit` makes P(C) of them.
        """
        weight = min(1.0, dt / self.correlation_time)
        kept = np.exp(-dt / self.memory) * np.asarray(log_odds, float)
        return np.asarray(np.clip(kept + weight * np.asarray(log_ratio, float), -self.limit, self.limit))
