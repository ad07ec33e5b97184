"""Kalman filter, gating and assignment against plain formulas and brute force."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.filtering import kalman
from tracker.filtering.assignment import assign


def _targets(rng, count):
    """Means (N, 2) and covariances (N, 2, 2)."""
    root = rng.normal(size=(count, 2, 2))
    return rng.normal(size=(count, 2)), root @ np.swapaxes(root, 1, 2) + 0.1 * np.eye(2)


@given(st.integers(0, 10_000), st.floats(0.01, 1.0), st.floats(0.0, 50.0))
@settings(max_examples=30, deadline=None)
def test_prediction_is_the_textbook_one(seed, step, intensity):
    before, spread = _targets(np.random.default_rng(seed), 5)
    mean, covariance = before.copy(), spread.copy()
    kalman.predict(mean, covariance, step, intensity)
    transition = np.array([[1.0, step], [0.0, 1.0]])
    noise = intensity * np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]])
    for i in range(5):
        assert np.allclose(mean[i], transition @ before[i])
        assert np.allclose(covariance[i], transition @ spread[i] @ transition.T + noise)


@given(st.integers(0, 10_000), st.floats(0.01, 10.0))
@settings(max_examples=30, deadline=None)
def test_update_is_the_textbook_one(seed, noise):
    rng = np.random.default_rng(seed)
    before, spread = _targets(rng, 5)
    mean, covariance = before.copy(), spread.copy()
    rows, measured = np.array([4, 0, 2]), rng.normal(size=3)
    kalman.update(mean, covariance, rows, measured, noise)
    observation = np.array([[1.0, 0.0]])
    for i in range(5):
        if i not in rows:
            assert np.array_equal(mean[i], before[i])
            assert np.array_equal(covariance[i], spread[i])
            continue
        position = measured[rows.tolist().index(i)]
        gain = spread[i] @ observation.T @ np.linalg.inv(observation @ spread[i] @ observation.T + noise)
        assert np.allclose(mean[i], before[i] + gain @ (position - observation @ before[i]))
        assert np.allclose(covariance[i], (np.eye(2) - gain @ observation) @ spread[i])


def _best(cost, gate):
    """Most pairs, then least cost, by trying all."""
    rows, columns = cost.shape
    best = (0, 0.0)
    for count in range(min(rows, columns), 0, -1):
        sums = [
            cost[list(chosen), list(order)].sum()
            for chosen in itertools.combinations(range(rows), count)
            for order in itertools.permutations(range(columns), count)
            if (cost[list(chosen), list(order)] <= gate).all()
        ]
        if sums:
            return count, min(sums)
    return best


@given(st.integers(0, 10_000), st.integers(1, 4), st.integers(1, 4))
@settings(max_examples=60, deadline=None)
def test_assignment_is_the_best(seed, rows, columns):
    rng = np.random.default_rng(seed)
    cost = rng.uniform(-1, 10, (rows, columns))
    cost[rng.random(cost.shape) < 0.3] = np.inf
    found_rows, found_columns = assign(cost, 5.0)
    assert len(set(found_columns.tolist())) == len(found_columns)
    count, total = _best(cost, 5.0)
    assert len(found_rows) == count
    assert np.isclose(cost[found_rows, found_columns].sum(), total)


def test_assignment_of_nothing():
    assert [len(part) for part in assign(np.zeros((0, 3)), 1.0)] == [0, 0]
    assert [len(part) for part in assign(np.full((2, 2), np.nan), 1.0)] == [0, 0]
