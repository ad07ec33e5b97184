"""highway-env's straights and arcs as plain numbers: where many vehicles are on them, at once.

What is decided here is left undecided where it is closer than `TOLERANCE`: arithmetic that rounds otherwise
than highway-env's must not decide otherwise.
"""

from __future__ import annotations

import math

import numpy as np
from highway_env.road.lane import AbstractLane, StraightLane
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TOLERANCE = 1e-6
"""Metres. Decisions closer than this are left to highway-env; rounding errors are a million times smaller."""
NEAR = 12.0
"""Metres around a lane within which cells know of it. Farther from all lanes, every lane is searched."""
TWO_PI = 2 * math.pi

CHART = np.dtype(
    [
        ("straight", "?"),
        ("x0", "f8"),  # its start, or the arc's centre
        ("y0", "f8"),
        ("a", "f8"),  # unit vector along it, or radius
        ("b", "f8"),  # and phase of the start,
        ("c", "f8"),  # its heading, or 1 for a clockwise arc and -1 for another
        ("length", "f8"),
        ("margin", "f8"),  # of `Road.neighbour_vehicles`, along
        ("half_width", "f8"),  # and across
        ("half_turn", "f8"),  # length of half a circle
    ]
)
"""A straight or circular lane."""


def chart(lane: AbstractLane) -> NDArray[np.void]:
    """Return the `CHART` record () of a straight or circular lane."""
    out = np.zeros((), CHART)
    straight = type(lane) is StraightLane
    if straight:
        numbers = (*lane.start, *lane.direction, lane.heading, math.inf)
    else:
        bend = lane.radius, lane.start_phase, lane.direction
        numbers = (*lane.center, *bend, math.pi * lane.radius)
    x0, y0, a, b, c, half_turn = numbers
    half_width = lane.width / 2 + 1
    out[()] = (straight, x0, y0, a, b, c, lane.length, lane.VEHICLE_LENGTH, half_width, half_turn)
    return out


@njit(cache=True)  # type: ignore[untyped-decorator]
def local(
    straight: bool, x0: float, y0: float, a: float, b: float, c: float, x: float, y: float
) -> tuple[float, float]:
    """Return local coordinates of a position, along and across, metres; a chart's first fields say where."""
    dx, dy = x - x0, y - y0
    if straight:
        return dx * a + dy * b, dy * a - dx * b
    turn = (math.atan2(dy, dx) - b + math.pi) % TWO_PI - math.pi
    return c * turn * a, c * (a - math.hypot(dx, dy))


@njit(cache=True)  # type: ignore[untyped-decorator]
def closest(charts: NDArray[np.void], near: Ints, spans: Ints, places: Floats) -> Ints:
    """Find the chart that is the closest by `AbstractLane.distance_with_heading`.

    Args:
        charts: (L,) `CHART` records.
        near: Numbers of charts, grouped by cells.
        spans: (N, 2) first and last plus one of each place's cell in ``near``.
        places: (N, 3) x, y and heading.

    Returns:
        (N,) number of the chart; -1 where none is within `NEAR`, or two are closer than `TOLERANCE` to each
        other.
    """
    out = np.full(len(places), -1, np.int64)
    for n in range(len(places)):
        x, y, heading = places[n]
        found, best, second = -1, NEAR, math.inf
        for k in near[spans[n, 0] : spans[n, 1]]:
            lane = charts[k]
            s, r = local(lane.straight, lane.x0, lane.y0, lane.a, lane.b, lane.c, x, y)
            along = lane.c if lane.straight else lane.b + lane.c * (s / lane.a + math.pi / 2)
            away = abs(r) + abs((heading - along + math.pi) % TWO_PI - math.pi)
            away += max(-s, s - lane.length, 0.0)
            if away < best:
                found, best, second = k, away, best
            elif away < second:
                second = away
        if second - best > TOLERANCE:
            out[n] = found
    return out


@njit(cache=True)  # type: ignore[untyped-decorator]
def on_charts(
    charts: NDArray[np.void], near: Ints, spans: Ints, places: Floats
) -> tuple[Ints, Ints, Floats, NDArray[np.bool_]]:
    """Find on which charts `Road.neighbour_vehicles` sees each place; arguments as of `closest`.

    Returns:
        For each of K finds (K,) the place and the chart, by place; (K,) how far along, metres; (K,) whether
        it is in doubt.
    """
    room = (spans[:, 1] - spans[:, 0]).sum()
    place, where = np.zeros(room, np.int64), np.zeros(room, np.int64)
    along, doubt = np.zeros(room), np.zeros(room, np.bool_)
    count = 0
    for n in range(len(places)):
        for k in near[spans[n, 0] : spans[n, 1]]:
            lane = charts[k]
            s, r = local(lane.straight, lane.x0, lane.y0, lane.a, lane.b, lane.c, places[n, 0], places[n, 1])
            slack = min(lane.half_width - abs(r), s + lane.margin, lane.length + lane.margin - s)
            # Half a turn away, s jumps from one end of its range to the other.
            unsure = abs(slack) <= TOLERANCE or abs(abs(s) - lane.half_turn) <= TOLERANCE
            if slack >= 0.0 or unsure:
                place[count], where[count], along[count], doubt[count] = n, k, s, unsure
                count += 1
    return place[:count], where[:count], along[:count], doubt[:count]
