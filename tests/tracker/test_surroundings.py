"""What is around a pixel: sums of windows, and which pixels are looked at."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tracker import surroundings

SHAPE = 14, 17


@given(arrays(np.int32, (2, 5, 6), elements=st.integers(0, 2**31 - 1)))
def test_integrals_give_the_sums_of_windows_though_they_overflow(maps):
    small = maps % 1000 + np.where(np.arange(6) < 2, 2**30, 0).astype(np.int32)
    sums = surroundings.integrals(small)
    for top, left in np.ndindex(4, 4):
        corners = (
            sums[:, top + 2, left + 2],
            sums[:, top, left + 2],
            sums[:, top + 2, left],
            sums[:, top, left],
        )
        window = small[:, top : top + 2, left : left + 2].astype(np.int64).sum((1, 2))
        total = corners[0] - corners[1] - corners[2] + corners[3]
        assert (total == window.astype(np.int32)).all()


@settings(max_examples=50, deadline=None)
@given(arrays(np.bool_, SHAPE), st.sampled_from([0.2, 0.36]))
def test_candidates_have_enough_foreground_around(raw, dense):
    wide = np.pad(raw, surroundings.NEAR // 2)
    for y, x in np.ndindex(*SHAPE):
        count = wide[y : y + surroundings.NEAR, x : x + surroundings.NEAR].sum()
        assert surroundings.candidates(raw, dense)[y, x] == (count >= round(dense * surroundings.NEAR**2))


@settings(deadline=None)
@given(arrays(np.int32, SHAPE, elements=st.integers(-1, 5)), arrays(np.bool_, 6))
def test_pixels_are_those_of_chosen_squares_and_of_no_others(numbers, chosen):
    squares = surroundings.Blocks(np.zeros(6, np.int64), np.zeros(6, np.int64), numbers)
    wanted = [[number >= 0 and chosen[number] for number in row] for row in numbers.tolist()]
    assert np.array_equal(squares.pixels(chosen), wanted)
