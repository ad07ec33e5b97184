"""The cues of an outline, against plain forms, and what they say of a drawn car."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tracker.in_car.reliefs import drawn_cars, layers, pictures, plain_mean, redness, relief_of
from tests.tracker.in_car.test_outlines import plain_foot, plain_side
from tracker.in_car.cues import (
    BODY_PLAY,
    BODY_SHARE,
    CLEAR,
    COUNT,
    LAMP_BANDS,
    LAMP_TALL,
    LAMP_TOP,
    LAMP_WIDE,
    MIRROR,
    MOST,
    REACH,
    Cue,
    _look,
    _weigh,
    cues,
)
from tracker.in_car.outlines import FRAME_SIDE, REAR, rear_edges, rear_width
from tracker.in_car.relief import ACROSS, BRIGHT, DOWN, RED

LAMPS = [Cue.WEAKER_LAMP, Cue.STRONGER_LAMP, Cue.RED_BETWEEN]
ROOFED = [Cue.FRAME, Cue.TALLNESS, Cue.ROOF, Cue.OTHER_ROOF, Cue.SIDE_ABOVE]
LOOKED = [cue for cue in Cue if cue < Cue.FOR and cue not in ROOFED] + LAMPS
WEIGHED = [cue for cue in Cue if cue >= Cue.FOR and cue not in LAMPS + ROOFED]


def plain_look(found, outline, scene):
    """The cues of edges and brightness by the means of rectangles."""
    _, height, width = found.shape
    (x0, x1, row), (horizon, middle, focal) = outline, scene
    wide, contact, cue = x1 - x0, row - horizon, {}
    usual = REAR * contact
    low = int(row - 0.5 * usual), int(row - 0.08 * usual)
    high = int(row - 0.8 * usual), low[0]
    cut = x0 < 3, x1 > width - 3
    a, b = rear_edges(x0, x1, contact, middle, focal)
    cue[Cue.NEARNESS] = math.log(contact)
    cue[Cue.WIDTH], cue[Cue.CUT_WIDTH] = (0.0, 0.0)
    cue[Cue.CUT_WIDTH if any(cut) else Cue.WIDTH] = math.log(max((b - a) / usual, 0.05))

    def box(layer, left, right, rows):
        return plain_mean(found, layer, int(left), rows[0], int(right), rows[1])

    level = box(ACROSS, x0 - 0.5 * wide, x1 + 0.5 * wide, low) + 2.0
    names = (Cue.WEAKER_SIDE, low), (Cue.WEAKER_PILLAR, high)
    for name, rows in names:
        both = [
            FRAME_SIDE if off else min(plain_side(found, place, *rows) / level, 4.0)
            for place, off in zip((x0, x1), cut, strict=True)
        ]
        cue[name], cue[Cue(name + 1)] = sorted(both)
    gap, strip = 0.02 * wide + 1.0, 0.12 * wide + 1.0
    both = []
    for place, off in zip((x0, x1), cut, strict=True):
        before = box(BRIGHT, place - gap - strip, place - gap, low)
        after = box(BRIGHT, place + gap, place + gap + strip, low)
        both.append(FRAME_SIDE if off else min(abs(after - before) / level, 6.0))
    cue[Cue.WEAKER_CONTRAST], cue[Cue.STRONGER_CONTRAST] = sorted(both)

    left, right = int(max(a, 0)), int(min(b, width))
    right = max(right, left + 4)
    steps = plain_mean(found, DOWN, left, low[0], right, int(row)) + 3.0
    _, cue[Cue.FOOT_LEAST], cue[Cue.FOOT_MEAN] = plain_foot(found, left, right, row, 1, steps)
    rear = right - left
    gap_below, tall = max(2, int(0.05 * rear)), max(2, int(0.18 * rear))
    below = int(row) + gap_below, int(row) + gap_below + tall
    above = int(row) - gap_below - 2 * tall, int(row) - gap_below
    road = plain_mean(found, DOWN, left, below[0], right, below[1])
    cue[Cue.ROAD] = min(road / (plain_mean(found, DOWN, left, above[0], right, above[1]) + 0.5), 2.0)
    cue[Cue.SHADOW] = 0.0
    if below[0] + 2 < height:
        dark = plain_mean(found, BRIGHT, left, int(row - 0.08 * rear) - 1, right, int(row))
        bright = plain_mean(found, BRIGHT, left, below[0], right, below[1])
        cue[Cue.SHADOW] = math.log((dark + 8.0) / (bright + 8.0))

    inner = int(x0 + 0.1 * wide), int(x1 - 0.1 * wide)
    cue[Cue.EDGES_INSIDE] = min(box(ACROSS, *inner, low) / level, 3.0)
    cue[Cue.STEPS_INSIDE] = min(box(DOWN, *inner, low) / level, 4.0)
    beside = box(ACROSS, x0 - 0.4 * wide, x0 - 0.06 * wide, low)
    beside += box(ACROSS, x1 + 0.06 * wide, x1 + 0.4 * wide, low)
    cue[Cue.EDGES_BESIDE] = min(0.5 * beside / level, 3.0)
    reach = max(LAMP_WIDE * (b - a), 2.0)
    lamps = np.zeros((3, LAMP_BANDS))
    for band in range(LAMP_BANDS):
        first = int(row - (LAMP_TOP - band * LAMP_TALL) * usual)
        rows = first, max(int(row - (LAMP_TOP - (band + 1) * LAMP_TALL) * usual), first + 1)
        spans = (a, a + reach), (b - reach, b), (a + 1.3 * reach, b - 1.3 * reach)
        lamps[:, band] = [max(box(RED, *span, rows), 0.0) for span in spans]
    cue[Cue.WEAKER_LAMP], cue[Cue.STRONGER_LAMP] = sorted(lamps[:2].max(1))
    cue[Cue.RED_BETWEEN] = lamps[2].max()
    bounds = a + (b - a) * np.arange(MIRROR + 1) / MIRROR
    profile = np.array([box(ACROSS, bounds[k], int(bounds[k + 1]) + 1, low) for k in range(MIRROR)])
    profile -= profile.mean()
    cue[Cue.SYMMETRY] = (profile @ profile[::-1]) / (profile @ profile + 1e-6)
    return cue


@settings(max_examples=100, deadline=None)
@given(pictures(20, 40), st.integers(0, 2**32 - 1))
def test_look_measures_what_the_rectangles_hold(grey, seed):
    rng = np.random.default_rng(seed)
    height, width = grey.shape
    x0 = rng.uniform(0, width - 6)
    outline = x0, rng.uniform(x0 + 5, width), float(rng.integers(12, height))
    scene = 5.0, rng.uniform(0, width), 50.0
    measured = np.zeros(COUNT)
    red = redness(grey)
    _look(relief_of(grey, red=red).sums, outline, scene, measured)
    expected = plain_look(layers(grey, red), outline, scene)
    assert set(expected) == set(LOOKED)
    feet = Cue.FOOT_LEAST, Cue.FOOT_MEAN
    # Of two feet equally good to the last bit either may be taken.
    assert sum(measured[cue] for cue in feet) == pytest.approx(sum(expected[cue] for cue in feet), abs=1e-8)
    for cue in set(LOOKED) - set(feet):
        assert measured[cue] == pytest.approx(expected[cue], abs=1e-8), cue


def plain_weigh(outline, rear, x, y, moved, evidence, horizon, middle):
    """The cues of the points, by sets of points."""
    x0, x1, row = outline
    wide = x1 - x0
    play, top = 0.03 * wide + 1.0, row - 1.2 * rear
    value = np.clip(evidence, -MOST, MOST)
    beside = (x < x0 - play) | (x > x1 + play)
    inside = ~beside & (y >= top) & (y <= row + play)
    far = inside & (y < horizon + 2)
    worth = np.where(far, np.minimum(value, 0.5), value)
    over = y < row - 0.8 * rear
    speak = inside & (worth > CLEAR)
    total = worth[inside & (worth > 0) & ((worth > CLEAR) | ~over)].sum()
    bars = inside & (worth <= 0) & ~over
    against = -worth[bars].sum()
    clear = bars & (worth < -CLEAR)
    core = clear & (x > x0 + 0.15 * wide) & (x < x1 - 0.15 * wide) & (y < row - 0.1 * wide)
    cue = {
        Cue.FOR: min(total, 40),
        Cue.AGAINST: min(against, 40),
        Cue.SHARE: (total + 0.5) / (total + against + 1),
        Cue.COUNT_FOR: min(speak.sum(), 15),
        Cue.COUNT_AGAINST: min(clear.sum(), 15),
        Cue.CORE_AGAINST: min(core.sum(), 8),
        Cue.DENSITY: speak.sum() / math.sqrt(wide),
    }
    if not speak.any():
        cue |= {Cue.GAP_INNER: 1.0, Cue.GAP_OUTER: 1.0, Cue.GAP_BELOW: 1.0, Cue.GAP_ABOVE: 1.2}
        return cue, row - 0.5 * rear
    px, py, weights = x[speak], y[speak], worth[speak]
    centre = np.average(moved[speak], axis=0, weights=weights)
    allowed = BODY_PLAY + BODY_SHARE * wide
    scatter = np.average(((moved[speak] - centre) ** 2).sum(1), weights=weights)
    cue[Cue.SCATTER] = min(scatter / allowed**2, 9.0)
    gaps = (px.min() - x0) / wide, (x1 - px.max()) / wide
    cue[Cue.GAP_INNER], cue[Cue.GAP_OUTER] = gaps if 0.5 * (x0 + x1) > middle else gaps[::-1]
    cue[Cue.GAP_ABOVE], cue[Cue.GAP_BELOW] = (py.min() - top) / rear, (row - py.max()) / rear
    for name, place, unit in ((Cue.SPREAD_X, px, wide), (Cue.SPREAD_Y, py, rear)):
        spread = np.average((place - np.average(place, weights=weights)) ** 2, weights=weights)
        cue[name] = math.sqrt(spread) / unit
    reach = REACH * wide
    about = (
        (x >= x0 - reach) & (x <= x1 + reach) & (y >= max(row - 0.8 * rear, horizon + 2)) & (y <= row + reach)
    )
    under, alongside = about & ~beside & (y > row + play), about & beside & (y <= row + play)
    along = (value > CLEAR) & (np.abs(moved - centre) < allowed).all(1)
    cue[Cue.ALIKE_BESIDE] = min(value[alongside & along].sum(), 20)
    cue[Cue.AGAINST_BESIDE] = min(-value[alongside & (value < 0)].sum(), 20)
    cue[Cue.AGAINST_BELOW] = min(-value[under & (value < 0)].sum(), 20)
    cue[Cue.FOR_BELOW] = min(value[under & (value > CLEAR)].sum(), 20)
    return cue, py.min()


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 60))
def test_weigh_sums_up_the_points_in_and_around(seed, count):
    rng = np.random.default_rng(seed)
    outline = 100.0, 100.0 + rng.uniform(15, 80), 150.0
    x, y = rng.uniform(70, 210, count), rng.uniform(60, 180, count)
    moved, evidence = rng.normal(0, 2, (count, 2)), rng.normal(0.5, 3, count)
    horizon, middle = rng.uniform(80, 130), rng.uniform(60, 220)
    measured = np.zeros(COUNT)
    u, v = moved[:, 0].copy(), moved[:, 1].copy()
    rear = (outline[1] - outline[0]) * rng.uniform(0.4, 1.0)
    highest = _weigh(outline, rear, x, y, u, v, evidence, horizon, middle, measured)
    expected, top = plain_weigh(outline, rear, x, y, moved, evidence, horizon, middle)
    assert highest == pytest.approx(top)
    for cue in WEIGHED:
        assert measured[cue] == pytest.approx(expected.get(cue, 0.0), abs=1e-6), cue


def test_a_drawn_car_looks_like_one_and_a_shifted_outline_less():
    car = (120, 165, 140)
    grey, boxes = drawn_cars([car])
    relief = relief_of(grey, horizon=110.0)
    points = np.stack(np.meshgrid([125.0, 142, 160], [112.0, 120, 130]), -1).reshape(-1, 2)
    shifted = (130, 175, 140)
    found, windows = cues(relief, np.array([car, shifted], float), points, np.zeros((9, 2)), np.full(9, 3.0))
    assert found.shape == (4, COUNT)
    assert np.isfinite(found).all()
    assert windows[0] == pytest.approx(boxes[0], abs=2.0)  # the roof is the drawn one
    true, off = found[0], found[1]
    assert true[Cue.WEAKER_SIDE] > 3 * off[Cue.WEAKER_SIDE]
    assert true[Cue.SHADOW] < -0.5
    assert true[Cue.SYMMETRY] > 0.9 > off[Cue.SYMMETRY]
    assert true[Cue.COUNT_FOR] == 9
    assert off[Cue.COUNT_FOR] < 9
    assert off[Cue.ALIKE_BESIDE] > 0.0 == true[Cue.ALIKE_BESIDE]


def test_a_body_that_goes_on_above_its_roof_and_red_lamps_are_seen():
    grey, _ = drawn_cars([(120, 165, 140)])
    red = np.zeros_like(grey)
    red[118:126, 121:128] = red[118:126, 157:164] = 120
    tall = grey.copy()
    tall[75:106, 120:165] = 60
    outlines, none = np.array([[120.0, 165, 140]]), np.empty((0, 2))

    def low_and_high(picture, red=None):
        return cues(relief_of(picture, horizon=110.0, red=red), outlines, none, none, np.empty(0))[0]

    car, lorry = low_and_high(grey, red), low_and_high(tall)
    assert car[0, Cue.WEAKER_LAMP] > 20 > 1 > car[0, Cue.RED_BETWEEN]
    assert lorry[0, Cue.WEAKER_LAMP] == 0.0
    assert lorry[0, Cue.SIDE_ABOVE] > 5 * car[0, Cue.SIDE_ABOVE]
    for found in (car, lorry):
        assert found[0, Cue.OTHER_ROOF] == found[1, Cue.ROOF]
        assert found[1, Cue.OTHER_ROOF] == found[0, Cue.ROOF]
    assert car[0, Cue.OTHER_ROOF] < car[0, Cue.ROOF]
    assert lorry[1, Cue.ROOF] > lorry[0, Cue.ROOF]


def test_rear_of_what_the_frame_cuts_off_is_no_less_than_usual():
    assert rear_width(300.0, 320.0, 40.0, 160.0, 400.0, 320) == REAR * 40.0
    assert rear_width(200.0, 280.0, 40.0, 160.0, 400.0, 320) == pytest.approx(
        80.0 - 40.0 * 3.5 * 40.0 / 400.0
    )


def test_a_brighter_picture_changes_no_cue_of_edges():
    grey, _ = drawn_cars([(120, 165, 140)])
    outlines, none = np.array([[120.0, 165, 140]]), np.empty((0, 2))
    both = [
        cues(relief_of(picture, horizon=110.0), outlines, none, none, np.empty(0))[0]
        for picture in (grey, grey + np.uint8(40))
    ]
    rest = [cue for cue in Cue if cue != Cue.SHADOW]  # a ratio of brightnesses
    np.testing.assert_allclose(both[0][:, rest], both[1][:, rest], atol=1e-9)
