"""The lane's scores, calculated by hand."""

from dataclasses import replace

import numpy as np
import pytest

from scenarios.score.foreground import flashes
from scenarios.score.lane import full_tracks, longest_gap, lost_riders
from scenarios.score.params import ScoringParams
from scenarios.score.summary import score
from scenarios.shown import NO_MASK, ShownLog
from sim.world import Role
from tests.scenarios.score.episodes import CAR, NOTHING_SHOWN, RATE, Car, episode, tracks

PARAMS = ScoringParams(training_frames=2)
BOX, AWAY = (100, 100, 140, 140), (200, 100, 240, 140)


def lane(cars, found=None, **more):
    return score(episode(cars, found, scene="motorcycle-lane", **more), params=PARAMS)


def rider(number=0, box=BOX, **more):
    return Car(id=CAR + number, box=box, **more)


def detected(frames):
    return replace(NOTHING_SHOWN, detections=tuple(np.array(boxes, float).reshape(-1, 4) for boxes in frames))


def test_what_was_never_shown_is_null():
    scores, difficulty = lane([[rider()]] * 20, [tracks((1, BOX))] * 20)
    assert set(scores["detection"].values()) == {None}
    assert scores["full_tracks"] == {"correct": 1, "total": 1, "lost": 0}
    assert scores["wrong_way"] == {"present": 0, "flagged": None, "false": None}
    assert scores["absorbed_s"] is None
    assert scores["recovery_s"] is None
    assert "identification" not in scores
    assert difficulty["riders_in_view"] == {"mean": 1.0, "most": 1.0}
    assert difficulty["partly_hidden"] == 0.0
    assert "traces" not in difficulty


def test_riders_behind_others_are_partly_hidden_and_those_at_the_border_are_not():
    behind = rider(1, AWAY, visible=0.6)
    cut_off = rider(2, (0, 100, 40, 140), visible=0.6, in_frame=0.6)
    difficulty = lane([[rider(), behind, cut_off]] * 12)[1]
    assert difficulty["riders_in_view"]["mean"] == 3.0
    assert difficulty["partly_hidden"] == pytest.approx(1 / 3)


def test_training_frames_are_not_scored():
    found = [tracks((9, AWAY))] * 2 + [tracks((1, BOX))] * 18
    scores, difficulty = lane([[rider()]] * 20, found)
    assert scores["idf1"] == scores["precision"] == scores["recall"] == 1.0
    assert difficulty["scored_boxes"] == 18


def test_a_blob_over_two_riders_is_one_hit_and_one_miss():
    # The blob holds both: IoU 40 / 90 with either one.
    left, right = rider(0, (100, 100, 140, 140)), rider(1, (150, 100, 190, 140))
    scores, _ = lane([[left, right]] * 12, shown=detected([[(100, 100, 190, 140)]] * 12))
    assert scores["detection"]["precision"] == 1.0
    assert scores["detection"]["recall"] == 0.5
    counts = {"riders": 20, "correct": 10, "false": 0, "missed": 10}
    assert scores["detection"].items() >= counts.items()


def test_detections_match_from_an_overlap_of_four_tenths():
    for width, hit in ((16, 1.0), (15, None)):  # IoU is width / 40
        shown = detected([[(100, 100, 100 + width, 140)]] * 12)
        recall = lane([[rider()]] * 12, shown=shown)[0]["detection"]["recall"]
        assert recall == (hit or 0.0)


def test_detections_on_ignored_riders_do_not_count():
    small, hidden = rider(1, (200, 100, 212, 113)), rider(2, (250, 100, 290, 140), visible=0.29)
    boxes = [BOX, small.box, hidden.box, (10, 10, 30, 30)]
    scores, difficulty = lane([[rider(), small, hidden]] * 12, shown=detected([boxes] * 12))
    assert scores["detection"]["precision"] == 0.5
    assert scores["detection"]["recall"] == 1.0
    assert difficulty["scored_objects"] == 1


def test_who_has_stood_for_three_seconds_is_ignored_until_it_moves():
    # Standing from frame 0 on; ignored from frame 30 (3 s) to 39, scored again once it moves.
    cars = [[rider(speed=0.0)]] * 40 + [[rider(speed=5.0)]] * 10
    scores, difficulty = lane(cars, shown=detected([[BOX]] * 30 + [[]] * 10 + [[BOX]] * 10))
    assert difficulty["scored_boxes"] == 28 + 10
    assert scores["detection"]["precision"] == scores["detection"]["recall"] == 1.0


def test_a_full_track_is_one_id_all_the_way():
    cars = [[rider()]] * 42  # 40 of them scored
    whole, other, nothing = tracks((1, BOX)), tracks((2, BOX)), tracks()

    def correct(found):
        return lane(cars, found)[0]["full_tracks"]["correct"]

    assert correct([whole] * 42) == 1
    assert correct([whole] * 20 + [nothing] * 2 + [whole] * 20) == 1  # 38 of 40 are 95 %
    assert correct([whole] * 20 + [nothing] * 3 + [whole] * 19) == 0
    assert correct([whole] * 20 + [other] * 22) == 0


def test_gaps_and_strays_have_limits_of_their_own():
    at = list(range(200))
    held = [[(7, 1)] for _ in at]
    assert full_tracks({7: at}, held, PARAMS) == {7: 1}
    gap = [[] if 100 <= k < 104 else [(7, 1)] for k in at]  # 98 %, but four in a row
    assert full_tracks({7: at}, gap, PARAMS) == {}
    spread = [[] if k in (20, 40, 60, 80) else [(7, 1)] for k in at]
    assert full_tracks({7: at}, spread, PARAMS) == {7: 1}
    for strays, found in ((3, {7: 1}), (4, {})):
        before = [[(8, 1)]] * strays
        life = {7: [k + strays for k in at]}
        assert full_tracks(life, before + held, PARAMS) == found


def test_a_rider_is_lost_where_no_one_id_is_on_it_for_a_fifth_of_its_frames():
    life = {7: list(range(20)), 8: list(range(20)), 9: list(range(20))}
    # On 7 one id for 4 frames, on 8 three ids for 3 frames each, on 9 none.
    pairs = [[(7, 1)]] * 4 + [[(8, 2)]] * 3 + [[(8, 3)]] * 3 + [[(8, 4)]] * 3 + [[]] * 7
    assert lost_riders(life, pairs, PARAMS) == {8, 9}


def test_riders_seen_for_less_than_a_second_do_not_count():
    for frames, total in ((RATE, 1), (RATE - 1, 0)):
        cars = [[]] * 2 + [[rider()]] * frames + [[]] * 5
        assert lane(cars)[0]["full_tracks"] == {"correct": 0, "total": total, "lost": total}


def test_longest_gap():
    assert longest_gap([True, False, False, True, False]) == 2
    assert longest_gap([]) == 0


@pytest.mark.parametrize(
    ("flags", "wanted"),
    [
        ([], {"present": 1, "flagged": 0, "false": 0}),
        ([1], {"present": 1, "flagged": 1, "false": 0}),
        ([1, 2], {"present": 1, "flagged": 1, "false": 1}),
        ([2, 5], {"present": 1, "flagged": 0, "false": 2}),
    ],
)
def test_wrong_way_riders(flags, wanted):
    cars = [[rider(0, role=Role.WRONG_WAY), rider(1, AWAY)]] * 20
    found = [tracks((1, BOX), (2, AWAY), (5, (10, 10, 30, 30)))] * 20
    shown = replace(
        NOTHING_SHOWN,
        flags=tuple(np.array(flags if k == 15 else [], np.int64) for k in range(20)),
    )
    assert lane(cars, found, shown=shown)[0]["wrong_way"] == wanted


def masks(mask_px, object_px) -> ShownLog:
    return replace(
        NOTHING_SHOWN,
        mask_px=np.array(mask_px, np.int64),
        object_px=tuple(np.array(counts, np.int64) for counts in object_px),
    )


def test_foreground_f_leaves_out_training_missing_masks_and_who_stands():
    # Riders have 1000 visible pixels. Scored: 800 of them in a mask of 1000, twice: F = 3200 / (2000 + 2000).
    cars = [[rider()]] * 5
    shown = masks([0, 0, 1000, NO_MASK, 1000], [[0], [0], [800], [0], [800]])
    assert lane(cars, shown=shown)[0]["detection"]["foreground_f"] == pytest.approx(0.8)
    # The second rider stands: after 3 s, in frames 30 and 31, neither its pixels nor their absence count.
    cars = [[rider(), rider(1, AWAY, speed=0.0)]] * 32
    shown = masks([2000] * 30 + [1000, 1700], [[1000, 1000]] * 30 + [[1000, 0], [1000, 700]])
    assert lane(cars, shown=shown)[0]["detection"]["foreground_f"] == 1.0


def test_seconds_until_what_stands_is_absorbed():
    cars = [[rider(speed=5.0)]] * 5 + [[rider(speed=0.0)]] * 50 + [[rider(speed=5.0)]] * 5
    # It stands from frame 5 on; the last with more than a fifth in the mask is 24: absorbed at 25, after 2 s.
    share = [1000] * 20 + [150, 150, 150, 150, 210] + [200] * 30 + [1000] * 5
    shown = masks(share, [[count] for count in share])
    assert lane(cars, shown=shown)[0]["absorbed_s"] == pytest.approx(2.0)
    assert lane(cars, shown=masks([900] * 60, [[900]] * 60))[0]["absorbed_s"] is None
    assert lane(cars, shown=masks([0] * 60, [[0]] * 60))[0]["absorbed_s"] is None
    brief = [[rider(speed=5.0)]] * 5 + [[rider(speed=0.0)]] * 25 + [[rider(speed=5.0)]] * 30
    assert lane(brief, shown=shown)[0]["absorbed_s"] is None


def test_seconds_until_a_flash_is_got_over():
    # 640 x 480 pixels, 1000 of them the rider's: 5 % of the rest are 15 310.
    cars = [[rider()]] * 40
    light = [1.0] * 10 + [1.5] * 30
    inside = [[0]] * 40
    calm, flooded = 15_000, 16_000
    mask = [calm] * 10 + [flooded] * 7 + [calm] * 23
    assert lane(cars, shown=masks(mask, inside), light=light)[0]["recovery_s"] == pytest.approx(0.7)
    # Calm for less than half a second is not over.
    mask = [calm] * 10 + [flooded] * 7 + [calm] * 4 + [flooded] + [calm] * 18
    assert lane(cars, shown=masks(mask, inside), light=light)[0]["recovery_s"] == pytest.approx(1.2)
    assert lane(cars, shown=masks([flooded] * 40, inside), light=light)[0]["recovery_s"] == pytest.approx(3.0)
    assert lane(cars, shown=masks(mask, inside))[0]["recovery_s"] is None


def test_flashes_are_changes_of_more_than_a_tenth_at_once():
    assert flashes(np.array([1.0, 1.09, 1.0, 1.2, 1.3, 0.9]), 0.1) == [3, 5]
    assert flashes(np.array([1.0]), 0.1) == []
