"""Tracks in view, and vehicles out of sight, on small made-up inputs."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.aerial import tracks
from tracker.aerial.appearance import PATCH
from tracker.aerial.belief import OFFSETS, deviations
from tracker.aerial.forecasts import LinearForecast
from tracker.aerial.hidden import AROUND, LONGEST, PATIENCE, RIM, HiddenVehicles
from tracker.aerial.measuring import Outlines
from tracker.aerial.occluders import Occluders
from tracker.aerial.reacquisition import Fusion
from tracker.aerial.tracks import Track
from tracker.aerial.trajectories import Trajectories

SIZE = np.array([28.0, 12.0])
RATE = 30.0
BESIDE = 4000.0
"""Px by which the camera has flown on: everything in the mosaic's first view is out of sight."""


def outlines(*centres, size=SIZE) -> Outlines:
    n = len(centres)
    return Outlines(
        centres=np.array(centres, float).reshape(n, 2),
        headings=np.tile([1.0, 0.0], (n, 1)),
        sizes=np.tile(size, (n, 1)),
        pixels=np.full(n, int(SIZE.prod()), np.int64),
    )


def driven(
    frames: int = 40, *, number: int = 1, y: float = 100.0, speed: float = 3.0, noise: float = 0.4
) -> Track:
    """Follow a vehicle that drives to the right from x = 50."""
    rng = np.random.default_rng(number)
    track = tracks.begin(number, outlines((50.0, y)), 0, 0)
    for tick in range(1, frames):
        tracks.predict([track])
        track.misses += 1
        centre = np.array([50.0 + speed * tick, y]) + rng.normal(0, noise, 2)
        tracks.measure(track, centre, SIZE, tick, False)
    return track


def test_a_track_follows_and_heads_where_it_goes():
    track = driven()
    assert np.hypot(*(track.centre - [50 + 3 * 39, 100])) < 1.0
    assert np.hypot(*(track.velocity - [3, 0])) < 0.3
    assert abs(track.heading[0] - 1) < 1e-2
    assert track.whole
    assert track.went()
    assert (track.misses, track.since) == (0, 39)


def test_of_a_vehicle_that_drives_under_a_bridge_the_rear_tells_the_place():
    track = driven()
    track.confirmed = True
    for tick in range(40, 45):
        tracks.predict([track])
        centre, length = 50.0 + 3.0 * tick, SIZE[0] - 3.0 * (tick - 39)
        # Its front is hidden: the middle of what is left lies behind that of the whole.
        tracks.measure(
            track, np.array([centre - 0.5 * (SIZE[0] - length), 100.0]), np.array([length, 12.0]), tick, False
        )
    assert not track.whole
    assert abs(track.centre[0] - (50 + 3 * 44)) < 1.5
    assert abs(track.size[0] - SIZE[0]) < 2.0


def test_a_new_tracks_front_tells_how_fast_it_goes():
    rng = np.random.default_rng(4)
    track = tracks.begin(1, outlines((52.0, 100.0), size=[4.0, 12.0]), 0, 0)
    assert track.pace == 0.0
    for tick in (1, 2, 3, 5, 6, 7, 8):
        tracks.predict([track])
        length = 4.0 + 3.0 * tick + rng.normal(0, 0.2)
        tracks.measure(
            track, np.array([50.0 + 0.5 * length, 100.0]), np.array([length, 12.0]), tick, False, SIZE
        )
    assert abs(track.pace - 3.0) < 0.15
    assert track.velocity[0] < 2.0
    track.confirmed = True
    tracks.measure(track, np.array([64.0, 100.0]), SIZE, 9, False)
    assert len(track.outlines) == 8


def test_a_track_that_began_at_a_part_grows_to_the_whole_and_no_further():
    track = driven()
    track.confirmed, track.size = True, np.array([12.0, 12.0])
    for tick in range(40, 70):
        tracks.predict([track])
        tracks.measure(track, np.array([50.0 + 3.0 * tick, 100.0]), SIZE, tick, False, 1.4 * SIZE)
    assert track.whole
    assert abs(track.size[0] - SIZE[0]) < 3.0
    length = track.size[0]
    for tick in range(70, 90):
        tracks.predict([track])
        tracks.measure(track, np.array([50.0 + 3.0 * tick, 100.0]), 2.0 * SIZE, tick, False, 1.4 * SIZE)
    assert track.size[0] == length


def test_two_tracks_in_one_vehicle_are_one_too_many():
    first, abreast, behind, double = (
        driven(number=1),
        driven(number=2, y=116.0),
        tracks.begin(3, outlines((50.0 + 3 * 39 - 32.0, 100.0)), 0, 39),
        tracks.begin(4, outlines((50.0 + 3 * 39 - 9.0, 103.0)), 0, 39),
    )
    assert tracks.doubles([double, first, abreast, behind], SIZE) == [double]
    # As long as no size is the usual one nothing is known.
    assert tracks.doubles([double, first], np.zeros(2)) == []


@settings(max_examples=60, deadline=None)
@given(count=st.integers(0, 12), seed=st.integers(0, 1000))
def test_doubles_are_those_that_a_plain_loop_finds(count, seed):
    rng = np.random.default_rng(seed)
    everyone = []
    for number in range(count):
        track = tracks.begin(number, outlines(rng.uniform(0, 60, 2)), 0, 0)
        angle = rng.uniform(-np.pi, np.pi)
        track.heading = np.array([np.cos(angle), np.sin(angle)])
        track.confirmed, track.hits = bool(rng.integers(2)), int(rng.integers(1, 5))
        everyone.append(track)
    seniors, found = [], []
    for track in sorted(everyone, key=lambda t: (-t.confirmed, -t.hits)):
        across = np.array([-track.heading[1], track.heading[0]])
        apart = [senior.centre - track.centre for senior in seniors]
        inside = [
            abs(a @ track.heading) < tracks.WITHIN * SIZE[0] and abs(a @ across) < tracks.WITHIN * SIZE[1]
            for a in apart
        ]
        (found if any(inside) else seniors).append(track)
    assert tracks.doubles(everyone, SIZE) == found


def test_a_confirmed_track_does_not_jump():
    track = driven()
    track.confirmed = True
    tracks.predict([track])
    before = track.centre.copy()
    assert not tracks.measure(track, before + np.array([0.0, 25.0]), SIZE, 40, False)
    assert (track.centre == before).all()


def test_a_first_outlines_axis_may_have_been_the_other():
    track = tracks.begin(1, outlines((50.0, 100.0), size=np.array([30.0, 12.0])), 0, 0)
    for tick in range(1, 8):
        tracks.predict([track])
        tracks.measure(track, np.array([50.0, 100.0 + 4.0 * tick]), track.size, tick, False)
    assert abs(track.heading[1]) > 0.99
    assert track.size[0] < track.size[1]


def test_free_outlines_go_to_the_nearest_within_the_gate():
    near, far = driven(number=1), driven(number=2, y=160.0)
    rows, columns = tracks.take_free([near, far], outlines((168.0, 160.5), (166.0, 101.0), (400.0, 100.0)))
    assert sorted(zip(rows.tolist(), columns.tolist(), strict=True)) == [(0, 1), (1, 0)]
    assert not len(tracks.take_free([], outlines((1, 1)))[0])


def hide(*vehicles: Track) -> HiddenVehicles:
    """Let vehicles drive along and vanish at tick 39."""
    trajectories = Trajectories()
    hidden = HiddenVehicles(LinearForecast, Fusion(), 640, 480, RATE)
    for track in vehicles:
        speed = track.velocity[0]
        for tick in range(40):
            trajectories.append(track.id, tick, track.centre - [speed * (39 - tick), 0.0])
        hidden.add(track, trajectories)
    return hidden


def picture(colour: float) -> np.ndarray:
    return np.full(PATCH[0] * PATCH[1] * 3, colour)


def test_who_comes_back_where_it_is_expected_gets_its_id_back():
    white, black = driven(number=1), driven(number=2, y=130.0)
    for track, colour in ((white, 220.0), (black, 30.0)):
        track.pictures.extend(picture(colour + k) for k in range(6))
    hidden = hide(white, black)
    for tick in range(40, 70):
        hidden.step(tick, np.eye(3), [])
    assert len(hidden.tracks) == 2
    new = tracks.begin(9, outlines((50.0 + 3 * 69, 131.0)), 0, 69)
    new.pictures.append(picture(32.0))
    ((old, found),) = hidden.reacquire([new], np.eye(3))
    assert (old.id, found.id) == (2, 9)
    assert [track.id for track in hidden.tracks] == [1]


def came_out(speed: float, *, x: float, tick: int) -> Track:
    """Return a new track that has been seen for ten frames at a speed."""
    new = tracks.begin(9, outlines((x - 9 * speed, 100.0)), 0, tick - 9)
    for k in range(8, -1, -1):
        tracks.predict([new])
        tracks.measure(new, np.array([x - k * speed, 100.0]), SIZE, tick - k, False)
    new.pictures.append(picture(128.0))
    return new


def test_who_comes_out_late_is_known_by_having_braked():
    found = {}
    for speed in (1.0, 3.0):
        hidden = hide(driven())
        for tick in range(40, 70):
            hidden.step(tick, np.eye(3), [])
        ((found[speed],),) = hidden._densities([came_out(speed, x=50.0 + 3 * 69 - 33, tick=69)])
    assert found[1.0] > found[3.0] + 1.0
    # Who comes the other way is somebody else.
    ((other_way,),) = hidden._densities([came_out(-3.0, x=257.0, tick=69)])
    assert other_way < found[3.0] - 2.0


def test_a_stranger_far_away_stays_one():
    hidden = hide(driven())
    hidden.tracks[0].pictures.extend(picture(200.0 + k) for k in range(6))
    hidden.step(45, np.eye(3), [])
    new = tracks.begin(9, outlines((600.0, 400.0)), 0, 45)
    new.pictures.append(picture(203.0))
    assert hidden.reacquire([new], np.eye(3)) == []
    assert len(hidden.tracks) == 1


def test_who_should_be_seen_is_given_up_sooner_than_who_is_out_of_view():
    away = np.array([[1.0, 0.0, BESIDE], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    in_view, out_of_view = hide(driven(speed=0.5)), hide(driven(speed=0.5))
    road = np.column_stack([np.linspace(0, 640, 300), np.full(300, 100.0)])
    for vehicles in (in_view, out_of_view):
        for _ in range(30):
            vehicles.occluders.see(road, [1.0, 0.0])
    left = {"in view": 0, "out of view": 0}
    for tick in range(40, 40 + round(RATE * LONGEST) + 10):
        in_view.step(tick, np.eye(3), [])
        out_of_view.step(tick, away, [])
        left["in view"] += len(in_view.tracks)
        left["out of view"] += len(out_of_view.tracks)
    assert left["out of view"] == round(RATE * LONGEST)
    assert PATIENCE <= left["in view"] < PATIENCE + 40


def test_where_each_hidden_vehicle_could_be_seen_is_what_it_is_by_itself():
    vehicles = hide(driven(number=1), driven(number=2, y=300.0, speed=1.0), driven(number=3, y=460.0))
    vehicles.tracks[1].size = np.array([60.0, 12.0])
    rng = np.random.default_rng(3)
    for _ in range(20):
        vehicles.occluders.see(rng.uniform([0, 90], [640, 310], (160, 2)), [1.0, 0.0])
    begun = [
        tracks.begin(9, outlines((143.0, 104.0)), 0, 45),
        tracks.begin(10, outlines((184.0, 300.0)), 0, 45),
    ]
    vehicles.step(45, np.eye(3), begun)
    turned = vehicles.tracks[2]
    turned.heading = np.array([0.0, 1.0])
    found = vehicles._visible(np.eye(3), begun)
    assert found.shape == (3, len(OFFSETS))
    for track, chances in zip(vehicles.tracks, found, strict=True):
        along, _ = deviations(track.heading, vehicles.covariance(track))
        for offset, chance in zip(OFFSETS, chances, strict=True):
            place = track.centre + offset * along * track.heading
            seen = (place > RIM).all() and (place < [640 - RIM, 480 - RIM]).all()
            for other in begun:
                reach = AROUND * max(track.size[0], other.size[0])
                seen = seen and np.hypot(*(place - other.centre)) > reach
            assert chance == seen * vehicles.occluders.visible(place, track.heading)[0]
    assert (found.max(1) > 0).tolist() == [True, True, False]
    assert (found[:2].min(1) == 0).all()


def test_cells_learn_way_by_way_where_vehicles_are_seen():
    occluders = Occluders()
    place, right, down = [[100.0, 100.0]], [1.0, 0.0], [0.0, 1.0]
    assert occluders.visible(place, right)[0] == 0.0
    for _ in range(20):
        occluders.see(place, right)
        occluders.miss(place, down)
    assert occluders.visible(place, right)[0] > 0.9
    assert occluders.visible(place, down)[0] < 0.1
    assert occluders.visible([[300.0, 100.0]], right)[0] == 0.0
    for _ in range(400):
        occluders.miss(place, right)
    assert occluders.visible(place, right)[0] < 0.3
