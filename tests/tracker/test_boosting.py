"""Boosted trees: those that come with the trackers are well formed, and all are walked as trees are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.boosting import FIRST, MOST_LEAVES, Trees, _hash, learnt, log_odds
from tracker.in_car.cues import COUNT as OUTLINE_CUES
from tracker.motorcycle_lane.foreground import COUNT as PIXEL_CUES

COUNT = 20
LEARNT = [
    ("tracker.in_car", "outline_odds", OUTLINE_CUES),
    ("tracker.motorcycle_lane", "foreground", PIXEL_CUES),
]


def leaf(grown, node, row):
    """Follow one tree by what its documentation says."""
    if grown.cues[node] < 0:
        return float(grown.limits[node])
    left = row[grown.cues[node]] <= grown.limits[node]
    return leaf(grown, node + 1 if left else grown.rights[node], row)


def walk(grown, row, low=-np.inf, high=np.inf):
    """Add up the trees one by one, but only the first ones where those settle it."""
    total = 0.0
    for number, root in enumerate(grown.roots):
        if number == FIRST and not low <= total <= high:
            return total
        total += leaf(grown, root, row)
    return total


def grow(rng, count):
    """Random trees."""
    roots, cues, limits, rights = [], [], [], []

    def add(depth):
        place = len(cues)
        split = depth > 0 and rng.random() < 0.8
        cues.append(rng.integers(COUNT) if split else -1)
        limits.append(rng.normal(0.0, 0.5))
        rights.append(0)
        if split:
            add(depth - 1)
            rights[place] = len(cues)
            add(depth - 1)

    for _ in range(count):
        roots.append(len(cues))
        add(5)
    return Trees(
        np.array(roots, np.int32),
        np.array(cues, np.int16),
        np.array(limits, np.float32),
        np.array(rights, np.int32),
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 2 * FIRST))
def test_sums_are_those_of_a_walk_through_random_trees(seed, count):
    rng = np.random.default_rng(seed)
    grown = grow(rng, count)
    found = rng.normal(0.0, 1.0, (20, COUNT)).astype(np.float32)
    for settled in ((-np.inf, np.inf), (-0.5, np.inf), (-0.3, 0.4)):
        wanted = [walk(grown, row, *settled) for row in found]
        np.testing.assert_allclose(log_odds(found, grown, settled=settled), wanted, atol=1e-9)


@pytest.mark.parametrize(("package", "name", "count"), LEARNT)
def test_learnt_trees_are_well_formed(package, name, count):
    grown = learnt(package, name)
    inner = grown.cues >= 0
    assert len(grown.roots) > FIRST
    assert grown.roots[0] == 0
    assert grown.cues.max() < count
    assert np.isfinite(grown.limits).all()
    assert max(np.add.reduceat(~inner, grown.roots)) <= MOST_LEAVES
    # Every node but the roots is the child of exactly one.
    children = np.concatenate([np.flatnonzero(inner) + 1, grown.rights[inner]])
    assert sorted([*children, *grown.roots]) == list(range(len(grown.cues)))
    assert (grown.rights[inner] > np.flatnonzero(inner) + 1).all()


@pytest.mark.parametrize(("package", "name", "count"), LEARNT)
def test_learnt_trees_are_walked(package, name, count):
    rng = np.random.default_rng(3)
    grown = learnt(package, name)
    # Near the limits that the trees ask for, so that all branches are taken.
    spread = [np.concatenate([grown.limits[grown.cues == cue], [0.0]]) for cue in range(count)]
    found = np.stack([rng.choice(limits, 300) for limits in spread], axis=1).astype(float)
    odds = log_odds(found, grown)
    np.testing.assert_allclose(odds, [walk(grown, row) for row in found.astype(np.float32)], atol=1e-9)
    assert (odds < 0.0).any()
    assert (odds > 0.0).any()


def test_every_leaf_has_a_place_of_its_own():
    assert {int(_hash(np.uint32(1 << leaf))) for leaf in range(MOST_LEAVES)} == set(range(MOST_LEAVES))


def test_no_candidates_no_odds():
    assert log_odds(np.empty((0, COUNT)), grow(np.random.default_rng(0), 3)).shape == (0,)
