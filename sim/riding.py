"""How riders see each other: who is ahead, who is beside, how hard to brake, and which steps are not taken.

Pure functions on the arrays of `Riders`; `sim.riders` decides with them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

ACCELERATION = 1.8
"""M/s^2 on a free road."""
BRAKING = 2.2
"""M/s^2 that is comfortable."""
SIDE = 0.22
"""Metres that riders abreast keep between them."""

_TIME_GAP, _STANDSTILL = 0.55, 0.9  # seconds and metres that are kept to whoever rides ahead
_FIRM = 3.2  # m/s^2, for whoever cuts in
_SIGHT = 28.0  # metres ahead


@dataclass(frozen=True, slots=True, kw_only=True)
class Riders:
    """N riders as parallel arrays; d counts to the left, speeds along the own way.

    Attributes:
        ids: (N,) uint32.
        way: (N,) 1, or -1 for who comes the wrong way.
        s: (N,) metres along the lane.
        d: (N,) metres, offset of the middle.
        v: (N,) m/s, >= 0.
        u: (N,) m/s to the left.
        yaw: (N,) radians from the lane's direction, to the left.
        lean: (N,) metres to the left for each metre of height.
        aim: (N,) offset that is steered for.
        wanted: (N,) m/s.
        favourite: (N,) offset that it likes best.
        weave: (N, 3) metres, rad/s and radians: how the favourite swings.
        stop: (N,) s of the place at the kerb where it stops, not a number if it stops nowhere.
        leave: (N,) tick at which a standing one leaves; 0 while it rides.
        half: (N, 2) half length and half width, with the room that turning takes.
        sizes: (N, 3) metres.
        models: (N,) int32.
        colours: (N, 3) float32.
    """

    ids: NDArray[np.uint32]
    way: Floats
    s: Floats
    d: Floats
    v: Floats
    u: Floats
    yaw: Floats
    lean: Floats
    aim: Floats
    wanted: Floats
    favourite: Floats
    weave: Floats
    stop: Floats
    leave: NDArray[np.int64]
    half: Floats
    sizes: Floats
    models: NDArray[np.int32]
    colours: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.ids)

    def take(self, rows: Mask) -> Self:
        """Return the riders that (N,) ``rows`` selects."""
        return replace(self, **{f.name: getattr(self, f.name)[rows] for f in fields(self)})

    def joined(self, other: Self) -> Self:
        """Return these riders and others."""
        return replace(
            self,
            **{f.name: np.concatenate([getattr(self, f.name), getattr(other, f.name)]) for f in fields(self)},
        )


def idm(v: Floats, wanted: Floats, gap: Floats, closing: Floats) -> Floats:
    """Acceleration of the intelligent driver model, m/s^2; an infinite gap is a free road.

    Who is cut in on brakes firmly, and harder only where that would not do.
    """
    dynamic = v * _TIME_GAP + v * closing / (2 * np.sqrt(ACCELERATION * BRAKING))
    room = np.maximum(gap, 0.05)
    ratio = (_STANDSTILL + np.maximum(dynamic, 0.0)) / room
    rate = ACCELERATION * (1 - (v / np.maximum(wanted, 0.1)) ** 4 - ratio**2)
    needed = np.maximum(closing, 0.0) ** 2 / (2 * np.maximum(gap - 0.4, 0.05))
    return np.asarray(np.maximum(rate, -np.maximum(_FIRM, 1.2 * needed)))


def ahead(now: Riders) -> tuple[Floats, Floats]:
    """Give the free metres (N, N) from each rider to each one before it, and how fast they close, m/s.

    Whoever is behind, or out of sight, is infinitely far.
    """
    along = now.way[:, None] * (now.s[None, :] - now.s[:, None])
    gap = along - now.half[:, None, 0] - now.half[None, :, 0]
    closing = now.v[:, None] - now.v[None, :] * now.way[:, None] * now.way[None, :]
    before = (along > 0) & (gap < _SIGHT + 2.0 * np.maximum(closing - 4.0, 0.0))
    return np.where(before, gap, np.inf), closing


def space(now: Riders) -> tuple[Floats, Floats]:
    """Give the free metres to the right and to the left of each rider, between those who could not brake."""
    between = np.abs(now.s[None, :] - now.s[:, None]) - now.half[:, None, 0] - now.half[None, :, 0]
    speed = now.way * now.v
    nearer = (speed[:, None] - speed[None, :]) * np.sign(now.s[None, :] - now.s[:, None])
    ahead = now.s[None, :] > now.s[:, None]
    behind = np.where(ahead == (now.way > 0)[:, None], now.v[:, None], now.v[None, :])
    beside = between < 0.7 + 0.2 * behind + np.maximum(nearer, 0.0) ** 2 / (2 * BRAKING)
    np.fill_diagonal(beside, False)
    across = now.d[None, :] - now.d[:, None]
    free = np.maximum(np.abs(across) - now.half[:, None, 1] - now.half[None, :, 1] - SIDE, 0.0)
    right = np.where(beside & (across <= 0), free, np.inf).min(axis=1, initial=np.inf)
    left = np.where(beside & (across >= 0), free, np.inf).min(axis=1, initial=np.inf)
    return right, left


def apart(now: Riders, s: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Take back moves after which bodies would touch, first those to the side, then those ahead.

    Args:
        now: Riders none of whom touches another.
        s: (N,) where they would go.
        d: (N,) likewise.

    Returns:
        s and d (N,) where none touches another.
    """
    s, d = s.copy(), d.copy()
    length = now.half[:, None, 0] + now.half[None, :, 0]
    width = now.half[:, None, 1] + now.half[None, :, 1]
    behind = now.way[:, None] * (now.s[None, :] - now.s[:, None]) > 0
    while True:
        touch = (np.abs(s[None, :] - s[:, None]) < length) & (np.abs(d[None, :] - d[:, None]) < width)
        np.fill_diagonal(touch, False)
        steered = touch.any(axis=1) & (d != now.d)
        moved = touch.any(axis=1) & (s != now.s)
        if steered.any():
            d[steered] = now.d[steered]
        elif moved.any():
            # Of two in line the one behind waits.
            waiting = moved & (touch & behind).any(axis=1)
            back = waiting if waiting.any() else moved
            s[back] = now.s[back]
        else:
            return s, d
