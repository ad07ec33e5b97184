"""Recorded traffic as the platform sees it."""

from __future__ import annotations

import numpy as np
import pytest

from sim import meshes
from sim.aerial.replay import LEAD_ON, RecordedTraffic, decks, middle_and_heading, surroundings
from sim.params import AerialRoadParams, AerialTrafficParams
from sim.recorded import Recording, RecordingError, Way
from sim.rng import stream
from sim.world import FIRST_VEHICLE_ID, Kind

MODELS = meshes.catalogue()


def way(name: str, y: float, speed: float, *, begin: float = 0.0, kind: Kind = Kind.CAR) -> Way:
    times = begin + np.arange(0.0, 4.01 - begin, 0.1)
    positions = np.column_stack([speed * times, np.full(len(times), y)])
    yaws = np.full(len(times), 0.0 if speed >= 0 else np.pi)
    size = (4.5, 1.8) if kind == Kind.CAR else (12.0, 2.5)
    return Way(name=name, kind=kind, size=size, times=times, positions=positions, yaws=yaws)


def recording(*, lanes: bool = False) -> Recording:
    borders = tuple(
        (np.array([[0.0, y + 1.75], [60.0, y + 1.75]]), np.array([[0.0, y - 1.75], [60.0, y - 1.75]]))
        for y in (0.0, 3.5)
    )
    return Recording(
        ways=(way("1", 0.0, 10.0), way("2", 3.5, -8.0, begin=1.0), way("3", 7.0, 0.0, kind=Kind.LORRY)),
        lanes=borders if lanes else (),
        seconds=4.0,
        origin=np.zeros(2),
    )


def drive(*, start: float = 0.0, seconds: float = 3.0) -> RecordedTraffic:
    params = AerialTrafficParams()
    return RecordedTraffic(recording(), params, MODELS, start=start, seconds=seconds, seed=1, rate=30)


def test_vehicles_are_where_they_were_recorded_when_they_were():
    traffic = drive(start=0.5)
    bodies = traffic.vehicles()
    assert bodies.ids.tolist() == [FIRST_VEHICLE_ID, FIRST_VEHICLE_ID + 2]
    assert bodies.positions[0] == pytest.approx([5.0, 0.0, 0.0])
    assert bodies.velocities[0] == pytest.approx([10.0, 0.0, 0.0])
    for _ in range(30):
        traffic.step()
    bodies = traffic.vehicles()
    assert len(bodies.ids) == 3
    assert bodies.positions[1] == pytest.approx([-12.0, 3.5, 0.0])
    assert bodies.yaws[1] == pytest.approx(np.pi)
    for _ in range(200):
        traffic.step()
    assert traffic.vehicles().positions[0, 0] == pytest.approx(10.0 * (0.5 + 89 / 30))
    assert not traffic.collided


def test_models_fit_the_recorded_kinds_and_lengths():
    bodies = drive(start=1.5, seconds=1.0).vehicles()
    assert bodies.kinds.tolist() == [Kind.CAR, Kind.CAR, Kind.LORRY]
    assert bodies.sizes[:, :2] == pytest.approx(np.array([[4.5, 1.8], [4.5, 1.8], [12.0, 2.5]]))
    assert [MODELS[k].kind for k in bodies.models] == bodies.kinds.tolist()


def test_a_run_that_is_longer_than_the_recording_is_refused():
    with pytest.raises(RecordingError, match=r"ends after 4\.00 s"):
        drive(start=2.0, seconds=3.0)


def test_asphalt_lies_below_the_lanes_and_is_led_on_where_the_map_ends():
    strips = surroundings(recording(lanes=True)).strips
    assert len(strips) == 2 + 4
    assert strips[0].paved == pytest.approx((-1.75, 1.75))
    assert min(strip.line[:, 0].min() for strip in strips) == pytest.approx(-LEAD_ON, abs=4.0)
    assert max(strip.line[:, 0].max() for strip in strips) == pytest.approx(60.0 + LEAD_ON, abs=4.0)


def test_without_lanes_asphalt_lies_where_was_driven():
    strips = surroundings(recording()).strips
    assert len(strips) == 2  # the lorry stood still
    assert {round(float(strip.line[:, 1].mean()), 1) for strip in strips} == {0.0, 3.5}


def test_bridges_cross_the_traffic_in_its_middle():
    middle, heading = middle_and_heading(recording())
    assert abs(np.sin(heading)) < 1e-6  # both ways are one axis
    found = decks(AerialRoadParams(bridges=2, bridge_width=20.0), middle, heading, stream(1, "decks"))
    centre = np.mean([[bridge.x, bridge.y] for bridge in found], axis=0)
    assert centre == pytest.approx(middle)
    assert all(abs(np.cos(bridge.heading)) < 0.25 for bridge in found)
