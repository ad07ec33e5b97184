"""Actions move the platform as they say, within bounds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.aerial.steering import SPEED, YAW_RATE, ZOOM_MOST, ZOOM_RATE, Steering

FAR = np.full(2, -1e4), np.full(2, 1e4)
HERE = Steering(place=np.array([3.0, -2.0]))
one = st.floats(-1.5, 1.5)


@given(one, one, one, one, st.floats(-4, 4))
def test_a_tick_moves_by_the_velocity_in_the_pictures_axes(right, ahead, yaw, zoom, heading):
    action = np.array([right, ahead, yaw, zoom], np.float32)
    later = HERE.after(action, heading, 0.1, FAR)
    right, ahead, yaw, zoom = (float(a) for a in np.clip(action, -1, 1))
    # Complex numbers: ahead is along the heading, the right is a quarter turn clockwise from it.
    moved = complex(*(later.place - HERE.place))
    assert moved == pytest.approx(0.1 * SPEED * np.exp(1j * heading) * (ahead - 1j * right), abs=1e-9)
    assert later.velocity * 0.1 == pytest.approx(later.place - HERE.place)
    assert later.turn == pytest.approx(-0.1 * YAW_RATE * yaw)
    assert later.zoom == pytest.approx(max(np.exp(0.1 * ZOOM_RATE * zoom), 1.0))


def test_zero_leaves_all_as_it_is():
    later = HERE.after(np.zeros(4, np.float32), 0.3, 0.1, FAR)
    assert (later.place == HERE.place).all()
    assert (later.velocity == 0).all()
    assert (later.turn, later.zoom) == (0.0, 1.0)


def test_it_stops_at_its_bounds():
    steering, bounds = HERE, (np.array([0.0, -5.0]), np.array([4.0, 5.0]))
    for _ in range(100):
        steering = steering.after(np.array([0, 1, 0, 1], np.float32), 0.0, 0.1, bounds)
    assert steering.place.tolist() == [4.0, -2.0]
    assert steering.velocity.tolist() == [0.0, 0.0]
    assert steering.zoom == ZOOM_MOST
