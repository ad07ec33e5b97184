"""Sizes, silhouettes and cores: each against a plain twin, or made-up regions of known truth."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios import bridge, spec
from scenarios.loop import make_scene
from sim.simulation import Simulation
from tests.tracker.motorcycle_lane.test_foreground import rider
from tracker.blobs import find_blobs
from tracker.boosting import learnt, log_odds
from tracker.motorcycle_lane import colour, foreground, measuring, silhouettes
from tracker.motorcycle_lane.sizes import ENOUGH, GUESSES, SURE, Samples, SizeModel, guessed, robust_lines
from tracker.motorcycle_lane.tracker import MotorcycleLaneTracker
from tracker.types import Frame


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_sizes_are_those_of_the_single_ones(seed):
    """A third of the regions are two abreast, a tenth are parts, some are anything."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.1, 0.9, 300)
    truth = np.array([[6.0, 12.0], [20.0, 45.0]])
    sizes = (truth[0] + truth[1] * places[:, None]) * rng.normal(1.0, 0.06, (300, 2))
    kind = rng.random(300)
    sizes[kind < 0.33, 0] *= rng.uniform(1.5, 2.2, (kind < 0.33).sum())
    sizes[kind > 0.9] *= 0.5
    sizes[(kind > 0.85) & (kind < 0.9)] *= rng.uniform(1.0, 4.0, ((kind > 0.85) & (kind < 0.9)).sum())[
        :, None
    ]
    lines = robust_lines(places, sizes, 240.0)
    for place in (0.1, 0.5, 0.9):
        wanted = truth[0] + truth[1] * place
        assert np.abs((lines[0] + lines[1] * place) / wanted - 1.0).max() < 0.12


def test_heights_tell_how_wide_riders_are_where_they_ride_abreast():
    """Far away most regions are of two who touch, nearby none is."""
    rng = np.random.default_rng(1)
    places = rng.uniform(0.0, 0.9, 400)
    truth = np.array([[6.0, 12.0], [30.0, 60.0]])
    sizes = (truth[0] + truth[1] * places[:, None]) * rng.normal(1.0, 0.06, (400, 2))
    sizes[(places < 0.4) & (rng.random(400) < 0.9), 0] *= 1.4
    freely, tied = (
        robust_lines(places, sizes, 240.0, one_horizon=tie)[0] / truth[0] for tie in (False, True)
    )
    assert freely[0] > 1.3
    assert np.abs(tied - 1.0).max() < 0.1
    model = SizeModel(240)
    model.learn(Samples(240.0 * places, sizes), travelled=True)
    assert np.abs(model.sizes(np.zeros(1))[0] / truth[0] - 1.0).max() < 0.1


def test_where_cars_go_sizes_are_theirs_and_not_those_of_the_one_cyclist():
    rng = np.random.default_rng(5)
    places = rng.uniform(0.1, 0.9, 480)
    cars = np.arange(480) < 415
    heights = np.where(cars, 60.0, 80.0) * (places + 0.17) * np.exp(rng.normal(0.0, 0.1, 480))
    widths = heights * np.where(cars, 1.15, 0.42) * np.exp(rng.normal(0.0, 0.1, 480))
    lines = robust_lines(places, np.stack([widths, heights], 1), 240.0)
    np.testing.assert_allclose(lines[0] + 0.5 * lines[1], [0.67 * 69.0, 0.67 * 60.0], rtol=0.1)


def test_sizes_are_known_only_about_rows_that_were_seen():
    model = SizeModel(240)
    assert not model.known(np.array([100.0])).any()
    rows = np.linspace(60, 120, ENOUGH)
    model.learn(Samples(rows, np.stack([0.2 * rows, 0.4 * rows], 1)), travelled=False)
    assert model.known(np.array([-60.0, 20.0, 90.0, 200.0, 230.0])).tolist() == [
        False,
        True,
        True,
        True,
        False,
    ]
    assert np.allclose(model.sizes(np.array([90.0])), [[18.0, 36.0]], rtol=0.02)


def test_what_travelled_outvotes_what_was_guessed():
    """Guesses that are too large, eight times as many as what travelled, do not hold the sizes for ever."""
    rng = np.random.default_rng(0)
    model = SizeModel(240)
    for frame in range(320):
        rows = rng.uniform(40.0, 200.0, 9)
        sizes = np.stack([0.2 * rows, 0.4 * rows], 1) * rng.normal(1.0, 0.05, (9, 2))
        model.learn(Samples(rows[1:], 2.5 * sizes[1:]), travelled=False)
        if frame >= 40:
            model.learn(Samples(rows[:1], sizes[:1]), travelled=True)
        if frame == 40:
            assert not model.settled
            assert np.allclose(model.sizes(np.array([120.0])), [[60.0, 120.0]], rtol=0.1)
    assert model.settled
    assert np.allclose(model.sizes(np.array([120.0])), [[24.0, 48.0]], rtol=0.1)


def test_pixels_that_surely_are_a_vehicles_are_asked_for_sizes():
    image, road, body, shadow = rider(np.random.default_rng(1), side=1)
    heights = np.linspace(30.0, 50.0, 120)
    trees, *size_trees = (
        learnt("tracker.motorcycle_lane", name) for name in ("foreground", "widths", "heights")
    )
    seen = foreground.weigh(image.astype(np.uint8), road.astype(np.uint8), body | shadow, heights, trees)
    labels = body.astype(np.int32)
    told = guessed(seen, labels, heights, size_trees)
    squares = seen.squares
    sure = np.flatnonzero((seen.odds > SURE) & body[squares.rows, squares.columns])
    assert GUESSES // 2 < len(told.rows) <= GUESSES < len(sure) < (seen.odds > SURE).sum()
    asked = sure[:: int(np.ceil(len(sure) / GUESSES))]
    assert told.rows.tolist() == squares.rows[asked].tolist()
    for square, size in zip(asked, told.sizes, strict=True):
        logs = [log_odds(seen.cues[square : square + 1], weighed_by)[0] for weighed_by in size_trees]
        np.testing.assert_allclose(size, heights[squares.rows[square]] * np.exp(logs))


@pytest.mark.parametrize("travelled", [False, True])
def test_what_was_seen_long_ago_is_forgotten(travelled):
    model = SizeModel(240)
    rows = np.linspace(40.0, 200.0, 3000)
    for times in (1.0, 2.0):
        model.learn(Samples(rows, times * np.stack([0.2 * rows, 0.4 * rows], 1)), travelled=travelled)
        there = model.sizes(np.array([120.0]))
        np.testing.assert_allclose(there, [[24.0 * times, 48.0 * times]], rtol=0.1)


@pytest.mark.parametrize("wrong", [0.7, 1.4])
def test_a_lane_tells_how_large_riders_are_whatever_was_expected(wrong):
    scenario = spec.load("lane-day", ["seconds=4.0"])
    scene = make_scene(scenario, 31)
    tracker = MotorcycleLaneTracker()
    tracker.start(bridge.tracker_info(scene.camera, scenario.rate))
    sizes = tracker._measurer.sizes
    sizes._lines *= wrong
    boxes = []
    with Simulation(scene, scenario.params.sensor, seed=31) as simulation:
        for seen in simulation.run(scenario.frames):
            tracker.step(Frame(image=seen.image, tick=seen.tick, time=seen.time))
            boxes.append(seen.truth.box_amodal[seen.truth.visible > 0.9])
    boxes = np.concatenate(boxes)
    rows, true = 0.5 * (boxes[:, 1] + boxes[:, 3]), boxes[:, 3] - boxes[:, 1]
    for low in (30.0, 80.0, 130.0):
        there = (rows > low) & (rows < low + 40.0)
        assert there.sum() > 20
        assert abs(np.median(np.log(sizes.sizes(rows[there])[:, 1] / true[there]))) < 0.15


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_pixels_inside_boxes_and_cores(seed):
    rng = np.random.default_rng(seed)
    blobs = find_blobs(rng.random((20, 30)) < 0.4, 5)
    boxes = rng.uniform(-5, 25, (4, 2))
    boxes = np.concatenate([boxes, boxes + rng.uniform(1, 15, (4, 2))], 1)
    counts = measuring.count_inside(blobs.labels, boxes, len(blobs))
    y, x = np.mgrid[:20, :30]
    for k, (x0, y0, x1, y1) in enumerate(boxes):
        inside = (x >= max(int(x0), 0)) & (x < np.ceil(x1)) & (y >= max(int(y0), 0)) & (y < np.ceil(y1))
        assert counts[k].tolist() == [(blobs.labels[inside] == b + 1).sum() for b in range(len(blobs))]
    for k, (x0, y0, x1, y1) in enumerate(measuring.core_boxes(blobs.labels, blobs.boxes).astype(int)):
        ax, ay, bx, by = blobs.boxes[k].astype(int)
        part = blobs.labels[ay:by, ax:bx] == k + 1
        above = part[: int(np.ceil((by - ay) * (1 - measuring.FEET)))]
        wide = np.flatnonzero(above.sum(0) >= measuring.CORE * (by - ay))
        wanted = (ax, ay, bx, by)
        if len(wide):
            tall = np.flatnonzero(
                part[:, wide[0] : wide[-1] + 1].sum(1) >= measuring.CORE * (wide[-1] + 1 - wide[0])
            )
            if len(tall):
                wanted = (ax + wide[0], ay + tall[0], ax + wide[-1] + 1, ay + tall[-1] + 1)
        assert (x0, y0, x1, y1) == wanted


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_riders_cut_off_by_the_border_are_measured_whole(seed):
    """What the picture's border leaves of boxes of known size, made whole again, is the boxes."""
    rng = np.random.default_rng(seed)
    frame, size = np.array([60.0, 40.0]), np.array([14.0, 18.0])
    low = rng.uniform(1.0 - size, frame - 1.0, (20, 2))
    boxes = np.concatenate([low, low + size], 1)
    visible = np.clip(boxes, 0.0, np.tile(frame, 2))
    touches = np.concatenate([visible[:, :2] <= 0, visible[:, 2:] >= frame], 1)
    whole = measuring.complete(visible, touches, np.tile(size, (20, 1)))
    assert np.allclose(whole, boxes)
    larger = measuring.complete(visible, np.zeros((20, 4), bool), np.tile(size, (20, 1)))
    assert np.array_equal(larger, visible)


def test_a_sliver_at_the_border_is_as_broad_as_a_rider():
    sliver = np.array([[20.0, 37.0, 24.0, 40.0]])
    below = np.array([[False, False, False, True]])
    assert measuring.complete(sliver, below, np.array([[14.0, 18.0]])).tolist() == [[15.0, 37.0, 29.0, 55.0]]


def joined_pair(offset):
    """Two silhouettes of 16 x 36 in one region: shape, groups, bins, centres, sizes, tables."""
    shape = silhouettes.Silhouette().shape
    centres = np.array([[40.0, 40.0], [40.0 + offset[0], 40.0 + offset[1]]])
    sizes = np.full((2, 2), (16.0, 36.0))
    image, groups = np.full((90, 100, 3), 90, np.uint8), np.zeros((90, 100), np.int32)
    for k in np.argsort(centres[:, 1]):
        for y, x in np.ndindex(90, 100):
            u = int((x + 0.5 - centres[k, 0] + 8) / 16 * silhouettes.COLUMNS // 1)
            v = int((y + 0.5 - centres[k, 1] + 18) / 36 * silhouettes.ROWS // 1)
            if 0 <= u < silhouettes.COLUMNS and 0 <= v < silhouettes.ROWS and shape[v, u] > 0.5:
                image[y, x], groups[y, x] = [(200, 30, 30), (30, 40, 200)][k], 1
    bins = colour.bin_pixels(image, groups)
    own = silhouettes.colours(shape, groups, 1, bins, centres, sizes, colour.BINS)
    tables = np.clip(np.log((own + 0.02) / (own[::-1] + 0.02)), -1.5, 1.5)
    return shape, groups, bins, centres, sizes, tables


def test_silhouettes_find_their_riders_in_one_region():
    rng = np.random.default_rng(3)
    for offset in ((12.0, 4.0), (14.0, 0.0), (4.0, 20.0), (-9.0, 14.0)):
        shape, groups, bins, truth, sizes, tables = joined_pair(offset)
        centres = truth + rng.uniform(-3, 3, (2, 2))
        shares = silhouettes.place(shape, groups, 1, bins, centres, sizes, tables, 2)
        assert np.abs(centres - truth).max() <= 2.5
        assert (shares > 0.35).all()
        assert shares[truth[:, 1].argmax()] > 0.85


def test_a_rider_that_nobody_expects_is_found_beside_one_that_is():
    shape, groups, _, truth, sizes, _ = joined_pair((14.0, 2.0))
    window = np.array([30.0, 30.0, 65.0, 55.0])
    line = np.array([16.0, 36.0]), np.zeros(2)
    ((worth, x, y),) = silhouettes.unexplained(shape, groups, 1, window, truth[:1], sizes[:1], *line, 0.45, 4)
    assert worth > 0.6
    assert np.hypot(x - truth[1, 0], y - truth[1, 1]) < 4.0
    assert not len(silhouettes.unexplained(shape, groups, 1, window, truth, sizes, *line, 0.2, 4))


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_pixels_belong_to_the_group_of_their_region_or_are_doubtful(seed):
    rng = np.random.default_rng(seed)
    labels, doubtful = rng.integers(0, 5, (6, 7), np.int32), rng.random((6, 7)) < 0.5
    numbers = np.array([0, *rng.integers(0, 3, 4)], np.int32)
    wanted = np.where((numbers[labels] == 0) & doubtful, -1, numbers[labels])
    assert np.array_equal(measuring.owners(labels, numbers, doubtful), wanted)
