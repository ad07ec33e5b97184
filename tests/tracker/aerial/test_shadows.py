"""Shadows: where they fall is learnt from bright vehicles, and taken off all."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.aerial.background import Background
from tracker.aerial.shadows import EVERY, CastShadows

NONE = np.zeros((0, 4))


@given(st.integers(-5, 5), st.integers(-5, 5), st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_what_is_left_is_vehicle_all_along_the_offset(right, down, seed):
    mask = cv2.medianBlur((np.random.default_rng(seed).random((40, 50)) < 0.7).astype(np.uint8), 5) > 0
    shadows = CastShadows()
    shadows.offset = np.array([right, down], float)
    left = shadows.take_off(mask)
    steps = max(abs(right), abs(down))
    for i, j in np.ndindex(mask.shape):
        expected = True
        for share in np.linspace(0.0, 1.0, steps + 1):
            y, x = i + int(np.round(share * down)), j + int(np.round(share * right))
            expected &= not (0 <= y < 40 and 0 <= x < 50) or bool(mask[y, x])
        assert left[i, j] == expected


def test_a_rectangle_is_found_again_without_its_shadow():
    mask = np.zeros((60, 80), bool)
    for share in np.linspace(0, 1, 5):
        y, x = round(20 + 4 * share), round(30 + 3 * share)
        mask[y : y + 10, x : x + 20] = True
    shadows = CastShadows()
    shadows.offset = np.array([3.0, 4.0])
    left = shadows.take_off(mask)
    assert left[20:30, 30:50].all()
    assert left.sum() <= 10 * 20 + 12


def test_the_offset_is_learnt_from_bright_vehicles():
    ground = np.full((120, 160, 3), (110, 112, 114), np.uint8)
    background, shadows = Background(), CastShadows()
    for _ in range(12):
        background.apply(ground, np.eye(3), NONE)
    for k in range(20 * EVERY):
        seen = ground.copy()
        x = 10 + k % 100
        seen[44:54, x + 0 : x + 24] = (ground[0, 0] * 0.55).astype(np.uint8)
        seen[40:50, x : x + 24] = (235, 230, 228)
        mask = background.apply(seen, np.eye(3), NONE)
        shadows.learn(background, mask)
    assert shadows.offset == pytest.approx([0.0, 4.0], abs=1.3)
    assert shadows.offset[1] > 2.0
