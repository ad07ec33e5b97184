"""Where a vehicle may be that is not tracked yet: windows of a vehicle's size, filled with points that move like one."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car import segments as seg

Floats = NDArray[np.float64]

# Width over the height of the horizon above the contact row: metres of width over metres of camera height.
SLIMMEST, USUAL, WIDEST = 0.85, 1.45, 2.6


@njit(cache=True)
def _score(windows, x, y, evidence, horizon):  # type: ignore[no-untyped-def]
    scores = np.zeros((windows.shape[0], 3))
    for k in range(windows.shape[0]):
        x0, y0, x1, y1 = windows[k, 0], windows[k, 1], windows[k, 2], windows[k, 3]
        play = 0.04 * (x1 - x0) + 1.0
        total, positive, negative = 0.0, 0, 0
        for i in range(x.size):
            if x0 - play <= x[i] <= x1 + play and y0 - play <= y[i] <= y1 + play:
                # Above the horizon far scenery moves like a vehicle: it cannot speak for one.
                value = min(max(evidence[i], -4.0), 4.0)
                if y[i] < horizon + 2.0:
                    value = min(value, 0.0)
                total += value
                if value > 0.8:
                    positive += 1
                elif value < -0.8:
                    negative += 1
        # Slim windows are to win over wide ones that hold the same points.
        scores[k, 0] = total - 0.25 * max(positive + negative, 1) * abs(
            np.log((x1 - x0) / ((y1 - horizon) * USUAL))
        )
        scores[k, 1] = positive
        scores[k, 2] = negative
    return scores


def windows_from_points(x: Floats, y: Floats, horizon: float) -> Floats:
    """Return windows (K, 4) around points (N,) that move like a vehicle: the point at several places of the rear."""
    below = y - horizon
    keep = below > 2.0
    x, below = x[keep], below[keep]
    lift = np.array([1.05, 1.3, 1.7, 2.3])
    place = np.array([-0.4, 0.0, 0.4])
    contact = below[:, None, None] * lift[None, :, None] + np.zeros((1, 1, 3))
    wide = USUAL * contact
    middle = x[:, None, None] + place[None, None, :] * wide
    boxes = np.stack(
        [
            middle - 0.5 * wide,
            horizon + contact - 0.85 * wide,
            middle + 0.5 * wide,
            horizon + contact,
        ],
        -1,
    )
    return np.asarray(boxes.reshape(-1, 4))


def windows_from_segments(segments: Floats, horizon: float) -> Floats:
    """Return windows (K, 4) that stand on horizontal segments as wide as a vehicle at that row (its shadow, its bumper)."""
    x0, x1, y = segments[:, seg.X0], segments[:, seg.X1], segments[:, seg.Y]
    wide, contact = x1 - x0, y - horizon
    keep = (contact > 5.0) & (wide > SLIMMEST * contact) & (wide < WIDEST * contact)
    x0, x1, y, wide = x0[keep], x1[keep], y[keep], wide[keep]
    return np.stack([x0, y - 0.85 * wide, x1, y], 1)


def propose(
    windows: Floats, position: Floats, evidence: Floats, horizon: float, *, least: float, most: int = 4
) -> Floats:
    """Choose the windows that hold the most points that move like a vehicle.

    Args:
        windows: (K, 4) px.
        position: (N, 2) of the points that no vehicle owns.
        evidence: (N,) their log odds.
        horizon: Row, px.
        least: Least sum of log odds.
        most: Windows returned at most; they do not overlap.

    Returns:
        (M, 4) windows, best first.
    """
    if not len(windows) or not len(position):
        return np.zeros((0, 4))
    x, y = np.ascontiguousarray(position.T)
    scores = _score(windows, x, y, evidence, horizon)
    good = (scores[:, 0] >= least) & (scores[:, 1] >= 2) & (scores[:, 1] >= 2.0 * scores[:, 2])
    chosen: list[Floats] = []
    for index in np.argsort(-scores[:, 0], kind="stable"):
        if not good[index] or len(chosen) == most:
            continue
        box = windows[index]
        if all(
            min(box[2], o[2]) <= max(box[0], o[0]) or min(box[3], o[3]) <= max(box[1], o[1]) for o in chosen
        ):
            chosen.append(box)
    return np.array(chosen).reshape(-1, 4)
