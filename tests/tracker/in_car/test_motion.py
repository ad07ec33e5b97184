"""The camera's own motion and the evidence of a point's motion, on points made up from geometry."""

from __future__ import annotations

import numpy as np
import pytest

from tracker.in_car.evidence import motion_evidence
from tracker.in_car.yaw import FLOW_NOISE, HEIGHT, EgoMotion, _deposit, _epipolar

FOCAL, RATE = 800.0, 30.0
FOCUS = np.array([330.0, 228.0])


def static_points(rng, count):
    """Points on the ground and above it: X, Y (down), Z."""
    z = rng.uniform(6, 60, count)
    x = rng.uniform(-1, 1, count) * 0.35 * z
    y = np.where(rng.random(count) < 0.6, HEIGHT, rng.uniform(-4, 1, count))
    return np.stack([x, y, z], 1)


def project(points):
    return FOCAL * points[:, :2] / points[:, 2:] + FOCUS


def turn(yaw, pitch):
    """Rotation of camera coordinates for a camera that turns right and up."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    around_y = np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])
    cos, sin = np.cos(pitch), np.sin(pitch)
    around_x = np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]])
    return around_x @ around_y


@pytest.mark.parametrize("yaw_rate", [-0.15, 0.0, 0.08])
def test_rotation_is_found_and_removed(yaw_rate):
    rng = np.random.default_rng(1)
    ego = EgoMotion(focal=FOCAL, focus=(330.0, 228.0), sure=True, rate=RATE)
    for _ in range(60):
        before = static_points(rng, 150)
        pitch = rng.normal(0, 0.001)
        after = (before - np.array([0, 0, 20.0 / RATE])) @ turn(yaw_rate / RATE, pitch).T
        flow = project(after) - project(before) + rng.normal(0, 0.1, (150, 2))
        rotation = ego.rotate(project(after), flow, np.ones(150))
    assert abs(ego.yaw_rate - yaw_rate) < 0.012
    straight = project(before - np.array([0, 0, 20.0 / RATE])) - project(before)
    assert np.abs(np.median(flow - rotation - straight, axis=0)).max() < 0.35


def test_focus_and_ground_are_learnt():
    rng = np.random.default_rng(2)
    ego = EgoMotion(focal=FOCAL, focus=(320.0, 240.0), sure=True, rate=RATE)
    for _ in range(200):
        now = static_points(rng, 120)
        moved = project(now) - project(now + np.array([0, 0, 20.0 * 0.3])) + rng.normal(0, 0.3, (120, 2))
        ego.learn(project(now), moved, np.full(120, 0.3), np.ones(120))
    assert np.abs(ego.focus - FOCUS).max() < 5.0
    assert ego.speed == pytest.approx(20.0, rel=0.15)


@pytest.mark.parametrize(("others", "standing"), [(0, True), (30, True), (60, False)])
def test_the_ego_stands_where_next_to_nothing_moves(others, standing):
    rng = np.random.default_rng(4)
    ego = EgoMotion(focal=FOCAL, focus=tuple(FOCUS), sure=True, rate=RATE)
    before = ego.speed
    for _ in range(40):
        position = FOCUS + rng.choice([-1, 1], (120, 2)) * rng.uniform(50, 200, (120, 2))
        moved = rng.normal(0, 0.3, (120, 2))
        # The traffic that passes by says nothing of the ego.
        moved[:others, 0] = 8.0
        ego.learn(position, moved, np.full(120, 0.3), np.zeros(120))
    assert (ego.speed < 0.1 * before) == standing


def test_vehicles_and_scenery_are_told_apart():
    rng = np.random.default_rng(3)
    seconds, speed = 0.35, 20.0
    static = static_points(rng, 400)
    static = static[static[:, 1] > 0.3]
    vehicle = static.copy()
    vehicle[:, 1] = rng.uniform(0.4, HEIGHT, len(vehicle))
    for points, closing, sign in ((static, speed, -1), (vehicle, rng.normal(0, 1.5), 1)):
        moved = project(points) - project(points + np.array([0, 0, closing * seconds]))
        moved += rng.normal(0, 0.3, moved.shape)
        ratios = motion_evidence(
            project(points) - FOCUS,
            moved,
            np.full(len(points), seconds),
            ground=speed / (FOCAL * HEIGHT),
            focal=FOCAL,
            yaw_rate=0.0,
        )
        assert (sign * ratios > 0).mean() > 0.9


def test_standing_still_says_nothing_against_a_static_thing():
    points = np.array([[60.0, 30.0], [-120.0, 60.0]])
    ratios = motion_evidence(
        points, np.zeros((2, 2)), np.full(2, 0.35), ground=0.0, focal=FOCAL, yaw_rate=0.0
    )
    assert (np.abs(ratios) < 1.5).all()


def test_epipolar_equations_equal_an_explicit_design_matrix():
    rng = np.random.default_rng(4)
    position, moved = rng.uniform(0, 600, (30, 2)), rng.normal(0, 3, (30, 2))
    weight = rng.choice([0.0, 0.3, 1.0], 30)
    matrix, vector = _epipolar(position, moved, weight, FOCUS, FOCAL)

    def residual(a: float, b: float, fx: float, fy: float) -> np.ndarray:
        """How far the flow of a static point, less a rotation, leaves the line through the focus."""
        x, y = (position - moved / 2 - FOCUS).T
        turned_x = -a * (1 + (x / FOCAL) ** 2) + b * x * y / FOCAL**2
        turned_y = b * (1 + (y / FOCAL) ** 2) - a * x * y / FOCAL**2
        u, v = moved[:, 0] - turned_x, moved[:, 1] - turned_y
        return (u * (y - fy) - v * (x - fx)) / np.hypot(x, y)

    step = 1e-5
    design = np.stack([(residual(*(step * e)) - residual(*(-step * e))) / (2 * step) for e in np.eye(4)], 1)
    free = residual(0, 0, 0, 0)
    noise = 2 * FLOW_NOISE
    w = 0.08 * weight / noise**2 / (1 + (free / (2 * noise)) ** 2)
    assert np.allclose(matrix, design.T @ (w[:, None] * design), rtol=1e-5)
    assert np.allclose(vector, -design.T @ (w * free), rtol=1e-5)


def test_a_focus_off_the_middle_is_not_taken_for_a_turn():
    rng = np.random.default_rng(9)
    rate, speed = 30.0, 15.0
    true = FOCUS + np.array([15.0, -3.0])
    ego = EgoMotion(focal=FOCAL, focus=tuple(FOCUS), sure=True, rate=rate)
    seconds = 10 / rate
    for _ in range(600):
        points = np.stack([rng.uniform(-40, 40, 150), rng.uniform(-3, 1.25, 150), rng.uniform(8, 90, 150)], 1)
        now = true + FOCAL * points[:, :2] / points[:, 2:]
        seen = (np.abs(now - true) < [320, 240]).all(1)
        now, points = now[seen], points[seen]
        one, ten = (
            now - true - FOCAL * points[:, :2] / (points[:, 2:] + speed * time)
            for time in (1 / rate, seconds)
        )
        weight = np.ones(len(now))
        turned = ego.rotate(now, one + rng.normal(0, 0.1, one.shape), weight)
        # Ten frames of the estimated rotation are taken off.
        left = ten - 10 * turned + rng.normal(0, 0.1, ten.shape)
        ego.learn(now, left, np.full(len(now), seconds), weight)
    assert np.abs(ego.focus - true).max() < 3.0
    assert abs(ego.yaw_rate) < 0.003


def test_deposit_adds_gaussians():
    rng = np.random.default_rng(5)
    places, spreads, weights = rng.uniform(-2, 42, 20), rng.uniform(1, 4, 20), rng.uniform(0, 2, 20)
    pile = np.zeros(40)
    _deposit(pile, places, spreads, weights)
    bins = np.arange(40)[:, None]
    expected = np.exp(-0.5 * ((bins - places) / spreads) ** 2) @ (weights / spreads)
    assert np.abs(pile - expected).max() < 0.02 * weights.sum()
