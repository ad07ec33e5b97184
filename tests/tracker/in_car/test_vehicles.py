"""Vehicles: carried by their points, ended when they leave, and found on simulated drives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios import spec
from scenarios.loop import run_episode
from scenarios.score.summary import score
from tests.tracker.in_car.reliefs import drawn_cars, relief_of
from tracker import registry
from tracker.boosting import learnt
from tracker.in_car.body import covered
from tracker.in_car.features import Picture
from tracker.in_car.points import PointStore
from tracker.in_car.vehicles import HIGHEST, INWARD, LONG, SEARCH, WALK, Vehicle, VehicleStore
from tracker.in_car.yaw import EgoMotion

RATE = 30.0
HORIZON = 110.0
TREES = learnt("tracker.in_car", "outline_odds")
WIDTH, FOCUS = 320, np.array([160.0, HORIZON])


def points_at(position, owner):
    """A store that holds points which have been followed for a while."""
    points = PointStore(memory=11)
    count = len(position)
    points.ids = np.arange(1, count + 1)
    points.position, points.flow = np.array(position, float), np.zeros((count, 2))
    points.age, points.evidence = np.full(count, 20), np.full(count, 3.0)
    points.owner = np.full(count, owner, np.int64)
    return points


def vehicle_at(box, **settings):
    box = np.array(box, float)
    return Vehicle(id=1, box=box, log_width=float(np.log((box[2] - box[0]) / (box[3] - HORIZON))), **settings)


def ended(store, points):
    store._end((240, 320), points, HORIZON)
    return [vehicle.id for vehicle in store.vehicles]


Boxes = st.tuples(*[st.integers(0, 12)] * 2, *[st.integers(1, 8)] * 2)


@given(Boxes, Boxes)
def test_covered_counts_shared_pixels(one, other):
    cells = [{(x, y) for x in range(a, a + w) for y in range(b, b + h)} for a, b, w, h in (one, other)]
    boxes = [np.array([a, b, a + w, b + h], float) for a, b, w, h in (one, other)]
    expected = len(cells[0] & cells[1]) / min(map(len, cells))
    assert covered(*boxes) == pytest.approx(expected)


def test_a_box_moves_and_grows_with_its_points():
    box = np.array([120.0, 105, 165, 140])
    rng = np.random.default_rng(0)
    points = points_at(rng.uniform(box[:2], box[2:], (20, 2)), owner=1)
    store, vehicle = VehicleStore(rate=RATE, trees=TREES), vehicle_at(box)
    shift, growth = np.array([0.8, 0.3]), 0.004
    for _ in range(90):
        middle = points.position.mean(0)
        points.flow = shift + growth * (points.position - middle)
        points.position = points.position + points.flow
        # What it would have moved over the remembered time at this pace.
        store._carry(vehicle, points, points.flow * RATE * 0.35, WIDTH, FOCUS)
    grown = np.exp(90 * np.log1p(growth))
    assert vehicle.members == 20
    assert vehicle.missed == 0
    assert vehicle.box[2] - vehicle.box[0] == pytest.approx(grown * 45, rel=0.04)
    centre = 0.5 * (vehicle.box[:2] + vehicle.box[2:])
    assert centre == pytest.approx(0.5 * (box[:2] + box[2:]) + 90 * shift, abs=2.0)


def test_a_point_that_does_not_move_along_is_let_go():
    box = (120, 105, 165, 140)
    points = points_at(np.random.default_rng(1).uniform(box[:2], box[2:], (9, 2)), owner=1)
    points.flow[4] = (5.0, 0.0)
    store, vehicle = VehicleStore(rate=RATE, trees=TREES), vehicle_at(box)
    store._carry(vehicle, points, points.flow, WIDTH, FOCUS)
    assert points.owner.tolist() == [1] * 4 + [0] + [1] * 4
    assert vehicle.box == pytest.approx(box)


def test_without_points_a_vehicle_goes_on_and_is_missed():
    store, vehicle = (
        VehicleStore(rate=RATE, trees=TREES),
        vehicle_at((120, 105, 165, 140), velocity=np.array([2.0, 0])),
    )
    points = points_at(np.empty((0, 2)), owner=0)
    store._carry(vehicle, points, np.empty((0, 2)), WIDTH, FOCUS)
    assert vehicle.missed == 1
    assert vehicle.box == pytest.approx((122, 105, 167, 140))


@pytest.mark.parametrize(
    ("before", "after"),
    [((0, 105, 60, 150), (0, 105, 62, 150)), ((250, 105, 320, 150), (248, 105, 320, 150))],
)
def test_what_comes_into_the_picture_goes_on_beyond_its_edge(before, after):
    toward = 2.0 if before[0] == 0 else -2.0
    points = points_at(np.random.default_rng(4).uniform(before[:2], before[2:], (9, 2)), owner=1)
    points.flow[:] = (toward, 0.0)
    store, vehicle = VehicleStore(rate=RATE, trees=TREES), vehicle_at(before)
    store._carry(vehicle, points, points.flow * RATE * 0.35, WIDTH, FOCUS)
    assert vehicle.box == pytest.approx(after)
    assert vehicle.inward > INWARD
    seen = vehicle_at(before, whole=True)
    store._carry(seen, points, points.flow * RATE * 0.35, WIDTH, FOCUS)
    assert seen.box == pytest.approx(np.add(before, (toward, 0, toward, 0)))


@pytest.mark.parametrize(("left", "others", "vehicles"), [(0, 4, 2), (0, 12, 1), (20, 12, 2)])
def test_points_of_one_vehicle_do_not_begin_another_that_is_cut_off(left, others, vehicles):
    store = VehicleStore(rate=RATE, trees=TREES)
    store.vehicles, store._next_id = [vehicle_at((155, 120, 170, 140))], 2
    free = np.random.default_rng(5).uniform((22, 112), (140, 178), (8, 2))
    held = np.random.default_rng(6).uniform((155, 120), (160, 140), (others, 2))
    points = points_at(np.concatenate([free, held]), owner=1)
    points.owner[:8] = 0
    scene = relief_of(np.zeros((240, WIDTH), np.uint8))
    store._begin(np.array([left, 110.0, 160, 180]), points, np.ones(8 + others, bool), scene)
    assert len(store.vehicles) == vehicles


@pytest.mark.parametrize(
    ("box", "settings", "stays"),
    [
        ((120, 105, 165, 140), {"confirmed": True}, True),
        ((310, 105, 355, 140), {"confirmed": True}, False),  # three quarters are out of the picture
        ((120, 105, 165, 140), {"confirmed": True, "odds": -2.0}, False),
        ((120, 105, 165, 140), {"confirmed": True, "missed": 10}, True),
        ((120, 105, 165, 140), {"confirmed": True, "missed": 16}, False),
        ((120, 105, 165, 140), {"missed": 4}, False),
        ((120, 105, 165, 140), {"age": 61}, False),  # has not proved itself in two seconds
        ((120, 90, 165, 113), {"confirmed": True}, False),  # stands on the horizon
    ],
)
def test_who_is_given_up(box, settings, stays):
    store = VehicleStore(rate=RATE, trees=TREES)
    store.vehicles = [vehicle_at(box, **settings)]
    points = points_at([(140.0, 120.0)], owner=1)
    assert ended(store, points) == ([1] if stays else [])
    assert points.owner.tolist() == [1 if stays else 0]


def test_of_two_boxes_on_one_vehicle_the_surer_stays():
    store = VehicleStore(rate=RATE, trees=TREES)
    store.vehicles = [
        vehicle_at((120, 105, 165, 140), confirmed=True, odds=1.0),
        vehicle_at((122, 106, 160, 140), confirmed=True, odds=4.0),
    ]
    store.vehicles[1].id = 2
    assert ended(store, points_at([(140.0, 120.0)], owner=1)) == [2]


def test_points_join_the_vehicle_they_move_with():
    store = VehicleStore(rate=RATE, trees=TREES)
    store.vehicles = [vehicle_at((120, 105, 165, 140))]
    inside, outside, passing, doubtful = (140.0, 120.0), (180.0, 120.0), (150.0, 120.0), (130.0, 120.0)
    points = points_at([inside, outside, passing, doubtful], owner=0)
    points.flow[2] = (3.0, 0.0)
    points.evidence[3] = -1.0
    store._join(points, moving=20.0)
    assert points.owner.tolist() == [1, 0, 0, 0]
    points.owner[1] = 1
    store._join(points, moving=20.0)
    assert points.owner[1] == 0


@pytest.mark.parametrize(
    ("box", "speed", "sure"),
    [
        ((120, 105, 165, 140), 2 * WALK, True),
        ((120, 105, 165, 140), 0.0, False),
        ((0, 105, 45, 140), 10, False),
    ],
)
def test_a_whole_one_that_looks_like_a_vehicle_for_long_is_sure(box, speed, sure):
    grey, _ = drawn_cars([(box[0], box[2], box[3])])
    relief, store = relief_of(grey, horizon=HORIZON), VehicleStore(rate=RATE, trees=TREES)
    vehicle = vehicle_at(box, odds=HIGHEST, age=60)
    for look in range(round(LONG * RATE / SEARCH)):
        assert not vehicle.confirmed, look
        store._hold(vehicle, vehicle.box[[0, 2, 3]], vehicle.box[None], np.array([4.0]), 0, relief, speed)
    assert vehicle.confirmed == sure


def test_nothing_is_begun_where_no_point_moves_like_a_vehicle():
    grey, _ = drawn_cars([(120, 165, 140)])
    points = points_at(np.random.default_rng(2).uniform((122, 108), (163, 138), (30, 2)), owner=0)
    points.evidence[:] = -3.0
    ego = EgoMotion(focal=300.0, focus=(160.0, HORIZON), sure=True, rate=RATE)
    store = VehicleStore(rate=RATE, trees=TREES)
    picture = Picture(grey=grey, red=np.zeros_like(grey), scale=1.0, brightness=float(grey.mean()))
    for _ in range(6):
        store.step(picture, points, np.zeros((30, 2)), ego, 4.0)
    assert store.vehicles == []


@pytest.fixture(scope="module")
def drive():
    """Five seconds of the motorway."""
    scenario = spec.load("in-car-day", ["seconds=5"])
    return run_episode(scenario, 410, {"in-car": registry.make("in-car")})[0]


def test_vehicles_of_a_drive_are_found_and_keep_their_ids(drive):
    found = score(drive)[0]
    assert found["recall"] > 0.6
    assert found["precision"] > 0.8
    assert found["idf1"] > 0.7
    assert found["id_switches"] <= 1


def test_an_empty_road_has_no_vehicles():
    empty = ["seconds=4", "traffic.density=0", "traffic.oncoming_density=0"]
    log = run_episode(spec.load("in-car-day", empty), 411, {"in-car": registry.make("in-car")})[0]
    assert sum((tracks.status == 1).sum() for tracks in log.tracks) == 0
