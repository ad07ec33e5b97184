"""Scores by stratum, under either convention, and what covariances say."""

from dataclasses import replace

import numpy as np
import pytest

from scenarios.score.consistency import WITHIN, consistency, normalised
from scenarios.score.params import ScoringParams
from scenarios.score.statistics import over_seeds
from scenarios.score.strata import EDGES, apparent_speeds, strata
from scenarios.score.summary import details
from tests.scenarios.score.episodes import CAR, NOTHING_SHOWN, Car, episode, frame_truth, tracks

PARAMS = ScoringParams()
NEAR, FAR = (100, 100, 140, 130), (300, 100, 340, 130)
OTHER = (100, 200, 140, 230)


def test_each_box_counts_in_the_stratum_that_it_lies_in():
    cars = [
        [Car(id=CAR, box=NEAR, distance=5.0), Car(id=CAR + 1, box=FAR, distance=50.0, visible=0.6)],
        [Car(id=CAR, box=NEAR, distance=10.0), Car(id=CAR + 1, box=FAR, distance=50.0, visible=0.5)],
        [Car(id=CAR, box=NEAR, distance=10.0), Car(id=CAR + 1, box=FAR, distance=50.0, visible=1.0)],
    ]
    found = strata(episode(cars, [tracks((1, NEAR)), tracks((2, NEAR)), tracks((2, FAR))]), params=PARAMS)
    hit = {"boxes": 1, "recall": 1.0, "iou": 1.0, "id_switches": 0}
    assert found["distance_m"] == {
        "0 to 10": hit,
        "10 to 20": {"boxes": 2, "recall": 0.5, "iou": 1.0, "id_switches": 1},
        "40 to 80": {"boxes": 3, "recall": pytest.approx(1 / 3), "iou": 1.0, "id_switches": 0},
    }
    assert {name: row["boxes"] for name, row in found["visible"].items()} == {"0.5 to 0.7": 2, "0.9 to 1": 4}
    assert {name: row["boxes"] for name, row in found["speed_px_s"].items()} == {"0 to 5": 4}
    joined = over_seeds([found, found])
    assert joined["distance_m"]["10 to 20"]["boxes"] == 4
    assert joined["distance_m"]["10 to 20"]["recall"]["mean"] == 0.5


def test_all_boxes_fall_into_strata_once():
    rng = np.random.default_rng(1)
    cars = [
        [
            Car(
                id=CAR + k,
                box=(x, 100, x + 40, 130),
                distance=rng.uniform(0, 60),
                visible=rng.uniform(0.3, 1),
            )
            for k, x in enumerate(rng.uniform(0, 500, 4))
        ]
        for _ in range(20)
    ]
    found = strata(episode(cars, [tracks()] * 20), params=PARAMS)
    counts = {quantity: sum(row["boxes"] for row in rows.values()) for quantity, rows in found.items()}
    assert counts["visible"] == counts["distance_m"] == counts["speed_px_s"] + 4 > 70
    assert all(
        row["recall"] == 0.0 and row["iou"] is None for rows in found.values() for row in rows.values()
    )
    assert set(found) == set(EDGES)


def test_apparent_speed_is_that_of_the_boxs_middle():
    frames = tuple(
        frame_truth(k, [Car(id=CAR + k // 2, box=(3 * k, 4 * k, 3 * k + 10, 4 * k + 10))]) for k in range(4)
    )
    found = np.concatenate(apparent_speeds(frames, 10))
    np.testing.assert_allclose(found, [np.nan, 50, np.nan, 50])


def test_either_convention_is_scored():
    cars = [[Car(id=CAR, box=NEAR)]] * 3
    log = episode(cars, [tracks((1, (100, 100, 120, 130)))] * 3)
    half = [replace(frame, box_visible=np.array([[100.0, 100, 120, 130]])) for frame in log.truth]
    found = details(replace(log, truth=tuple(half)))["conventions"]
    assert found["visible"]["deta"] == 1.0
    assert found["amodal"]["deta"] == pytest.approx(10 / 19)
    assert found["visible"]["mota"] == found["amodal"]["mota"] == 1.0


@pytest.mark.parametrize(("factor", "nees"), [(1.0, 2.0), (4.0, 0.5), (0.25, 8.0)])
def test_covariances_that_are_right_give_two(factor, nees):
    rng = np.random.default_rng(2)
    root = rng.normal(size=(2, 2)) + 2 * np.eye(2)
    covariance = np.eye(4)
    covariance[:2, :2] = factor * root @ root.T
    shown = []
    for _ in range(4000):
        state = np.array([[120.0, 115.0, 0.0, 0.0]])
        state[0, :2] += root @ rng.normal(size=2)
        shown.append(replace(tracks((1, NEAR)), state=state, covariance=covariance[None]))
    found = consistency(episode([[Car(id=CAR, box=NEAR)]] * 4000, shown), params=PARAMS)
    assert found is not None
    assert found["nees"] == pytest.approx(nees, rel=0.06)
    assert found["errors"] == 4000
    if factor == 1.0:
        assert found["within_95"] == pytest.approx(0.95, abs=0.012)


def test_without_covariances_or_whole_vehicles_there_is_nothing_to_say():
    cars = [[Car(id=CAR, box=NEAR)]]
    assert consistency(episode(cars, [tracks((1, NEAR))]), params=PARAMS) is None
    known = replace(tracks((1, NEAR)), state=np.zeros((1, 4)), covariance=np.eye(4)[None])
    assert consistency(episode(cars, [known]), params=PARAMS) is not None
    cut = [[Car(id=CAR, box=NEAR, in_frame=0.9, visible=0.9)]]
    assert consistency(episode(cut, [known]), params=PARAMS) is None
    assert (
        consistency(episode(cars, [replace(known, boxes=np.array([[300.0, 1, 310, 9]]))]), params=PARAMS)
        is None
    )


def test_innovations_are_told_too():
    cars = [[Car(id=CAR, box=NEAR)]] * 2
    shown = replace(NOTHING_SHOWN, innovations=(np.array([1.0, 3.0]), np.array([8.0])))
    log = replace(episode(cars, [tracks((1, NEAR))] * 2), shown=shown)
    assert consistency(log, params=PARAMS) == {"nis": 4.0, "nis_within_95": 2 / 3, "innovations": 3}


def test_normalised_errors_are_those_of_the_inverse():
    rng = np.random.default_rng(3)
    roots, errors = rng.normal(size=(5, 2, 2)), rng.normal(size=(5, 2))
    covariances = roots @ roots.transpose(0, 2, 1) + np.eye(2)
    wanted = [e @ np.linalg.inv(p) @ e for e, p in zip(errors, covariances, strict=True)]
    np.testing.assert_allclose(normalised(errors, covariances), wanted)
    assert 5.99 < WITHIN < 6.0
