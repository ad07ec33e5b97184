"""Exponents, search, regression, trajectories and the forecasts that come of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.aerial import lyapunov
from tracker.aerial.calibration import Calibration, quantile, scale
from tracker.aerial.forecasts import Growth, KalmanForecast, LinearForecast, leads_to, went_until
from tracker.aerial.motion_context import PRINTED, ContextForecast, ContextParameters
from tracker.aerial.regression import affine, carry, similarity
from tracker.aerial.trajectories import Trajectories


def _walks(rng, count, length):
    return np.cumsum(rng.normal([2.0, 0.0], 0.5, (count, length, 2)), axis=1)


@given(st.integers(0, 10_000), st.integers(2, 40), st.floats(0.5, 5.0))
@settings(max_examples=50, deadline=None)
def test_sum_of_logarithms_telescopes(seed, window, start):
    path, other = _walks(np.random.default_rng(seed), 2, window)
    apart = np.hypot(*((path - path[0]) - (other - other[0])).T)
    regular = np.sqrt(apart**2 + start**2)
    printed = sum(math.log(regular[i] / regular[i - 1]) for i in range(1, window)) / window
    assert lyapunov.exponent(path, other, start) == pytest.approx(printed, abs=1e-12)


def test_exponent_of_the_example():
    path = np.zeros((30, 2))
    other = np.linspace([0.0, 0.0], [10.0, 0.0], 30)
    assert lyapunov.exponent(path, other, 2.5) == pytest.approx(0.0472, abs=5e-5)
    assert lyapunov.threshold(30, 2.5, 10.0) == pytest.approx(0.0472, abs=5e-5)
    assert lyapunov.distance(30, 2.5, lyapunov.threshold(30, 2.5, 10.0)) == pytest.approx(10.0)
    assert lyapunov.exponent(path, path + 7.0, 2.5) == 0.0


def test_path_tells_apart_what_ends_alike():
    time = np.linspace(0.0, 1.0, 30)
    steady, late = np.stack([60 * time, 0 * time], 1), np.stack([60 * time**3, 0 * time], 1)
    assert lyapunov.exponent(steady, late, 2.5) == pytest.approx(0.0)
    assert lyapunov.path_distance(steady, late) > 10.0


@given(st.integers(0, 10_000), st.floats(1.0, 30.0), st.floats(5.0, 200.0), st.floats(1.0, 20.0))
@settings(max_examples=40, deadline=None)
def test_search_finds_what_trying_all_sections_finds(seed, most, reach, rms):
    rng = np.random.default_rng(seed)
    window, nearness = 6, 0.25
    points = _walks(rng, 5, 20) + rng.normal(0, 3.0, (5, 1, 2))
    counts = rng.integers(1, 21, 5)
    path = _walks(rng, 1, window)[0]
    ends, costs = lyapunov.search(points, counts, path, most, reach, rms, nearness)
    for j in range(5):
        found = {}
        for e in range(window - 1, counts[j]):
            section = points[j, e - window + 1 : e + 1]
            apart = np.hypot(*((section[-1] - section[0]) - (path[-1] - path[0])))
            away = np.hypot(*(section[-1] - path[-1]))
            if apart <= most and away <= reach and lyapunov.path_distance(path, section) <= rms:
                found[e] = apart**2 + nearness * away**2
        if not found:
            assert ends[j] == -1
            continue
        best = min(found.values())
        assert costs[j] == pytest.approx(best)
        assert found[int(ends[j])] == pytest.approx(best)


def test_affine_oracle():
    reference = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 2.0]])
    turn, shift = np.array([[1.1, -0.2], [0.3, 0.9]]), np.array([5.0, -1.0])
    point, left = carry(reference, reference @ turn.T + shift, [3.0, 1.0], ridge=0.0)
    assert point == pytest.approx([8.1, 0.8], abs=1e-12)
    assert np.abs(left).max() < 1e-12


@given(st.integers(0, 10_000), st.integers(1, 8))
@settings(max_examples=40, deadline=None)
def test_ridge_leads_from_least_squares_to_a_shift(seed, count):
    rng = np.random.default_rng(seed)
    reference, current = rng.normal(0, 20.0, (2, count, 2))
    point = rng.normal(0, 20.0, 2)
    shifted, _ = carry(reference, current, point, ridge=1e15)
    assert shifted == pytest.approx(point + current.mean(0) - reference.mean(0), abs=1e-6)
    if count > 2:
        fitted, _ = carry(reference, current, point, ridge=0.0)
        design = np.column_stack([reference, np.ones(count)])
        map_, *_ = np.linalg.lstsq(design, current, rcond=None)
        assert fitted == pytest.approx(np.append(point, 1.0) @ map_, rel=1e-5, abs=1e-5)
        # In between, the ridge is the one of the normal equations.
        before, now = reference - reference.mean(0), current - current.mean(0)
        wanted = (now.T @ before + 30 * np.eye(2)) @ np.linalg.inv(before.T @ before + 30 * np.eye(2))
        assert affine(reference, current, 30.0) == pytest.approx(wanted)


def test_two_predictors_give_a_similarity():
    angle = 0.4
    turn = 1.2 * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    reference = np.array([[0.0, 0.0], [9.0, 3.0]])
    assert similarity(reference, reference @ turn.T + 3.0, 0.0) == pytest.approx(turn)
    assert similarity(np.zeros((2, 2)), np.ones((2, 2)), 0.0) == pytest.approx(np.eye(2))
    with pytest.raises(ValueError, match="no predictor"):
        carry(np.zeros((0, 2)), np.zeros((0, 2)), [0.0, 0.0])


def test_ridge_helps_predictors_on_a_line():
    """Methods.md 2.1: sigma 1 px, 60 px cluster, lateral sd 1 px, turn 0.3 rad and stretch 1.1, M = 3."""
    rng = np.random.default_rng(3)
    turn = 1.1 * np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    errors = {0.0: [], 25.0: [], 1e12: []}
    for _ in range(400):
        places = np.column_stack([rng.uniform(-30, 30, 4), rng.normal(0, 1.0, 4)])
        before, now = (p + rng.normal(0, 1.0, p.shape) for p in (places, places @ turn.T))
        for ridge, found in errors.items():
            point, _ = carry(before[:3], now[:3], places[3], ridge=ridge)
            found.append(np.hypot(*(point - places[3] @ turn.T)))
    median = {ridge: np.median(found) for ridge, found in errors.items()}
    assert median[25.0] < 0.8 * median[0.0]
    assert median[25.0] < 0.5 * median[1e12]
    assert np.quantile(errors[25.0], 0.95) < 0.4 * np.quantile(errors[0.0], 0.95)


@given(st.lists(st.tuples(st.integers(1, 6), st.integers(1, 4)), min_size=1, max_size=60))
@settings(max_examples=40, deadline=None)
def test_trajectories_keep_what_a_dictionary_keeps(steps):
    known, plain, tick = Trajectories(most=4, longest=16), {}, 0
    for track, pause in steps:
        tick += pause
        point = np.array([tick * 2.0, track])
        known.append(track, tick, point)
        if track in plain:
            before = max(plain[track])
            gap = range(before + 1, tick + 1)
            way = {
                t: plain[track][before] + (t - before) / (tick - before) * (point - plain[track][before])
                for t in gap
            }
            plain[track] = plain.pop(track) | way
        else:
            if len(plain) == 4:
                del plain[next(iter(plain))]
            plain[track] = {tick: point}
        for other in plain:
            first, last = known.extent(other)
            assert last == max(plain[other])
            assert last - first < 16 + tick
            assert known.at(other, np.arange(first, last + 1)) == pytest.approx(
                np.array([plain[other][t] for t in range(first, last + 1)])
            )
    assert set(known.ids) == set(plain)
    points, counts = known.table
    for row, track in enumerate(known.ids):
        assert points[row, counts[row] - 1] == pytest.approx(known.at(track, [10_000])[0])
    with pytest.raises(ValueError, match="already"):
        known.append(track := known.ids[0], known.extent(track)[1], [0.0, 0.0])


def _bend(ticks, *, radius=120.0, speed=3.0):
    """A quarter turn to the right between two straights, px: entered at tick 60."""
    way = speed * np.asarray(ticks, float)
    into = way - 60 * speed
    angle = np.clip(into / radius, 0.0, np.pi / 2)
    x = np.minimum(way, 60 * speed) + radius * np.sin(angle)
    beyond = np.maximum(into - radius * np.pi / 2, 0.0)
    return np.stack([x, radius * (1 - np.cos(angle)) + beyond], -1)


def _traffic(rng, *, hidden_at, lags=(80, 110, 150), noise=0.3):
    """Vehicles through the bend, each so many frames before the hidden one, which is track 9."""
    known = Trajectories()
    for tick in range(-200, hidden_at + 1):
        for track, lag in enumerate(lags, 1):
            known.append(track, tick, _bend(tick + lag) + rng.normal(0, noise, 2))
        if tick >= 0:
            known.append(9, tick, _bend(tick) + rng.normal(0, noise, 2))
    return known


def test_context_follows_a_bend_that_others_cannot():
    known = _traffic(np.random.default_rng(0), hidden_at=55)
    models = {
        "context": ContextForecast(known, 9),
        "linear": LinearForecast(known, 9),
        "Kalman": KalmanForecast(known, 9),
    }
    errors = {name: [] for name in models}
    for tick in range(56, 116):
        for name, model in models.items():
            model.step(tick)
            errors[name].append(np.hypot(*(model.point - _bend(tick))))
    assert np.mean(errors["context"]) < 2.0
    assert min(np.mean(errors["linear"]), np.mean(errors["Kalman"])) > 20.0


def test_predictors_that_end_or_leave_are_dropped():
    rng = np.random.default_rng(1)
    known = _traffic(rng, hidden_at=40, lags=(100, 125, 150))
    # One track ends a second after the place where the hidden one vanishes; one turns off there.
    for tick in range(-60, 31):
        known.append(20, tick, _bend(tick + 40))
    for tick in range(-100, 60):
        known.append(30, tick, _bend(min(tick + 100, 45)) + max(tick + 55, 0) * np.array([0.0, -3.0]))
    forecast = ContextForecast(known, 9)
    assert {guide.track for guide in forecast.guides} == {1, 2, 3, 20, 30}
    for tick in range(41, 141):
        forecast.step(tick)
        held = {guide.track for guide in forecast.guides}
        if tick > 80:
            assert 20 not in held
        if tick == 90:
            assert held == {1, 2, 3}
    assert np.isfinite(forecast.point).all()


def test_what_stands_and_shakes_shows_nobody_the_way():
    rng = np.random.default_rng(3)
    known = Trajectories()
    for tick in range(120):
        # What has moved a little, and then stands.
        known.append(1, tick, rng.normal([100.0 + min(1.2 * tick, 40.0), 4.0], 0.3))
        known.append(9, tick, rng.normal([1.2 * (tick - 120) + 120.0, 0.0], 0.3))
    trusting = ContextForecast(known, 9, parameters=ContextParameters(journey=0.0))
    forecast = ContextForecast(known, 9)
    for tick in range(120, 180):
        trusting.step(tick)
        forecast.step(tick)
    truth = np.array([1.2 * 59 + 120.0, 0.0])
    assert np.hypot(*(forecast.point - truth)) < 6.0
    assert np.hypot(*(trusting.point - truth)) > 10.0


def test_the_last_points_of_a_predictor_tell_nothing_of_the_speed():
    known = Trajectories()
    for track, lag in ((1, 50), (2, 60), (3, 70)):
        for tick in range(-60, 60):
            # They vanish under something front first, so that their middles seem to stop.
            ahead = min(tick + lag, 100) + 0.3 * np.clip(tick + lag - 100, 0, 6)
            if tick + lag <= 106:
                known.append(track, tick, [3.0 * ahead, 13.0 * track])
    for tick in range(40):
        known.append(9, tick, [3.0 * tick, 0.0])
    forecast = ContextForecast(known, 9)
    assert len(forecast.guides) == 3
    forecast.step(160)
    assert forecast.guides == []
    assert abs(forecast.point[0] - 3.0 * 160) < 45.0


def test_a_place_straight_ahead():
    known = Trajectories()
    for tick in range(40):
        known.append(1, tick, [3.0 * tick, 2.0 * tick])
    assert leads_to(known, 1, np.array([300.0, 200.0]))
    assert not leads_to(known, 1, np.array([300.0, 300.0]))
    assert not leads_to(known, 1, np.array([0.0, 0.0]))


@pytest.mark.parametrize(
    ("going", "speed", "standing", "creeping", "until"),
    [
        (60, 1.5, 40, 0.05, 53),  # Ten px before the end: eight of them at its speed.
        (60, 1.5, 0, 0.0, 59),
        (60, 1.5, 40, 0.75, 99),  # It braked.
        (60, 0.05, 40, 0.05, 99),  # It always crept.
        (20, 1.5, 40, 0.05, 59),  # Too short to tell its speed.
    ],
)
def test_who_stands_at_the_end_of_its_path_had_gone_before(going, speed, standing, creeping, until):
    known = Trajectories()
    steps = np.append(np.full(going, speed), np.full(standing, creeping))
    for tick, way in enumerate(np.cumsum(steps)):
        known.append(1, tick, np.array([100.0 + way, 50.0]))
    assert went_until(known, 1, 20.0) == until
    known.cut(1, until)
    assert known.extent(1) == (0, until)
    np.testing.assert_allclose(known.at(1, [until])[0], [100.0 + steps[: until + 1].sum(), 50.0])
    known.append(1, until + 2, np.array([500.0, 50.0]))
    assert known.extent(1) == (0, until + 2)


def test_without_predictors_it_goes_straight_on():
    known = Trajectories()
    for tick in range(40):
        known.append(5, tick, [2.0 * tick, 1.0])
    forecast = ContextForecast(known, 5)
    spreads = []
    for tick in range(40, 100):
        forecast.step(tick)
        spreads.append(np.linalg.det(forecast.covariance))
    assert forecast.guides == []
    assert forecast.point == pytest.approx([198.0, 1.0], abs=1e-6)
    assert (np.diff(spreads) > 0).all()


def test_without_predictors_all_last_points_tell_where_it_goes():
    known, rng = Trajectories(), np.random.default_rng(4)
    for tick in range(40):
        known.append(5, tick, np.array([2.0 * tick, 1.0]) + rng.normal(0, 1.0, 2))
    forecast, straight = ContextForecast(known, 5), LinearForecast(known, 5)
    forecast.step(40)
    assert forecast.velocity == pytest.approx(straight.velocity, abs=1e-9)


@pytest.mark.parametrize("roads", [True, False])
def test_without_predictors_it_follows_the_road_that_oncoming_traffic_shows(roads):
    known = Trajectories()
    for tick in range(-200, 56):
        for track, lead in enumerate((0, 40), 1):
            known.append(track, tick, _bend(60 - tick - lead) + np.array([6.0, -6.0]))
        if tick >= 0:
            known.append(9, tick, _bend(tick))
    forecast = ContextForecast(known, 9, parameters=ContextParameters(roads=roads))
    forecast.step(115)
    assert forecast.guides == []
    off = np.hypot(*(forecast.point - _bend(115)))
    assert off < 15.0 if roads else off > 50.0


def test_one_that_brakes_by_itself_says_little_and_many_say_much():
    off = {}
    for count in (1, 6):
        known = Trajectories()
        for track in range(1, count + 1):
            for tick in range(-100, 41):
                # At the place where the hidden one vanishes they go on at less than their speed.
                ahead = tick + 45 + track
                known.append(track, tick, [3.0 * min(ahead, 39) + 2.5 * max(ahead - 39, 0), 4.0 * track])
        for tick in range(40):
            known.append(9, tick, [3.0 * tick, 0.0])
        forecast = ContextForecast(known, 9)
        forecast.step(69)
        off[count] = 3.0 * 69 - forecast.point[0]
        assert abs(forecast.point[1]) < 0.5
    assert off[1] < 1.0
    assert 8.0 < off[6] < 0.5 * 30 + 1.0


def test_printed_rules_need_three_predictors():
    few = _traffic(np.random.default_rng(2), hidden_at=55, lags=(80, 110))
    forecast = ContextForecast(few, 9, parameters=PRINTED)
    forecast.step(100)
    assert np.hypot(*(forecast.point - _bend(100))) > 10.0
    mended = ContextForecast(few, 9, parameters=ContextParameters())
    mended.step(100)
    assert np.hypot(*(mended.point - _bend(100))) < 4.0


def test_growth_is_wider_along_the_way():
    spread = Growth().covariance(np.array([0.6, 0.8]), 100.0, 30.0)
    along, across = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    assert along @ spread @ along > 5 * (across @ spread @ across)
    assert along @ spread @ across == pytest.approx(0.0, abs=1e-9)


@given(st.integers(0, 10_000), st.floats(0.2, 5.0), st.floats(0.2, 5.0))
@settings(max_examples=20, deadline=None)
def test_scale_restores_the_shares_of_each_axis(seed, along, across):
    squares = [along, across] * np.random.default_rng(seed).chisquare(1, (4000, 2))
    assert scale(squares) == pytest.approx([along, across], rel=0.15)
    assert quantile([0.5, 0.95]) == pytest.approx([1.3863, 5.9915], abs=1e-4)
    assert (scale([]) == 1.0).all()


def test_calibration_rehearses_on_what_is_seen():
    rng = np.random.default_rng(4)
    known, calibration = Trajectories(), Calibration(LinearForecast, every=5)
    way = np.array([0.6, 0.8])
    for tick in range(400):
        for track in (1, 2, 3):
            place = 3.0 * tick * way + 40.0 * track * np.array([0.8, -0.6])
            known.append(track, tick, place + rng.normal(0, 0.3, 2) + 4.0 * np.sin(0.02 * tick) * way)
        calibration.step(known, tick, [1, 2, 3] if tick > 40 else [])
    forecast = LinearForecast(known, 1)
    forecast.step(459)
    found, usual = calibration.covariance(forecast, 60), forecast.covariance
    across = np.array([-way[1], way[0]])
    # They brake and speed up a little, and keep to their lanes: the usual growth is too wide, most across.
    assert way @ found @ way < 0.8 * way @ usual @ way
    assert across @ found @ across == pytest.approx(0.1 * across @ usual @ across, rel=0.7)
    assert np.array_equal(found, calibration.covariance(forecast, 200))
    bounded = calibration.covariance(forecast, 60, [[1.0, 0.5], [2.0, 2.0]])
    assert way @ bounded @ way == pytest.approx(way @ usual @ way, rel=0.02)
    assert across @ bounded @ across == pytest.approx(0.5 * across @ usual @ across, rel=0.02)
