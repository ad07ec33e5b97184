"""Association probabilities and moments against the reference case, brute force and simulated tracks."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from tracker.filtering import jpda, planar

FIXTURE = json.loads((Path(__file__).parents[2] / "fixtures" / "jpda.json").read_text())
EXACT = {"rtol": 0, "atol": 1e-12}


def events(weights):
    """All joint events: for each target the chosen column, none but the miss twice; and their weights."""
    rows = len(weights)
    found = []
    for chosen in itertools.product(*(np.flatnonzero(weights[i]) for i in range(rows))):
        taken = [j for j in chosen if j]
        if len(set(taken)) == len(taken):
            found.append((chosen, float(np.prod(weights[np.arange(rows), chosen]))))
    return found


def brute(weights):
    beta = np.zeros(weights.shape)
    for chosen, weight in events(weights):
        beta[np.arange(len(chosen)), chosen] += weight
    return beta / beta.sum(1, keepdims=True)


def case(name=None):
    """Prediction, measurements and parameters of the fixture."""
    part = FIXTURE[name] if name else FIXTURE
    parameters = part if name else FIXTURE["params"]
    clutter = parameters.get("clutter_density", parameters.get("clutter_density_per_px2"))
    mean, covariance, measurements = (
        np.array(part[key]) for key in ("predicted_mean", "predicted_cov", "measurements")
    )
    found = jpda.innovations(mean, covariance, measurements, planar.POSITION, 4.0 * np.eye(2))
    weights = jpda.likelihoods(found, detection=parameters["P_D"], gate=parameters["P_G"], clutter=clutter)
    return mean, covariance, found, weights


def test_reference_innovations_and_gate():
    _, _, found, weights = case()
    assert np.allclose(found.spread, FIXTURE["S"], **EXACT)
    assert np.allclose(found.distances, FIXTURE["mahalanobis2"], rtol=1e-13)
    assert np.allclose(found.densities, FIXTURE["gaussian_pdf"], **EXACT)
    assert np.isclose(jpda.gate_distance(0.99), FIXTURE["params"]["gate_chi2_2dof"], rtol=1e-12)
    assert np.array_equal(weights > 0, np.array(FIXTURE["validation_matrix"], bool))
    assert np.allclose(weights, FIXTURE["likelihood_matrix"], rtol=1e-12)
    assert len(events(weights)) == FIXTURE["n_joint_events"]


def test_reference_association_and_moments():
    mean, covariance, found, weights = case()
    association = jpda.associate(weights)
    assert np.allclose(association.beta, FIXTURE["beta_exact"], **EXACT)
    assert association.clusters.tolist() == [0, 0, 1]
    assert not association.approximate.any()
    mean, covariance = jpda.update(mean, covariance, found, association.beta)
    assert np.allclose(mean, FIXTURE["updated_mean"], **EXACT)
    assert np.allclose(covariance, FIXTURE["updated_cov"], **EXACT)


def test_reference_without_a_gate():
    part = FIXTURE["ungated_PG1"]
    mean, covariance = np.array(FIXTURE["predicted_mean"]), np.array(FIXTURE["predicted_cov"])
    measured = np.array(FIXTURE["measurements"])
    found = jpda.innovations(mean, covariance, measured, planar.POSITION, 4.0 * np.eye(2))
    weights = jpda.likelihoods(found, detection=0.9, gate=1.0, clutter=2e-4)
    # The fifth measurement is so far from all that its density is 0 in float64.
    assert np.allclose(weights, part["likelihood_matrix"], rtol=1e-12)
    assert len(events(np.ones(weights.shape))) == part["n_joint_events"]
    assert np.allclose(jpda.associate(weights).beta, part["beta_exact"], **EXACT)


def test_reference_with_a_weak_measurement_and_the_printed_form():
    part = FIXTURE["scenario_weak"]
    mean, covariance, found, weights = case("scenario_weak")
    assert len(events(weights)) == part["n_joint_events"]
    beta = jpda.associate(weights).beta
    assert np.allclose(beta, part["beta_exact"], **EXACT)
    moved, _ = jpda.update(mean, covariance, found, beta)
    assert np.allclose(moved, part["updated_mean_standard"], **EXACT)
    moved, _ = jpda.update(mean, covariance, found, jpda.without_misses(beta))
    assert np.allclose(moved, part["updated_mean_paper_eq29"], **EXACT)


def test_reference_in_the_printed_form():
    part = FIXTURE["paper_mode"]
    mean, covariance, found, weights = case()
    beta = jpda.without_misses(jpda.associate(weights).beta)
    assert np.allclose(beta[:, 1:], part["beta_tilde_eq28"], **EXACT)
    assert not beta[:, 0].any()
    moved, _ = jpda.update(mean, covariance, found, beta)
    assert np.allclose(moved, part["updated_mean_eq29"], **EXACT)


def test_printed_form_leaves_a_target_with_an_empty_gate_where_it_is():
    mean, covariance, found, weights = case()
    weights[1, 1:] = 0.0
    beta = jpda.without_misses(jpda.associate(weights).beta)
    assert beta[1].tolist() == [1.0, 0, 0, 0, 0, 0]
    moved, spread = jpda.update(mean, covariance, found, beta)
    assert np.array_equal(moved[1], mean[1])
    assert np.array_equal(spread[1], covariance[1])


def test_reference_of_another_toolbox():
    part = FIXTURE["mathworks_crosscheck"]
    valid = np.array(part["validation_matrix_5meas_x_clutterplus6tracks"])
    weights = np.concatenate([np.ones((6, 1)), valid[:, 1:].T], 1)
    assert len(events(weights)) == part["n_feasible_events_expected"]
    given_ = np.array(part["likelihood_matrix_row0_missed_col0_clutter"])
    # Rows are measurements there, and clutter weighs what a measurement has in column 0.
    weights = np.concatenate([given_[0, 1:, None], given_[1:, 1:].T / given_[1:, 0]], 1)
    total = sum(weight for _, weight in events(weights))
    best = sorted((weight / total for _, weight in events(weights)), reverse=True)[:3]
    best = np.array(best) / sum(best)
    assert np.allclose(best, part["three_best_probs"], **EXACT)
    assert np.allclose(jpda.associate(weights).beta, part["beta_exact_tracks_by_missed_then_meas"], **EXACT)


@pytest.mark.parametrize(("size", "count"), FIXTURE["n_joint_events_full_gate"].items())
def test_number_of_events_of_open_gates(size, count):
    """All weights 1: the probability of one certain pair is a ratio of two numbers of events."""
    rows, columns = map(int, size.split("x"))
    smaller = sum(
        np.prod([float(rows - 1 - a) * (columns - 1 - a) / (a + 1) for a in range(k)])
        for k in range(min(rows, columns))
    )
    beta = jpda.associate(np.ones((rows, columns + 1))).beta
    assert np.allclose(beta[:, 1:], smaller / count, rtol=1e-12)


@st.composite
def problems(draw, rows=5, columns=6):
    shape = draw(st.integers(0, rows)), draw(st.integers(0, columns))
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    weights = np.exp(rng.normal(0, 3, (shape[0], shape[1] + 1)))
    weights[:, 1:] *= rng.random(shape) < draw(st.sampled_from([0.2, 0.5, 1.0]))
    return weights


@given(problems(), st.booleans())
@settings(max_examples=150, deadline=None)
def test_association_is_the_sum_over_all_events(weights, turn):
    if turn and weights.shape[0]:
        # More targets than measurements: the other side of the state.
        weights = np.concatenate([np.ones((weights.shape[1] - 1, 1)), weights[:, 1:].T], 1)
    beta = jpda.associate(weights).beta
    if beta.size:
        assert np.allclose(beta, brute(weights) if len(weights) else beta, **EXACT)
    assert np.allclose(beta.sum(1), 1.0, **EXACT)
    assert (beta[:, 1:].sum(0) <= 1.0 + 1e-12).all()
    assert (beta >= 0.0).all()


@given(problems(40, 40))
@settings(max_examples=40, deadline=None)
def test_large_problems_are_proper_and_agree_with_belief_propagation(weights):
    """Rows of 1, columns of at most 1, and messages end where the exact sum is, roughly."""
    association = jpda.associate(weights, budget=1 << 14)
    assert np.allclose(association.beta.sum(1), 1.0, atol=1e-9)
    assert (association.beta[:, 1:].sum(0) <= 1.0 + 1e-6).all()
    approximate = jpda.associate(weights, budget=0)
    assert np.abs(approximate.beta - association.beta).max(initial=0.0) < 0.25


def test_long_chain_is_exact_and_cheap():
    """Sixty targets, each sharing a measurement with the next: one cluster, two open columns at a time."""
    rng = np.random.default_rng(4)
    weights = np.zeros((60, 62))
    weights[:, 0] = 1.0
    for i in range(60):
        weights[i, i + 1 : i + 3] = rng.uniform(0.1, 10, 2)
    shuffled = rng.permutation(60)
    association = jpda.associate(weights[shuffled], budget=60 * 4)
    assert not association.approximate.any()
    assert set(association.clusters.tolist()) == {0}
    # The transfer matrix of the chain, written out: the state is whether the next measurement is taken.
    forward, backward = np.zeros((61, 2)), np.ones((61, 2))
    forward[0, 0] = 1.0

    def step(i, vector):
        first, second = weights[i, i + 1], weights[i, i + 2]
        return np.array([vector.sum() + vector[0] * first, vector.sum() * second])

    for i in range(60):
        forward[i + 1] = step(i, forward[i])
    for i in range(59, -1, -1):
        first, second = weights[i, i + 1], weights[i, i + 2]
        own = backward[i + 1, 0] + second * backward[i + 1, 1]
        backward[i] = [own + first * backward[i + 1, 0], own]
    total = forward[60].sum()
    missed = [forward[i].sum() * backward[i + 1, 0] / total for i in range(60)]
    assert np.allclose(association.beta[np.argsort(shuffled), 0], missed, rtol=1e-10)


def test_belief_propagation_beyond_the_budget():
    _, _, _, weights = case()
    association = jpda.associate(weights, budget=3)
    assert association.approximate.tolist() == [True, True, False]
    error = np.abs(association.beta - np.array(FIXTURE["beta_exact"])).max()
    assert np.isclose(error, FIXTURE["max_abs_diff"]["LBP"], atol=1e-5)
    assert np.allclose(association.beta, FIXTURE["beta_stonesoup_LBP_approx"], atol=1e-5)


def test_weights_that_cannot_be():
    for bad in ([[0.0, 1.0]], [[1.0, -1.0]], [[1.0, np.nan]]):
        with pytest.raises(ValueError, match="weights must be finite"):
            jpda.associate(np.array(bad))


def test_colour_and_detection_by_target():
    """One P_D for each target and one clutter density for each measurement are their rows and columns."""
    _, _, found, _ = case()
    weights = jpda.likelihoods(
        found, detection=[0.9, 0.5, 0.9], gate=0.99, clutter=[1e-4, 1e-4, 1e-4, 2e-4, 1]
    )
    assert np.allclose(weights[:, 0], [0.109, 0.505, 0.109])
    assert np.isclose(weights[1, 2], 0.5 * found.densities[1, 1] / 1e-4)
    assert np.isclose(weights[2, 4], 0.9 * found.densities[2, 3] / 2e-4)


# --- consistency on simulated tracks

STEP, INTENSITY, NOISE, STEPS, RUNS = 0.5, 20.0, 4.0, 40, 200


def simulate(rng, detection, clutter):
    """RUNS targets, each in a world of its own; yields truth and measurements (own one first, or nan)."""
    f, q = planar.transition(STEP), planar.process_noise(STEP, INTENSITY)
    root = np.linalg.cholesky(q)
    truth = rng.normal(size=(RUNS, 4)) * [2.0, 5.0, 2.0, 5.0]
    for _ in range(STEPS):
        truth = truth @ f.T + rng.normal(size=truth.shape) @ root.T
        own = truth @ planar.POSITION.T + np.sqrt(NOISE) * rng.normal(size=(RUNS, 2))
        own[rng.random(RUNS) > detection] = np.nan
        # Clutter in a square about each target, wider than any gate.
        side = 60.0
        false = [
            truth[i, [0, 2]] + rng.uniform(-side / 2, side / 2, (rng.poisson(clutter * side**2), 2))
            for i in range(RUNS)
        ]
        yield truth, own, false


@pytest.mark.parametrize(("detection", "clutter"), [(1.0, 0.0), (0.9, 2e-5)])
def test_error_is_what_the_covariance_says(detection, clutter):
    """NEES over 200 runs lies in its 95 % band: the filter alone, and with misses and clutter."""
    rng = np.random.default_rng(1)
    mean = np.zeros((RUNS, 4))
    covariance = np.tile(np.diag([4.0, 25.0, 4.0, 25.0]), (RUNS, 1, 1))
    gate = 0.9999
    nees = []
    for truth, own, false in simulate(rng, detection, clutter):
        mean, covariance = planar.predict(mean, covariance, STEP, INTENSITY)
        for i in range(RUNS):
            measured = np.concatenate([own[i : i + 1][~np.isnan(own[i : i + 1, 0])], false[i]])
            one = slice(i, i + 1)
            found = jpda.innovations(mean[one], covariance[one], measured, planar.POSITION, NOISE * np.eye(2))
            weights = jpda.likelihoods(
                found, detection=min(detection, 0.99999), gate=gate, clutter=max(clutter, 1e-12)
            )
            beta = jpda.associate(weights).beta
            mean[one], covariance[one] = jpda.update(mean[one], covariance[one], found, beta)
        error = mean - truth
        nees.append(np.einsum("na,nab,nb->n", error, np.linalg.inv(covariance), error).mean())
    low, high = chi2.ppf([0.025, 0.975], 4 * RUNS) / RUNS
    inside = (np.array(nees) > low) & (np.array(nees) < high)
    # Of 40 steps 2 are outside on average, more or fewer since neighbouring steps go together.
    assert inside.mean() >= 0.85
    assert low < np.mean(nees) < high
