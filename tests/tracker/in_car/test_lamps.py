"""Points on tail lamps, against means taken pixel by pixel."""

from __future__ import annotations

import numpy as np

from tests.tracker.in_car.reliefs import relief_of
from tracker.in_car.lamps import AROUND, LAMP_REACH, LAMP_RED, on_lamp


def test_points_on_lamps_are_redder_than_what_is_around():
    rng = np.random.default_rng(3)
    red = rng.integers(0, 30, (60, 80)).astype(np.uint8)
    red[30:36, 20:26] = 140
    relief = relief_of(np.zeros_like(red), red=red)
    position = rng.uniform((0, 0), (80, 60), (200, 2))
    position[0] = 23.0, 33.0
    expected = []
    for column, row in position.astype(int):
        near, wide = (
            red[max(row - k, 0) : row + k + 1, max(column - k, 0) : column + k + 1].mean()
            for k in (LAMP_REACH, AROUND)
        )
        expected.append(near - wide > LAMP_RED)
    found = on_lamp(relief, position)
    np.testing.assert_array_equal(found, expected)
    assert found[0]
    assert found.mean() < 0.1
