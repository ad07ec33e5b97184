"""The traffic on the indexed road."""

import numpy as np
import pytest
from highway_env.vehicle.behavior import IDMVehicle

from sim.drivers import Driver
from sim.indexed_road import IndexedRoad
from sim.models import Model
from sim.params import EgoParams, RoadParams, TrafficParams
from sim.rng import stream
from sim.roads import build_road
from sim.traffic import Traffic
from sim.world import FIRST_VEHICLE_ID, Kind, Lamps, Role

RATE = 30
CATALOGUE = tuple(
    Model(name=kind.name.lower(), kind=kind, size=size, lods=())
    for kind, size in (
        (Kind.TREE, (4.0, 4.0, 9.0)),
        (Kind.CAR, (4.4, 1.8, 1.45)),
        (Kind.CAR, (3.9, 1.7, 1.5)),
        (Kind.VAN, (5.2, 2.0, 2.2)),
        (Kind.LORRY, (11.5, 2.5, 3.6)),
        (Kind.BUS, (12.0, 2.5, 3.2)),
    )
)
CASES = {
    "straight": (RoadParams(), TrafficParams(), EgoParams()),
    "curve": (RoadParams(curved=True), TrafficParams(), EgoParams()),
    "stop-and-go": (
        RoadParams(),
        TrafficParams(stop_and_go=True, density=35.0, speed=14.0),
        EgoParams(speed=14.0),
    ),
    "dense": (
        RoadParams(lanes=3, curved=True),
        TrafficParams(density=28.0, oncoming_density=25.0, speed_spread=5.0),
        EgoParams(),
    ),
}


def traffic(case="straight", seed=0, *, seconds=20.0, rate=RATE, lights_on=False, **ego):
    road_params, params, ego_params = CASES[case]
    ego_params = EgoParams(**{**ego_params.model_dump(), **ego})
    length = 1.5 * max(ego_params.speed, params.speed) * seconds + 700.0
    road = build_road(road_params, length, stream(seed, "road"))
    return Traffic(road, params, ego_params, CATALOGUE, seed=seed, rate=rate, lights_on=lights_on)


def test_no_class_state_leaks_between_worlds():
    import gymnasium

    def run(disturb):
        run_of = traffic("curve", 4, seconds=5.0, rate=8)
        if disturb:
            before = (IDMVehicle.COMFORT_ACC_MAX, IDMVehicle.DISTANCE_WANTED)
            env = gymnasium.make("intersection-v1")
            env.reset(seed=0)
            env.step(env.action_space.sample() * 0)
            env.close()
            assert before != (IDMVehicle.COMFORT_ACC_MAX, IDMVehicle.DISTANCE_WANTED)
        for _ in range(15):
            run_of.step()
        return run_of.vehicles().positions.tobytes()

    saved = {name: getattr(IDMVehicle, name) for name in dir(IDMVehicle) if name.isupper()}
    import highway_env

    highway_env._register_highway_envs()
    try:
        undisturbed = run(disturb=False)
        assert run(disturb=True) == undisturbed
        assert run(disturb=False) == undisturbed  # and one that is built afterwards
    finally:
        for name, value in saved.items():
            setattr(IDMVehicle, name, value)


@pytest.mark.parametrize("case", ["curve", "stop-and-go"])
def test_the_same_seed_gives_the_same_drive_and_another_seed_another(case):
    def drive(seed):
        run = traffic(case, seed, seconds=5.0, rate=8)
        for _ in range(5):
            run.step()
        bodies = run.vehicles()
        return b"".join(a.tobytes() for a in (bodies.ids, bodies.positions, bodies.yaws, bodies.colours))

    assert drive(1) == drive(1)
    assert drive(1) != drive(2)


def drive_without_collision(case, seed, seconds=20.0):
    """Drive, and return how often somebody was ahead within 60 m, and the ego's states."""
    run = traffic(case, seed, seconds=seconds)
    ahead, egos = 0, [run.ego()]
    for _ in range(int(seconds * RATE)):
        run.step()
        assert not run.collided
        ego, bodies = run.ego(), run.vehicles()
        egos.append(ego)
        away = (bodies.positions - ego.position)[:, :2] @ [np.cos(ego.yaw), np.sin(ego.yaw)]
        ahead += np.any((bodies.roles == Role.SAME_WAY) & (away > 0) & (away < 60))
    return ahead / (seconds * RATE), egos


@pytest.mark.parametrize("case", CASES)
def test_a_drive_has_cars_ahead_and_no_collision(case):
    ahead, egos = drive_without_collision(case, 0, seconds=2.0)
    assert ahead > 0.5
    yaw = np.unwrap([e.yaw for e in egos])
    rates = np.array([e.yaw_rate for e in egos])
    speeds = np.array([e.speed for e in egos])
    assert np.allclose(-np.diff(yaw) * RATE, rates[1:], atol=1e-9)  # positive turns to the right
    assert np.abs(rates * speeds).max() < 3.0  # m/s^2 sideways
    path = np.array([e.position[:2] for e in egos])
    run = np.hypot(*np.diff(path, axis=0).T) * RATE
    assert np.allclose(run, speeds[:-1], atol=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_twenty_seeds_drive_without_collision(case):
    assert np.mean([drive_without_collision(case, seed)[0] for seed in range(20)]) > 0.8


@pytest.mark.parametrize("seed", [0, 1])
def test_nobody_stands_in_another_at_the_start(seed):
    params = TrafficParams(density=45.0, speed=8.0, stop_and_go=True, lorries=0.4, buses=0.2)
    road = build_road(RoadParams(lanes=3), 900.0, stream(seed, "road"))
    assert not Traffic(road, params, EgoParams(speed=8.0), CATALOGUE, seed=seed, rate=6).collided


def test_who_changes_lanes_is_on_the_old_one_until_it_is_cleared():
    road = build_road(RoadParams(), 900.0, stream(0, "road"))
    world = IndexedRoad(road.network)
    driver = Driver(world, road.network.get_lane(("f0", "f1", 1)).position(50.0, 0), speed=20.0)
    driver.enable_lane_change = False
    world.vehicles.append(driver)
    assert driver.lanes == (1,)
    driver.target_lane_index = ("f0", "f1", 0)
    beside = 0
    for _ in range(5 * RATE):
        world.act()
        world.step(1 / RATE)
        across = abs(road.network.get_lane(("f0", "f1", 1)).local_coordinates(driver.position)[1])
        if across < 3.5:
            assert sorted(driver.lanes) == [0, 1]
            beside += driver.lane_index[2] == 0  # as highway-env sees it, it is over already
    assert beside > RATE
    assert driver.lanes == (0,)


@pytest.mark.parametrize(
    ("behind", "speed", "goes"), [(28.0, 23.5, False), (28.0, 12.0, True), (80.0, 23.5, True)]
)
def test_nobody_changes_into_the_way_of_who_comes_fast_from_the_other_side(behind, speed, goes):
    road = build_road(RoadParams(lanes=3), 900.0, stream(0, "road"))
    world = IndexedRoad(road.network)
    for lane, s, v in ((2, 200.0, 12.0), (2, 225.0, 5.0), (0, 200.0 - behind, speed)):
        place = road.network.get_lane(("f0", "f1", lane)).position(s, 0)
        driver = Driver(world, place, speed=v, target_speed=25.0)
        driver.COMFORT_ACC_MAX, driver.COMFORT_ACC_MIN, driver.TIME_WANTED = 1.6, -2.0, 0.75
        world.vehicles.append(driver)
    mover, _, other = world.vehicles
    assert mover.mobil(("f0", "f1", 1))
    other.target_lane_index = ("f0", "f1", 1)  # he has begun, and is still on his old lane
    assert mover.mobil(("f0", "f1", 1)) == goes


def test_who_is_cut_in_on_falls_back_calmly():
    road = build_road(RoadParams(), 900.0, stream(0, "road"))
    world = IndexedRoad(road.network)
    lane = road.network.get_lane(("f0", "f1", 1))
    for s, speed in ((62.0, 20.0), (50.0, 21.0)):  # seven metres between bumpers
        driver = Driver(world, lane.position(s, 0), speed=speed, target_speed=speed)
        driver.COMFORT_ACC_MAX, driver.COMFORT_ACC_MIN, driver.enable_lane_change = 1.6, -2.0, False
        world.vehicles.append(driver)
    hardest = 0.0
    for _ in range(10 * RATE):
        world.act()
        hardest = min(hardest, world.vehicles[1].action["acceleration"])
        world.step(1 / RATE)
    assert -3.0 < hardest < -1.0
    assert world.vehicles[1].lane_distance_to(world.vehicles[0]) > 25.0
    assert not world.vehicles[1].crashed


def test_stop_and_go_stops_and_goes():
    stops = 0
    for seed in range(3):
        run = traffic("stop-and-go", seed, rate=10)
        speeds, braking = [], False
        for _ in range(200):
            run.step()
            speeds.append(run.ego().speed)
            bodies = run.vehicles()
            braking |= bool(np.any(bodies.lamps & Lamps.BRAKE))
        assert braking
        assert min(speeds) >= 0.0
        assert max(speeds) > 5.0
        stops += min(speeds) < 0.5
    assert stops > 0


def test_bodies_are_whole_and_stand_where_they_should():
    road_params = RoadParams(lanes=1, oncoming_lanes=1, median=0.0, curved=True)
    road = build_road(road_params, 1200.0, stream(0, "road"))
    params = TrafficParams(parked=40.0, density=18.0, speed=13.0)
    run = Traffic(road, params, EgoParams(speed=13.0), CATALOGUE, seed=0, rate=RATE, lights_on=True)
    ids: dict[int, tuple[int, int]] = {}
    for _ in range(150):
        run.step()
        bodies = run.vehicles()
        assert len(np.unique(bodies.ids)) == len(bodies)
        assert bodies.ids.min() >= FIRST_VEHICLE_ID
        for number, kind, model in zip(bodies.ids.tolist(), bodies.kinds, bodies.models, strict=True):
            assert ids.setdefault(number, (kind, model)) == (kind, model)
    assert np.array_equal(bodies.sizes, [CATALOGUE[m].size for m in bodies.models])
    assert [CATALOGUE[m].kind for m in bodies.models] == bodies.kinds.tolist()
    s, d = road.locate(bodies.positions[:, 0], bodies.positions[:, 1])
    same, coming, parked = (bodies.roles == r for r in (Role.SAME_WAY, Role.ONCOMING, Role.PARKED))
    assert same.any()
    assert coming.any()
    assert np.all(np.abs(d[same] + 1.8) < 0.6)
    assert np.all(np.abs(d[coming] - 1.8) < 0.6)
    assert np.all(np.abs(d[parked]) - bodies.sizes[parked, 1] / 2 > 3.6 + 0.3)
    assert (d[parked] < 0).any()
    assert (d[parked] > 0).any()
    along = np.cos(bodies.yaws - road.heading(s))
    assert np.all(np.sign(along) == np.where(d < 0, 1, -1))
    assert not bodies.velocities[parked].any()
    moving = np.einsum(
        "ij,ij->i", bodies.velocities[:, :2], np.stack([np.cos(bodies.yaws), np.sin(bodies.yaws)]).T
    )
    assert np.all(moving[~parked] >= 0)
    assert np.all(bodies.lamps[~parked] & (Lamps.TAIL | Lamps.HEAD) == Lamps.TAIL | Lamps.HEAD)
    assert np.all((bodies.colours >= 0) & (bodies.colours <= 1))


def test_vehicles_appear_and_vanish_far_away():
    run = traffic("straight", 3, seconds=30.0)
    bodies = run.vehicles()
    known = dict(zip(bodies.ids.tolist(), bodies.positions, strict=True))
    for _ in range(10 * RATE):
        run.step()
        bodies, ego = run.vehicles(), run.ego()
        now = dict(zip(bodies.ids.tolist(), bodies.positions, strict=True))
        for number in now.keys() ^ known.keys():
            away = (now.get(number, known.get(number)) - ego.position) @ [np.cos(ego.yaw), np.sin(ego.yaw), 0]
            assert away > 400 or away < -100
        known = now


def test_the_ego_obeys_actions():
    run = traffic("straight", 5, driver="actions", speed=15.0)
    start = run.ego()
    for _ in range(15):
        run.step(np.array([1.0, 0.0], np.float32))
    faster = run.ego()
    assert faster.speed == pytest.approx(start.speed + 1.5, abs=0.02)
    for _ in range(10):
        run.step(np.array([0.0, 0.5], np.float32))
    turned = run.ego()
    assert turned.yaw_rate == pytest.approx(0.2)
    assert turned.yaw < faster.yaw  # to the right
    for _ in range(15):
        run.step(np.array([-1.0, 0.0], np.float32))
    assert run.ego().speed == pytest.approx(faster.speed - 3.5, abs=0.02)


def test_the_ego_follows_a_profile():
    run = traffic("curve", 6, rate=15, driver="profile", speed=12.0)
    offsets = []
    for _ in range(10 * 15):
        run.step()
        ego = run.ego()
        offsets.append(run._road.locate(*ego.position[:2])[1])
        assert not run.collided
    assert 0.2 < np.ptp(offsets) < 1.0


def test_impossible_traffic_is_an_error():
    road = build_road(RoadParams(), 900.0, stream(0, "road"))
    with pytest.raises(ValueError, match=r"ego\.lane"):
        Traffic(road, TrafficParams(), EgoParams(lane=2), CATALOGUE, seed=0, rate=RATE)
    with pytest.raises(ValueError, match="car"):
        Traffic(road, TrafficParams(), EgoParams(), CATALOGUE[:1], seed=0, rate=RATE)
    with pytest.raises(ValueError, match="more than 1"):
        Traffic(road, TrafficParams(vans=0.6, lorries=0.6), EgoParams(), CATALOGUE, seed=0, rate=RATE)


def test_an_empty_road_has_no_traffic():
    road = build_road(RoadParams(oncoming_lanes=0), 900.0, stream(0, "road"))
    run = Traffic(road, TrafficParams(density=0.0), EgoParams(), CATALOGUE, seed=0, rate=10)
    run.step()
    assert len(run.vehicles()) == 0
    assert run.ego().speed == pytest.approx(20.0, rel=0.12)  # it swells and sinks by a tenth


@pytest.mark.slow
def test_a_long_drive_costs_no_more_than_a_short_one():
    """Two minutes on 4 km of curves: the window empties behind as it fills ahead."""
    run = traffic("curve", 1, seconds=120.0)
    counts, last = [], 0
    for tick in range(120 * RATE):
        run.step()
        if tick % RATE == 0:
            bodies = run.vehicles()
            counts.append(len(bodies))
            last = int(bodies.ids.max())
            assert not run.collided
    assert 0.6 < np.mean(counts[-30:]) / np.mean(counts[:30]) < 1.6
    assert max(counts) < 80
    assert last - FIRST_VEHICLE_ID > 2 * max(counts)  # others had come, and their numbers are not used again
