"""How the points on a body carry it: which of them still move with it, where it goes, how it grows."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

# How far the points of one body may move apart over the remembered time: px, and as a share of its width.
BODY_PLAY, BODY_SHARE = 1.0, 0.02
# The same from one frame to the next.
STEP_PLAY, STEP_SHARE = 1.0, 0.02
# Most growth that is believed, share of the size a frame, and the points' spread, px^2, below which they
# hardly tell it.
MOST_GROWTH, SPREAD, LEAST_SPREAD = 0.05, 2000.0, 30.0


@njit(cache=True)
def _middle(values):  # type: ignore[no-untyped-def]
    return np.array([np.median(values[:, 0]), np.median(values[:, 1])])


@njit(cache=True)
def body_motion(position, flow, moved, ripe, middle, wide, growth, remembered):  # type: ignore[no-untyped-def]
    """Tell how a body moved from the points on it.

    Args:
        position: (N, 2) of the points after the step, px, N >= 1.
        flow: (N, 2) their step, px.
        moved: (N, 2) their displacement over the remembered time, px.
        ripe: (N,) whether that was long enough to tell.
        middle: (2,) of the body before the step, px.
        wide: Its width, px.
        growth: Share of its size a frame, as it was.
        remembered: Frames that ``moved`` spans.

    Returns:
        Which points move with the body (N,); the median step of these (2,); their median distance from the
        middle (2,), both px; the growth that they show; and how far it can be trusted, 0 to 1.
    """
    count = len(position)
    away = position - middle - _middle(flow)
    off = flow - _middle(flow) - growth * away
    kept = np.maximum(np.abs(off[:, 0]), np.abs(off[:, 1])) <= STEP_PLAY + STEP_SHARE * wide
    if count >= 3:
        # Over a longer time bodies come apart that a frame does not tell apart.
        long = moved - growth * remembered * away
        off = long - _middle(long)
        far = np.maximum(np.abs(off[:, 0]), np.abs(off[:, 1])) > 2.0 * (BODY_PLAY + BODY_SHARE * wide)
        kept &= ~(far & ripe)
    flow, away = flow[kept], away[kept]
    number = len(flow)
    if number == 0:
        return kept, np.zeros(2), np.zeros(2), 0.0, 0.0
    scale, trust = 0.0, 0.0
    if number >= 3:
        mean_x, mean_y = away[:, 0].mean(), away[:, 1].mean()
        step_x, step_y = flow[:, 0].mean(), flow[:, 1].mean()
        power, shared = 0.0, 0.0
        for i in range(number):
            dx, dy = away[i, 0] - mean_x, away[i, 1] - mean_y
            power += dx * dx + dy * dy
            shared += dx * (flow[i, 0] - step_x) + dy * (flow[i, 1] - step_y)
        scale = min(max(shared / max(power, LEAST_SPREAD), -MOST_GROWTH), MOST_GROWTH)
        trust = power / (power + SPREAD)
    return kept, _middle(flow), _middle(away), scale, trust


def inward(relative: NDArray[np.float64], moved: NDArray[np.float64]) -> float:
    """Return how far points (N, 2) from the focus of expansion that moved by (N, 2) came nearer to it, px."""
    away = np.maximum(np.hypot(relative[:, 0], relative[:, 1]), 1.0)
    return -float(np.median((moved * relative).sum(1) / away))


@njit(cache=True)  # type: ignore[untyped-decorator]
def covered(box: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the shared area over the smaller box's area."""
    wide = min(box[2], other[2]) - max(box[0], other[0])
    tall = min(box[3], other[3]) - max(box[1], other[1])
    if wide <= 0 or tall <= 0:
        return 0.0
    smaller = min((box[2] - box[0]) * (box[3] - box[1]), (other[2] - other[0]) * (other[3] - other[1]))
    share: float = wide * tall / max(smaller, 1e-9)
    return share
