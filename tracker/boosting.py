"""Boosted trees: log odds from cues. They are learnt elsewhere; this reads and adds them up.

The trees of each tracker lie beside it, and the commands that learnt them in ``tests/training``.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import as_file, files
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FIRST = 40
"""Trees after which what is settled is asked no more."""
MOST_LEAVES = 32
"""A tree's leaves have a bit each in a word."""


class Trees(NamedTuple):
    """T trees of `MOST_LEAVES` leaves at most, node after node; a node's left child follows it.

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
def learnt(package: str, name: str) -> Trees:
    """Read the trees ``name`` (.npz) that come with a package of a tracker."""
    with as_file(files(package) / f"{name}.npz") as path, np.load(path) as stored:
        return Trees(**{field: stored[field] for field in Trees._fields})


@njit(cache=True)
def _hash(bit):  # type: ignore[no-untyped-def]
    """Return a number below 32 that is another one for each power of two (de Bruijn)."""
    return np.uint32(bit * np.uint32(0x077CB531)) >> np.uint32(27)


@njit(cache=True)
def _sum(found, low, high, roots, cues, limits, rights):  # type: ignore[no-untyped-def]
    """Add up the trees' leaves for K candidates with the cues (K, C).

    All nodes of a tree are asked of all candidates, which takes no branch and several at a time: a
    node that leads to the right strikes out the leaves on its left, and the first that is left over is the
    one (QuickScorer; Lucchese et al., SIGIR 2015).
    """
    number = found.shape[0]
    result, alive = np.zeros(number), np.arange(number)
    columns = np.ascontiguousarray(found.T)
    remaining = np.empty(number, np.uint32)
    # Leaves that come before a node, and the values of a tree's leaves in the order of their bits' hashes.
    before, values = np.zeros(cues.size, np.int64), np.zeros(MOST_LEAVES, np.float32)
    for k in range(roots.size):
        if k == FIRST:
            alive = np.flatnonzero((result >= low) & (result <= high))
            columns = columns[:, alive]
            number = alive.size
        root, end = roots[k], roots[k + 1] if k + 1 < roots.size else cues.size
        leaves = 0
        for node in range(root, end):
            before[node] = leaves
            if cues[node] < 0:
                values[_hash(np.uint32(1) << np.uint32(leaves))] = limits[node]
                leaves += 1
        remaining[:] = np.uint32(0xFFFFFFFF)
        for node in range(root, end):
            if cues[node] >= 0:
                struck = (np.int64(1) << before[rights[node]]) - (np.int64(1) << before[node])
                kept = np.uint32(~struck & 0xFFFFFFFF)
                column, limit = columns[cues[node]], limits[node]
                for i in range(number):
                    remaining[i] &= kept if column[i] > limit else np.uint32(0xFFFFFFFF)
        for i in range(number):
            bits = remaining[i]
            result[alive[i]] += values[_hash(bits & (~bits + np.uint32(1)))]
    return result


def log_odds(
    found: NDArray[np.floating[Any]], weighed_by: Trees, *, settled: tuple[float, float] = (-np.inf, np.inf)
) -> Floats:
    """Return the log odds (K,) of candidates with the cues (K, C).

    Args:
        found: The cues.
        weighed_by: The trees.
        settled: Log odds after `FIRST` trees, below the one and above the other of which those of a candidate
            are good enough as they are.
    """
    low, high = settled
    result: Floats = _sum(found.astype(np.float32), low, high, *weighed_by)
    return result
