"""Networks below the platform, and the vehicles on them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from sim import meshes
from sim.aerial.crossing import BOX, crossing_roads
from sim.aerial.driving import StopLine
from sim.aerial.fleet import LookalikeFleet
from sim.aerial.flows import Flows
from sim.aerial.networks import Path, along_road, lay_road
from sim.aerial.overpass import CLEARANCE, DEPTH, RAMP, Overpass
from sim.aerial.site import lay_out
from sim.aerial.traffic import AerialTraffic
from sim.aerial.waves import Waves
from sim.params import AerialParams, AerialRoadParams, AerialTrafficParams, PlatformParams
from sim.rng import stream

ROADS = {
    "motorway": AerialRoadParams(),
    "winding": AerialRoadParams(network="winding", lanes=1),
    "u-turn": AerialRoadParams(network="u-turn", lanes=2),
    "intersection": AerialRoadParams(network="intersection", lanes=2, lane_width=3.4),
}
LIGHT = AerialTrafficParams(density=14.0, oncoming_density=8.0)


def network(name: str, seed: int = 1):
    if name == "intersection":
        return crossing_roads(ROADS[name], LIGHT, 210.0)
    return along_road(lay_road(ROADS[name], 500.0, stream(seed, "road")), 14.0, 8.0)


def flows(name: str, seed: int = 1) -> Flows:
    made = network(name, seed)
    fleet = LookalikeFleet(LIGHT, meshes.catalogue(), stream(seed, "looks"))
    depth = 0.0 if name == "intersection" else 0.9
    streams = 1 + max(entry.stream for entry in made.entries)
    waves = Waves(depth, streams, stream(seed, "waves"))
    out = Flows(made, fleet, waves, changes=name != "intersection", seed=seed, name="ground", rate=30)
    out.fill()
    return out


@pytest.mark.parametrize("name", ROADS)
def test_paths_have_no_gaps_and_no_kinks(name):
    made = network(name)
    for entry in made.entries:
        assert sum(entry.shares) == pytest.approx(1.0)
        for path in entry.paths:
            lanes = [made.lanes.get_lane(index) for index in path.lanes]
            for before, after in pairwise(lanes):
                assert np.allclose(before.position(before.length, 0), after.position(0, 0), atol=1e-6)
                turn = before.heading_at(before.length) - after.heading_at(0)
                assert np.cos(turn) == pytest.approx(1.0)
            assert path.length == pytest.approx(sum(lane.length for lane in lanes))


def test_paths_slow_down_before_arcs():
    made = network("u-turn")
    path = made.entries[0].paths[0]
    bend = path.starts[1]
    assert path.allowed(bend + 5.0) < 10.0
    assert path.allowed(bend - 10.0) < path.allowed(bend - 60.0)


@pytest.mark.parametrize("name", ROADS)
def test_nobody_collides_and_who_leaves_is_gone(name):
    traffic = flows(name)
    numbers = set()
    for _ in range(150):
        traffic.step()
        numbers |= {t.number for t in traffic.travellers}
        assert len(traffic.world.vehicles) == len(traffic.travellers)
    assert not traffic.collided
    assert all(t.s < t.driver.path.length for t in traffic.travellers)
    assert np.mean([t.driver.speed for t in traffic.travellers]) > 2.0


def test_red_lights_hold_the_traffic_and_green_ones_let_it_go():
    traffic = flows("intersection", 2)
    signals = network("intersection").signals
    last = {}
    crossed_on_green = 0
    for tick in range(420):
        green = traffic._lights.green(tick / 30)
        recent = frozenset().union(
            *(traffic._lights.green(tick / 30 - back) for back in (1.0, 2.0, 3.0, 4.0))
        )
        for each in traffic.travellers:
            index = each.driver.path.lanes[0]
            line = signals.lines[index]
            before, now = last.get(each.number, each.s), each.s
            last[each.number] = now
            nose = each.driver.LENGTH / 2
            if before + nose < line <= now + nose:
                # Only who could not stop any more drives over the line, soon after it has turned red.
                assert index in green or index in recent
                crossed_on_green += index in green
        traffic.step()
    assert crossed_on_green >= 3


def test_phases_never_cross():
    """Ways that are green at the same time do not meet, but where they come from one approach."""
    made = network("intersection")
    ways = {}
    for entry in made.entries:
        for path in entry.paths:
            lane = made.lanes.get_lane(path.lanes[1])
            points = np.array([lane.position(s, 0) for s in np.linspace(0, lane.length, 60)])
            ways.setdefault(path.lanes[0], []).append((path.lanes[0][0], points))
    for phase in made.signals.phases:
        green = [way for index in phase for way in ways[index]]
        for k, (origin, one) in enumerate(green):
            for other_origin, other in green[k + 1 :]:
                gap = np.hypot(*(one[:, None] - other[None]).transpose(2, 0, 1)).min()
                assert origin == other_origin or gap > 2.5
    assert {index for phase in made.signals.phases for index in phase} == set(made.signals.lines)
    assert all(abs(line) < 210 - BOX + 5 for line in made.signals.lines.values())


def test_a_stop_line_is_nothing_that_one_can_hit():
    traffic = flows("motorway")
    line = StopLine(traffic.world, ("f0", "f1", 0), 50.0)
    assert not line.collidable
    assert line.speed == 0.0


def test_waves_run_against_the_traffic():
    waves = Waves(0.9, 2, np.random.default_rng(0))
    places = np.arange(0.0, 200.0, 0.5)
    now = np.array([waves.factor(0, s, 0.0) for s in places])
    later = np.array([waves.factor(0, s - 4.5, 1.0) for s in places])
    assert np.allclose(now, later)
    assert now.min() < 0.15
    assert now.max() > 0.99
    assert Waves(0.0, 1, np.random.default_rng(0)).factor(0, 3.0, 4.0) == 1.0


def test_lookalikes_are_the_same_to_the_last_bit():
    params = AerialTrafficParams(lookalikes=1.0, looks=2, vans=0.0, lorries=0.0, buses=0.0)
    fleet = LookalikeFleet(params, meshes.catalogue(), stream(3, "looks"))
    draws = [fleet.draw(stream(3, "vehicle", k)) for k in range(40)]
    assert {(draw.model, draw.colour) for draw in draws} == set(fleet.looks)
    assert {draw.size for draw in draws} == {meshes.catalogue()[model].size for model, _ in fleet.looks}


def test_convoy_keeps_together_and_the_aim_follows_it():
    params = AerialParams(
        road=ROADS["u-turn"].model_copy(update={"bridges": 0}),
        traffic=AerialTrafficParams(density=4.0, oncoming_density=4.0, convoy=6, waves=0.0, speed=12.0),
        platform=PlatformParams(altitude=150.0),
    )
    layout = lay_out(params, 20.0, 4, 110.0)
    traffic = AerialTraffic(params.traffic, layout, meshes.catalogue(), seed=4, rate=30)
    start = traffic.convoy_at()
    for _ in range(90):
        traffic.step()
    assert traffic.convoy_at() - start == pytest.approx(3 * 12.0, rel=0.4)
    places = sorted(t.s for t in traffic._levels[0][0].travellers if t.convoy >= 0)
    assert len(places) == 6
    assert places[-1] - places[0] < 6 * 40.0
    assert not traffic.collided


def test_a_bridge_comes_down_to_the_ground_on_its_ramps():
    bridge = Overpass(name="b", x=3.0, y=4.0, heading=0.7, span=40.0, width=16.0, carries="road")
    top = CLEARANCE + DEPTH
    assert bridge.height([0.0, 19.9, 20.0 + RAMP / 2, -20.0 - RAMP, 200.0]) == pytest.approx(
        [top, top, top / 2, 0.0, 0.0]
    )
    model = bridge.model()
    low, high = model.lods[0].vertices.min(axis=0), model.lods[0].vertices.max(axis=0)
    assert np.allclose(high - low, model.size, atol=1e-3)
    assert bridge.lanes == 1
    assert len(bridge.approaches(50.0)) == 2
    road = bridge.road(50.0)
    x, y = road.to_world(road.length / 2, 0.0)
    assert (float(x), float(y)) == pytest.approx((3.0, 4.0))


def test_levels_never_meet():
    params = AerialParams()
    layout = lay_out(params, 4.0, 2, 110.0)
    traffic = AerialTraffic(params.traffic, layout, meshes.catalogue(), seed=2, rate=30)
    bodies = traffic.vehicles()
    assert len(np.unique(bodies.ids)) == len(bodies)
    assert (bodies.positions[:, 2] > 5.0).any()
    assert (bodies.positions[:, 2] == 0.0).any()


def test_a_path_is_as_fast_as_its_arcs_allow():
    made = network("winding")
    path = made.entries[0].paths[0]
    assert isinstance(path, Path)
    radius = min(getattr(made.lanes.get_lane(index), "radius", np.inf) for index in path.lanes)
    assert min(path.pace) == pytest.approx(np.sqrt(2.6 * radius), rel=1e-6)
