"""Assignment within a gate."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


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
    # Pairs that compete with none are settled; the rest is small.
    alone = possible & (possible.sum(1) == 1)[:, None] & (possible.sum(0) == 1)
    contested = possible & ~alone
    rows, columns = np.nonzero(alone)
    if contested.any():
        some_rows, some_columns = np.flatnonzero(contested.any(1)), np.flatnonzero(contested.any(0))
        part = np.ix_(some_rows, some_columns)
        found_rows, found_columns = _cheapest(cost[part], contested[part])
        rows = np.concatenate([rows, some_rows[found_rows]])
        columns = np.concatenate([columns, some_columns[found_columns]])
    order = np.argsort(rows)
    return rows[order].astype(np.int64), columns[order].astype(np.int64)


def _cheapest(cost: Floats, possible: NDArray[np.bool_]) -> tuple[Indices, Indices]:
    # An impossible pair must cost more than all possible ones together, so that it never buys a better sum.
    lowest = cost[possible].min()
    shifted = np.where(possible, cost - lowest, 0.0)
    forbidden = (shifted.max() + 1.0) * (min(cost.shape) + 1)
    rows, columns = linear_sum_assignment(np.where(possible, shifted, forbidden))
    kept = possible[rows, columns]
    return rows[kept], columns[kept]
