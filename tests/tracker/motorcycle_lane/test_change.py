"""Features, differences and upkeep of the background image against the same pixel by pixel."""

from __future__ import annotations

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tracker.motorcycle_lane.twin import sobel
from tracker.motorcycle_lane.change import carry, differences, histogram, keep
from tracker.motorcycle_lane.features import extract
from tracker.motorcycle_lane.tables import approach, fade

HEIGHT, WIDTH = 7, 9
SEEDS = st.integers(0, 10_000)


def pictures(seed):
    """Two pictures and a background image of three channels apart, and what random numbers follow."""
    rng = np.random.default_rng(seed)
    image, previous = rng.integers(0, 256, (2, HEIGHT, WIDTH, 3), dtype=np.uint8)
    return image, previous, rng.uniform(0, 255, (3, HEIGHT * WIDTH)).astype(np.float32), rng


@given(SEEDS)
@settings(max_examples=50, deadline=None)
def test_features_are_packed_as_they_say(seed):
    image, previous, _, _ = pictures(seed)
    found = extract(image, extract(previous)[0])
    edges = sobel(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)).reshape(-1, 2)
    for k, (now, then) in enumerate(zip(image.reshape(-1, 3), previous.reshape(-1, 3), strict=True)):
        (r, g, b), (u, v, w) = now.tolist(), then.tolist()
        x, y = edges[k].tolist()
        assert found[0][k] == r << 16 | g << 8 | b
        assert found[1][k] == x + 128 | (y + 128) << 8
        assert found[2][k] == u // 8 << 25 | v // 8 << 20 | w // 8 << 15 | r // 8 << 10 | g // 8 << 5 | b // 8


@given(SEEDS)
@settings(max_examples=50, deadline=None)
def test_differences_are_the_largest_of_a_channel(seed):
    image, previous, background, _ = pictures(seed)
    far, moved = differences(extract(image)[0], background, extract(previous)[0])
    wanted = np.abs(image.reshape(-1, 3) - background.T).max(1)
    assert np.array_equal(far, np.floor(wanted + np.float32(0.5)))
    assert np.array_equal(moved, np.abs(image.astype(int) - previous).max(2).ravel())
    assert np.array_equal(histogram(far), np.bincount(far, minlength=256))


@given(SEEDS)
@settings(max_examples=50, deadline=None)
def test_background_image_is_kept_and_carried(seed):
    image, _, background, rng = pictures(seed)
    seen, changed = rng.random((2, HEIGHT * WIDTH)) < 0.5
    wanted, before = background.T.copy(), background.T.astype(float)
    for k, colour in enumerate(image.reshape(-1, 3).astype(np.float32)):
        if seen[k]:
            wanted[k] += np.float32(1.0 if changed[k] else 0.1) * (colour - wanted[k])
    light = keep(background, extract(image)[0], seen, changed, 0.1)
    assert np.array_equal(background.T, wanted)
    assert np.allclose(light, wanted[seen].sum(0) / before[seen].sum(0), rtol=1e-6)
    carry(background, ~seen, light)
    wanted[~seen] = np.minimum(wanted[~seen] * light, np.float32(255.0))
    assert np.array_equal(background.T, wanted)


@given(SEEDS)
@settings(max_examples=50, deadline=None)
def test_background_pixels_fade_and_grow_likelier(seed):
    rng = np.random.default_rng(seed)
    factors, p_b = rng.uniform(0.01, 1.0, (2, 40)).astype(np.float32)
    seen, rate = rng.random(40) < 0.5, np.float32(0.005)
    faded = [f * (1 - rate) if s else f for f, s in zip(factors, seen, strict=True)]
    grown = [rate / f if s else 0.0 for f, s in zip(faded, seen, strict=True)]
    likely = [p + rate * (np.float32(s) - p) for p, s in zip(p_b, seen, strict=True)]
    assert np.array_equal(fade(factors, seen, rate), grown)
    assert np.array_equal(factors, faded)
    approach(p_b, seen, rate)
    assert np.array_equal(p_b, likely)
