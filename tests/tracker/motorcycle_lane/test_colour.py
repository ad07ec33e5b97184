"""Colours of riders against plain formulas."""

from __future__ import annotations

import colorsys
from fractions import Fraction

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.blobs import find_blobs
from tracker.motorcycle_lane import colour


def plain_bin(red, green, blue):
    # The standard library's conversion in fractions instead of floats: pixels do lie on limits.
    hue, saturation, value = colorsys.rgb_to_hsv(Fraction(red), Fraction(green), Fraction(blue))
    least = Fraction(15, 100)
    if value < 40 or saturation < least:
        return 24 + int(value) // 32
    sector = int(Fraction(hue).limit_denominator(10_000) * 8 + Fraction(1, 2)) % 8
    return sector * 3 + min(int((saturation - least) / (1 - least) * 3), 2)


@given(st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_histograms_count_the_pixels_of_each_half(seed):
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (12, 16, 3)).astype(np.uint8)
    found = find_blobs(rng.random((12, 16)) < 0.35, 3)
    counted = colour.histograms(
        colour.bin_pixels(image, found.labels), found.labels, np.arange(1, len(found) + 1), found.boxes
    )
    assert counted.shape == (len(found), 2, colour.BINS)
    for k, (_, y0, _, y1) in enumerate(found.boxes):
        wanted = np.zeros((2, colour.BINS))
        for y, x in np.argwhere(found.labels == k + 1):
            wanted[int(y + 0.5 >= (y0 + y1) / 2), plain_bin(*map(int, image[y, x]))] += 1
        for region in range(2):
            total = wanted[region].sum()
            expected = wanted[region] / total if total else np.full(colour.BINS, 1 / colour.BINS)
            assert np.abs(counted[k, region] - expected).sum() < 1e-9


@given(st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_distances_are_bhattacharyyas(seed):
    rng = np.random.default_rng(seed)
    candidates, references = (rng.dirichlet(np.full(colour.BINS, 0.3), (n, 2)) for n in (4, 3))
    found = colour.distances(candidates, references)
    for i in range(3):
        for j in range(4):
            d = [np.sqrt(1 - np.sqrt(references[i, r] * candidates[j, r]).sum()) for r in range(2)]
            assert np.isclose(found[i, j], d[0] ** 2 + d[1] ** 2)
    assert np.allclose(np.diag(colour.distances(references, references)), 0, atol=1e-12)
    ratios = colour.likelihood_ratios(candidates, references, references[:2], sharpness=3.0, limit=1e6)
    population = np.exp(-3.0 * colour.distances(candidates, references[:2])).mean(0)
    assert np.allclose(ratios, np.exp(-3.0 * found) / population)


def test_colours_tell_riders_apart():
    """Red above black, blue above black: the ratio favours one's own colours, and is 1 among equals."""
    labels = np.zeros((20, 30), np.int32)
    boxes = np.array([[2.0, 2, 10, 18], [14, 2, 22, 18]])
    image = np.full((20, 30, 3), 20, np.uint8)
    for k, (x0, y0, x1, y1) in enumerate(boxes.astype(int)):
        labels[y0:y1, x0:x1] = k + 1
        image[y0:10, x0:x1] = [(200, 30, 30), (30, 40, 190)][k]
    found = colour.histograms(colour.bin_pixels(image, labels), labels, np.arange(1, 3), boxes)
    ratios = colour.likelihood_ratios(found, found, found)
    assert (np.diag(ratios) > 1.5).all()
    assert np.isclose(ratios[0, 1], 0.1)
    assert np.isclose(ratios[1, 0], 0.1)
    assert np.allclose(colour.likelihood_ratios(found[:1], found[:1], found[:1]), 1.0)
