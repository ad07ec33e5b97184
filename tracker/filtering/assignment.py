"""Gating and assignment."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


def mahalanobis(difference: ArrayLike, covariance: ArrayLike) -> Floats:
    """Return squared Mahalanobis distances (...) of differences (..., m) under covariances (..., m, m)."""
    difference = np.asarray(difference, float)
    solved = np.linalg.solve(np.asarray(covariance, float), difference[..., None])[..., 0]
    return np.asarray((difference * solved).sum(-1))


def assign(cost: ArrayLike, gate: float) -> tuple[Indices, Indices]:
    """Assign rows to columns one to one: as many as the gate allows, and among those the cheapest.

    Args:
        cost: (N, M); not a number or infinite means impossible.
        gate: Costs above it are impossible.

    Returns:
        Rows and columns of the pairs, rows ascending.
    """
    cost = np.asarray(cost, float)
    possible = np.isfinite(cost) & (cost <= gate)
    if not possible.any():
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    # An impossible pair must cost more than all possible ones together, so that it never buys a better sum.
    lowest = cost[possible].min()
    shifted = np.where(possible, cost - lowest, 0.0)
    forbidden = (shifted.max() + 1.0) * (min(cost.shape) + 1)
    rows, columns = linear_sum_assignment(np.where(possible, shifted, forbidden))
    kept = possible[rows, columns]
    return rows[kept].astype(np.int64), columns[kept].astype(np.int64)
