"""What is scored, what is ignored, and what is false."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.score.params import ScoringParams
from scenarios.score.preprocess import covered_area, kept_tracks, select
from scenarios.score.summary import box_scores
from sim.world import Role
from tests.scenarios.score.episodes import CAR, Car, episode, frame_truth, tracks
from tracker.types import Status, Tracks

PARAMS = ScoringParams()
BOX = (100, 100, 140, 130)


def fate(car: Car, params: ScoringParams = PARAMS) -> str:
    chosen = select(frame_truth(0, [car]), width=640, height=480, params=params)
    assert not (chosen.scored & chosen.ignored).any()
    return "scored" if chosen.scored[0] else "ignored" if chosen.ignored[0] else "background"


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        ({}, "scored"),
        ({"role": Role.ONCOMING}, "ignored"),
        ({"role": Role.CROSSING}, "ignored"),
        ({"role": Role.PARKED}, "background"),
        ({"distance": 60.0}, "scored"),
        ({"distance": 60.1}, "ignored"),
        ({"visible": 0.3}, "scored"),
        ({"visible": 0.29}, "ignored"),
        ({"visible": 0.0}, "ignored"),
        ({"box": (100, 100, 140, 112)}, "scored"),
        ({"box": (100, 100, 140, 111.9)}, "ignored"),
        ({"box": (100, 470, 140, 500)}, "ignored"),  # 10 px high once clipped to the frame
        ({"box": (-50, 100, -10, 130)}, "background"),  # no box in the frame at all
        ({"box": (np.nan,) * 4}, "background"),
    ],
)
def test_what_becomes_of_a_vehicle(change: dict, wanted: str) -> None:
    assert fate(replace(Car(id=CAR), **change)) == wanted


def test_thresholds_are_parameters() -> None:
    assert fate(Car(id=CAR, distance=70), ScoringParams(max_distance=80)) == "scored"
    assert fate(Car(id=CAR, visible=0.2), ScoringParams(min_visible=0.1)) == "scored"
    assert fate(Car(id=CAR), ScoringParams(min_height=31)) == "ignored"


def one(car: Car, *boxes: tuple[int, tuple[float, ...]], status: Status = Status.CONFIRMED, **kwargs) -> dict:
    others = [Car(id=CAR + 9, box=(500, 300, 560, 340))]
    found = [*boxes, (99, (500, 300, 560, 340))]
    shown = tracks(*found, status=status)
    return box_scores(episode([[car, *others]], [shown]), **kwargs)


def test_boxes_on_ignored_vehicles_cost_nothing_and_on_parked_ones_they_are_false() -> None:
    assert one(Car(id=CAR, role=Role.ONCOMING), (1, BOX))["precision"] == 1
    assert one(Car(id=CAR, distance=80), (1, BOX))["precision"] == 1
    assert one(Car(id=CAR, role=Role.PARKED), (1, BOX))["precision"] == 0.5
    assert one(Car(id=CAR, role=Role.ONCOMING), (1, (0, 0, 40, 40)))["precision"] == 0.5
    # A small box, by half its area inside the ignored one, has a low overlap and is dropped all the same.
    assert one(Car(id=CAR, role=Role.ONCOMING), (1, (130, 100, 150, 105)))["precision"] == 1
    assert one(Car(id=CAR, role=Role.ONCOMING), (1, (130, 100, 151, 105)))["precision"] == 0.5


def test_only_confirmed_tracks_are_scored() -> None:
    for status in (Status.TENTATIVE, Status.COASTING):
        scores = one(Car(id=CAR), (1, BOX), status=status)
        assert scores["recall"] == 0
        assert scores["precision"] is None


def test_a_box_that_is_matched_is_not_ignored() -> None:
    """A scored car stands in front of an ignored one of nearly the same box: one box is its match."""
    scored, ignored = np.array([[100.0, 100, 140, 130]]), np.array([[102.0, 100, 142, 130]])
    keep = kept_tracks(np.array([[102.0, 100, 142, 130]]), scored, ignored, PARAMS)
    assert keep.tolist() == [True]
    keep = kept_tracks(np.array([[102.0, 100, 142, 130], [100, 100, 140, 130]]), scored, ignored, PARAMS)
    assert keep.tolist() == [False, True]
    assert kept_tracks(np.zeros((0, 4)), scored, ignored, PARAMS).shape == (0,)


def test_two_ignored_vehicles_cover_a_box_together_and_nothing_is_counted_twice() -> None:
    box = np.array([[0.0, 0, 100, 20]])
    none = np.zeros((0, 4))
    side_by_side = np.array([[0.0, 0, 25, 20], [75, 0, 100, 20]])
    the_same_twice = np.array([[0.0, 0, 25, 20], [0, 0, 25, 20]])
    assert kept_tracks(box, none, side_by_side, PARAMS).tolist() == [False]
    assert kept_tracks(box, none, the_same_twice, PARAMS).tolist() == [True]


def test_boxes_are_compared_inside_the_frame() -> None:
    car = Car(id=CAR, box=(-60, 100, 20, 130), in_frame=0.5)
    scores = one(car, (1, (-5, 100, 20, 130)))
    assert scores["recall"] == scores["precision"] == 1
    assert scores["hota"] == pytest.approx(1)


def test_visible_boxes() -> None:
    car = Car(id=CAR)
    truth = frame_truth(0, [car])
    truth = replace(truth, box_visible=np.array([[100.0, 100, 110, 130]]))
    log = replace(episode([[car]], [tracks((1, (100, 100, 110, 130)))]), truth=(truth,))
    assert box_scores(log)["recall"] == 0
    assert box_scores(log, boxes="visible")["recall"] == 1


def test_perfect_and_missing() -> None:
    cars = [[Car(id=CAR), Car(id=CAR + 1, box=(200, 100, 260, 150))]] * 5
    found = [tracks((3, BOX), (8, (200, 100, 260, 150)))] * 5
    scores = box_scores(episode(cars, found))
    assert scores.pop("id_switches") == 0
    assert all(value == pytest.approx(1) for value in scores.values())
    assert all(value is None for value in box_scores(episode(cars, found, has_boxes=False)).values())
    nothing = box_scores(episode([[]] * 5, [Tracks.none()] * 5))
    assert all(value is None for value in nothing.values())
    false = box_scores(episode([[]] * 5, found))
    assert false.pop("precision") == 0
    assert all(value is None for value in false.values())
    missed = box_scores(episode(cars))
    assert missed["precision"] is None
    assert missed["hota"] == missed["recall"] == missed["mota"] == missed["idf1"] == 0


side = st.integers(0, 7)
whole_boxes = st.tuples(side, side, side, side).map(
    lambda b: [min(b[0], b[2]), min(b[1], b[3]), max(b[0], b[2]), max(b[1], b[3])]
)


@given(whole_boxes, st.lists(whole_boxes, max_size=5))
def test_covered_area_counts_cells(box: list[int], others: list[list[int]]) -> None:
    def cells(b: list[int]) -> set[tuple[int, int]]:
        return {(x, y) for x in range(b[0], b[2]) for y in range(b[1], b[3])}

    covered = cells(box) & set().union(*map(cells, others))
    assert covered_area(np.array(box, float), np.array(others, float).reshape(-1, 4)) == len(covered)
