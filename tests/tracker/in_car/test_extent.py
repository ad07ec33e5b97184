"""Outlines of vehicles, against naive sums and on drawn vehicles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.in_car.extent import clear, make_relief, refine, roof_row
from tracker.in_car.proposals import windows_from_edges

HORIZON, MIDDLE, FOCAL = 60.0, 160.0, 400.0
CAR = np.array([140.0, 52.0, 200.0, 98.0])


def picture(*boxes: np.ndarray) -> np.ndarray:
    """Draw dark rears with a brighter window on a grey road."""
    grey = np.full((200, 320), 120, np.uint8)
    for box in boxes:
        x0, y0, x1, y1 = box.astype(int)
        grey[y0:y1, x0:x1] = 50
        grey[y0 + 4 : y0 + 14, x0 + 6 : x1 - 6] = 90
    return grey


def relief_of(grey: np.ndarray):
    return make_relief(grey, horizon=HORIZON, middle=MIDDLE, focal=FOCAL)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(6, 20), st.integers(6, 20))
def test_integral_images_equal_naive_sums(seed: int, height: int, width: int):
    grey = np.random.default_rng(seed).integers(0, 256, (height, width), dtype=np.uint8)
    relief = make_relief(grey, horizon=2.0, middle=3.0, focal=50.0)
    wide = grey.astype(float)
    across, signed = np.zeros(grey.shape), np.zeros(grey.shape)
    for j in range(2, width - 1):
        across[:, j] = np.abs(wide[:, j] + wide[:, j + 1] - wide[:, j - 1] - wide[:, j - 2]) / 2
    for i in range(2, height - 1):
        signed[i] = (wide[i] + wide[i + 1] - wide[i - 1] - wide[i - 2]) / 2
    for sums, values in ((relief.across, across), (relief.signed, signed), (relief.down, np.abs(signed))):
        assert np.array_equal(sums[1:, 1:], 2 * values.cumsum(0).cumsum(1))
        assert not sums[0].any()
        assert not sums[:, 0].any()


def test_true_outline_is_clearer_than_shifted_ones():
    relief = relief_of(picture(CAR))
    best = clear(relief, CAR)
    for shift in ((20, 0, 20, 0), (-15, 0, -15, 0), (0, 12, 0, 12), (0, -12, 0, -12), (-20, 0, 20, 0)):
        assert clear(relief, CAR + np.array(shift, float)) < 0.6 * best


def test_no_outline_over_two_vehicles_and_the_road_between():
    left, right = np.array([110.0, 52, 150, 90]), np.array([180.0, 52, 220, 90])
    relief = relief_of(picture(left, right))
    both = np.array([110.0, 52, 220, 90])
    between = np.array([150.0, 52, 180, 90])
    assert clear(relief, left) > 2 * max(clear(relief, both), clear(relief, between))


@pytest.mark.parametrize("off", [(3, 3, 3, 3), (-3, 0, 2, -3), (2, -3, -2, 2)])
def test_refining_returns_to_the_vehicle(off: tuple[int, int, int, int]):
    box = CAR + np.array(off, float)
    found = refine(
        relief_of(picture(CAR)),
        box,
        loose=0.08,
        body=CAR + np.array([8.0, 8, -8, -8]),
        log_width=float(np.log(60 / 38)),
    )
    assert np.abs(found - CAR).max() <= 1.0


def test_windows_and_roof_of_a_drawn_vehicle():
    relief = relief_of(picture(CAR))
    likely = np.array([[150.0, 70], [180, 80], [170, 75]])
    windows, shown = windows_from_edges(relief, likely, 100.0, 8.0)
    best = windows[0]
    assert best[[0, 2, 3]] == pytest.approx(CAR[[0, 2, 3]], abs=1.5)
    assert (np.diff(shown) <= 0).all()
    assert roof_row(relief, best[0], best[2], best[3], 60.0) == pytest.approx(CAR[1], abs=1.0)
