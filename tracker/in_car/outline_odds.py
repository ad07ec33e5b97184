"""The log odds that an outline is a vehicle's that goes the ego's way: boosted trees over its cues.

The trees (outline_odds.npz) were learnt from simulated drives. They are of an earlier state of
``python -m tests.training.outlines``, which learnt from the mistakes of still earlier trees; that command now
begins from nothing and makes others, as good on simulated drives (`docs/outlines.md`).
"""

from __future__ import annotations

from functools import cache
from importlib.resources import as_file, files
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# After so many trees an outline with odds below HOPELESS is given up: the others could not save it.
FIRST, HOPELESS = 40, -4.0


class Trees(NamedTuple):
    """T trees, their nodes one after the other; a node's left child follows it.

    Attributes:
        roots: (T,) int32, where each tree begins.
        cues: (M,) int16, the cue that a node asks for, -1 in a leaf.
        limits: (M,) float32: up to here it goes left; in a leaf the log odds that it adds.
        rights: (M,) int32, the right child.
    """

    roots: NDArray[np.int32]
    cues: NDArray[np.int16]
    limits: NDArray[np.float32]
    rights: NDArray[np.int32]


@cache
def learnt_trees() -> Trees:
    """Read the trees that come with the tracker."""
    with as_file(files("tracker.in_car") / "outline_odds.npz") as path, np.load(path) as stored:
        return Trees(**{name: stored[name] for name in Trees._fields})


@njit(cache=True)
def _sum(found, roots, cues, limits, rights):  # type: ignore[no-untyped-def]
    count = found.shape[0]
    result = np.zeros(count)
    alive, number = np.arange(count), count
    # Tree by tree, since a tree stays in the fastest memory while all outlines go down it.
    for k in range(roots.size):
        if k == FIRST:
            number = 0
            for i in range(count):
                if result[i] >= HOPELESS:
                    alive[number] = i
                    number += 1
        for place in range(number):
            i = alive[place]
            node = roots[k]
            while cues[node] >= 0:
                node = node + 1 if found[i, cues[node]] <= limits[node] else rights[node]
            result[i] += limits[node]
    return result


def log_odds(found: Floats, weighed_by: Trees) -> Floats:
    """Return the log odds (K,) of outlines with the cues (K, C)."""
    result: Floats = _sum(found.astype(np.float32), *weighed_by)
    return result
