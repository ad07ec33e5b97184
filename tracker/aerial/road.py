"""The way of the road, where nobody shows it now: all paths ever seen near a place, in either direction."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NEAR = 15.0
"""Standard deviation, px, of the distance at which a path tells."""
FAR = 2.5
"""Of those deviations, from which on it does not."""
SPAN = 8
"""Ticks of a path between whose ends it has a direction."""
LEAST = 4.0
"""Px between those ends: what stands points nowhere."""
ALIKE = 0.8
"""Cosine of the angle from a heading, or from its reverse, up to which a path may be the same road."""
ENOUGH = 2.0
"""Weight of paths that are believed: a point of a path at the place itself has 1."""


@njit(cache=True)
def course(points, counts, place, heading):  # type: ignore[no-untyped-def]
    """Turn a heading to the way of the road at a place.

    Args:
        points: (N, T, 2) paths, px, tick by tick.
        counts: (N,) points of each.
        place: (2,) px.
        heading: (2,) unit vector.

    Returns:
        (2,) unit vector along the paths near the place, weighted by nearness, the way that ``heading`` goes;
        ``heading`` where there are too few.
    """
    sum_x, sum_y, weight = 0.0, 0.0, 0.0
    most = (FAR * NEAR) ** 2
    for n in range(points.shape[0]):
        for i in range(0, counts[n] - SPAN, SPAN // 2):
            middle = i + SPAN // 2
            away = (points[n, middle, 0] - place[0]) ** 2 + (points[n, middle, 1] - place[1]) ** 2
            if away > most:
                continue
            x, y = points[n, i + SPAN, 0] - points[n, i, 0], points[n, i + SPAN, 1] - points[n, i, 1]
            length = np.sqrt(x * x + y * y)
            if length < LEAST:
                continue
            cosine = (x * heading[0] + y * heading[1]) / length
            if abs(cosine) < ALIKE:
                continue
            share = np.exp(-0.5 * away / NEAR**2) * np.sign(cosine) / length
            sum_x, sum_y = sum_x + share * x, sum_y + share * y
            weight += abs(share) * length
    if weight < ENOUGH:
        return heading.copy()
    length = np.sqrt(sum_x * sum_x + sum_y * sum_y)
    return np.array([sum_x / length, sum_y / length])
