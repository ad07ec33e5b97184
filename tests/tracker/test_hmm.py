import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import expit, logit

from tracker.in_car.hmm import (
    PAPER,
    Evidence,
    Transitions,
    predict_max,
    predict_sum,
    update_max,
    update_sum,
)

RATIOS = np.array([0.5, 2, 3, 0.4, 0.4, 0.2, 5])


@pytest.mark.parametrize(
    ("update", "expected"),
    [
        (update_max, [0.444444, 0.719101, 0.923077, 0.615385, 0.505929, 0.246806, 0.833333]),
        (update_sum, [0.481481, 0.783784, 0.892779, 0.569504, 0.449114, 0.257910, 0.872299]),
    ],
)
def test_paper_vectors(update, expected):
    p_car = np.array([0.5])
    found = []
    for ratio in RATIOS:
        p_car = update(p_car, np.log([ratio]))
        found.append(p_car[0])
    np.testing.assert_allclose(found, expected, atol=5e-7)


@given(st.floats(0, 1), st.floats(1e-6, 1e6), st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_one_step_is_the_printed_recursion(p, ratio, stay, enter):
    transitions = Transitions(car_to_car=stay, background_to_car=enter)
    car = max((1 - p) * enter, p * stay) * ratio
    background = max((1 - p) * (1 - enter), p * (1 - stay))
    found = update_max([p], np.log([ratio]), transitions)
    np.testing.assert_allclose(found, car / (car + background), rtol=1e-9)
    car = ((1 - p) * enter + p * stay) * ratio
    background = (1 - p) * (1 - enter) + p * (1 - stay)
    found = update_sum([p], np.log([ratio]), transitions)
    np.testing.assert_allclose(found, car / (car + background), rtol=1e-9)


@given(st.floats(0, 1))
def test_memory_of_the_printed_model_is_a_factor_between_1_and_4(p):
    for predict in (predict_max, predict_sum):
        assert 1 - 1e-12 <= predict([p])[0] <= 4 + 1e-12
    odds = p / (1 - p) if p < 1 else np.inf
    gain = 1.0 if odds <= 0.625 else min(1.6 * odds, 4.0)
    np.testing.assert_allclose(predict_max([p]), gain, rtol=1e-9)


def test_hysteresis_of_the_printed_model():
    firm = update_max([0.5], [50.0])
    assert update_max(firm, np.log([0.26]))[0] > 0.5
    assert update_max(firm, np.log([0.24]))[0] < 0.5
    background = update_max([0.5], [-50.0])
    assert update_max(background, np.log([1.01]))[0] > 0.5


def test_many_traces_are_as_one_each():
    rng = np.random.default_rng(5)
    p, ratio = rng.random(50), rng.normal(size=50)
    for update in (update_max, update_sum):
        together = update(p, ratio)
        np.testing.assert_array_equal(together, [update([a], [b])[0] for a, b in zip(p, ratio, strict=True)])


def test_extreme_ratios_stay_finite():
    for update in (update_max, update_sum):
        for start in (0.0, 0.5, 1.0):
            found = update(np.full(2, start), [-1e4, 1e4])
            assert np.isfinite(found).all()
            assert found[0] < 0.5 < found[1]


def test_sticky_needs_repeated_evidence():
    sticky = Transitions.sticky(1 / 30, 6.0)
    assert sticky.car_to_car == pytest.approx(1 - 1 / 180)
    background = np.array([0.02])
    once = update_sum(background, [1.0], sticky)
    assert once[0] < 0.5 < update_max(background, [1.0], PAPER)[0]
    p = background
    for _ in range(8):
        p = update_sum(p, [1.0], sticky)
    assert p[0] > 0.5


def test_evidence_of_independent_frames_is_bayes_rule():
    evidence = Evidence(correlation_time=0.1)
    ratios = np.array([0.3, -1.0, 2.0])
    log_odds = np.array([logit(0.2)])
    for ratio in ratios:
        log_odds = evidence.update(log_odds, [ratio], dt=0.1)
    prior = 0.2 / 0.8
    assert expit(log_odds[0]) == pytest.approx(prior * np.exp(1.3) / (1 + prior * np.exp(1.3)))


def test_evidence_does_not_depend_on_the_frame_rate():
    slow, fast = np.zeros(1), np.zeros(1)
    evidence = Evidence(correlation_time=0.5)
    for _ in range(10):
        slow = evidence.update(slow, [0.4], dt=0.1)
    for _ in range(30):
        fast = evidence.update(fast, [0.4], dt=1 / 30)
    np.testing.assert_allclose(slow, fast)


def test_evidence_is_bounded_and_fades():
    evidence = Evidence(correlation_time=0.1, memory=1.0, limit=5.0)
    log_odds = evidence.update([0.0], [1e6], dt=0.1)
    assert log_odds[0] == 5.0
    assert evidence.update(log_odds, [0.0], dt=1.0)[0] == pytest.approx(5 / np.e)


@pytest.mark.parametrize("build", [lambda: Transitions(car_to_car=1.2), lambda: Evidence(limit=0)])
def test_bad_parameters(build):
    with pytest.raises(ValueError, match="must"):
        build()
