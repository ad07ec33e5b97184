"""The integral images of edges and brightness, against sums pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tracker.in_car.reliefs import layers, pictures, plain_mean, redness, relief_of
from tracker.in_car.relief import ACROSS, BRIGHT, SIGNED, mean


@settings(max_examples=60, deadline=None)
@given(pictures())
def test_sums_are_those_of_the_pixels(grey):
    height, width = grey.shape
    red = redness(grey)
    sums, found = relief_of(grey, red=red).sums, layers(grey, red)
    assert sums.shape == (5, height + 1, width + 1)
    for layer in range(5):
        for i in range(height + 1):
            for j in range(width + 1):
                assert sums[layer, i, j] == found[layer][:i, :j].sum()


@settings(max_examples=100, deadline=None)
@given(pictures(), st.integers(0, 4), st.tuples(*[st.integers(-6, 30)] * 4))
def test_mean_is_that_of_the_pixels_inside(grey, layer, box):
    x0, y0, x1, y1 = box
    red = redness(grey)
    expected = plain_mean(layers(grey, red), layer, x0, y0, x1, y1) if x1 > x0 and y1 > y0 else 0.0
    assert mean(relief_of(grey, red=red).sums, layer, x0, y0, x1, y1) == pytest.approx(expected, abs=1e-12)


def test_an_edge_of_ten_levels_counts_twenty_half_levels_over_two_columns():
    grey = np.full((8, 12), 50, np.uint8)
    grey[:, 6:] = 60
    sums = relief_of(grey).sums
    assert mean(sums, ACROSS, 6, 0, 7, 8) == 10.0
    assert mean(sums, ACROSS, 5, 0, 6, 8) == mean(sums, ACROSS, 7, 0, 8, 8) == 5.0
    assert mean(sums, BRIGHT, 0, 0, 12, 8) == 55.0
    down = np.ascontiguousarray(grey.T)
    assert mean(relief_of(down).sums, SIGNED, 0, 6, 8, 7) == 10.0
    assert mean(relief_of(255 - down).sums, SIGNED, 0, 6, 8, 7) == -10.0
