"""The land around the roads: its parcels, what stands on them, and its picture."""

from __future__ import annotations

import numpy as np
import pytest

from sim import meshes
from sim.aerial.land import Land
from sim.aerial.networks import along_road, lay_road
from sim.aerial.parcels import Free, Parcel, Use, divide
from sim.aerial.photo import car_rows, photograph
from sim.params import AerialRoadParams, AerialSceneryParams
from sim.rng import stream
from sim.world import FIRST_SCENERY_ID, Kind

AREA = (-80.0, -60.0, 120.0, 90.0)
MODELS = meshes.catalogue()


def road(seed: int = 1):
    return along_road(lay_road(AerialRoadParams(lanes=2), 300.0, stream(seed, "road")), 20.0, 20.0)


@pytest.mark.parametrize("setting", ["open", "suburb", "town"])
def test_parcels_tile_the_land(setting):
    parcels = divide(AREA, setting, 0.3, stream(2, "parcels"))
    points = stream(3, "points").uniform(AREA[:2], AREA[2:], (400, 2))
    held = np.zeros(len(points), int)
    for parcel in parcels:
        apart = points - [parcel.x, parcel.y]
        cos, sin = np.cos(parcel.heading), np.sin(parcel.heading)
        along, across = apart @ [cos, sin], apart @ [-sin, cos]
        held += (np.abs(along) <= parcel.length / 2) & (np.abs(across) <= parcel.width / 2)
    assert (held == 1).mean() > 0.995
    assert any(parcel.use is Use.STREET for parcel in parcels) == (setting != "open")


def test_corners_and_insets_of_a_parcel():
    parcel = Parcel(Use.YARD, 10.0, 20.0, np.pi / 2, 8.0, 4.0, (0.0,) * 6)
    assert parcel.at(4.0, 0.0) == pytest.approx((10.0, 24.0))
    assert parcel.corners()[0] == pytest.approx([12.0, 16.0])
    assert parcel.corners(1.0)[0] == pytest.approx([11.0, 17.0])


def test_room_is_the_distance_from_the_asphalt():
    (strip,) = road().strips
    free = Free([strip])
    middle = len(strip.line) // 2
    for away in (0.5, 3.0, 20.0):
        x, y = strip.beside(strip.paved[1] + away)[middle]
        assert free.room(x, y) == pytest.approx(away, abs=0.25)
    assert free.room(*strip.line[middle]) < 0.0
    assert free.room(1e4, 1e4) == 80.0


def standing(setting: str, **options: float):
    params = AerialSceneryParams(setting=setting, **options)
    network = road()
    free = Free(network.strips)
    land = Land(MODELS, params, AREA, free, 4)
    land.furnish(divide(AREA, setting, 0.0, stream(2, "parcels")))
    land.line(network.strips)
    return land.bodies(), free


@pytest.mark.parametrize("setting", ["open", "suburb", "town"])
def test_what_stands_on_the_land_is_numbered_inside_it_and_off_the_road(setting):
    bodies, free = standing(setting)
    assert (bodies.ids == FIRST_SCENERY_ID + np.arange(len(bodies.ids))).all()
    places = bodies.positions[:, :2]
    assert (places > AREA[:2]).all()
    assert (places < AREA[2:]).all()
    room = np.array([free.room(*place) for place in places.tolist()])
    assert room.min() > 0.0
    buildings = bodies.kinds == Kind.BUILDING
    reach = np.hypot(*bodies.sizes[buildings, :2].T) / 2
    assert (room[buildings] > 0.9 * reach).all()
    assert buildings.any() == (setting != "open")


def test_trees_and_buildings_can_be_left_out():
    bare, _ = standing("suburb", trees=0.0, buildings=0.0, overhang=0.0)
    full, _ = standing("suburb")
    assert not (bare.kinds == Kind.BUILDING).any()
    assert (bare.kinds == Kind.TREE).sum() < 0.3 * (full.kinds == Kind.TREE).sum()


def test_overhanging_crowns_reach_over_the_asphalt():
    with_crowns, free = standing("open", overhang=40.0)
    without, _ = standing("open", overhang=0.0)

    def over(bodies):
        trees = np.flatnonzero(bodies.kinds == Kind.TREE)
        room = np.array([free.room(*bodies.positions[k, :2].tolist()) for k in trees])
        return int((room < bodies.sizes[trees, :2].max(1) / 2 - 1.0).sum())

    assert over(with_crowns) > over(without) + 5


def test_the_photo_shows_the_road_where_it_is():
    network = road()
    (strip,) = network.strips
    parcels = divide(AREA, "open", 0.0, stream(2, "parcels"))
    photo = photograph(AREA, parcels, (network,), kerbs=False, rng=stream(5, "photo"))
    inside = [k for k, p in enumerate(strip.line) if AREA[0] + 5 < p[0] < AREA[2] - 5]
    away = strip.paved[1] + 12.0

    def colours(d: float) -> np.ndarray:
        places = ((strip.beside(d)[inside] - photo.low) / photo.texel).astype(int)
        return photo.image[places[:, 1], places[:, 0]].astype(float)

    asphalt, land = colours(0.5 * strip.paved[1] + 0.4), colours(away)
    # Asphalt is grey, the land is not.
    assert np.ptp(np.median(asphalt, axis=0)) < 14
    assert np.ptp(np.median(land, axis=0)) > 20
    assert photo.extent == pytest.approx((200.0, 150.0), abs=photo.texel)
    again = photograph(AREA, parcels, (network,), kerbs=False, rng=stream(5, "photo"))
    assert (again.image == photo.image).all()


def test_rows_of_parked_cars_lie_within_their_yard():
    for width in (20.0, 36.0, 60.0):
        parcel = Parcel(Use.YARD, 0.0, 0.0, 0.0, 40.0, width, (0.5,) * 6)
        rows = car_rows(parcel)
        assert all(abs(row) < width / 2 for row in rows)
