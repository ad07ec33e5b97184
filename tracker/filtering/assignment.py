"""Assignment within a gate."""

from __future__ import annotations

import numpy as np
from numba import njit
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
    # Pairs that compete with none are settled; the rest is small.
    row_rivals, column_rivals, partners = _rivals(cost, gate)
    if not row_rivals.any():
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    alone = (row_rivals == 1) & (column_rivals[partners] == 1)
    contested = (row_rivals > 0) & ~alone
    if not contested.any():
        rows = np.flatnonzero(alone)
        return rows, partners[rows]
    partners = np.where(alone, partners, -1)
    column_rivals[partners[alone]] = 0
    some_rows, some_columns = np.flatnonzero(contested), np.flatnonzero(column_rivals)
    part = cost[np.ix_(some_rows, some_columns)]
    found_rows, found_columns = _cheapest(part, part <= gate)
    partners[some_rows[found_rows]] = some_columns[found_columns]
    rows = np.flatnonzero(partners >= 0)
    return rows, partners[rows]


@njit(cache=True)
def _rivals(cost, gate):  # type: ignore[no-untyped-def]
    """Count the possible partners of each row and column; of each row also the last of them, else 0."""
    rows, columns = np.zeros(cost.shape[0], np.int64), np.zeros(cost.shape[1], np.int64)
    partners = np.zeros(cost.shape[0], np.int64)
    for i in range(cost.shape[0]):
        for j in range(cost.shape[1]):
            if cost[i, j] <= gate:
                rows[i] += 1
                columns[j] += 1
                partners[i] = j
    return rows, columns, partners


def _cheapest(cost: Floats, possible: NDArray[np.bool_]) -> tuple[Indices, Indices]:
    # An impossible pair must cost more than all possible ones together, so that it never buys a better sum.
    lowest = cost[possible].min()
    shifted = np.where(possible, cost - lowest, 0.0)
    forbidden = (shifted.max() + 1.0) * (min(cost.shape) + 1)
    rows, columns = linear_sum_assignment(np.where(possible, shifted, forbidden))
    kept = possible[rows, columns]
    return rows[kept], columns[kept]
