"""Which tracks move as another does: Lyapunov characteristic exponents between tracks (paper 2, eq. (1)).

The printed sum of logarithms telescopes: gamma = (1/F) ln(d_F / d_1), where d_i is the distance of two
sections of F points moved to a common start. So d_1 = 0, and the distances have to be regularised,
d_i <- sqrt(d_i^2 + epsilon^2); and what lies between start and end does not count, so the sections' paths
are compared, too. The search for a section over all tracks is one difference at lag F - 1 along each of them.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def exponent(path: ArrayLike, other: ArrayLike, start: float) -> float:
    """Return gamma of two sections moved to a common start, per frame.

    Args:
        path: (F, 2) px.
        other: (F, 2) px.
        start: epsilon, px: how uncertain the common start is. Two and a half times the noise of a coordinate.

    Returns:
        0 where both move alike, never less.
    """
    path, other = np.asarray(path, float), np.asarray(other, float)
    apart = (path[-1] - path[0]) - (other[-1] - other[0])
    return 0.5 * math.log1p(float(apart @ apart) / start**2) / len(path)


def threshold(window: int, start: float, most: float) -> float:
    """Return alpha, the exponent of sections of ``window`` points that end ``most`` px apart.

    >>> round(threshold(30, 2.5, 10.0), 4)
    0.0472
    """
    return 0.5 * math.log1p((most / start) ** 2) / window


def distance(window: int, start: float, alpha: float) -> float:
    """Return how far apart, px, sections with exponent ``alpha`` end: the inverse of `threshold`."""
    return start * math.sqrt(math.expm1(2.0 * window * alpha))


def path_distance(path: ArrayLike, other: ArrayLike) -> float:
    """Return the root mean square distance, px, of two sections (F, 2) moved to a common start."""
    path, other = np.asarray(path, float), np.asarray(other, float)
    apart = (path - path[0]) - (other - other[0])
    return math.sqrt(float((apart**2).sum() / len(path)))


@njit(cache=True)
def search(points, counts, path, most, reach, rms, nearness):  # type: ignore[no-untyped-def]
    """Find in each track the section that moves most as ``path`` does.

    Args:
        points: (N, T, 2) tracks, px, frame by frame.
        counts: (N,) points of each.
        path: (F, 2) section of the predictand.
        most: Greatest distance, px, of the ends of sections moved to a common start: alpha, as `distance`.
        reach: Greatest distance, px, of the ends of the sections as they lie.
        rms: Greatest root mean square distance, px, of the sections moved to a common start.
        nearness: Weight of the squared distance as they lie beside that of the aligned ends: among sections
            that move alike the nearest serves best, since roads bend at places, not at times.

    Returns:
        (N,) index of the last point of the best section, -1 where there is none; and (N,) its cost, px^2.
    """
    window = path.shape[0]
    lag = window - 1
    end_x, end_y = path[lag, 0], path[lag, 1]
    gone_x, gone_y = end_x - path[0, 0], end_y - path[0, 1]
    ends = np.full(points.shape[0], -1, np.int64)
    costs = np.full(points.shape[0], np.inf)
    most2, reach2, sum2 = most * most, reach * reach, rms * rms * window
    for j in range(points.shape[0]):
        track = points[j]
        for e in range(lag, counts[j]):
            x = track[e, 0] - track[e - lag, 0] - gone_x
            y = track[e, 1] - track[e - lag, 1] - gone_y
            apart = x * x + y * y
            if apart > most2:
                continue
            x, y = track[e, 0] - end_x, track[e, 1] - end_y
            away = x * x + y * y
            cost = apart + nearness * away
            if away > reach2 or cost >= costs[j]:
                continue
            left = sum2
            shift_x, shift_y = track[e - lag, 0] - path[0, 0], track[e - lag, 1] - path[0, 1]
            for i in range(1, window):
                x = track[e - lag + i, 0] - shift_x - path[i, 0]
                y = track[e - lag + i, 1] - shift_y - path[i, 1]
                left -= x * x + y * y
                if left < 0.0:
                    break
            if left >= 0.0:
                ends[j], costs[j] = e, cost
    return ends, costs
