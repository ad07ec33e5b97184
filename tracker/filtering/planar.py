"""Constant velocity in the plane with measured positions, many targets at a time: state (x, vx, y, vy).

The axes are kept together, unlike in `tracker.filtering.kalman`: uncertain association couples them.
Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

POSITION: Floats = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
"""(2, 4) H: the position is measured."""


def transition(step: float) -> Floats:
    """Return (4, 4) F of ``step`` seconds."""
    return np.array(
        [[1.0, step, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, step], [0.0, 0.0, 0.0, 1.0]]
    )


def process_noise(step: float, intensity: float | Floats) -> Floats:
    """Return (4, 4) Q, or (N, 4, 4) of (N, 1, 1) intensities, of ``step`` seconds.

    Args:
        step: Seconds.
        intensity: Power spectral density of the white acceleration, units^2 / s^3; more lets targets turn
            and brake harder, and widens the gates.
    """
    a, b, c = step**3 / 3, step**2 / 2, step
    along = np.array([[a, b, 0.0, 0.0], [b, c, 0.0, 0.0], [0.0, 0.0, a, b], [0.0, 0.0, b, c]])
    return np.asarray(intensity * along)


def predict(
    mean: Floats, covariance: Floats, step: float, intensity: float | Floats
) -> tuple[Floats, Floats]:
    """Advance N targets by ``step`` seconds.

    Args:
        mean: (N, 4).
        covariance: (N, 4, 4).
        step: Seconds.
        intensity: As in `process_noise`.

    Returns:
        Mean (N, 4) and covariance (N, 4, 4).
    """
    f = transition(step)
    return mean @ f.T, f @ covariance @ f.T + process_noise(step, intensity)
