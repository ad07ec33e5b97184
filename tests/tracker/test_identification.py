"""The rules of hmm.py on simulated traces (methods.md 1.6): what memory and a known yaw rate are worth."""

from functools import cache

import numpy as np
import pytest
from scipy.special import logit

from tracker.in_car.hmm import Evidence, Transitions, update_max, update_sum
from tracker.in_car.likelihood import LikelihoodTable, MotionModel, MotionPriors, corridor_density

FOCAL, RATE, COUNT, STEPS, FIT = 800.0, 30.0, 600, 150, 12


def wander(rng, sd, time_constant, shape):
    """Draw Ornstein-Uhlenbeck processes, (N, T)."""
    keep = np.exp(-1 / RATE / time_constant)
    values = np.empty(shape)
    values[:, 0] = rng.normal(0, sd, shape[0])
    for t in range(1, shape[1]):
        values[:, t] = keep * values[:, t - 1] + rng.normal(0, sd * np.sqrt(1 - keep**2), shape[0])
    return values


def traces(kind, yaw_sd, rng):
    """Draw traces x(t) of points in space, (N, T), not a number once out of view."""
    p = MotionPriors()
    shape = (COUNT, STEPS + FIT)
    if kind == "background":
        support = np.linspace(0, p.lateral_limit, 5001)
        mass = np.cumsum(corridor_density(support, p.corridor))
        X = np.interp(rng.random(COUNT) * mass[-1], mass, support) * rng.choice([-1, 1], COUNT)
        Z = rng.uniform(*p.depth_range, COUNT)
        t_x, t_z = np.zeros(shape), np.repeat(-rng.normal(p.speed, p.speed_sd, (COUNT, 1)), shape[1], 1)
    else:
        X, Z = rng.normal(0, p.car_lateral_sd, COUNT), rng.normal(p.car_depth, p.car_depth_sd, 3 * COUNT)
        Z = Z[(p.car_depth_range[0] < Z) & (p.car_depth_range[1] > Z)][:COUNT]
        t_x, t_z = wander(rng, p.car_t_x_sd, 1.0, shape), wander(rng, p.car_t_z_sd, 2.0, shape)
    yaw = wander(rng, yaw_sd, 1.0, shape)
    x = np.empty(shape)
    for t in range(shape[1]):
        x[:, t] = np.where(Z > 3, FOCAL * X / np.maximum(Z, 1), np.nan)
        X = X + (t_x[:, t] - yaw[:, t] * Z) / RATE
        Z = Z + (t_z[:, t] + yaw[:, t] * X) / RATE
    x[np.logical_or.accumulate(~(np.abs(x) < 320), axis=1)] = np.nan
    return x + rng.normal(0, 0.5, shape)


@cache
def right_at_the_end(yaw_sd):
    """Return, by rule, the fractions of background and of car traces whose last label is right."""
    rng = np.random.default_rng(8)
    v_sd = np.sqrt(12 * 0.25 * RATE**2 / (FIT * (FIT**2 - 1)))
    model = MotionModel(FOCAL, MotionPriors(yaw_sd=yaw_sd, v_sd=float(v_sd)))
    table = LikelihoodTable.build(model)
    slope = (np.arange(FIT) - (FIT - 1) / 2) * RATE * 12 / (FIT * (FIT**2 - 1))
    result = {}
    for kind in ("background", "car"):
        x = traces(kind, yaw_sd, rng)
        v = np.stack([x[:, t : t + FIT] @ slope for t in range(STEPS)], axis=1)
        x = x[:, FIT - 1 : FIT - 1 + STEPS]
        started = ~np.isnan(v[:, 0])
        ratios = table.log_ratio(np.nan_to_num(x), np.nan_to_num(v))
        state = {name: np.full(COUNT, 0.5) for name in ("frame", "paper", "sticky")}
        log_odds = np.zeros(COUNT)
        evidence, sticky = Evidence(limit=1e6), Transitions(car_to_car=0.995, background_to_car=0.005)
        for t in range(STEPS):
            seen = ~np.isnan(v[:, t])
            ratio = ratios[seen, t]
            state["frame"][seen] = ratio > 0
            state["paper"][seen] = update_max(state["paper"][seen], ratio)
            state["sticky"][seen] = update_sum(state["sticky"][seen], ratio, sticky)
            log_odds[seen] = evidence.update(log_odds[seen], ratio, 1 / RATE)
        state["evidence"] = np.where(log_odds > 0, 1.0, 0.0)
        for name, p_car in state.items():
            right = (p_car > 0.5) == (kind == "car")
            result.setdefault(name, []).append(float(right[started].mean()))
    return result


EXPECTED = {
    0.01: {"frame": (0.96, 0.60), "paper": (0.93, 0.70), "sticky": (0.97, 0.62), "evidence": (0.95, 0.83)},
    0.001: {"frame": (0.98, 0.65), "paper": (0.96, 0.72), "sticky": (0.98, 0.68), "evidence": (0.98, 0.92)},
}


@pytest.mark.parametrize("yaw_sd", list(EXPECTED))
def test_rules_are_as_good_as_expected(yaw_sd):
    found = right_at_the_end(yaw_sd)
    print(yaw_sd, found)
    for name, (background, car) in EXPECTED[yaw_sd].items():
        assert found[name] == pytest.approx([background, car], abs=0.1), name


def test_memory_beats_single_frames():
    for yaw_sd in EXPECTED:
        score = {name: np.mean(right) for name, right in right_at_the_end(yaw_sd).items()}
        assert score["evidence"] > score["paper"] + 0.03
        assert score["evidence"] > score["frame"] + 0.05


def test_removing_the_yaw_helps():
    with_yaw, without = right_at_the_end(0.01), right_at_the_end(0.001)
    for name in ("frame", "sticky", "evidence"):
        assert np.mean(without[name]) > np.mean(with_yaw[name])
    assert logit(np.mean(without["evidence"])) > logit(np.mean(with_yaw["evidence"])) + 0.5
