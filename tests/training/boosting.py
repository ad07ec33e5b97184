"""Boosts trees with LightGBM, and writes them as `tracker.boosting` reads them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import lightgbm
import numpy as np
from numpy.typing import NDArray

from scenarios.files import moved_in
from tracker.boosting import Trees

RATE = 0.1
"""How much of each step is taken."""


def fit(
    cues: NDArray[np.floating[Any]],
    right: NDArray[np.generic],
    *,
    trees: int,
    leaves: int,
    objective: str = "binary",
    rate: float = RATE,
    monotone: Sequence[int] | None = None,
) -> Trees:
    """Boost trees.

    Args:
        cues: (N, C) of the candidates.
        right: (N,) which of them are right, or the number that is to be told of each.
        trees: How many.
        leaves: Of a tree at most.
        objective: LightGBM's name for what is minimised.
        rate: How much of each step is taken.
        monotone: (C,) 1 for a cue of which more never speaks against a candidate, -1 for one of which more
            never speaks for it; None binds none.
    """
    booster = lightgbm.train(
        {
            "objective": objective,
            "num_leaves": leaves,
            "learning_rate": rate,
            "min_data_in_leaf": 100,
            "lambda_l2": 5.0,
            "monotone_constraints": monotone,
            "max_bin": 63,
            "num_threads": 1,
            "deterministic": True,
            "force_row_wise": True,
            "seed": 0,
            "verbosity": -1,
        },
        lightgbm.Dataset(cues.astype(np.float32), right.astype(float)),
        num_boost_round=trees,
    )
    print(f"{len(right)} candidates, {right.astype(float).mean():.2f} in the mean; fitted.")
    roots: list[int] = []
    nodes: list[list[float]] = []
    for tree in booster.dump_model()["tree_info"]:
        roots.append(len(nodes))
        _lay_out(tree["tree_structure"], nodes)
    cue, limit, child = zip(*nodes, strict=True)
    return Trees(
        roots=np.array(roots, np.int32),
        cues=np.array(cue, np.int16),
        limits=np.array(limit, np.float32),
        rights=np.array(child, np.int32),
    )


def _lay_out(node: dict[str, Any], nodes: list[list[float]]) -> None:
    """Append a tree's nodes, parents first, left before right."""
    if "leaf_value" in node:
        nodes.append([-1, node["leaf_value"], 0])
        return
    here = len(nodes)
    nodes.append([node["split_feature"], node["threshold"], 0])
    _lay_out(node["left_child"], nodes)
    nodes[here][2] = len(nodes)
    _lay_out(node["right_child"], nodes)


def write(trees: Trees, file: Path) -> None:
    """Write trees where `tracker.boosting.learnt` finds them."""
    with moved_in(file) as path, path.open("wb") as stream:
        np.savez_compressed(stream, **asdict(trees))
    print(f"Written: {file}")
