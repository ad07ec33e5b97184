"""Kalman filter for constant velocity, many targets at a time.

Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, chapters 5 and 6.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def constant_velocity(step: float, intensity: float, axes: int = 1) -> tuple[Floats, Floats]:
    """Build the transition and the noise of white acceleration.

    Args:
        step: Seconds between two measurements.
        intensity: Power spectral density of the acceleration, units^2 / s^3.
        axes: Number of axes; the state is (position, velocity) for each in turn.

    Returns:
        F and Q, each (2 axes, 2 axes).
    """
    transition = np.array([[1.0, step], [0.0, 1.0]])
    noise = intensity * np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]])
    eye = np.eye(axes)
    return np.asarray(np.kron(eye, transition), np.float64), np.asarray(np.kron(eye, noise), np.float64)


def predict(mean: Floats, covariance: Floats, transition: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Advance N states (N, n) and covariances (N, n, n) by one step."""
    moved: Floats = mean @ transition.T
    spread: Floats = transition @ covariance @ transition.T + noise
    return moved, spread


def update(
    mean: Floats, covariance: Floats, measurement: ArrayLike, observation: Floats, noise: Floats
) -> tuple[Floats, Floats]:
    """Correct N states by one measurement each.

    Args:
        mean: (N, n).
        covariance: (N, n, n).
        measurement: (N, m).
        observation: (m, n).
        noise: (m, m) or (N, m, m).

    Returns:
        Corrected mean and covariance; the covariance in Joseph's form, so it stays symmetric and positive.
    """
    innovation = np.asarray(measurement, float) - mean @ observation.T
    spread = observation @ covariance @ observation.T + noise
    gain = np.swapaxes(np.linalg.solve(spread, observation @ covariance), -1, -2)
    corrected = mean + np.einsum("nij,nj->ni", gain, innovation)
    rest = np.eye(mean.shape[1]) - gain @ observation
    covariance = rest @ covariance @ np.swapaxes(rest, -1, -2) + gain @ noise @ np.swapaxes(gain, -1, -2)
    return corrected, covariance
