"""The indexed road and its vehicles against stock highway-env, bit for bit."""

import numpy as np
import pytest
from highway_env.road.lane import CircularLane, SineLane, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.objects import Landmark, Obstacle
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.drivers import Driver
from sim.indexed_road import IndexedRoad
from sim.params import RoadParams
from sim.quick_vehicle import QuickVehicle
from sim.rng import stream
from sim.roads import build_road
from tests.benchmarks.traffic import populate, state

RATE = 30


def twins(road, count, *, stock=IDMVehicle, indexed=QuickVehicle, seed=0, connected=True):
    worlds = []
    for kind, vehicle in ((Road, stock), (IndexedRoad, indexed)):
        world = kind(network=road.network, neighbour_vehicles_connected_lanes=connected)
        populate(road, world, vehicle, count, seed)
        for number, driver in enumerate(world.vehicles):  # slow and fast ones, so that lanes are changed
            driver.target_speed = 10.0 if number % 5 == 4 else 32.0
        worlds.append(world)
    return worlds


def assert_equal_runs(worlds, ticks, dt=1 / RATE):
    changes = 0
    for _ in range(ticks):
        for world in worlds:
            world.act()
            world.step(dt)
        stock, indexed = worlds
        assert state(stock) == state(indexed)
        for a, b in zip(stock.vehicles, indexed.vehicles, strict=True):
            assert (a.lane_index, a.target_lane_index, a.crashed) == (
                b.lane_index,
                b.target_lane_index,
                b.crashed,
            )
            changes += a.lane_index != a.target_lane_index
    return changes


@pytest.mark.parametrize("vehicle", [IDMVehicle, QuickVehicle])
@pytest.mark.parametrize(("curved", "count"), [(False, 24), (True, 24)])
def test_every_trajectory_is_that_of_stock_highway_env(curved, count, vehicle):
    road = build_road(RoadParams(curved=curved), 1200.0, stream(3, "road"))
    changes = assert_equal_runs(twins(road, count, indexed=vehicle), 120)
    assert changes > 0  # lanes were changed while we watched


@pytest.mark.slow
@pytest.mark.parametrize("connected", [True, False])
@pytest.mark.parametrize("count", [20, 50, 100])
@pytest.mark.parametrize("curved", [False, True])
def test_long_trajectories_are_those_of_stock_highway_env(curved, count, connected):
    road = build_road(RoadParams(curved=curved), 2000.0, stream(1, "road"))
    assert assert_equal_runs(twins(road, count, connected=connected), 500) > 0


@pytest.mark.parametrize("vehicle", [IDMVehicle, QuickVehicle])
def test_collisions_and_obstacles_are_those_of_stock_highway_env(vehicle):
    road = build_road(RoadParams(curved=True), 900.0, stream(2, "road"))
    worlds = twins(road, 24, indexed=vehicle)
    for world in worlds:
        for s, d in ((150.0, -2.0), (320.0, 2.5), (400.0, -6.0)):
            x, y = road.to_world(s, d)
            world.objects.append(Obstacle(world, [float(x), -float(y)]))
        world.objects.append(Landmark(world, world.vehicles[3].position + 4.0))
        for number in (0, 4, 8):  # rammed from behind
            world.vehicles[number].target_speed = world.vehicles[number].speed = 39.0
            world.vehicles[number].TIME_WANTED = world.vehicles[number].DISTANCE_WANTED = 0.0
    assert_equal_runs(worlds, 90)
    assert any(v.crashed for v in worlds[0].vehicles)


def test_drivers_are_the_same_on_either_road():
    road = build_road(RoadParams(curved=True), 900.0, stream(2, "road"))
    assert_equal_runs(twins(road, 16, stock=Driver, indexed=Driver), 150)


def test_a_network_of_other_lanes_is_answered_as_by_stock_highway_env():
    network = RoadNetwork()
    for y in (0.0, 4.0):
        network.add_lane("a", "b", StraightLane([0, y], [150, y]))
        network.add_lane("b", "c", SineLane([150, y], [300, y], 2.0, 0.05, 0.0))
    worlds = []
    for kind, vehicle in ((Road, IDMVehicle), (IndexedRoad, QuickVehicle)):
        world = kind(network=network, neighbour_vehicles_connected_lanes=True)
        for i in range(6):
            world.vehicles.append(vehicle(world, [20.0 * i, 4.0 * (i % 2)], 0.0, 15.0 + i, target_speed=25.0))
        worlds.append(world)
    assert_equal_runs(worlds, 120)


place = st.tuples(
    st.one_of(st.floats(-20, 330), st.sampled_from([0.0, 95.0, 100.0, 105.0, 50.0])),
    st.one_of(st.floats(-12, 12), st.sampled_from([-3.0, -1.0, 0.0, 1.0, 3.0, 4.0])),
)


def small_network():
    network = RoadNetwork()
    for lane in range(2):
        y = 4.0 * lane
        network.add_lane("a", "b", StraightLane([0, y], [100, y]))
        network.add_lane("b", "c", CircularLane([100, 60], 60 - y, -np.pi / 2, 0.0))
        network.add_lane("c", "a", StraightLane([160 - y, 60], [160 - y, 120]))
    network.add_lane("b", "d", StraightLane([100, 0], [200, 0]))
    return network


@settings(max_examples=50, deadline=None)
@given(places=st.lists(place, min_size=2, max_size=9), connected=st.booleans(), objects=st.integers(0, 2))
def test_queries_are_those_of_stock_highway_env(places, connected, objects):
    network = small_network()
    worlds = []
    for kind in (Road, IndexedRoad):
        world = kind(network=network, neighbour_vehicles_connected_lanes=connected)
        for x, y in places:
            world.vehicles.append(IDMVehicle(world, [x, y], 0.1 * (y % 7), 10.0))
        for x, y in places[:objects]:
            world.objects.append(Obstacle(world, [x + 3.0, y]))
        worlds.append(world)

    def number(world, found):
        return [
            next((i for i, b in enumerate([*world.vehicles, *world.objects]) if b is f), None) for f in found
        ]

    for i in range(len(places)):
        stock, indexed = (w.vehicles[i] for w in worlds)
        assert stock.lane_index == indexed.lane_index
        for index in network.lanes_dict():
            found = [number(w, w.neighbour_vehicles(w.vehicles[i], index)) for w in worlds]
            assert found[0] == found[1]
        for options in ({}, {"count": 2}, {"see_behind": False}, {"sort": False, "vehicles_only": True}):
            near = [number(w, w.close_objects_to(w.vehicles[i], 30.0, **options)) for w in worlds]
            assert near[0] == near[1]
