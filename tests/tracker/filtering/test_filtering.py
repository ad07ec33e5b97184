"""Kalman filter, gating and assignment against plain formulas and brute force."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.filtering import kalman
from tracker.filtering.assignment import assign


def test_prediction_of_constant_velocity():
    transition, noise = kalman.constant_velocity(0.1, 4.0, axes=2)
    mean, covariance = kalman.predict(
        np.array([[1.0, 2.0, 3.0, -1.0]]), np.zeros((1, 4, 4)), transition, noise
    )
    assert np.allclose(mean, [[1.2, 2.0, 2.9, -1.0]])
    assert np.allclose(covariance[0, :2, :2], 4.0 * np.array([[0.1**3 / 3, 0.005], [0.005, 0.1]]))
    assert np.allclose(covariance[0, :2, 2:], 0)


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_update_is_the_textbook_one(seed):
    rng = np.random.default_rng(seed)
    mean = rng.normal(size=(5, 3))
    root = rng.normal(size=(5, 3, 3))
    covariance = root @ np.swapaxes(root, 1, 2) + np.eye(3)
    observation, noise = rng.normal(size=(2, 3)), np.diag(rng.uniform(0.5, 2, 2))
    measured = rng.normal(size=(5, 2))
    new_mean, new_covariance = kalman.update(mean, covariance, measured, observation, noise)
    for i in range(5):
        spread = observation @ covariance[i] @ observation.T + noise
        gain = covariance[i] @ observation.T @ np.linalg.inv(spread)
        assert np.allclose(new_mean[i], mean[i] + gain @ (measured[i] - observation @ mean[i]))
        assert np.allclose(new_covariance[i], (np.eye(3) - gain @ observation) @ covariance[i])


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
