"""The road darkened: a made-up shadow beside dark clothes, and the kernel against its plain twin."""

from __future__ import annotations

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.aerial.darkening import REACH, Shadows, darkness


def _remove(image, background, mask):
    around = np.ones((3, 3), np.uint8)
    bounds = [change(background, around) for change in (cv2.erode, cv2.dilate)]
    return Shadows().remove(image, background, mask, bounds)


def test_shadows_are_taken_out_and_dark_paint_is_not():
    rng = np.random.default_rng(1)
    background = np.clip(120 + rng.normal(0, 12, (80, 100, 1)) + [6, 0, -6], 0, 255).astype(np.uint8)
    picture = background.astype(float)
    picture[40:60, 50:80] *= np.array([0.55, 0.6, 0.66])
    picture[20:60, 35:50] = (40, 42, 45)
    image = np.clip(picture + rng.normal(0, 2, picture.shape), 0, 255).astype(np.uint8)
    mask = np.zeros((80, 100), bool)
    mask[40:60, 50:80] = mask[20:60, 35:50] = True
    before = image.copy(), background.copy(), mask.copy()
    left, own = _remove(image, background, mask)
    assert left[40:60, 52:80].mean() < 0.05
    assert left[20:60, 35:48].mean() > 0.9
    assert own[20:60, 35:48].mean() > 0.9
    assert not (own & ~left).any()
    assert not (left & ~mask).any()
    assert all(np.array_equal(a, b) for a, b in zip(before, (image, background, mask), strict=True))


def test_of_two_darknesses_the_one_to_one_side_is_the_shadows():
    # Paints as smooth as shadows, and more of them, but of many darknesses.
    rng = np.random.default_rng(2)
    background = np.full((240, 200, 3), 120, np.uint8)
    image, mask, shadow = background.copy(), np.zeros((240, 200), bool), np.zeros((240, 200), bool)
    paints = (0.4, 0.4, 0.4, 0.5, 0.85, 1.05, 1.3, 1.6)
    for k, (y, x) in enumerate((y, x) for y in range(10, 230, 28) for x in (10, 60, 110, 160)):
        image[y : y + 10, x : x + 24] = round(120 * paints[k % len(paints)])
        image[y + 10 : y + 17, x : x + 24] = 82
        mask[y : y + 17, x : x + 24] = shadow[y + 10 : y + 17, x : x + 24] = True
    image = np.clip(image + rng.normal(0, 1.5, image.shape), 0, 255).astype(np.uint8)
    left, own = _remove(image, background, mask)
    assert left[shadow].mean() < 0.1
    # Paint that is hardly brighter than the road may be a rim's; bright paint may not.
    pale, bright = (mask & ~shadow & (np.abs(image.mean(2) - 120 * share) < 6) for share in (1.05, 1.6))
    assert left[pale].mean() > 0.8
    assert own[pale].mean() < 0.15
    assert own[bright].mean() > 0.9
    dark = mask & ~shadow & (image.mean(2) < 66)
    assert left[dark].mean() > 0.9


def test_a_line_of_the_road_that_does_not_lie_quite_still_is_no_vehicle_in_a_shadow():
    background = np.full((60, 80, 3), 120, np.uint8)
    background[:, 40:42] = (210, 200, 90)
    moved = np.roll(background, 1, axis=1)
    image = np.round(moved * np.array([0.5, 0.6, 0.7])).astype(np.uint8)
    image[10:20, 20:60] = 220
    mask = np.zeros((60, 80), bool)
    mask[10:40, 20:60] = True
    left, _ = _remove(image, background, mask)
    assert not left[24:38, 24:56].any()


@given(seed=st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_darkness_is_its_plain_twin(seed):
    rng = np.random.default_rng(seed)
    background = rng.integers(90, 110, (9, 11, 3)).astype(np.uint8)
    image = (background * rng.uniform(0.4, 0.9)).astype(np.uint8)
    mask = rng.random((9, 11)) < 0.8
    found = darkness(image, background, mask)
    pixels = np.argwhere(mask)
    assert len(found) == len(pixels)
    for (y, x), measured in zip(pixels, found, strict=True):
        near = np.zeros_like(mask)
        near[max(y - REACH, 0) : y + REACH + 1, max(x - REACH, 0) : x + REACH + 1] = True
        near &= mask
        now, then = image[near].astype(float).sum(0), background[near].astype(float).sum(0)
        mean = (now.sum() + 1.0) / (then.sum() + 1.0)
        red, green, blue = now / (then + 1.0)
        ratios = (image[near].astype(float).sum(1) + 3) / (background[near].astype(float).sum(1) + 3)
        wanted = mean, (blue - red) / mean, (green - (red + blue) / 2) / mean, ratios.std() / mean
        assert np.allclose(measured, wanted, atol=1e-4)
