"""The ground: beside a naive twin, and that traffic leaves no traces in it."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tracker.motorcycle_lane.ground import UNSURE, Ground, lead, relit

SHAPE = (5, 7)
PICTURES = arrays(np.uint8, (*SHAPE, 3))
MASKS = arrays(np.bool_, SHAPE)


@given(
    ground=PICTURES, image=PICTURES, held=MASKS, changed=MASKS, rise=st.floats(0, 99), fall=st.floats(0, 99)
)
@settings(max_examples=60, deadline=None)
def test_it_follows_as_naive_code_does(ground, image, held, changed, rise, fall):
    rate = 0.25
    exact = ground.astype(np.float32)
    shown = lead(exact, image, held.view(np.uint8), changed, *map(np.float32, (rise, fall, rate)))
    for y, x, c in np.ndindex(*SHAPE, 3):
        wanted, seen = float(ground[y, x, c]), float(image[y, x, c])
        if not held[y, x] and not changed[y, x]:
            wanted += rate * (seen - wanted)
        elif not held[y, x]:
            wanted = min(wanted + rise, seen) if seen > wanted else max(wanted - fall, seen)
        assert abs(exact[y, x, c] - wanted) < 1e-3
        assert abs(int(shown[y, x, c]) - wanted) <= 0.501


def test_traces_vanish_and_vehicles_leave_none():
    road = np.full((40, 60, 3), 120, np.uint8)
    traced = road.copy()
    traced[10:20, 10:20] = 60
    rng = np.random.default_rng(0)
    ground = Ground()
    for frame in range(60):
        image = np.clip(road + rng.normal(0, 2.0, road.shape), 0, 255).astype(np.uint8)
        rider = np.zeros((40, 60), bool)
        rider[22:38, 40 : 40 + min(frame, 12)] = True
        shadow = np.roll(rider, -14, axis=1) & ~rider
        image[rider], image[shadow] = 30, 70
        raw = rider | shadow
        raw[10:20, 10:20] = True
        assert ground.image(traced).shape == road.shape
        ground.learn(image, raw, rider)
    off = np.abs(ground.image(traced).astype(int) - road)
    assert off[:20].max() <= 10
    assert off[22:38, 38:54].max() <= 10
    # A shadow that stays for two seconds darkens it, but only by so much.
    assert 10 < off[22:38, 30:34].mean() < 45


def test_light_that_changes_at_once_is_followed_at_once():
    road = np.full((40, 60, 3), 90, np.uint8)
    none = np.zeros((40, 60), bool)
    ground = Ground()
    for _ in range(20):
        ground.image(road)
        ground.learn(road, none, none)
    lit = road + np.uint8(50)
    ground.image(road)
    ground.learn(lit, ~none, none)
    assert ground.image(road).max() < 120
    assert (ground.image(lit) == lit).all()
    part = road.copy()
    part[:15] = 140
    assert relit(road, lit)
    assert not relit(road, part)


def test_it_follows_fast_at_first_and_never_beside_a_vehicle():
    road = np.full((40, 60, 3), 100, np.uint8)
    light = np.full((40, 60, 3), 140, np.uint8)
    nobody = np.zeros((40, 60), bool)
    rider = nobody.copy()
    rider[20, 30] = True
    ground = Ground()
    ground.image(light)
    ways = []
    for _ in range(40):
        before = ground.image(light).astype(int)
        ground.learn(road, ~nobody, rider)
        ways.append((before - ground.image(light))[0, 0, 0])
    assert sum(ways[:10]) > 20 > 10 > sum(ways[30:])
    shown = ground.image(light)
    assert (shown[18:23, 28:33] == 140).all()
    assert (shown[20, [27, 33]] < 140).all()


def test_for_a_while_after_the_light_has_changed_what_stands_still_is_ground():
    road, none = np.full((40, 60, 3), 90, np.uint8), np.zeros((40, 60), bool)
    shade, rider = none.copy(), none.copy()
    shade[25:35, 5:25], rider[5:15, 30:40] = True, True

    def lasting(light: int, frames: int) -> np.ndarray:
        """Return the ground where shade, and a rider of many colours, are taken for vehicles for a while."""
        ground = Ground()
        ground.image(road)
        ground.learn(road, none, none)
        for frame in range(frames):
            image = road + np.uint8(light)
            image[shade] -= np.uint8(30)
            image[rider] = 40 + 40 * (frame % 3)
            ground.image(road + np.uint8(light))
            ground.learn(image, shade | rider, shade | rider)
        return ground.image(road + np.uint8(light)).astype(int)

    for frames, seen in ((UNSURE, 120), (10, 137)):
        relit_ground = lasting(50, frames)
        assert (np.abs(relit_ground[shade] - seen) < 10).all()
        assert (relit_ground[rider] == 140).all()
    assert (lasting(0, UNSURE)[shade] == 90).all()


def test_later_who_stands_still_is_no_ground():
    road, nobody = np.full((40, 60, 3), 90, np.uint8), np.zeros((40, 60), bool)
    parked = nobody.copy()
    parked[10:20, 10:20] = True
    ground = Ground()
    for frame in range(UNSURE + 80):
        lit = road if frame == 0 else road + np.uint8(50)
        there = parked if frame > UNSURE + 5 else nobody
        image = lit.copy()
        image[there] = 30
        ground.image(lit)
        ground.learn(image, there, there)
    assert (ground.image(lit) == 140).all()
