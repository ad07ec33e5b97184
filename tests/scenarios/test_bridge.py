import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios import bridge
from sim.world import FIRST_VEHICLE_ID
from tests.scenarios.fakes import CAMERA, CAR, observations, truth_of
from tracker.types import Traces

OTHER = CAR + 1


def naive_owner(x, y, ids, truth):
    """Scoring.md 7, word for word, one point at a time."""
    height, width = ids.shape
    x, y = min(max(x, 0.0), np.nextafter(width, 0)), min(max(y, 0.0), np.nextafter(height, 0))
    under = ids[int(y), int(x)]
    if under >= FIRST_VEHICLE_ID:
        return {int(under)}
    near = {}
    for row in range(height):
        for column in range(width):
            squared = (column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2
            if ids[row, column] >= FIRST_VEHICLE_ID and squared <= 9:
                near.setdefault(squared, set()).add(int(ids[row, column]))
    if near:
        return near[min(near)]
    boxed = {}
    for k in range(len(truth)):
        x0, y0, x1, y1 = truth.box_visible[k]
        if x0 <= x < x1 and y0 <= y < y1 + 0.1 * (y1 - y0):
            boxed.setdefault(truth.distances[k], set()).add(int(truth.ids[k]))
    return boxed[min(boxed)] if boxed else {int(under)}


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 3))
def test_point_owners_follow_the_definition(seed, vehicles):
    rng = np.random.default_rng(seed)
    ids = rng.integers(0, 3, (16, 20)).astype(np.uint32)
    boxes = np.full((vehicles, 4), np.nan)
    for k in range(vehicles):
        if rng.random() < 0.8:
            x0, y0 = rng.integers(0, 14), rng.integers(0, 12)
            x1, y1 = rng.integers(x0 + 1, 20), rng.integers(y0 + 1, 16)
            boxes[k] = x0, y0, x1, y1
            sparse = rng.random((16, 20)) < 0.15
            ids[y0:y1, x0:x1][sparse[y0:y1, x0:x1]] = FIRST_VEHICLE_ID + k
    truth = truth_of(FIRST_VEHICLE_ID + np.arange(vehicles), boxes, rng.permutation(vehicles) + 5.0)
    points = rng.uniform([-2, -2], [22, 18], (40, 2))
    owners = bridge.point_owners(points, ids, truth)
    for (x, y), owner in zip(points, owners, strict=True):
        assert int(owner) in naive_owner(x, y, ids, truth)


@pytest.mark.parametrize(
    ("point", "owner"),
    [
        ((10.5, 10.5), CAR),  # on it
        ((10.5, 22.4), CAR),  # 2.9 px below its last pixel's centre
        ((10.5, 22.9), 1),  # beyond 3 px, and below the stretched box
        ((2.0, 2.0), 0),
        ((31.5, 10.5), OTHER),  # within 3 px of its pixels, and in the box of none
        ((-5.0, 10.5), 1),  # outside counts as on the border
    ],
)
def test_who_owns_a_point(point, owner):
    ids = np.zeros((40, 60), np.uint32)
    ids[8:] = 1
    ids[5:20, 5:20] = CAR
    ids[5:20, 34:50] = OTHER
    truth = truth_of([CAR, OTHER], [[5, 5, 20, 20], [34, 5, 50, 20]], [10.0, 20.0])
    assert bridge.point_owners(np.array([point]), ids, truth)[0] == owner


def test_the_box_is_stretched_down_by_a_tenth_and_the_nearest_wins():
    ids = np.ones((100, 100), np.uint32)
    truth = truth_of([CAR, OTHER], [[10, 10, 60, 60], [10, 10, 60, 60]], [30.0, 20.0])
    points = np.array([[30.0, 64.9], [30.0, 65.0], [30.0, 9.9]])
    assert bridge.point_owners(points, ids, truth).tolist() == [OTHER, 1, 1]


def test_votes_count_points_by_trace_and_object():
    observation = next(observations(1))
    traces = Traces(
        ids=np.array([7, 9]),
        x=np.array([18.0, 2.0]),
        v=np.zeros(2),
        labels=np.zeros(2, np.uint8),
        p_car=np.zeros(2),
        owners=np.zeros(2, np.int64),
        points=np.array([[18.0, 25.0], [2.0, 40.0], [19.0, 26.0], [60.0, 2.0]]),
        point_traces=np.array([7, 9, 7, 7]),
    )
    votes = bridge.votes(traces, observation.ids, observation.depth, observation.truth)
    rows = list(zip(votes.ids.tolist(), votes.objects.tolist(), votes.counts.tolist(), strict=True))
    assert rows == [(7, 0, 1), (7, CAR, 2), (9, 1, 1)]


def test_no_points_no_votes():
    observation = next(observations(1))
    none = np.zeros(0, np.int64)
    traces = Traces(
        ids=none, x=np.zeros(0), v=np.zeros(0), labels=np.zeros(0, np.uint8), p_car=np.zeros(0), owners=none,
        points=np.zeros((0, 2)), point_traces=none,
    )  # fmt: skip
    assert len(bridge.votes(traces, observation.ids, observation.depth, observation.truth).ids) == 0


def test_the_tracker_is_told_the_camera_and_gets_odometry_only_on_request():
    info = bridge.tracker_info(CAMERA, 30)
    assert (info.width, info.height, info.rate) == (64, 48, 30)
    assert info.intrinsics is not None
    assert (info.intrinsics.focal, info.intrinsics.cx, info.intrinsics.cy) == (80.0, 32.0, 24.0)
    observation = next(observations(1))
    assert bridge.tracker_frame(observation, odometry=False).odometry is None
    measured = bridge.tracker_frame(observation, odometry=True).odometry
    assert measured is not None
    assert (measured.speed, measured.yaw_rate) == (20.5, 0.01)
