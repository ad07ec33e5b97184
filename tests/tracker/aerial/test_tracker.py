"""The whole tracker on a drawn scene: vehicles on a textured ground pass under a bridge."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tracker.aerial import tracks
from tracker.aerial.measuring import outline
from tracker.aerial.reacquisition import Fusion
from tracker.aerial.tracker import AerialTracker
from tracker.base import check_tracker
from tracker.types import Frame, Info, Status

WIDTH, HEIGHT, FRAMES = 320, 240, 170
INFO = Info(width=WIDTH, height=HEIGHT, rate=30.0, intrinsics=None)
BRIDGE = (150, 200)
LANES = (70, 120, 170)
COLOURS = ((210, 40, 40), (235, 235, 235), (40, 60, 200))
"""Of the vehicle in each lane; in the first one more, alike, follows."""


def ground() -> np.ndarray:
    rng = np.random.default_rng(4)
    picture = rng.integers(90, 130, (HEIGHT + 80, WIDTH + 80, 3)).astype(np.uint8)
    picture = cv2.GaussianBlur(picture, (5, 5), 1.5)
    for _ in range(250):
        corner = rng.integers(0, [WIDTH + 80, HEIGHT + 80])
        end = corner + rng.integers(4, 16, 2)
        cv2.rectangle(picture, corner.tolist(), end.tolist(), rng.integers(70, 150, 3).tolist(), -1)
    return picture


def scene() -> list[np.ndarray]:
    """Draw the frames: the camera drifts, the vehicles drive to the right at 1.6 px a frame."""
    base, rng, frames = ground(), np.random.default_rng(5), []
    bridge = np.random.default_rng(6).integers(60, 100, (HEIGHT + 80, BRIDGE[1] - BRIDGE[0], 3))
    for k in range(FRAMES):
        picture = base.copy()
        for lane, colour, behind in (*zip(LANES, COLOURS, (0, 26, 12), strict=True), (70, COLOURS[0], 40)):
            x = round(40 + 1.6 * k - behind)
            if k > 12 and x > 2:
                cv2.rectangle(picture, (x, lane), (x + 21, lane + 9), colour, -1)
                cv2.rectangle(picture, (x + 13, lane + 2), (x + 16, lane + 7), (20, 20, 25), -1)
        picture[:, BRIDGE[0] : BRIDGE[1]] = bridge
        x, y = round(20 + 8 * np.sin(0.03 * k)), round(20 + 5 * np.cos(0.05 * k))
        seen = picture[y : y + HEIGHT, x : x + WIDTH].astype(float) + rng.normal(0, 1.5, (HEIGHT, WIDTH, 3))
        frames.append(np.clip(seen, 0, 255).astype(np.uint8))
    return frames


@pytest.fixture(scope="module")
def frames() -> list[np.ndarray]:
    return scene()


@pytest.fixture
def all_changes(monkeypatch):
    """Take all changes for vehicles, as drawn vehicles cast no shadows: what comes after is tested."""
    monkeypatch.setattr("tracker.aerial.tracker.vehicles", lambda _, raw: raw)


Lanes = dict[int, list[int]]


def ids_in_lanes(tracker: AerialTracker, frames: list[np.ndarray]) -> tuple[Lanes, Lanes]:
    """Return the ids by lane of the vehicles that lead it, on both sides of the bridge."""
    before: Lanes = {}
    after: Lanes = {}
    tracker.start(INFO)
    for k, image in enumerate(frames):
        shown = tracker.step(Frame(image=image, tick=k, time=k / 30.0))
        y0 = 20 + 5 * np.cos(0.05 * k)
        x0 = 20 + 8 * np.sin(0.03 * k)
        for number, box, status in zip(shown.ids, shown.boxes, shown.status, strict=True):
            if status != Status.CONFIRMED:
                continue
            x, y = 0.5 * (box[0] + box[2]) + x0, 0.5 * (box[1] + box[3]) + y0
            lane = int(np.argmin([abs(y - lane - 5) for lane in LANES]))
            if x < BRIDGE[0] - 12:
                before.setdefault(lane, []).append(int(number))
            elif x > BRIDGE[1] + 12:
                after.setdefault(lane, []).append(int(number))
    # Before the bridge who was seen last left last; behind it who was seen first came first.
    left = {lane: list(dict.fromkeys(reversed(numbers)))[::-1] for lane, numbers in before.items()}
    return left, {lane: list(dict.fromkeys(numbers)) for lane, numbers in after.items()}


def test_who_passes_under_a_bridge_gets_its_id_back(frames):
    before, after = ids_in_lanes(AerialTracker(), frames)
    assert sorted(after) == [0, 1, 2]
    for lane, numbers in after.items():
        assert set(numbers) <= set(before[lane])
    # Of two alike in a lane the first that went in is the first that comes out.
    assert len(after[0]) == 2
    assert after[0] == [number for number in before[0] if number in after[0]]


@pytest.mark.parametrize("straight", [True, False])
def test_a_path_goes_on_through_a_gap_where_the_road_is_straight(frames, monkeypatch, straight):
    if not straight:
        monkeypatch.setattr("tracker.aerial.tracker.leads_to", lambda *_: False)
    tracker = AerialTracker()
    _, after = ids_in_lanes(tracker, frames)
    back = {number for numbers in after.values() for number in numbers}
    again = [track for track in tracker._tracks if track.id in back]
    assert len(again) >= 3
    assert all((track.path == track.id) == straight for track in again)


def test_boxes_are_as_large_as_vehicles_though_blur_widens_what_is_seen(frames):
    tracker, sizes = AerialTracker(), []
    tracker.start(INFO)
    for k, image in enumerate(frames[:80]):
        blurred = cv2.GaussianBlur(image, (5, 5), 1.2)
        shown = tracker.step(Frame(image=blurred, tick=k, time=k / 30.0))
        boxes = shown.boxes[shown.status == Status.CONFIRMED]
        sizes.extend(boxes[:, 2:] - boxes[:, :2])
    assert np.abs(np.median(sizes, 0) - [22.0, 10.0]).max() < 1.5, np.median(sizes, 0)


def test_a_vehicle_looks_in_the_shade_as_in_the_sun(frames):
    tracker = AerialTracker()
    tracker.start(INFO)
    reds = {True: [], False: []}
    for k, image in enumerate(frames[:80]):
        # The shade lies still on the ground.
        edge = 100 - round(20 + 8 * np.sin(0.03 * k))
        image = image.copy()
        image[:, edge:] = image[:, edge:] * 0.5
        tracker.step(Frame(image=image, tick=k, time=k / 30.0))
        for track in tracker._tracks:
            if track.pictures and track.hits % tracks.PICTURE_EVERY == 0:
                shaded = track.centre[0] > 80
                if abs(track.centre[0] - 80) > 15 and track.centre[1] < 70:
                    reds[shaded].append(track.pictures[-1].max())
    assert min(map(len, reds.values())) > 5
    assert abs(np.median(reds[True]) - np.median(reds[False])) < 25


@pytest.mark.usefixtures("all_changes")
def test_it_is_remembered_which_way_the_last_picture_was_taken(frames):
    tracker = AerialTracker()
    tracker.start(INFO)
    for k, image in enumerate(frames[:60]):
        if k == 50:
            for track in tracker._tracks:
                track.pictured = np.zeros(2)
        tracker.step(Frame(image=image, tick=k, time=k / 30.0))
    known = [track for track in tracker._tracks if track.confirmed]
    assert len(known) >= 2
    for track in known:
        assert track.pictured @ [1.0, 0.0] > 0.99


@pytest.mark.usefixtures("all_changes")
def test_rehearsals_narrow_what_is_hidden_no_further_than_they_may(frames):
    tracker, found = AerialTracker(), []
    tracker.start(INFO)
    for k, image in enumerate(frames[:120]):
        tracker.step(Frame(image=image, tick=k, time=k / 30.0))
        for track in tracker._hidden.tracks if k > 100 else []:
            axes = np.array([track.heading, [-track.heading[1], track.heading[0]]])
            usual, own = track.forecast.covariance, tracker._hidden.covariance(track)
            found.append(np.diag(axes @ own @ axes.T) / np.diag(axes @ usual @ axes.T))
    assert np.min(found) > 0.59
    assert np.min(found) < 0.65


@pytest.mark.parametrize("settled", [True, False])
def test_a_known_vehicle_that_loses_its_outline_to_another_one_is_hidden(frames, monkeypatch, settled):
    def beaten(*arguments):
        own, _, left = outline(*arguments)
        lost = np.ones(len(own.pixels), bool)
        return replace(own, pixels=np.zeros_like(own.pixels)), lost, np.zeros_like(left)

    tracker = AerialTracker()
    tracker.start(INFO)
    last = 55 if settled else 20
    for k, image in enumerate(frames[: last + 1]):
        tracker.step(Frame(image=image, tick=k, time=k / 30.0))
    before = {track.id for track in tracker._tracks}
    monkeypatch.setattr("tracker.aerial.tracker.outline", beaten)
    for k in (last + 1, last + 2):
        tracker.step(Frame(image=frames[k], tick=k, time=k / 30.0))
        where = tracker._tracks if k == last + 1 else tracker._hidden.tracks
        assert bool(before & {track.id for track in where}) == settled


def test_who_is_lost_again_at_once_is_still_expected(frames, monkeypatch):
    """What comes out from under the bridge lasts for a few frames: it may not have been that vehicle."""

    def nothing(*arguments):
        own, lost, left = outline(*arguments)
        return replace(own, pixels=np.zeros_like(own.pixels)), np.zeros_like(lost), np.zeros_like(left)

    tracker, expected, back = AerialTracker(), {}, set()
    tracker.start(INFO)
    for k, image in enumerate(frames):
        if not back:
            expected = {track.id: track for track in tracker._hidden.tracks}
        else:
            monkeypatch.setattr("tracker.aerial.tracker.outline", nothing)
        tracker.step(Frame(image=image, tick=k, time=k / 30.0))
        going = {track.id for track in tracker._tracks if track.confirmed}
        if back and not going:
            break
        back = back or going & set(expected)
    assert back
    again = {track.id: track for track in tracker._hidden.tracks}
    for number in back:
        old = expected[number]
        assert again[number].forecast is old.forecast
        assert tracker._trajectories.extent(old.path)[1] == old.since
    # What comes out later may be it.
    monkeypatch.setattr("tracker.aerial.tracker.outline", outline)
    for later in range(k + 1, FRAMES):
        tracker.step(Frame(image=frames[later], tick=later, time=later / 30.0))
    assert back <= {track.id for track in tracker._tracks if track.confirmed}


@pytest.mark.usefixtures("all_changes")
@pytest.mark.parametrize("double", [False, True])
def test_the_path_of_who_seemed_to_stand_ends_before(frames, monkeypatch, double):
    tracker = AerialTracker()
    tracker.start(INFO)
    for k, image in enumerate(frames[:60]):
        tracker.step(Frame(image=image, tick=k, time=k / 30.0))
    places = {track.id: track.centre for track in tracker._tracks}
    paths = [track.path for track in tracker._tracks if track.confirmed]
    seen = True

    def stuck(labels, single, senior, centres, *arguments):
        own, beaten, left = outline(labels, single, senior, centres, *arguments)
        origin = tracker._background.origin + np.array(tracker._background.view[:2])
        where = (
            np.array([places.get(track.id, track.centre) for track in tracker._tracks]).reshape(-1, 2)
            - origin
        )
        sizes = np.array([track.size for track in tracker._tracks]).reshape(-1, 2)
        pixels = np.full(len(where), 100 if seen else 0)
        return replace(own, centres=where, sizes=sizes, pixels=pixels), beaten & False, np.zeros_like(left)

    monkeypatch.setattr("tracker.aerial.tracker.outline", stuck)
    for k, image in enumerate(frames[60:94], 60):
        seen = k < 90
        if double and not seen:
            monkeypatch.setattr("tracker.aerial.tracks.doubles", lambda everyone, _: everyone)
        tracker.step(Frame(image=image, tick=k, time=k / 30.0))
    assert len(paths) > 1
    assert all(tracker._trajectories.extent(path)[1] < 65 for path in paths)
    hidden = [track for track in tracker._hidden.tracks if track.id in places]
    assert bool(hidden) != double
    for track in hidden:
        assert track.since < 65
        assert track.forecast is not None
        assert track.forecast.velocity[0] > 1.2
        assert track.centre[0] > places[track.id][0] + 35.0


def test_without_re_acquisition_they_are_new(frames):
    before, after = ids_in_lanes(AerialTracker(matcher=Fusion(least=np.inf)), frames)
    assert after
    for lane, numbers in after.items():
        assert not set(numbers) & set(before[lane])


@pytest.mark.usefixtures("all_changes")
def test_what_is_larger_than_any_lorry_is_no_vehicle(frames, monkeypatch):
    monkeypatch.setattr("tracker.aerial.tracker.ENOUGH", 2)
    tracker, largest = AerialTracker(), []
    tracker.start(INFO)
    for k, image in enumerate(frames[:110]):
        if k > 85:
            # The sun comes out on a field.
            image = image.copy()
            image[185:235, 40:140] = np.clip(image[185:235, 40:140].astype(int) + 60, 0, 255)
        shown = tracker.step(Frame(image=image, tick=k, time=k / 30.0))
        largest.append((shown.boxes[:, 2] - shown.boxes[:, 0]).max(initial=0.0))
    assert max(largest) < 40.0


def test_the_tracker_keeps_the_contract():
    check_tracker(AerialTracker())
