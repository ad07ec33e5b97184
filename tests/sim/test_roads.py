import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.params import RoadParams
from sim.rng import stream
from sim.roads import LEAD_IN, build_road, from_plane, to_plane

STRAIGHT = build_road(RoadParams(), 1500.0, stream(0, "road"))
CURVED = [build_road(RoadParams(curved=True), 2500.0, stream(seed, "road")) for seed in range(6)]
ROADS = [STRAIGHT, *CURVED]


@pytest.mark.parametrize("road", ROADS)
def test_the_road_starts_at_the_origin_heading_east_and_is_long_enough(road):
    assert np.allclose(road.to_world(0.0, 0.0), 0.0, atol=1e-9)
    assert road.heading(0.0) == pytest.approx(0.0)
    assert road.pieces[0].start == -LEAD_IN
    assert road.length >= 1500.0
    assert np.abs(road.heading(np.arange(0, road.length, 5.0))).max() < np.pi / 2


@given(seed=st.integers(0, 5), part=st.floats(0, 1), d=st.floats(-15, 15))
def test_locate_inverts_to_world(seed, part, d):
    road = CURVED[seed]
    s = part * road.length
    s_back, d_back = road.locate(*road.to_world(s, d))
    assert s_back == pytest.approx(s, abs=1e-6)
    assert d_back == pytest.approx(d, abs=1e-6)


@pytest.mark.parametrize("road", CURVED)
def test_heading_and_curvature_are_derivatives_of_the_line(road):
    s = np.linspace(1, road.length - 1, 4001)
    x, y = road.to_world(s, 0.0)
    h = 1e-4
    xa, ya = road.to_world(s - h, 0.0)
    xb, yb = road.to_world(s + h, 0.0)
    assert np.allclose(np.hypot(xb - xa, yb - ya) / (2 * h), 1.0, atol=1e-6)
    assert np.allclose(np.arctan2(yb - ya, xb - xa), road.heading(s), atol=1e-5)
    xl, yl = road.to_world(s, 1.0)
    normal = np.stack([-np.sin(road.heading(s)), np.cos(road.heading(s))])
    assert np.allclose([xl - x, yl - y], normal)  # d counts to the left
    turning = (road.heading(s + h) - road.heading(s - h)) / (2 * h)
    inside = road.curvature(s - h) == road.curvature(s + h)
    assert np.allclose(turning[inside], road.curvature(s)[inside], atol=1e-6)
    radii = 1 / np.abs(road.curvature(s)[road.curvature(s) != 0])
    assert radii.min() >= 150 - 1e-6
    assert radii.max() <= 500 + 1e-6


@pytest.mark.parametrize("road", ROADS)
def test_lanes_lie_where_the_reference_line_says(road):
    for k, piece in enumerate(road.pieces):
        for same_way in (True, False):
            ends = (f"f{k}", f"f{k + 1}") if same_way else (f"b{k + 1}", f"b{k}")
            for number, d in enumerate(road.lane_offsets(same_way)):
                lane = road.network.get_lane((*ends, number))
                for part in (0.0, 0.3, 1.0):
                    along = part * lane.length
                    x, y, yaw = from_plane(lane.position(along, 0.0), lane.heading_at(along))
                    s = piece.start + (part if same_way else 1 - part) * piece.length
                    assert np.allclose([x, y], road.to_world(s, d), atol=1e-6)
                    heading = road.heading(min(s, piece.end - 1e-9)) + (0 if same_way else np.pi)
                    assert np.cos(yaw - heading) == pytest.approx(1.0, abs=1e-9)
                if piece.curvature:
                    assert lane.length < lane.radius * np.pi / 2  # beyond half a turn its projection wraps


@pytest.mark.parametrize("road", ROADS)
def test_traffic_keeps_right(road):
    assert np.all(road.lane_offsets(same_way=True) < 0)
    assert np.all(road.lane_offsets(same_way=False) > 0)
    assert np.all(np.diff(road.lane_offsets(same_way=True)) < 0)  # from the left, as its drivers see it
    low, high = road.paved
    assert low < road.lane_offsets(same_way=True).min() - 1.8
    assert high > road.lane_offsets(same_way=False).max() + 1.8


def test_the_plane_is_mirrored_in_one_place():
    assert from_plane(to_plane(3.0, 4.0), -0.5) == (3.0, 4.0, 0.5)


def test_lines_of_a_two_way_road():
    d, styles = STRAIGHT.painted_lines()
    assert np.allclose(d, [7.7, 4.1, 0.5, -0.5, -4.1, -7.7])
    assert styles.tolist() == [1, 2, 3, 3, 2, 1]
    narrow = build_road(RoadParams(lanes=1, oncoming_lanes=1, median=0.0), 100.0, stream(0, "road"))
    assert [a.tolist() for a in narrow.painted_lines()] == [[3.6, 0.0, -3.6], [1, 4, 1]]
    one_way = build_road(RoadParams(lanes=1, oncoming_lanes=0), 100.0, stream(0, "road"))
    assert one_way.painted_lines()[1].tolist() == [3, 1]
    assert one_way.lane_offsets(same_way=False).size == 0


@pytest.mark.parametrize("road", ROADS)
def test_the_ground_is_accurate_and_never_folds(road):
    ground = road.ground()
    corners = ground.vertices[ground.faces].astype(float)
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    assert np.all(area > 0)  # counter-clockwise from above, none turned over
    band = ground.faces[:-2]
    middle_s, middle_d = ground.coordinates[band].astype(float).mean(axis=1).T
    x, y = ground.vertices[band].astype(float).mean(axis=1)[:, :2].T
    s, d = road.locate(x, y)
    near = (np.abs(middle_d) < 12) & (middle_s > -300) & (middle_s < road.length - 5)
    assert np.abs(d - middle_d)[near].max() < 0.03
    assert np.abs(s - middle_s)[near].max() < 0.15
    owned = (middle_s > -300) & (middle_s < road.length - 5)
    assert np.abs(s - middle_s)[owned].max() < 25.0  # no land lies on another stretch of road
    assert len(ground.faces) < 16 * (len(np.unique(ground.coordinates[:-4, 0])) - 1) + 3


def test_the_horizon_is_closed():
    ground = STRAIGHT.ground()
    assert ground.vertices[:, 0].max() > STRAIGHT.length + 1400
    assert ground.vertices[:, 1].max() > 1400
    assert ground.vertices[-4:, 2].max() < 0
    assert np.abs(ground.coordinates[-4:, 1]).min() > 100


def test_impossible_roads_are_errors():
    with pytest.raises(ValueError, match="more than 0 m"):
        build_road(RoadParams(), 0.0, stream(0, "road"))
    for radii in ({"min_radius": 10.0}, {"min_radius": 300.0, "max_radius": 200.0}):
        with pytest.raises(ValueError, match="min_radius"):
            build_road(RoadParams(curved=True, **radii), 500.0, stream(0, "road"))


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), low=st.floats(60, 300), ratio=st.floats(1, 4))
def test_any_seed_makes_a_road(seed, low, ratio):
    params = RoadParams(curved=True, min_radius=low, max_radius=low * ratio)
    road = build_road(params, 1200.0, stream(seed, "road"))
    assert all(piece.length > 0 for piece in road.pieces)
    assert all(abs(piece.curvature) * piece.length < np.pi / 2 for piece in road.pieces)
