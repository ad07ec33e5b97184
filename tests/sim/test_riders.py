"""Riders: nobody touches anybody, and what is asked for happens."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.meshes.motorcycles import rider_models
from sim.params import RiderParams
from sim.riders import RiderTraffic
from sim.world import Bodies, Role

LANE, FAR, RATE = (-6.0, 0.0), 58.0, 30


def ride(params: RiderParams, seed: int, ticks: int, lane: tuple[float, float] = LANE) -> list[Bodies]:
    traffic = RiderTraffic(params, lane=lane, far=FAR, models=rider_models(), seed=seed, rate=RATE)
    states = []
    for _ in range(ticks):
        states.append(traffic.bodies())
        traffic.step()
    return states


def overlapping(bodies: Bodies) -> list[tuple[int, int]]:
    """Pairs whose footprints, turned as they are, meet: by separating axes, one pair after another."""
    found = []
    axes = np.stack([np.cos(bodies.yaws), np.sin(bodies.yaws)], axis=1)
    for a in range(len(bodies)):
        for b in range(a):
            offset = bodies.positions[a, :2] - bodies.positions[b, :2]
            apart = False
            for k in (a, b):
                for axis in (axes[k], np.array([-axes[k][1], axes[k][0]])):
                    reach = 0.0
                    for body in (a, b):
                        ahead = abs(axis @ axes[body])
                        aside = abs(axis @ np.array([-axes[body][1], axes[body][0]]))
                        reach += 0.5 * (bodies.sizes[body, 0] * ahead + bodies.sizes[body, 1] * aside)
                    apart |= abs(axis @ offset) > reach
            if not apart:
                found.append((a, b))
    return found


def test_the_check_sees_an_overlap():
    bodies = ride(RiderParams(riders=9), 0, 1)[0].take(np.array([0, 1]))
    bodies.positions[1] = bodies.positions[0] + [0.3, 0.2, 0.0]
    assert overlapping(bodies) == [(1, 0)]


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    riders=st.integers(2, 70),
    speed=st.floats(2.0, 12.0),
    width=st.floats(2.5, 8.0),
    wrong=st.integers(0, 2),
    parked=st.integers(0, 2),
)
def test_no_two_riders_ever_overlap(seed, riders, speed, width, wrong, parked):
    params = RiderParams(
        riders=riders, speed=speed, speed_spread=0.25 * speed, wrong_way=wrong, parked=parked
    )
    for state in ride(params, seed, 150, (-width, 0.0))[::5]:
        assert overlapping(state) == []


def test_same_seed_same_ride_and_another_seed_another():
    first, again, other = (ride(RiderParams(), seed, 60) for seed in (5, 5, 6))
    for a, b in zip(first, again, strict=True):
        assert a.positions.tobytes() == b.positions.tobytes()
        assert a.yaws.tobytes() == b.yaws.tobytes()
    assert not np.array_equal(first[-1].positions, other[-1].positions)


def test_riders_move_as_their_velocities_say_and_never_jump():
    states = ride(RiderParams(riders=30, speed=5.0), 3, 90)
    for before, after in itertools.pairwise(states):
        _, old, new = np.intersect1d(before.ids, after.ids, return_indices=True)
        moved = after.positions[new] - before.positions[old]
        assert np.allclose(moved * RATE, after.velocities[new], atol=1e-6)
        assert np.abs(moved[:, 1]).max() * RATE < 1.3


def test_they_overtake_and_ride_abreast():
    states = ride(RiderParams(riders=20, speed=6.0, speed_spread=2.0), 1, 300)
    abreast = overtaken = 0
    for before, after in zip(states[::10], states[10::10], strict=False):
        _, old, new = np.intersect1d(before.ids, after.ids, return_indices=True)
        s0, s1 = before.positions[old, 0], after.positions[new, 0]
        overtaken += int(((s0[:, None] < s0) & (s1[:, None] > s1)).sum())
        abreast += int((np.abs(s1[:, None] - s1) < 1.0).sum() - len(s1))
    assert overtaken >= 5
    assert abreast >= 20


@pytest.mark.parametrize("seed", range(4))
def test_a_rider_stops_in_view_and_leaves(seed):
    states = ride(RiderParams(riders=13, parked=1, stand=4.0), seed, 320)
    standing = [
        {int(i) for i, v, x in zip(b.ids, b.velocities, b.positions, strict=True) if not v.any() and x[0] > 8}
        for b in states
    ]
    still = [k for k, ids in enumerate(standing) if ids]
    stopped = standing[still[0]]
    assert still[0] < 60
    assert still[-1] - still[0] == 4 * RATE - 1
    gone = states[-1]
    assert not any(int(i) in stopped and x[0] < 30 for i, x in zip(gone.ids, gone.positions, strict=True))


@pytest.mark.parametrize("seed", range(4))
def test_one_comes_the_wrong_way_through_the_view(seed):
    states = ride(RiderParams(riders=13, speed=7.5, wrong_way=1), seed, 330)
    strays = [b.positions[b.roles == Role.WRONG_WAY, 0] for b in states]
    places = [float(x[0]) for x in strays if len(x)]
    assert places[0] > 40
    assert min(places) < 25
    assert all(b <= a + 1e-9 for a, b in itertools.pairwise(places))
    backward = [b.velocities[b.roles == Role.SAME_WAY, 0] for b in states]
    assert all((v >= 0).all() for v in backward)
