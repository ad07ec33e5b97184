"""Segments, lamps, corners and profiles against plain twins."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.in_car import profile as prof
from tracker.in_car import segments as seg
from tracker.in_car.features import (
    _peaks,
    corner_response,
    find_corners,
    find_lamps,
    stiffness,
    working_picture,
)


def naive_segments(derivative, threshold, slope, shortest):
    """Chain edge maxima column by column with dictionaries."""
    height, width = derivative.shape
    chains: list[dict] = []
    ends: dict[tuple[int, int], int] = {}
    for column in range(width):
        for row in range(1, height - 1):
            value = int(derivative[row, column])
            sign = 1 if value > 0 else -1
            if abs(value) < threshold:
                continue
            if abs(value) < sign * int(derivative[row - 1, column]) or abs(value) <= sign * int(
                derivative[row + 1, column]
            ):
                continue
            found = None
            for back, offset in [(b, o) for b in (1, 2) for o in (0, -1, 1)]:
                label = ends.get((column - back, row + offset))
                if label is None or chains[label]["sign"] != sign or chains[label]["last"] == column:
                    continue
                if abs(row - chains[label]["rows"][0]) <= 1 + slope * (column - chains[label]["start"]):
                    found = label
                    break
            if found is None:
                found = len(chains)
                chains.append({"start": column, "sign": sign, "rows": [], "sizes": []})
            chain = chains[found]
            chain["last"] = column
            chain["rows"].append(row)
            chain["sizes"].append(abs(value))
            ends[column, row] = found
    return np.array(
        [
            [
                c["start"],
                c["last"] + 1,
                np.mean(c["rows"]) + 0.5,
                np.mean(c["sizes"]),
                c["sign"],
                c["rows"][-1] - c["rows"][0],
            ]
            for c in chains
            if c["last"] + 1 - c["start"] >= shortest
        ]
    ).reshape(-1, 6)


@given(st.integers(0, 10_000), st.integers(20, 60))
@settings(max_examples=25, deadline=None)
def test_segments_equal_the_naive_ones(seed, threshold):
    rng = np.random.default_rng(seed)
    # Rows that go on for a while, with noise: chains of all lengths, gaps and crossings.
    derivative = np.repeat(rng.integers(-80, 80, (24, 12)), 4, axis=1) + rng.integers(-15, 16, (24, 48))
    derivative = derivative.astype(np.int16)
    found = seg.find_segments(derivative, float(threshold), slope=0.2, shortest=4)
    assert np.allclose(found, naive_segments(derivative, threshold, 0.2, 4))


def test_a_bar_has_its_two_edges():
    grey = np.full((60, 100), 120, np.uint8)
    grey[30:40, 20:70] = 40
    found = seg.find_segments(
        seg.vertical_derivative(grey), seg.edge_threshold(seg.vertical_derivative(grey))
    )
    assert len(found) == 2
    upper, lower = found[np.argsort(found[:, seg.Y])]
    assert upper[seg.SIGN] == -1
    assert lower[seg.SIGN] == 1
    assert abs(upper[seg.X0] - 20) <= 1
    assert abs(upper[seg.X1] - 70) <= 1
    assert abs(upper[seg.Y] - 30) <= 1
    assert abs(lower[seg.Y] - 40) <= 1


def test_oblique_edges_are_no_segments():
    grey = np.where(np.add.outer(np.arange(80), np.arange(80)) > 80, 200, 50).astype(np.uint8)
    derivative = seg.vertical_derivative(grey)
    assert len(seg.find_segments(derivative, seg.edge_threshold(derivative))) == 0


def test_working_picture_leans_to_red():
    image = np.random.default_rng(0).integers(0, 256, (40, 60, 3), dtype=np.uint8)
    picture = working_picture(image)
    expected = 0.8 * cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) + 0.2 * image[..., 0]
    assert np.array_equal(picture.grey, np.rint(expected))
    assert np.array_equal(picture.red, np.maximum(image[..., 0].astype(int) - image[..., 1], 0))
    assert picture.brightness == pytest.approx(picture.grey.mean())


@given(st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_peaks_equal_the_naive_ones(seed):
    rng = np.random.default_rng(seed)
    smooth = rng.integers(0, 20, (20, 25)).astype(np.int16)
    surround = np.full_like(smooth, 10)
    expected = []
    for row in range(3, 17):
        for column in range(3, 22):
            patch = smooth[row - 3 : row + 4, column - 3 : column + 4].ravel()
            value = smooth[row, column]
            if value - 10 >= 4 and value == patch.max() and int(patch.argmax()) == 24:
                expected.append([column + 0.5, row + 0.5, value - 10])
    assert np.allclose(_peaks(smooth, surround, 4.0, 3, 400), np.array(expected).reshape(-1, 3))


def test_lamps_shine_at_night_only():
    image = np.full((80, 120, 3), 8, np.uint8)
    for x in (40, 80):
        image[38:42, x - 2 : x + 2] = (255, 60, 50)
    picture = working_picture(image)
    assert picture.night == 1.0
    found = find_lamps(picture.grey, picture.night)
    assert np.allclose(np.sort(found[:, 0]), [40, 80], atol=1)
    assert np.allclose(found[:, 1], 40, atol=1)
    assert len(find_lamps(picture.grey, 0.0)) == 0


@given(st.integers(0, 10_000), st.integers(3, 9))
@settings(max_examples=20, deadline=None)
def test_corners_are_the_best_of_their_free_cells(seed, cell):
    rng = np.random.default_rng(seed)
    response = rng.random((31, 44)).astype(np.float32)
    taken = (rng.random(response.shape) < 0.01).astype(np.uint8)
    expected = []
    for row in range(0, 31, cell):
        for column in range(0, 44, cell):
            part = response[row : row + cell, column : column + cell]
            if taken[row : row + cell, column : column + cell].any() or part.max() <= 0.9:
                continue
            i, j = np.unravel_index(part.argmax(), part.shape)
            expected.append([column + j, row + i])
    held = np.argwhere(taken)[:, ::-1]
    assert np.array_equal(find_corners(response, held, cell, 0.9, 1000), np.array(expected).reshape(-1, 2))


@given(st.integers(0, 10_000), st.integers(0, 10), st.integers(12, 24))
@settings(max_examples=20, deadline=None)
def test_corner_response_is_that_of_opencv(seed, first, last):
    grey = np.random.default_rng(seed).integers(0, 256, (24, 31), dtype=np.uint8)
    expected = cv2.cornerMinEigenVal(grey, 3, ksize=3)
    expected[:2] = expected[-2:] = expected[:, :2] = expected[:, -2:] = 0
    assert np.allclose(corner_response(grey, first, last), expected[first:last], rtol=1e-4, atol=1e-6)


def test_an_edge_is_stiff_across_and_slack_along():
    grey = np.full((40, 40), 50, np.uint8)
    grey[:, 20:] = 200
    place = np.array([[20.0, 20.0]])
    assert stiffness(grey, place, np.array([[0.0, 1.0]]))[0] < 1e-6
    grey[20:] = 50
    assert corner_response(grey, 0, 40).max() > 1e-4
    assert stiffness(grey, place, np.array([[0.0, 1.0]]))[0] > 0.3


@given(st.integers(0, 10_000), st.integers(0, 30))
@settings(max_examples=30, deadline=None)
def test_condensing_sums_the_spans(seed, count):
    rng = np.random.default_rng(seed)
    spans = np.sort(rng.integers(0, 51, (count, 2)), axis=1).astype(float)
    weights = rng.uniform(0, 5, count)
    expected = np.zeros(50)
    for (start, end), weight in zip(spans.astype(int), weights, strict=True):
        expected[start:end] += weight
    assert np.allclose(prof.condense(spans, weights, 50), expected, atol=1e-4)


@given(st.integers(0, 10_000), st.integers(0, 25))
@settings(max_examples=30, deadline=None)
def test_clusters_are_connected_components(seed, count):
    rng = np.random.default_rng(seed)
    x0, y = rng.uniform(0, 60, count), rng.uniform(0, 40, count)
    x1 = x0 + rng.uniform(8, 30, count)

    def alike(i, j):
        lengths = sorted((x1[i] - x0[i], x1[j] - x0[j]))
        return (
            lengths[0] >= 0.4 * lengths[1]
            and abs(y[i] - y[j]) <= 0.45 * lengths[1] + 2
            and abs(x0[i] + x1[i] - x0[j] - x1[j]) <= 0.4 * lengths[1]
        )

    labels = np.arange(count)
    for _ in range(count):
        for i in range(count):
            for j in range(count):
                if alike(i, j):
                    labels[i] = labels[j] = min(labels[i], labels[j])
    group, sums = prof._cluster(x0, x1, y)
    roots, expected = np.unique(labels, return_inverse=True)
    assert np.array_equal(group, expected)
    assert sums.shape == (len(roots), 5)
    length = x1 - x0
    for k in range(len(roots)):
        own = expected == k
        means = [np.average(of[own], weights=length[own]) for of in (0.5 * (x0 + x1), y, length)]
        assert np.allclose(sums[k], [length[own].sum(), *means, own.sum()])


@given(st.integers(0, 10_000), st.integers(0, 30), st.integers(0, 6))
@settings(max_examples=30, deadline=None)
def test_strongest_clusters_are_the_heaviest_at_each_maximum(seed, count, maxima):
    rng = np.random.default_rng(seed)
    middle, weight = rng.uniform(0, 100, count), rng.integers(1, 6, count).astype(float)
    peaks = np.sort(rng.choice(100, maxima, replace=False))
    chosen = np.zeros(count, bool)
    for peak in peaks:
        own = [k for k in range(count) if np.abs(peaks - middle[k]).argmin() == np.flatnonzero(peaks == peak)]
        for k in sorted(own, key=lambda k: -weight[k])[:2]:
            chosen[k] = abs(middle[k] - peak - 0.5) <= 8.0
    assert np.array_equal(prof._strongest(middle, weight, peaks, 8.0, 2), chosen)


@given(st.lists(st.integers(0, 6), min_size=1, max_size=60), st.integers(1, 5))
@settings(max_examples=40, deadline=None)
def test_maxima_are_highest_around(values, radius):
    profile = np.array(values, np.float32)
    expected = [
        i
        for i in range(len(values))
        if values[i] >= 2
        and values[i] == max(values[max(0, i - radius) : i + radius + 1])
        and values[i] not in values[max(0, i - radius) : i]
    ]
    assert prof.local_maxima(profile, 2.0, radius).tolist() == expected
