"""Two roads that cross at traffic lights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.aerial.networks import STEP, Entry, LaneIndex, Network, Path, Signals, Strip
from sim.params import AerialRoadParams, AerialTrafficParams
from sim.roads import to_plane

Floats = NDArray[np.float64]

BOX = 22.0
"""Metres from an intersection's middle to its stop lines."""


def crossing_roads(params: AerialRoadParams, traffic: AerialTrafficParams, arm_length: float) -> Network:
    """Lay two roads that cross at the origin, with lights and lanes of their own for those who turn left.

    Arms are numbered counter-clockwise from east. On each, seen by those who come in, lane 0 turns left, the
    others go straight on and the last turns right too. Phases: straight on and right of two opposite arms,
    then their left turns. Each arm is ``arm_length`` metres long, from the middle.
    """
    from highway_env.road.lane import CircularLane, StraightLane
    from highway_env.road.road import RoadNetwork

    width, through = params.lane_width, params.lanes
    network = RoadNetwork()
    # Of arms at 0, offsets to the right of the arm's inward direction; straight on, lane k meets exit k - 1.
    offsets: Floats = (np.arange(through + 1, dtype=np.float64) + 0.5) * width
    common = {"width": width, "speed_limit": None}

    def straight(start: Floats, end: Floats) -> Any:
        return StraightLane(to_plane(*start), to_plane(*end), **common)

    for arm in range(4):
        out = np.array([np.cos(arm * np.pi / 2), np.sin(arm * np.pi / 2)])
        left_of_out = np.array([-out[1], out[0]])
        for lane, offset in enumerate(offsets):
            # To the right of those who come in is to the left of those who look outward.
            stop = BOX - (width if lane == 0 else 0.0)
            network.add_lane(
                *_approach(arm, lane)[:2],
                straight(arm_length * out + offset * left_of_out, stop * out + offset * left_of_out),
            )
        for offset in offsets[1:]:
            network.add_lane(
                f"e{arm}",
                f"o{arm}",
                straight(BOX * out - offset * left_of_out, arm_length * out - offset * left_of_out),
            )
    for arm in range(4):
        out = np.array([np.cos(arm * np.pi / 2), np.sin(arm * np.pi / 2)])
        side = np.array([-out[1], out[0]])
        opposite, right, left = (arm + 2) % 4, (arm + 1) % 4, (arm + 3) % 4
        for offset in offsets[1:]:
            network.add_lane(
                f"a{arm}", f"e{opposite}", straight(BOX * out + offset * side, -BOX * out + offset * side)
            )
        for k, offset, to, bend in ((through, offsets[-1], right, -1.0), (0, offsets[0], left, 1.0)):
            start = (BOX - (width if k == 0 else 0.0)) * out + offset * side
            # A left turn begins a lane's width later, and so ends on the exit's inner lane.
            radius = BOX - offsets[-1] if bend < 0 else BOX + offsets[0]
            heading = arm * np.pi / 2 + np.pi
            centre = start + bend * radius * np.array([-np.sin(heading), np.cos(heading)])
            first = -(heading - bend * np.pi / 2)
            network.add_lane(
                _approach(arm, k)[1],
                f"e{to}",
                CircularLane(
                    to_plane(*centre), radius, first, first - bend * np.pi / 2, clockwise=bend < 0, **common
                ),
            )
    return _with_lights(params, traffic, network, offsets, arm_length)


def _approach(arm: int, lane: int) -> LaneIndex:
    """Return the index of an approach's lane, by its number from the left.

    Those who turn left have a road of their own: highway-env's drivers look at every road that goes on from
    theirs, and would heed the red light of the lane beside them.
    """
    return (f"l{arm}", f"b{arm}", 0) if lane == 0 else (f"i{arm}", f"a{arm}", lane - 1)


def _with_lights(
    params: AerialRoadParams, traffic: AerialTrafficParams, network: Any, offsets: Floats, arm_length: float
) -> Network:
    """Say who drives where on the lanes of two roads that cross, and what is painted there."""
    through, width = params.lanes, params.lane_width
    entries, lines = [], {}
    for arm in range(4):
        opposite, right, left = (arm + 2) % 4, (arm + 1) % 4, (arm + 3) % 4
        density = traffic.density if arm % 2 == 0 else traffic.oncoming_density
        for lane in range(through + 1):
            ways: list[tuple[int, int]]
            if lane == 0:
                ways = [(left, 0)]
            else:
                ways = [(opposite, lane - 1)] + ([(right, through - 1)] if lane == through else [])
            paths = tuple(
                Path.along(
                    network,
                    [
                        _approach(arm, lane),
                        (_approach(arm, lane)[1], f"e{to}", 0 if to in (left, right) else exit_lane),
                        (f"e{to}", f"o{to}", exit_lane),
                    ],
                )
                for to, exit_lane in ways
            )
            index = _approach(arm, lane)
            lines[index] = network.get_lane(index).length - 0.6
            entries.append(
                Entry(
                    paths=paths,
                    shares=(1.0,) if len(paths) == 1 else (0.65, 0.35),
                    density=density * (0.7 if lane == 0 else 1.0),
                    rank=(0, 1),
                    stream=arm,
                    filled=lines[index] - 12.0,
                )
            )
    straight_on = [[_approach(arm, k) for k in range(1, through + 1)] for arm in range(4)]
    turns = [[_approach(arm, 0)] for arm in range(4)]
    signals = Signals(
        phases=tuple(tuple(group[a] + group[a + 2]) for a in (0, 1) for group in (straight_on, turns)),
        greens=(10.0, 3.0, 6.0, 3.0),
        clearance=3.0,
        lines=lines,
    )
    strips, stops, zebras = [], [], []
    half = float(offsets[-1]) + width / 2
    for arm in range(4):
        angle = arm * np.pi / 2
        out, side = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        s = np.arange(0.0, arm_length - BOX + STEP, STEP)
        marks = [(half - 0.25, 1), (0.0, 3), (-width, 3), (0.25 - half, 1)]
        marks += [(k * width, 1 if k == 1 else 2) for k in range(1, through + 1)]
        marks += [(-width - k * width, 2) for k in range(1, through)]
        marks.sort(reverse=True)
        strips.append(
            Strip(
                line=(BOX + s)[:, None] * out,
                headings=np.full(len(s), angle),
                s=s,
                paved=(-half - 0.6, half + 0.6),
                edges=np.array([d for d, _ in marks]),
                styles=np.array([style for _, style in marks], np.uint8),
            )
        )
        stops.append([BOX * out + 0.2 * side, BOX * out + (half - 0.3) * side])
        zebras.append([(BOX - 4.5) * out - half * side, (BOX - 4.5) * out + half * side])
    east = np.linspace(-BOX - 0.5, BOX + 0.5, 24)
    middle = Strip(
        line=np.column_stack([east, np.zeros(24)]),
        headings=np.zeros(24),
        s=east - east[0],
        paved=(-BOX, BOX),
        edges=np.zeros(0),
        styles=np.zeros(0, np.uint8),
    )
    return Network(
        lanes=network,
        entries=tuple(entries),
        strips=(*strips, middle),
        stop_lines=np.array(stops),
        crossings=np.array(zebras),
        signals=signals,
    )
