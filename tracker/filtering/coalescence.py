"""Keeping neighbours apart that would take each other's measurements in equal shares.

The mean over association events moves two targets that come close onto one path (track coalescence). Where
the best joint event gives a measurement to one target, the others leave it to that target: the exclusive
pruning of Fitzgerald (ENNPDA; in Bar-Shalom (ed.), Multitarget-Multisensor Tracking, 1990, ch. 6; Blom,
Bloem, IEEE T-AC 45(2), 2000, show that it does not coalesce).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

Floats = NDArray[np.float64]


def best_event(weights: Floats) -> NDArray[np.int64]:
    """Return (N,) the column of each target in the most probable joint event; 0 is a miss.

    Args:
        weights: (N, M + 1) as from `tracker.filtering.jpda.likelihoods`; a miss must be possible.
    """
    count, measured = weights.shape[0], weights.shape[1] - 1
    gain = np.full((count, measured + count), -np.inf)
    with np.errstate(divide="ignore"):
        gain[:, :measured] = np.log(weights[:, 1:]) - np.log(weights[:, :1])
    gain[np.arange(count), measured + np.arange(count)] = 0.0
    # Only what is worth more than a miss can be in the best event; the rest must be finite.
    gain = np.where(gain >= 0.0, gain, -1e9)
    rows, columns = linear_sum_assignment(gain, maximize=True)
    chosen = np.zeros(count, np.int64)
    chosen[rows] = np.where(columns < measured, columns + 1, 0)
    return chosen


def keep_apart(weights: Floats) -> Floats:
    """Leave to each target what the best joint event gives it.

    Args:
        weights: (N, M + 1) as in `best_event`.

    Returns:
        (N, M + 1) with 0 where a measurement is another target's.
    """
    chosen = best_event(weights)
    pruned = weights.copy()
    taken = chosen[chosen > 0]
    pruned[:, taken] = 0.0
    rows = np.flatnonzero(chosen)
    pruned[rows, taken] = weights[rows, taken]
    return pruned
