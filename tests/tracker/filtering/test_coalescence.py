"""The best joint event against all of them, and two targets on parallel paths that must not merge."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tracker.filtering.test_jpda import events
from tracker.filtering import coalescence, jpda, planar


@given(seed=st.integers(0, 100_000), targets=st.integers(1, 4), measured=st.integers(0, 4))
@settings(max_examples=60, deadline=None)
def test_best_event_is_the_best_of_all(seed, targets, measured):
    rng = np.random.default_rng(seed)
    weights = rng.exponential(1.0, (targets, measured + 1))
    weights[:, 1:] *= rng.random((targets, measured)) < 0.7
    chosen = coalescence.best_event(weights)
    taken = chosen[chosen > 0]
    assert len(np.unique(taken)) == len(taken)
    weight = np.prod(weights[np.arange(targets), chosen])
    assert np.isclose(weight, max(w for _, w in events(weights)), rtol=1e-9)


@given(seed=st.integers(0, 100_000))
@settings(max_examples=30, deadline=None)
def test_a_measurement_stays_with_one_target_or_with_all(seed):
    rng = np.random.default_rng(seed)
    weights = rng.exponential(1.0, (3, 5))
    chosen, pruned = coalescence.best_event(weights), coalescence.keep_apart(weights)
    for j in range(1, 5):
        if j in chosen:
            assert np.flatnonzero(pruned[:, j]).tolist() == [int(np.flatnonzero(chosen == j)[0])]
        else:
            assert np.array_equal(pruned[:, j], weights[:, j])
    assert np.array_equal(pruned[:, 0], weights[:, 0])


def distance_of_neighbours(prune, seed):
    """Two targets three apart, measured with a deviation of two: mean distance of their tracks at the end."""
    rng = np.random.default_rng(seed)
    mean = np.array([[0.0, 10.0, 0.0, 0.0], [0.0, 10.0, 3.0, 0.0]])
    covariance = np.array([np.diag([4.0, 4.0, 4.0, 4.0])] * 2)
    apart = []
    for t in range(1, 61):
        mean, covariance = planar.predict(mean, covariance, 0.1, 20.0)
        truth = np.array([[t, 0.0], [t, 3.0]])
        found = jpda.innovations(
            mean, covariance, truth + rng.normal(0, 2.0, (2, 2)), planar.POSITION, 4.0 * np.eye(2)
        )
        weights = jpda.likelihoods(found, detection=0.95, gate=0.999, clutter=1e-5)
        beta = jpda.associate(prune(weights)).beta
        mean, covariance = jpda.update(mean, covariance, found, beta)
        if t > 30:
            apart.append(abs(mean[0, 2] - mean[1, 2]))
    return np.mean(apart)


def test_neighbours_do_not_coalesce():
    plain = np.mean([distance_of_neighbours(lambda w: w, seed) for seed in range(12)])
    kept = np.mean([distance_of_neighbours(coalescence.keep_apart, seed) for seed in range(12)])
    assert plain < 1.5
    assert 2.5 < kept < 4.0
