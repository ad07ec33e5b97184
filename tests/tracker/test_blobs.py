"""Regions of a mask against flood filling by hand."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.blobs import clean, find_blobs


def flood(mask, corners):
    """Regions as sets of pixels, in the order of their first pixel."""
    left = {(int(y), int(x)) for y, x in np.argwhere(mask)}
    regions = []
    for first in sorted(left):
        if first not in left:
            continue
        stack, region = [first], {first}
        left.discard(first)
        while stack:
            y, x = stack.pop()
            for dy in (-1, 0, 1):
                for dx in (-1, 0, 1):
                    near = (y + dy, x + dx)
                    if near in left and (corners or not dx or not dy):
                        left.discard(near)
                        region.add(near)
                        stack.append(near)
        regions.append(region)
    return regions


@given(st.integers(0, 10_000), st.integers(1, 6))
@settings(max_examples=40, deadline=None)
def test_blobs_are_the_connected_regions(seed, least):
    mask = np.random.default_rng(seed).random((9, 12)) < 0.4
    wanted = [region for region in flood(mask, corners=True) if len(region) >= least]
    found = find_blobs(mask, least)
    assert len(found) == len(wanted)
    pixels = [{(int(y), int(x)) for y, x in np.argwhere(found.labels == k + 1)} for k in range(len(found))]
    assert sorted(map(sorted, pixels)) == sorted(map(sorted, wanted))
    for k, region in enumerate(pixels):
        rows, columns = np.array(sorted(region)).T
        assert found.areas[k] == len(region)
        assert found.boxes[k].tolist() == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        assert np.allclose(found.centres[k], [columns.mean() + 0.5, rows.mean() + 0.5])


@given(st.integers(0, 10_000), st.integers(1, 12))
@settings(max_examples=40, deadline=None)
def test_clean_is_a_median_and_fills_what_is_enclosed(seed, largest):
    rng = np.random.default_rng(seed)
    mask = np.kron(rng.random((6, 8)) < 0.5, np.ones((2, 2))).astype(bool) ^ (rng.random((12, 16)) < 0.05)
    padded = np.pad(mask, 1, mode="edge")
    votes = sum(padded[dy : dy + 12, dx : dx + 16].astype(int) for dy in range(3) for dx in range(3))
    wanted = votes > 4
    for hole in flood(~wanted, corners=False):
        rows, columns = np.array(sorted(hole)).T
        enclosed = rows.min() > 0 and columns.min() > 0 and rows.max() < 11 and columns.max() < 15
        if enclosed and len(hole) <= largest:
            wanted[rows, columns] = True
    assert np.array_equal(clean(mask, window=3, largest_hole=largest), wanted)


def test_nothing_and_everything():
    for mask in (np.zeros((10, 10), bool), np.ones((10, 10), bool)):
        assert np.array_equal(clean(mask), mask)
    assert len(find_blobs(np.zeros((10, 10), bool))) == 0
    assert find_blobs(np.ones((10, 10), bool)).boxes.tolist() == [[0, 0, 10, 10]]
