"""Numbers over seeds (scoring.md 16)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sim.rng import stream

_RESAMPLES = 2000
_NO_DIFFERENCE = ("confusion",)
"""What differences between trackers leave out: each cell of it depends on how many traces a tracker dared."""


def interval(values: ArrayLike) -> dict[str, Any]:
    """Give the mean of one number over seeds, with its 95 % bootstrap interval.

    Args:
        values: (n,) finite, n >= 1.

    Returns:
        ``mean``; ``ci95`` as [low, high], None of a single value, which says nothing of the spread; ``n``.
    """
    numbers = np.asarray(values, float)
    bounds = None
    if len(numbers) > 1:
        picks = stream(0, "bootstrap").integers(0, len(numbers), (_RESAMPLES, len(numbers)))
        bounds = [float(q) for q in np.quantile(numbers[picks].mean(axis=1), [0.025, 0.975])]
    return {"mean": float(numbers.mean()), "ci95": bounds, "n": len(numbers)}


def over_seeds(documents: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Join the scores of several seeds, which are nested alike.

    Args:
        documents: One a seed. Whole numbers are counts and are summed; other numbers give an `interval`, in
            which nulls are left out; what is null in every seed stays null.
    """
    return {key: _joined([document.get(key) for document in documents]) for key in _keys(documents)}


def paired(scores: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Compare every two trackers on the same seeds.

    Args:
        scores: Each tracker's scores, one a seed, in the same order of seeds.

    Returns:
        For each two trackers ``tracker``, ``against``, and ``difference``: the first less the second, as an
        `interval` of the differences on the seeds where both have the score; a score without such a seed is
        left out, and so are confusion matrices.

    Raises:
        ValueError: If the trackers have not as many seeds.
    """
    return [
        {"tracker": a, "against": b, "difference": _differences(list(zip(scores[a], scores[b], strict=True)))}
        for a, b in combinations(scores, 2)
    ]


def _keys(documents: Sequence[Mapping[str, Any]]) -> list[str]:
    """All keys, in the order in which they first appear."""
    return list(dict.fromkeys(key for document in documents for key in document))


def _joined(values: list[Any]) -> Any:
    known = [value for value in values if value is not None]
    if not known:
        return None
    if isinstance(known[0], Mapping):
        return over_seeds(known)
    if all(isinstance(value, int) for value in known):
        return sum(known)
    return interval(known)


def _differences(pairs: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key in _keys([document for pair in pairs for document in pair]):
        if key in _NO_DIFFERENCE:
            continue
        both = [(a[key], b[key]) for a, b in pairs if a.get(key) is not None and b.get(key) is not None]
        if both and isinstance(both[0][0], Mapping):
            inner = _differences(both)
            if inner:
                found[key] = inner
        elif both:
            found[key] = interval([a - b for a, b in both])
    return found
