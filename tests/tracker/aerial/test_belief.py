"""How far ahead of its forecast a hidden vehicle is believed to be."""

from __future__ import annotations

import numpy as np
import pytest

from tracker.aerial.belief import (
    FLOOR,
    LASTING,
    LEFT,
    OFFSETS,
    PRIOR,
    STRANGE,
    Belief,
    deviations,
    speed_log_ratio,
)
from tracker.filtering import planar

HEADING = np.array([0.6, -0.8])
BESIDE = np.array([0.8, 0.6])
CENTRE = np.array([120.0, 80.0])
COVARIANCE = 144.0 * np.outer(HEADING, HEADING) + 9.0 * np.outer(BESIDE, BESIDE)


def test_deviations_are_those_of_the_ellipse():
    assert deviations(HEADING, COVARIANCE) == pytest.approx((12.0, 3.0))


def test_the_density_is_one():
    belief = Belief()
    belief.miss((OFFSETS > 0.5).astype(float))
    along, across = np.meshgrid(np.arange(-70, 70, 0.5), np.arange(-40, 40, 0.5))
    points = CENTRE + along.reshape(-1, 1) * HEADING + across.reshape(-1, 1) * BESIDE
    density = np.exp(belief.log_density(points, CENTRE, HEADING, COVARIANCE))
    assert density.sum() * 0.25 == pytest.approx(1.0, abs=0.01)


def test_a_change_of_lanes_is_less_likely_but_not_impossible():
    lanes = CENTRE + np.array([[0.0], [3.0], [18.0]]) * BESIDE
    own, near, other = Belief().log_density(lanes, CENTRE, HEADING, COVARIANCE)
    assert own - near == pytest.approx(2.5 * np.log(1.25))
    assert own - other == pytest.approx(2.5 * np.log(10.0))


def test_a_vehicle_is_not_where_it_would_have_been_seen():
    belief = Belief()
    assert belief.unseen == pytest.approx(1.0)
    assert belief.mean == pytest.approx(0.0, abs=1e-9)
    for _ in range(12):
        belief.miss((OFFSETS > -0.5).astype(float))
    assert belief.mean < -0.9
    ahead, behind = belief.log_density(
        np.array([CENTRE + 12 * HEADING, CENTRE - 15 * HEADING]), CENTRE, HEADING, COVARIANCE
    )
    assert behind > ahead + 4
    for _ in range(60):
        belief.miss(np.ones(len(OFFSETS)))
    assert belief.unseen == pytest.approx(FLOOR)
    assert belief.weights == pytest.approx(FLOOR * PRIOR)


def test_the_first_in_is_the_first_out():
    """Both forecasts have run out from under a bridge: the first is held back more."""
    exit_at = 100.0
    first, second = 140.0, 105.0
    beliefs = []
    for centre in (first, second):
        belief = Belief()
        for _ in range(12):
            belief.miss((centre + 20.0 * OFFSETS > exit_at).astype(float))
        beliefs.append(belief)
    covariance = np.diag([400.0, 9.0])
    means = [c + 20.0 * b.mean for c, b in zip((first, second), beliefs, strict=True)]
    assert means[1] < means[0] < exit_at
    seen = np.array([[102.0, 0.0]])
    right, wrong = (
        b.log_density(seen, np.array([c, 0.0]), np.array([1.0, 0.0]), covariance)[0]
        for c, b in zip((first, second), beliefs, strict=True)
    )
    assert right > wrong


def test_who_is_behind_goes_slower():
    """Sixty frames late, 30 px behind: half a px a frame too slow on the whole, and a bit more now."""
    speeds = np.linspace(-12.0, 12.0, 4801)
    ratios = speed_log_ratio(speeds, np.full(4801, -30.0), 20.0, 60.0)
    assert speeds[ratios.argmax()] == pytest.approx(-0.5 * LASTING, abs=0.005)
    assert (np.exp(ratios) * STRANGE).sum() * 0.005 == pytest.approx(1.0, abs=0.01)
    as_forecast, slower, much_faster = speed_log_ratio(
        np.array([0.0, -0.6, 2.0]), np.array([-30.0, -30.0, -30.0]), 20.0, 60.0
    )
    assert slower > as_forecast + 0.5
    assert slower > 0 > much_faster


def test_what_a_speed_leaves_unknown_is_that_of_white_acceleration():
    spread = planar.predict(np.zeros((1, 4)), np.zeros((1, 4, 4)), 60.0, 0.01)[1][0, :2, :2]
    left = spread[1, 1] - spread[0, 1] ** 2 / spread[0, 0]
    assert left == pytest.approx(LEFT * spread[0, 0] / 60.0**2)
    assert 1.0 <= LASTING <= spread[0, 1] / spread[0, 0] * 60.0 == pytest.approx(1.5)
