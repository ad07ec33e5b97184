"""Boosted trees: log odds from cues. They are learnt elsewhere; this reads and adds them up.

The trees of each tracker lie beside it, and the commands that learnt them in ``tests/training``.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache, cached_property
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
TOGETHER = 256
"""Candidates that are asked together: their cues fit into the cache next to the processor."""


@dataclass(frozen=True, eq=False)
class Trees:
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

    @cached_property
    def questions(self) -> Questions:
        """The same, as many candidates at once are asked."""
        return Questions(*_questions(self.roots, self.cues, self.limits, self.rights))


class Questions(NamedTuple):
    """The K inner nodes of T trees, and their leaves.

    Attributes:
        begins: (T + 1,) int64, the first node of each tree, and K.
        cues: (K,) int64, the cue that a node asks for.
        limits: (K,) float32: beyond, it goes right.
        kept: (K,) uint32, the leaves that are left over if it does; a bit each.
        values: (T, `MOST_LEAVES`) float32, what a leaf adds, by the hash of its bit.
    """

    begins: NDArray[np.int64]
    cues: NDArray[np.int64]
    limits: NDArray[np.float32]
    kept: NDArray[np.uint32]
    values: NDArray[np.float32]


@cache
def learnt(package: str, name: str) -> Trees:
    """Read the trees ``name`` (.npz) that come with a package of a tracker."""
    with as_file(files(package) / f"{name}.npz") as path, np.load(path) as stored:
        return Trees(**{field.name: stored[field.name] for field in fields(Trees)})


@njit(cache=True)
def _hash(bit):  # type: ignore[no-untyped-def]
    """Return a number below 32 that is another one for each power of two (de Bruijn)."""
    return np.uint32(bit * np.uint32(0x077CB531)) >> np.uint32(27)


@njit(cache=True)
def _questions(roots, cues, limits, rights):  # type: ignore[no-untyped-def]
    """Return the fields of `Questions`."""
    inner = np.flatnonzero(cues >= 0)
    kept, values = np.empty(inner.size, np.uint32), np.zeros((roots.size, MOST_LEAVES), np.float32)
    before = np.zeros(cues.size, np.int64)
    for k in range(roots.size):
        leaves = 0
        for node in range(roots[k], roots[k + 1] if k + 1 < roots.size else cues.size):
            before[node] = leaves
            if cues[node] < 0:
                values[k, _hash(np.uint32(1) << np.uint32(leaves))] = limits[node]
                leaves += 1
    for n in range(inner.size):
        struck = (np.int64(1) << before[rights[inner[n]]]) - (np.int64(1) << before[inner[n]])
        kept[n] = np.uint32(~struck & 0xFFFFFFFF)
    begins = np.append(np.searchsorted(inner, roots), inner.size)
    return begins, cues[inner].astype(np.int64), limits[inner], kept, values


@njit(cache=True)
def _add(sums, found, first, last, questions):  # type: ignore[no-untyped-def]
    """Add the leaves of some trees to the sums (K,) of candidates with the cues (K, C), in place."""
    number, everything = sums.size, np.uint32(0xFFFFFFFF)
    columns, remaining = np.ascontiguousarray(found.T), np.empty(number, np.uint32)
    for tree in range(first, last):
        remaining[:] = everything
        for node in range(questions.begins[tree], questions.begins[tree + 1]):
            column, limit, kept = columns[questions.cues[node]], questions.limits[node], questions.kept[node]
            for i in range(number):
                remaining[i] &= kept if column[i] > limit else everything
        values = questions.values[tree]
        for i in range(number):
            bits = remaining[i]
            sums[i] += values[_hash(bits & (~bits + np.uint32(1)))]


@njit(cache=True)
def _sum(found, low, high, questions):  # type: ignore[no-untyped-def]
    """Add up the trees' leaves for K candidates with the cues (K, C).

    All nodes of a tree are asked of many candidates, which takes no branch and several at a time: a
    node that leads to the right strikes out the leaves on its left, and the first that is left over is the
    one (QuickScorer; Lucchese et al., SIGIR 2015).
    """
    result, count = np.zeros(found.shape[0]), questions.values.shape[0]
    first = min(FIRST, count)
    for begin in range(0, result.size, TOGETHER):
        end = begin + TOGETHER
        _add(result[begin:end], found[begin:end], 0, first, questions)
    alive = np.flatnonzero((result >= low) & (result <= high))
    for begin in range(0, alive.size, TOGETHER):
        some = alive[begin : begin + TOGETHER]
        sums = result[some]
        _add(sums, found[some], first, count, questions)
        result[some] = sums
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
    result: Floats = _sum(np.asarray(found, np.float32), low, high, weighed_by.questions)
    return result
