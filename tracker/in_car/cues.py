"""What speaks for an outline being a vehicle's that goes the ego's way: one number a cue.

Edges and brightness say whether it looks like a vehicle from behind, the points in and around it whether it
moves like one. Trees (outline_odds.npz, `docs/outlines.md`) weigh them.
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car.body import BODY_PLAY, BODY_SHARE
from tracker.in_car.outlines import FRAME_SIDE, REAR, foot, rear_edges, rear_width, roof, side
from tracker.in_car.relief import ACROSS, BRIGHT, DOWN, RED, Relief, mean

Floats = NDArray[np.float64]


class Cue(IntEnum):
    """The columns of `cues`.

    Lengths are shares of the outline's width, strengths relate to the surroundings.
    """

    WIDTH = 0
    """ln of the rear's width over a usual one, 0 where the frame cuts it off."""
    CUT_WIDTH = 1
    """The same where the frame cuts it off, else 0."""
    NEARNESS = 2
    """ln of the horizon's height above the contact row, px."""
    FRAME = 3
    """Vertical edge on the weaker side, from the contact row up to the roof."""
    TALLNESS = 4
    """Height over the rear's width."""
    WEAKER_SIDE = 5
    """Vertical edge on the weaker side, lower half."""
    STRONGER_SIDE = 6
    WEAKER_PILLAR = 7
    """The same over the upper half."""
    STRONGER_PILLAR = 8
    WEAKER_CONTRAST = 9
    """Change of brightness over the weaker side, in units of the edges around."""
    STRONGER_CONTRAST = 10
    FOOT_LEAST = 11
    """Horizontal edge at the contact row: its weakest quarter."""
    FOOT_MEAN = 12
    ROAD = 13
    """Structure just below the contact row over that above: a road is smooth."""
    SHADOW = 14
    """ln of the brightness just above the contact row over that below."""
    ROOF = 15
    """Horizontal edge at the roof."""
    EDGES_INSIDE = 16
    EDGES_BESIDE = 17
    STEPS_INSIDE = 18
    """Horizontal edges inside."""
    SYMMETRY = 19
    """Correlation of the edges with their mirror image."""
    FOR = 20
    """Sum of the points' log odds that speak for a vehicle."""
    AGAINST = 21
    SHARE = 22
    """Of the sums, that which speaks for it."""
    COUNT_FOR = 23
    COUNT_AGAINST = 24
    CORE_AGAINST = 25
    """Points against it that lie well inside."""
    DENSITY = 26
    """Points for it over the root of the width in px."""
    GAP_INNER = 27
    """From the points for it to the side next to the ego's path."""
    GAP_OUTER = 28
    GAP_ABOVE = 29
    GAP_BELOW = 30
    SPREAD_X = 31
    """Standard deviation of the points for it."""
    SPREAD_Y = 32
    SCATTER = 33
    """Variance of their motion, in units of what a body is allowed."""
    ALIKE_BESIDE = 34
    """Log odds of points beside it that move along: a part of it was cut off."""
    AGAINST_BESIDE = 35
    AGAINST_BELOW = 36
    FOR_BELOW = 37
    WEAKER_LAMP = 38
    """Redness where tail lamps are, on the weaker side, in grey levels."""
    STRONGER_LAMP = 39
    RED_BETWEEN = 40
    """The same between them: a red body is no lamp."""
    OTHER_ROOF = 41
    """Horizontal edge at the other roof, a high one for a car's and a low one for a lorry's."""
    SIDE_ABOVE = 42
    """Vertical edge on the weaker side over the roof: the body goes on."""


# Points' log odds count up to this much; beyond CLEAR a point is called for or against.
MOST, CLEAR = 4.0, 0.8
# How far around an outline its cut-off parts are looked for: less than the gap between two lanes.
REACH = 0.3
COUNT = len(Cue)
# Tail lamps are looked for in so many bands, each so tall, from a top down: shares of a usual width; and over
# this share of the rear's width from each side.
LAMP_BANDS, LAMP_TOP, LAMP_TALL, LAMP_WIDE = 4, 0.75, 0.14, 0.22
# How far above a roof it is looked whether the body goes on, as a share of the rear's width.
ABOVE = 0.3
# Places at which the two halves are compared.
MIRROR = 12


@njit(cache=True)
def _look(sums, outline, scene, row_out):  # type: ignore[no-untyped-def]
    """Write the cues of edges and brightness of one outline (x0, x1, row)."""
    height, width = sums.shape[1] - 1, sums.shape[2] - 1
    x0, x1, row = outline
    horizon, middle, focal = scene
    wide, contact = x1 - x0, row - horizon
    usual = REAR * contact
    top, bottom, pillar_top = int(row - 0.5 * usual), int(row - 0.08 * usual), int(row - 0.8 * usual)
    cut_left, cut_right = x0 < 3.0, x1 > width - 3.0
    a, b = rear_edges(x0, x1, contact, middle, focal)
    size = math.log(max((b - a) / usual, 0.05))
    row_out[Cue.CUT_WIDTH if cut_left or cut_right else Cue.WIDTH] = size
    row_out[Cue.NEARNESS] = math.log(contact)

    level = mean(sums, ACROSS, int(x0 - 0.5 * wide), top, int(x1 + 0.5 * wide), bottom) + 2.0
    sides, pillars, contrasts = np.full(2, FRAME_SIDE), np.full(2, FRAME_SIDE), np.full(2, FRAME_SIDE)
    gap, strip = 0.02 * wide + 1.0, 0.12 * wide + 1.0
    for k in range(2):
        if cut_right if k else cut_left:
            continue
        place = x1 if k else x0
        sides[k] = min(side(sums, place, top, bottom) / level, 4.0)
        pillars[k] = min(side(sums, place, pillar_top, top) / level, 4.0)
        before = mean(sums, BRIGHT, int(place - gap - strip), top, int(place - gap), bottom)
        after = mean(sums, BRIGHT, int(place + gap), top, int(place + gap + strip), bottom)
        contrasts[k] = min(abs(after - before) / level, 6.0)
    row_out[Cue.WEAKER_SIDE], row_out[Cue.STRONGER_SIDE] = sides.min(), sides.max()
    row_out[Cue.WEAKER_PILLAR], row_out[Cue.STRONGER_PILLAR] = pillars.min(), pillars.max()
    row_out[Cue.WEAKER_CONTRAST], row_out[Cue.STRONGER_CONTRAST] = contrasts.min(), contrasts.max()

    left, right = int(max(a, 0.0)), int(min(b, width))
    right = max(right, left + 4)
    steps = mean(sums, DOWN, left, top, right, int(row)) + 3.0
    _, row_out[Cue.FOOT_LEAST], row_out[Cue.FOOT_MEAN] = foot(sums, left, right, row, 1, steps)
    rear = right - left
    gap_below, tall = max(2, int(0.05 * rear)), max(2, int(0.18 * rear))
    first, last = int(row) + gap_below, int(row) + gap_below + tall
    above = mean(sums, DOWN, left, int(row) - gap_below - 2 * tall, right, int(row) - gap_below)
    row_out[Cue.ROAD] = min(mean(sums, DOWN, left, first, right, last) / (above + 0.5), 2.0)
    if first + 2 < height:
        dark = mean(sums, BRIGHT, left, int(row - 0.08 * rear) - 1, right, int(row))
        row_out[Cue.SHADOW] = math.log((dark + 8.0) / (mean(sums, BRIGHT, left, first, right, last) + 8.0))

    inner_left, inner_right = int(x0 + 0.1 * wide), int(x1 - 0.1 * wide)
    row_out[Cue.EDGES_INSIDE] = min(mean(sums, ACROSS, inner_left, top, inner_right, bottom) / level, 3.0)
    beside = mean(sums, ACROSS, int(x0 - 0.4 * wide), top, int(x0 - 0.06 * wide), bottom)
    beside += mean(sums, ACROSS, int(x1 + 0.06 * wide), top, int(x1 + 0.4 * wide), bottom)
    row_out[Cue.EDGES_BESIDE] = min(0.5 * beside / level, 3.0)
    row_out[Cue.STEPS_INSIDE] = min(mean(sums, DOWN, inner_left, top, inner_right, bottom) / level, 4.0)
    lamps, between = np.zeros(2), 0.0
    for band in range(LAMP_BANDS):
        first = int(row - (LAMP_TOP - band * LAMP_TALL) * usual)
        last = max(int(row - (LAMP_TOP - (band + 1) * LAMP_TALL) * usual), first + 1)
        reach = max(LAMP_WIDE * (b - a), 2.0)
        lamps[0] = max(lamps[0], mean(sums, RED, int(a), first, int(a + reach), last))
        lamps[1] = max(lamps[1], mean(sums, RED, int(b - reach), first, int(b), last))
        between = max(between, mean(sums, RED, int(a + 1.3 * reach), first, int(b - 1.3 * reach), last))
    row_out[Cue.WEAKER_LAMP], row_out[Cue.STRONGER_LAMP] = lamps.min(), lamps.max()
    row_out[Cue.RED_BETWEEN] = between
    profile = np.empty(MIRROR)
    for k in range(MIRROR):
        c0, c1 = int(a + k * (b - a) / MIRROR), int(a + (k + 1) * (b - a) / MIRROR) + 1
        profile[k] = mean(sums, ACROSS, c0, top, c1, bottom)
    profile -= profile.mean()
    row_out[Cue.SYMMETRY] = (profile * profile[::-1]).sum() / ((profile * profile).sum() + 1e-6)


@njit(cache=True)
def _weigh(outline, rear, x, y, u, v, evidence, horizon, middle, row_out):  # type: ignore[no-untyped-def]
    """Write the cues of the points of one outline; return the row of the highest one for it."""
    x0, x1, row = outline
    wide = x1 - x0
    play, top = 0.03 * wide + 1.0, row - 1.2 * rear
    weight, sx, sy, sxx, syy, su, sv, suv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    total, against, count, count_against, core = 0.0, 0.0, 0, 0, 0
    left, right, highest, lowest = 1e9, -1e9, 1e9, -1e9
    for i in range(x.size):
        if x[i] < x0 - play or x[i] > x1 + play or y[i] < top or y[i] > row + play:
            continue
        value = min(max(evidence[i], -MOST), MOST)
        # Above the horizon far scenery moves like a vehicle: it cannot speak for one.
        if y[i] < horizon + 2.0:
            value = min(value, 0.5)
        # Over a low vehicle's roof the background is seen.
        over = y[i] < row - 0.8 * rear
        if value > 0.0:
            if value > CLEAR:
                count += 1
                weight += value
                sx += value * x[i]
                sy += value * y[i]
                sxx += value * x[i] * x[i]
                syy += value * y[i] * y[i]
                su += value * u[i]
                sv += value * v[i]
                suv += value * (u[i] * u[i] + v[i] * v[i])
                left, right = min(left, x[i]), max(right, x[i])
                highest, lowest = min(highest, y[i]), max(lowest, y[i])
            if value > CLEAR or not over:
                total += value
        elif not over:
            against -= value
            if value < -CLEAR:
                count_against += 1
                if x0 + 0.15 * wide < x[i] < x1 - 0.15 * wide and y[i] < row - 0.1 * wide:
                    core += 1
    row_out[Cue.FOR], row_out[Cue.AGAINST] = min(total, 40.0), min(against, 40.0)
    row_out[Cue.SHARE] = (total + 0.5) / (total + against + 1.0)
    row_out[Cue.COUNT_FOR], row_out[Cue.COUNT_AGAINST] = min(count, 15), min(count_against, 15)
    row_out[Cue.CORE_AGAINST] = min(core, 8)
    row_out[Cue.DENSITY] = count / math.sqrt(wide)
    if count == 0:
        row_out[Cue.GAP_INNER] = row_out[Cue.GAP_OUTER] = row_out[Cue.GAP_BELOW] = 1.0
        row_out[Cue.GAP_ABOVE] = 1.2
        return row - 0.5 * rear
    mean_u, mean_v = su / weight, sv / weight
    moves = BODY_PLAY + BODY_SHARE * wide
    scatter = max(suv - (su * su + sv * sv) / weight, 0.0) / weight
    row_out[Cue.SCATTER] = min(scatter / (moves * moves), 9.0)
    gaps = ((left - x0) / wide, (x1 - right) / wide)
    toward_left = 0.5 * (x0 + x1) > middle
    row_out[Cue.GAP_INNER] = gaps[0] if toward_left else gaps[1]
    row_out[Cue.GAP_OUTER] = gaps[1] if toward_left else gaps[0]
    row_out[Cue.GAP_ABOVE], row_out[Cue.GAP_BELOW] = (highest - top) / rear, (row - lowest) / rear
    row_out[Cue.SPREAD_X] = math.sqrt(max(sxx / weight - (sx / weight) ** 2, 0.0)) / wide
    row_out[Cue.SPREAD_Y] = math.sqrt(max(syy / weight - (sy / weight) ** 2, 0.0)) / rear
    alike, beside, under, under_for = 0.0, 0.0, 0.0, 0.0
    reach, ceiling = REACH * wide, max(row - 0.8 * rear, horizon + 2.0)
    for i in range(x.size):
        if x[i] < x0 - reach or x[i] > x1 + reach or y[i] < ceiling or y[i] > row + reach:
            continue
        value = min(max(evidence[i], -MOST), MOST)
        if x0 - play <= x[i] <= x1 + play:
            if y[i] > row + play:
                if value < 0.0:
                    under -= value
                elif value > CLEAR:
                    under_for += value
        elif y[i] <= row + play:
            if value > CLEAR and abs(u[i] - mean_u) < moves and abs(v[i] - mean_v) < moves:
                alike += value
            elif value < 0.0:
                beside -= value
    row_out[Cue.ALIKE_BESIDE], row_out[Cue.AGAINST_BESIDE] = min(alike, 20.0), min(beside, 20.0)
    row_out[Cue.AGAINST_BELOW], row_out[Cue.FOR_BELOW] = min(under, 20.0), min(under_for, 20.0)
    return highest


@njit(cache=True)
def _weaker_side(sums, x0, x1, first, last, level):  # type: ignore[no-untyped-def]
    """Return the vertical edge over rows [first, last) on the weaker of the sides that the frame shows."""
    weaker = 4.0
    if x0 >= 3.0:
        weaker = min(weaker, side(sums, x0, first, last) / level)
    if x1 <= sums.shape[2] - 4.0:
        weaker = min(weaker, side(sums, x1, first, last) / level)
    return weaker


@njit(cache=True)
def _cues(sums, outlines, x, y, u, v, evidence, scene):  # type: ignore[no-untyped-def]
    width = sums.shape[2] - 1
    count = outlines.shape[0]
    found, boxes = np.zeros((2 * count, COUNT)), np.empty((2 * count, 4))
    for k in range(count):
        outline = (outlines[k, 0], outlines[k, 1], outlines[k, 2])
        x0, x1, row = outline
        wide = x1 - x0
        _look(sums, outline, scene, found[k])
        rear = rear_width(x0, x1, row - scene[0], scene[1], scene[2], width)
        highest = _weigh(outline, rear, x, y, u, v, evidence, scene[0], scene[1], found[k])
        found[count + k] = found[k]
        for tall in range(2):
            index = count * tall + k
            top, strength = roof(sums, x0, x1, row, rear, highest, tall == 1)
            boxes[index] = (x0, top, x1, row)
            found[index, Cue.ROOF] = strength
            found[index, Cue.TALLNESS] = (row - top) / rear
            first, last = int(top), int(row - 0.08 * wide)
            level = mean(sums, ACROSS, int(x0 - 0.5 * wide), first, int(x1 + 0.5 * wide), last) + 2.0
            found[index, Cue.FRAME] = _weaker_side(sums, x0, x1, first, last, level)
            above = int(top - ABOVE * rear)
            found[index, Cue.SIDE_ABOVE] = _weaker_side(sums, x0, x1, above, first - 1, level)
        found[k, Cue.OTHER_ROOF] = found[count + k, Cue.ROOF]
        found[count + k, Cue.OTHER_ROOF] = found[k, Cue.ROOF]
    return found, boxes


def cues(
    relief: Relief, outlines: Floats, position: Floats, moved: Floats, evidence: Floats
) -> tuple[Floats, Floats]:
    """Measure all cues of outlines, each under a car's roof and under a van's or lorry's.

    Args:
        relief: Of the picture.
        outlines: (K, 3) x0, x1, contact row, px.
        position: (N, 2) of points that have been followed for a while, px.
        moved: (N, 2) how far they moved over the remembered time, px.
        evidence: (N,) their log odds of being on a vehicle that goes the ego's way.

    Returns:
        (2 K, len(Cue)), and the boxes (2 K, 4): first all K under low roofs, then under high ones.
    """
    x, y = np.ascontiguousarray(position.T)
    u, v = np.ascontiguousarray(moved.T)
    scene = (float(relief.horizon), float(relief.middle), float(relief.focal))
    found, boxes = _cues(relief.sums, np.ascontiguousarray(outlines), x, y, u, v, evidence, scene)
    return found, boxes
