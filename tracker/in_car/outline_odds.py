"""The log odds that an outline is a vehicle's that goes the ego's way: a table for each cue, their sum.

The tables (outline_odds.json) were learnt from simulated drives by ``python -m tests.training.outlines``.
Each says by how much a value of its cue raises or lowers the odds.
"""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car.cues import Cue

Floats = NDArray[np.float64]


class Tables(NamedTuple):
    """What each cue is worth.

    Attributes:
        edges: (C, B - 1) between the B bins of each of the C cues, ascending, infinite where there are fewer.
        odds: (C, B) log odds that a value in the bin adds.
        bias: Log odds of an outline whose cues say nothing.
    """

    edges: Floats
    odds: Floats
    bias: float


@cache
def tables() -> Tables:
    """Read the tables."""
    document = json.loads(files("tracker.in_car").joinpath("outline_odds.json").read_text())
    rows = [document["cues"][cue.name.lower()] for cue in Cue]
    bins = max(len(row["odds"]) for row in rows)
    edges, odds = np.full((len(Cue), bins - 1), np.inf), np.zeros((len(Cue), bins))
    for k, row in enumerate(rows):
        edges[k, : len(row["edges"])] = row["edges"]
        odds[k, : len(row["odds"])] = row["odds"]
    return Tables(edges=edges, odds=odds, bias=float(document["bias"]))


@njit(cache=True)
def _sum(found, edges, odds, bias):  # type: ignore[no-untyped-def]
    result = np.full(found.shape[0], bias)
    for i in range(found.shape[0]):
        for k in range(edges.shape[0]):
            low, high = 0, edges.shape[1]
            while low < high:
                middle = (low + high) // 2
                if edges[k, middle] <= found[i, k]:
                    low = middle + 1
                else:
                    high = middle
            result[i] += odds[k, low]
    return result


def log_odds(found: Floats) -> Floats:
    """Return the log odds (K,) of outlines with the cues (K, C)."""
    result: Floats = _sum(found, *tables())
    return result
