"""Scenery in lines along the road's edge: rails, walls, fences, posts; and gantries over it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.scenery.settings import LINES, SIGNS
from sim.scenery.yard import GREY, Yard

SEGMENT = 16.0
"""Length of a piece of rail, wall or fence as it is placed, metres."""

LAMP_SPACING = 38.0
"""Metres between lamp posts on one side."""

LIT_SHARE = 0.3
"""Share of a motorway that is lined with lamp posts."""

MEDIAN_BARRIER = 2.0
"""Medians wider than this carry a barrier, metres."""


def _stretches(rng: np.random.Generator, count: int, share: float, run: float) -> NDArray[np.bool_]:
    """Return (count,) flags in runs of about ``run`` segments, ``share`` of them set."""
    flags = np.zeros(count, bool)
    place = 0
    on = bool(rng.random() < share)
    while place < count:
        mean = run if on else run * (1 - share) / max(share, 1e-3)
        length = 1 + int(rng.exponential(mean))
        flags[place : place + length] = on
        place += length
        on = share >= 1 or (share > 0 and not on)
    return flags


def _line(yard: Yard, name: str, d: float, flags: NDArray[np.bool_], *, segment: float = SEGMENT) -> None:
    """Place pieces end to end at offset ``d`` where ``flags`` is set."""
    size = yard.size(name)
    size[0] = segment
    reach = size[1] / 2
    for i in np.flatnonzero(flags):
        s = (float(i) + 0.5) * segment
        if d != 0 and not yard.clear_of_road(s, d, reach):
            continue
        # On the outer side of a bend the pieces lie further apart than on the reference line.
        (x0, x1), (y0, y1) = yard.road.to_world(np.array([s - segment / 2, s + segment / 2]), d)
        fitted = size.copy()
        fitted[0] = float(np.hypot(x1 - x0, y1 - y0)) + 0.02
        yard.add_at(name, float(x0 + x1) / 2, float(y0 + y1) / 2, float(np.arctan2(y1 - y0, x1 - x0)), fitted)


def _posts(
    yard: Yard,
    name: str,
    d: float,
    every: float,
    *,
    turn: float = 0.0,
    first: float = 0.5,
    flags: NDArray[np.bool_] | None = None,
) -> None:
    """Place posts at even distances at offset ``d``, all of them or where ``flags`` (one a post) is set."""
    for i, s in enumerate(np.arange(first * every, yard.road.length, every)):
        if flags is not None and not flags[i]:
            continue
        if yard.clear_of_road(float(s), d, float(yard.size(name)[1]) / 2):
            yard.add(name, float(s), d, turn=turn, colour=SIGNS.get(name, GREY))


def place_lines(yard: Yard, lit: bool) -> None:
    """Place rails, walls, fences, lamp posts, delineators and gantries."""
    road, params = yard.road, yard.params
    low, high = road.paved
    count = int(road.length / SEGMENT)
    plan = LINES[params.setting]
    if road.params.median > MEDIAN_BARRIER and road.params.oncoming_lanes:
        kind = ("barrier", "rail")[yard.stream("median").integers(2)]
        _line(yard, kind, 0.0, np.full(count, params.density > 0))
    for side, edge in (("right", low), ("left", high)):
        out = -1.0 if side == "right" else 1.0
        inward = 0.0 if side == "right" else np.pi
        rails, walls, fences = (
            _stretches(yard.stream(name, side), count, min(1.0, share * params.density), run)
            for name, share, run in zip(("rail", "wall", "fence"), plan.shares, (14, 12, 9), strict=True)
        )
        _line(yard, "rail", edge + out * 0.85, rails)
        _line(yard, plan.wall, edge + out * plan.wall_away, walls)
        _line(yard, "fence", edge + out * plan.fence_away, fences & ~walls)
        if params.density == 0:
            continue
        if params.setting == "urban" or (params.setting == "motorway" and lit):
            name = "lamp-post-a" if params.setting == "motorway" else "lamp-post-b"
            # Towns are lit throughout, motorways at junctions only, on both sides at once.
            posts = int(road.length / LAMP_SPACING) + 1
            share = 1.0 if params.setting == "urban" else LIT_SHARE
            shining = _stretches(yard.stream("lit"), posts, share, 9)
            away, first = yard.size(name)[1] / 2 + 0.4, 0.3 if side == "right" else 0.8
            _posts(yard, name, edge + out * away, LAMP_SPACING, turn=inward, first=first, flags=shining)
        if params.setting == "motorway":
            _posts(yard, "delineator", edge + out * 0.45, 50.0, turn=inward)
        elif params.setting == "rural":
            _posts(yard, "delineator", edge + out * 0.55, 50.0, turn=inward)
            if side == ("right", "left")[yard.stream("wires").integers(2)]:
                _posts(yard, "pole-b", edge + out * 7.0, 45.0)
    if params.setting == "motorway":
        rng = yard.stream("gantry")
        for s in rng.uniform(60, road.length, rng.poisson(0.7 * params.density * road.length / 1000)):
            size = yard.size("gantry")
            size[1] = high - low + 2 * 1.3
            yard.add("gantry", float(s), (low + high) / 2, size=size, colour=SIGNS["gantry"])
