"""Kalman filter for constant velocity with measured positions, many targets at a time, one axis each.

Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, chapters 5 and 6;
written out for two states, since the general form spends its time on the shapes of small matrices.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def predict(mean, covariance, step, intensity):  # type: ignore[no-untyped-def]
    """Advance N targets by one step, in place.

    Args:
        mean: (N, 2) position and velocity, units and units/s.
        covariance: (N, 2, 2).
        step: Seconds between two measurements.
        intensity: Power spectral density of the white acceleration, units^2 / s^3.
    """
    for i in range(mean.shape[0]):
        own = covariance[i]
        mean[i, 0] += step * mean[i, 1]
        own[0, 0] += step * (2.0 * own[0, 1] + step * own[1, 1]) + intensity * step**3 / 3.0
        own[0, 1] += step * own[1, 1] + intensity * step**2 / 2.0
        own[1, 0] = own[0, 1]
        own[1, 1] += intensity * step


@njit(cache=True)
def update(mean, covariance, rows, positions, noise):  # type: ignore[no-untyped-def]
    """Correct some of N targets by one measured position each, in place.

    The covariance is corrected in Joseph's form, so it stays symmetric and positive.

    Args:
        mean: (N, 2) position and velocity, units and units/s.
        covariance: (N, 2, 2).
        rows: (K,) targets that were measured.
        positions: (K,) where.
        noise: Variance of a measured position, units^2.
    """
    for k in range(rows.size):
        state, own = mean[rows[k]], covariance[rows[k]]
        spread = own[0, 0] + noise
        gain, drag = own[0, 0] / spread, own[0, 1] / spread
        innovation = positions[k] - state[0]
        state[0] += gain * innovation
        state[1] += drag * innovation
        own[1, 1] += drag * (drag * spread - 2.0 * own[0, 1])
        own[0, 1] = (1.0 - gain) * (own[0, 1] - drag * own[0, 0]) + gain * drag * noise
        own[1, 0] = own[0, 1]
        own[0, 0] = (1.0 - gain) ** 2 * own[0, 0] + gain**2 * noise
