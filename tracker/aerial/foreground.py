"""What of the changes is a vehicle, and what is a shadow, a tree in the wind, a wall that leans, or nothing.

What a shadow falls on keeps its pattern, only darker; leaves change all the time, and are green; walls shift
along their edges. No single cue tells them from vehicles, as a dark roof looks like a shadow, but those of a
pixel and its surroundings do together, weighed by boosted trees (`tracker.boosting`), as in Shotton et al.,
Real-time human pose recognition in parts from single depth images, CVPR 2011. Below a bridge, where changes
are faint, that gives back what is missing within a vehicle.

The trees (foreground.npz) were learnt from simulated flights by ``python -m
tests.training.aerial_foreground``, over roads of all kinds, from many heights, in many lights.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.aerial.background import Background
from tracker.boosting import learnt, log_odds
from tracker.surroundings import (
    DIM,
    UNIT,
    Blocks,
    average,
    blocks,
    candidates,
    differences,
    integrals,
    reaches,
    smoothed,
)

Mask = NDArray[np.bool_]

DENSE = 0.36
"""A pixel is looked at if such a share of what is around it changes, as at a rectangle's corner."""
BLOCK = 2
"""Side, px, of the squares that are decided as one."""
RINGS = ((3.0, 1), (6.0, 1), (10.0, 2), (16.0, 3))
"""Radii, px, on which surroundings are looked at in eight directions, and half widths of squares there."""
OFFSETS = np.array(
    [(0, 0, 1)]
    + [
        (round(radius * np.cos(angle)), round(radius * np.sin(angle)), half)
        for radius, half in RINGS
        for angle in np.arange(8) * np.pi / 4
    ],
    np.int64,
)
"""(K, 3) to the right, down, and half the width of the square, px."""
AREAS = np.array([2, 5, 10, 20], np.int64)
"""Half the widths, px, of the squares around a pixel whose share of changes is taken."""
OWN = 15
"""Cues of the pixel itself."""
COUNT = OWN + 2 * len(AREAS) + 2 * len(OFFSETS)
"""Cues of a pixel with its surroundings."""
SETTLED = -1.5, 1.5
"""Log odds after the first trees beyond which the others hardly ever change the sign."""


@njit(cache=True, error_model="numpy")
def _gather(now, then, sums, changes, reached, spread, often, rows, columns, offsets, areas):  # type: ignore[no-untyped-def]
    """Return (N, COUNT) the cues of pixels.

    ``sums`` are `integrals` of `differences`, ``changes`` those of changes and of how often they are.
    """
    found = np.empty((rows.size, OWN + 2 * areas.size + 2 * offsets.shape[0]), np.float32)
    for n in range(rows.size):
        y, x = rows[n], columns[n]
        r, g, b = float(now[0, y, x]), float(now[1, y, x]), float(now[2, y, x])
        s, h, c = float(then[0, y, x]), float(then[1, y, x]), float(then[2, y, x])
        red, green, blue = (r + 1.0) / (s + 1.0), (g + 1.0) / (h + 1.0), (b + 1.0) / (c + 1.0)
        ratio = (red + green + blue) / 3.0
        most = max(r, g, b)
        found[n, 0] = ratio
        found[n, 1] = (blue - red) / ratio
        found[n, 2] = (green - 0.5 * (red + blue)) / ratio
        found[n, 3] = (most - min(r, g, b)) / (most + DIM)
        found[n, 4] = r + g + b
        ground = max(s, h, c)
        found[n, 5] = s + h + c
        found[n, 6] = (ground - min(s, h, c)) / (ground + DIM)
        found[n, 7] = (2.0 * h - s - c) / (ground + DIM)
        found[n, 8] = max(abs(r - s), abs(g - h), abs(b - c))
        found[n, 9], found[n, 10] = spread[y, x], often[y, x]
        for k in range(4):
            found[n, 11 + k] = reached[n, k]
        at = OWN
        for k in range(areas.size):
            for kind in range(2):
                found[n, at] = average(changes[kind], y, x, areas[k])
                at += 1
        for k in range(offsets.shape[0]):
            for kind in range(2):
                found[n, at] = average(sums[kind], y + offsets[k, 1], x + offsets[k, 0], offsets[k, 2])
                at += 1
    return found


def cues(
    background: Background, raw: Mask, rows: NDArray[np.int64], columns: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return (N, COUNT) what tells of pixels whether they are a vehicle's.

    Args:
        background: With the last picture laid on it.
        raw: (H, W) its changes.
        rows: (N,) of the pixels.
        columns: (N,) of them.
    """
    now, then = smoothed(background.laid), smoothed(background.ground)
    changes = np.empty((2, *raw.shape), np.int32)
    np.multiply(raw, UNIT, out=changes[0])
    np.multiply(background.often, UNIT, out=changes[1], casting="unsafe")
    sums = integrals(differences(now, then)), integrals(changes)
    reached, often = reaches(raw, rows, columns), background.often
    found: NDArray[np.float32] = _gather(
        now, then, *sums, reached, background.spread, often, rows, columns, OFFSETS, AREAS
    )
    return found


def squares(raw: Mask) -> Blocks:
    """Divide what may be a vehicle's (H, W) into squares."""
    return blocks(candidates(raw, DENSE), np.full(len(raw), BLOCK))


def vehicles(background: Background, raw: Mask) -> Mask:
    """Return (H, W) what of the changes is a vehicle.

    Args:
        background: With the last picture laid on it.
        raw: (H, W) its changes.
    """
    near = squares(raw)
    found = cues(background, raw, near.rows, near.columns)
    return near.pixels(log_odds(found, learnt(__package__, "foreground"), settled=SETTLED) > 0.0)
