"""Frame truth against hand-made scenes and a naive oracle."""

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sim.camera import Camera, Pose
from sim.render.types import Picture, Plots, Silhouettes
from sim.truth.boxes import frame_truth, visible_parts
from sim.truth.types import FrameTruth
from sim.world import Bodies, Ego, Kind, Role, WorldState

CAMERA = Camera(width=64, height=48, focal=80.0, cx=32.0, cy=24.0)
POSE = Pose.looking((0, 0, 1.2), yaw=0.0)
FIRST = 1 << 20


def vehicles(
    ids: list[int], positions: list[tuple[float, float, float]], *, yaw: float = 0.0, speed: float = 0.0
) -> Bodies:
    n = len(ids)
    return Bodies(
        ids=np.array(ids, np.uint32),
        kinds=np.full(n, Kind.CAR, np.uint8),
        roles=np.full(n, Role.SAME_WAY, np.uint8),
        models=np.zeros(n, np.int32),
        positions=np.array(positions, float).reshape(n, 3),
        yaws=np.full(n, yaw),
        velocities=np.tile([speed, 0.0, 0.0], (n, 1)),
        sizes=np.tile([4.0, 1.8, 1.5], (n, 1)),
        colours=np.ones((n, 3), np.float32),
        lamps=np.zeros(n, np.uint8),
        leans=np.zeros((n, 2)),
    )


def state_of(bodies: Bodies, *, speed: float = 20.0, yaw: float = 0.0) -> WorldState:
    ego = Ego(position=np.zeros(3), yaw=yaw, speed=speed, yaw_rate=0.0, pitch=0.0, heave=0.0)
    return WorldState(tick=7, rate=30, vehicles=bodies, ego=ego)


def picture_of(ids: np.ndarray) -> Picture:
    return Picture(
        colour=np.zeros((*ids.shape, 3), np.uint8),
        ids=ids.astype(np.uint32),
        depth=np.ones(ids.shape, np.float32),
    )


def silhouettes_of(alone: dict[int, np.ndarray], extra: dict[int, int] | None = None) -> Silhouettes:
    """Silhouettes of in-frame masks; ``extra`` adds pixels to the right of the frame, in one row."""
    extra = extra or {}
    boxes, parts = [], []
    for number, mask in alone.items():
        rows, columns = np.nonzero(mask)
        if len(rows) == 0:
            boxes.append([np.nan] * 4)
            parts.append(np.zeros((0, 0), bool))
            continue
        y0, y1, x0, x1 = rows.min(), rows.max() + 1, columns.min(), columns.max() + 1
        boxes.append([x0, y0, x1 + extra.get(number, 0), y1])
        parts.append(mask[y0:y1, x0:x1])
    pixels = np.array([int(mask.sum()) for mask in alone.values()], np.int64)
    held = np.array(boxes, float).reshape(-1, 4)
    inside = held - np.array([[0, 0, extra.get(number, 0), 0] for number in alone]).reshape(-1, 4)
    sizes = np.array([part.size for part in parts], int)
    return Silhouettes(
        ids=np.array(list(alone), np.uint32),
        pixels=pixels,
        pixels_full=pixels + np.array([extra.get(number, 0) for number in alone], np.int64),
        boxes=held,
        plots=Plots(
            np.nan_to_num(inside).astype(np.int32),
            (np.cumsum(sizes) - sizes).astype(np.int32),
            np.concatenate([np.zeros(0), *(part.ravel() for part in parts)]).astype(np.uint32),
        ),
    )


def block(y0: int, y1: int, x0: int, x1: int) -> np.ndarray:
    mask = np.zeros((CAMERA.height, CAMERA.width), bool)
    mask[y0:y1, x0:x1] = True
    return mask


def paint(*layers: tuple[int, np.ndarray]) -> np.ndarray:
    ids = np.zeros((CAMERA.height, CAMERA.width), np.uint32)
    ids[24:] = 1
    for number, mask in layers:
        ids[mask] = number
    return ids


def truth_of(bodies: Bodies, ids: np.ndarray, silhouettes: Silhouettes) -> FrameTruth:
    return frame_truth(state_of(bodies), picture_of(ids), silhouettes, CAMERA, POSE)


def test_a_half_hidden_car_and_its_occluders() -> None:
    far, near, tree = FIRST + 5, FIRST + 2, 9
    alone = {far: block(10, 20, 10, 30), near: block(12, 22, 20, 30)}
    ids = paint((far, alone[far]), (near, alone[near]), (tree, block(0, 20, 10, 12)))
    bodies = vehicles([near, 77 + FIRST, far], [(20, 0, 0), (9, 9, 0), (40, 1, 0)])
    truth = truth_of(bodies, ids, silhouettes_of(alone))
    assert truth.ids.tolist() == [far, near]
    assert truth.tick == 7
    assert truth.amodal_px.tolist() == [200, 100]
    assert truth.visible_px.tolist() == [200 - 80 - 20, 100]
    assert truth.occluder_ids.tolist() == [near, 0]
    assert truth.box_visible[0].tolist() == [12, 10, 30, 20]
    assert truth.box_amodal[0].tolist() == [10, 10, 30, 20]
    assert truth.visible.tolist() == [0.5, 1.0]


def test_the_occluder_is_the_largest_contributor_not_the_nearest() -> None:
    car, left, right = FIRST, 30, 20
    alone = {car: block(10, 20, 10, 30)}
    ids = paint((car, alone[car]), (left, block(0, 48, 10, 15)), (right, block(0, 48, 26, 30)))
    truth = truth_of(vehicles([car], [(20, 0, 0)]), ids, silhouettes_of(alone))
    assert truth.occluder_ids.tolist() == [left]


def test_many_small_occluders() -> None:
    car = FIRST
    alone = {car: block(10, 30, 10, 50)}
    ids = paint((car, alone[car]))
    for k in range(40):
        ids[10:20, 10 + k] = 100 + k
    ids[25, 49] = 139
    truth = truth_of(vehicles([car], [(20, 0, 0)]), ids, silhouettes_of(alone))
    assert truth.occluder_ids.tolist() == [139]


def test_wholly_hidden_and_out_of_frame() -> None:
    hidden, outside, partly = FIRST, FIRST + 1, FIRST + 2
    alone = {hidden: block(10, 20, 10, 20), outside: block(0, 0, 0, 0), partly: block(30, 40, 60, 64)}
    ids = paint((3, block(0, 48, 5, 25)), (partly, alone[partly]))
    silhouettes = silhouettes_of(alone, extra={partly: 60, outside: 10})
    truth = truth_of(
        vehicles([hidden, outside, partly], [(20, 0, 0), (5, 40, 0), (5, -3, 0)]), ids, silhouettes
    )
    assert truth.visible_px.tolist() == [0, 0, 40]
    assert np.isnan(truth.box_visible[:2]).all()
    assert np.isnan(truth.box_amodal[1]).all()
    assert truth.occluder_ids.tolist() == [3, 0, 0]
    assert truth.visibility_in_frame.tolist() == [0.0, 0.0, 1.0]
    assert truth.in_frame.tolist() == [1.0, 0.0, 0.4]
    assert truth.box_amodal[2, 2] == 124


def test_camera_coordinates_and_relative_velocity() -> None:
    body = vehicles([FIRST], [(30, 2, 0)], speed=25.0)
    silhouettes = silhouettes_of({FIRST: block(1, 2, 1, 2)})
    truth = truth_of(body, paint((FIRST, block(1, 2, 1, 2))), silhouettes)
    np.testing.assert_allclose(truth.positions, [[-2.0, 1.2 - 0.75, 30.0]], atol=1e-12)
    np.testing.assert_allclose(truth.velocities, [[0.0, 0.0, 5.0]], atol=1e-12)
    np.testing.assert_allclose(truth.distances, [28.0])


def test_distance_of_a_turned_car_under_a_turned_camera() -> None:
    body = vehicles([FIRST], [(0, 30, 0)], yaw=0.3)
    pose = Pose.looking((0, 0, 1.2), yaw=np.pi / 2)
    silhouettes = silhouettes_of({FIRST: block(1, 2, 1, 2)})
    state = state_of(body, speed=10.0, yaw=np.pi / 2)
    truth = frame_truth(state, picture_of(paint()), silhouettes, CAMERA, pose)
    # Along +y the near corner reaches back by l/2 sin(yaw) + w/2 cos(yaw).
    np.testing.assert_allclose(truth.distances, [30 - 2.0 * np.sin(0.3) - 0.9 * np.cos(0.3)])
    np.testing.assert_allclose(truth.velocities, [[0.0, 0.0, -10.0]], atol=1e-12)


def test_nothing_in_view() -> None:
    truth = truth_of(vehicles([FIRST], [(-20, 0, 0)]), paint(), silhouettes_of({}))
    assert len(truth) == 0
    assert truth.box_visible.shape == truth.box_amodal.shape == (0, 4)


def test_a_silhouette_of_nobody_is_an_error() -> None:
    with pytest.raises(ValueError, match="no vehicles"):
        truth_of(vehicles([FIRST], [(20, 0, 0)]), paint(), silhouettes_of({FIRST + 1: block(1, 2, 1, 2)}))
    with pytest.raises(ValueError, match="id map"):
        truth_of(vehicles([], []), np.zeros((3, 3)), silhouettes_of({}))


@given(
    hnp.arrays(np.uint32, hnp.array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.integers(0, 6)),
    st.lists(st.integers(0, 7), unique=True),
)
def test_visible_parts_against_a_naive_oracle(ids: np.ndarray, wanted: list[int]) -> None:
    counts, boxes = visible_parts(ids, np.array(wanted, np.uint32))
    for k, number in enumerate(wanted):
        rows, columns = np.nonzero(ids == number)
        assert counts[k] == len(rows)
        if len(rows):
            assert boxes[k].tolist() == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        else:
            assert np.isnan(boxes[k]).all()


masks = hnp.arrays(bool, (CAMERA.height // 8, CAMERA.width // 8))


@given(st.lists(masks, min_size=1, max_size=5), masks)
def test_truth_of_painted_layers_against_a_naive_oracle(layers: list[np.ndarray], tree: np.ndarray) -> None:
    """Objects painted from back to front: everything can be counted by hand."""
    alone = {FIRST + k: np.kron(layer, np.ones((8, 8), bool)) for k, layer in enumerate(layers)}
    ids = paint(*alone.items(), (4, np.kron(tree, np.ones((8, 8), bool))))
    bodies = vehicles(list(alone), [(20 + k, 0, 0) for k in range(len(alone))])
    truth = truth_of(bodies, ids, silhouettes_of(alone))
    for k, (number, mask) in enumerate(alone.items()):
        assert truth.visible_px[k] == (ids == number).sum()
        others = ids[mask]
        others = others[others != number]
        values, counts = np.unique(others, return_counts=True)
        assert truth.occluder_ids[k] == (values[counts.argmax()] if len(values) else 0)


def test_it_takes_less_than_a_millisecond() -> None:
    rng = np.random.default_rng(0)
    ids = np.ones((480, 640), np.uint32)
    numbers = np.arange(FIRST, FIRST + 30, dtype=np.uint32)
    for number in numbers:
        y, x = rng.integers(0, 400), rng.integers(0, 560)
        ids[y : y + 60, x : x + 80] = number
    ids[rng.random(ids.shape) < 0.02] = 9  # foliage
    visible_parts(ids, numbers)
    best = min(_seconds(ids, numbers) for _ in range(20))
    assert best < 3e-3  # well under 1 ms alone; the machine may be busy


def _seconds(ids: np.ndarray, numbers: np.ndarray) -> float:
    start = time.perf_counter()
    visible_parts(ids, numbers)
    return time.perf_counter() - start
