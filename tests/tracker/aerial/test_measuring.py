"""Outlines of vehicles: the compiled loops against plain ones, and rectangles that are known."""

from __future__ import annotations

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tracker.aerial import twin
from tracker.aerial import measuring
from tracker.aerial.measuring import corners, free_outlines, outline

HEIGHT, WIDTH = 26, 34


def scene(seed: int):
    """Return labels, which of them are single, and tracks: who is senior, centres, headings, half sides."""
    rng = np.random.default_rng(seed)
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    for _ in range(rng.integers(0, 7)):
        y, x = rng.integers(0, [HEIGHT - 3, WIDTH - 3])
        mask[y : y + rng.integers(1, 9), x : x + rng.integers(1, 13)] = 1
    count, labels = cv2.connectedComponents(mask)
    tracks = int(rng.integers(0, 5))
    angles = rng.uniform(-np.pi, np.pi, tracks)
    return (
        labels.astype(np.int32),
        np.append(False, rng.random(count - 1) < 0.5),
        rng.random(tracks) < 0.5,
        rng.uniform(-3, [WIDTH + 3, HEIGHT + 3], (tracks, 2)),
        np.column_stack([np.cos(angles), np.sin(angles)]),
        rng.uniform(2, 8, (tracks, 2)),
    )


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 10**6))
def test_claims_are_those_of_the_plain_rule(seed):
    given_scene = scene(seed)
    sums, beaten, left = measuring._claim(*given_scene)
    pixels, plain_beaten, plain_left = twin.claim(*given_scene)
    assert (left == plain_left).all()
    assert (beaten == plain_beaten).all()
    for n, heading in enumerate(given_scene[4]):
        assert np.allclose(sums[n], twin.moments(pixels.get(n, []), heading))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6))
def test_axes_are_the_first_eigenvectors(seed):
    labels, single, *_ = scene(seed)
    axes = measuring._axes(labels, single.size - 1)
    for label, axis in enumerate(axes, 1):
        points = np.argwhere(labels == label)[:, ::-1] + 0.5
        values, vectors = np.linalg.eigh(np.cov(points.T, bias=True) if len(points) > 1 else np.eye(2))
        if values[1] - values[0] > 1e-6:
            assert abs(abs(axis @ vectors[:, 1]) - 1.0) < 1e-6


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6))
def test_sums_are_those_of_the_pixels(seed):
    labels, single, *_ = scene(seed)
    count = single.size - 1
    headings = measuring._axes(labels, count)
    sums = measuring._sums(labels, headings)
    for label in range(1, count + 1):
        points = np.argwhere(labels == label)[:, ::-1] + 0.5
        assert np.allclose(sums[label - 1], twin.moments(points, headings[label - 1]))


def test_a_rectangle_is_measured_as_it_was_drawn():
    centre, size, angle = np.array([60.0, 50.0]), np.array([40.0, 16.0]), 0.5
    heading = np.array([np.cos(angle), np.sin(angle)])
    y, x = np.mgrid[:100, :120] + 0.5
    along = (x - centre[0]) * heading[0] + (y - centre[1]) * heading[1]
    across = (y - centre[1]) * heading[0] - (x - centre[0]) * heading[1]
    labels = ((np.abs(along) < size[0] / 2) & (np.abs(across) < size[1] / 2)).astype(np.int32)
    free = free_outlines(labels, 1)
    one, yes = np.array([[0.0, 0.0]]), np.array([True])
    known, _, left = outline(
        labels, np.array([False, True]), yes, centre[None] + 2.0, heading[None] + one, size[None]
    )
    for found in (free, known):
        assert np.allclose(found.centres[0], centre, atol=0.15)
        assert np.allclose(found.sizes[0], size, atol=0.5)
        assert abs(abs(found.headings[0] @ heading) - 1) < 1e-3
    assert not left.any()


def test_two_vehicles_that_touch_share_their_region():
    labels = np.zeros((30, 70), np.int32)
    labels[10:20, 5:65] = 1
    centres, size = np.array([[20.0, 15.0], [50.0, 15.0]]), np.array([30.0, 10.0])
    found, beaten, left = outline(
        labels,
        np.zeros(2, bool),
        np.ones(2, bool),
        centres,
        np.tile([1.0, 0.0], (2, 1)),
        np.tile(size, (2, 1)),
    )
    assert np.allclose(found.centres, centres)
    assert np.allclose(found.sizes, size, atol=0.1)
    assert not beaten.any()
    assert not left.any()


def test_in_a_region_that_is_one_vehicles_the_senior_track_stays():
    labels = np.zeros((30, 40), np.int32)
    labels[10:20, 5:25] = 1
    centres = np.array([[15.0, 15.0], [18.0, 15.0]])
    _, beaten, _ = outline(
        labels,
        np.array([False, True]),
        np.array([False, True]),
        centres,
        np.tile([1.0, 0.0], (2, 1)),
        np.tile([20.0, 10.0], (2, 1)),
    )
    assert beaten.tolist() == [True, False]


def test_corners_begin_at_the_front_left():
    # To the right in a picture left is up.
    found = corners(np.array([[10.0, 10.0]]), np.array([[1.0, 0.0]]), np.array([[8.0, 4.0]]))[0]
    assert found.tolist() == [[14, 8], [14, 12], [6, 12], [6, 8]]
