"""Paper 1's rules on drawn frames: boards at the roadside and a car ahead."""

import cv2
import numpy as np
import pytest

from tracker.base import Diagnosable, Tracker
from tracker.in_car.paper import (
    MINIMUM_DURATION,
    AccumulatingTracker,
    PaperTracker,
    PerFrameTracker,
    StickyTracker,
)
from tracker.types import Frame, Info, Intrinsics, Label

FOCAL, WIDTH, HEIGHT, RATE, SPEED = 800.0, 640, 480, 30, 20.0
INFO = Info(
    width=WIDTH, height=HEIGHT, rate=RATE, intrinsics=Intrinsics(focal=FOCAL, cx=WIDTH / 2, cy=HEIGHT / 2)
)
CAR_X = 2.0 * FOCAL / 22


def board(image, X, Z, width, top, bottom, shades):
    """Draw a board with horizontal stripes, at Y from ``top`` to ``bottom`` metres below the camera."""
    edges = np.linspace(top, bottom, len(shades) + 1)
    for shade, above, below in zip(shades, edges[:-1], edges[1:], strict=True):
        corners = [(X - width / 2, above), (X + width / 2, below)]
        (x0, y0), (x1, y1) = ((WIDTH / 2 + FOCAL * a / Z, HEIGHT / 2 + FOCAL * b / Z) for a, b in corners)
        cv2.rectangle(
            image, (round(x0 * 16), round(y0 * 16)), (round(x1 * 16), round(y1 * 16)), shade, -1, 16, 4
        )


def drive(frames, seed=1):
    """Yield frames: a car that keeps its place ahead, boards that come nearer at 20 m/s."""
    rng = np.random.default_rng(seed)
    boards = [
        (side * rng.uniform(6, 9), 30 + 14 * i + rng.uniform(0, 6)) for i, side in enumerate((-1, 1) * 6)
    ]
    for tick in range(frames):
        image = np.full((HEIGHT, WIDTH, 3), 150, np.uint8)
        image[HEIGHT // 2 :] = 110
        for X, Z0 in sorted(boards, key=lambda b: -b[1]):
            Z = Z0 - SPEED * tick / RATE
            if Z > 4:
                board(image, X, Z, 1.6, -0.8, 0.6, [(230,) * 3, (40,) * 3, (230,) * 3])
        Z = 22 + 0.8 * np.sin(tick / 40)
        board(image, 2.0, Z, 1.8, -0.25, 1.2, [(30,) * 3, (190, 40, 40), (120, 20, 20), (25,) * 3])
        noisy = image + rng.normal(0, 1.5, image.shape)
        yield Frame(image=noisy.clip(0, 255).astype(np.uint8), tick=tick, time=tick / RATE)


def run(tracker, frames):
    tracker.start(INFO)
    result = []
    for frame in frames:
        assert len(tracker.step(frame)) == 0
        result.append(tracker.diagnostics.traces)
    return result


@pytest.fixture(scope="module")
def frames():
    return list(drive(90))


def final_labels(results, which, least=MINIMUM_DURATION):
    """Return the last label of each trace that lasted, of those whose mean x satisfies ``which``."""
    places, labels = {}, {}
    for traces in results:
        for trace, x, label in zip(traces.ids, traces.x, traces.labels, strict=True):
            places.setdefault(trace, []).append(x)
            labels[trace] = label
    return [
        labels[i] for i, x in places.items() if len(x) > least * RATE + 5 and which(np.array(x) - WIDTH / 2)
    ]


def on_car(x):
    return np.all(np.abs(x - CAR_X) < 45) and np.ptp(x) < 12


def on_board(x):
    return np.ptp(x) > 40


@pytest.mark.parametrize("kind", [PaperTracker, StickyTracker, AccumulatingTracker])
def test_cars_and_boards_are_labelled(kind, frames):
    results = run(kind(), frames)
    cars, boards = final_labels(results, on_car), final_labels(results, on_board)
    assert len(cars) >= 1
    assert len(boards) >= 3
    assert np.mean(np.array(cars) == Label.CAR) > 0.9
    assert np.mean(np.array(boards) == Label.BACKGROUND) > 0.7


def test_no_label_before_the_minimum_duration(frames):
    first = {}
    for tick, traces in enumerate(run(PaperTracker(), frames)):
        for trace, label in zip(traces.ids, traces.labels, strict=True):
            first.setdefault(trace, tick)
            if label != Label.UNDECIDED:
                # A trace is shown from its fourth centre on.
                assert tick - first[trace] >= MINIMUM_DURATION * RATE - 8


def test_per_frame_has_no_memory(frames):
    per_frame, late = PerFrameTracker(), PerFrameTracker()
    results = run(per_frame, frames)
    assert all(np.all(traces.labels != Label.UNDECIDED) for traces in results)
    cars = final_labels(results, on_car)
    assert np.mean(np.array(cars) == Label.CAR) > 0.5
    # What came long before does not matter but for the slopes' twelve frames.
    shifted = run(late, frames[40:])[-1]
    last = results[-1]
    assert np.allclose(sorted(last.x), sorted(shifted.x), atol=0.6)
    np.testing.assert_allclose(sorted(last.p_car), sorted(shifted.p_car), atol=0.1)


def test_memory_changes_its_mind_less_often(frames):
    """Methods.md 1.6: without memory labels flicker."""

    def changes(kind):
        last, count = {}, 0
        for traces in run(kind(), frames):
            for trace, label in zip(traces.ids, traces.labels, strict=True):
                count += last.get(trace, label) != label != Label.UNDECIDED != last.get(trace)
                last[trace] = label
        return count

    per_frame, paper, accumulating = map(changes, (PerFrameTracker, PaperTracker, AccumulatingTracker))
    assert accumulating <= paper < per_frame


@pytest.mark.parametrize("kind", [PaperTracker, PerFrameTracker, StickyTracker, AccumulatingTracker])
def test_contract(kind, frames):
    tracker = kind()
    assert isinstance(tracker, Tracker)
    assert isinstance(tracker, Diagnosable)
    assert not kind.has_boxes
    with pytest.raises(RuntimeError, match="start"):
        tracker.step(frames[0])
    first, again = run(tracker, frames[:30]), run(tracker, frames[:30])
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.ids, b.ids)
        np.testing.assert_array_equal(a.p_car, b.p_car)
        assert len(a.ids) == len(set(a.ids.tolist()))
        assert set(a.point_traces.tolist()) <= set(a.ids.tolist())
        assert np.all((a.p_car >= 0) & (a.p_car <= 1))
