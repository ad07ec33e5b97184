"""Regions of the foreground that travel: whatever they hold, one rider or several, it rides on as one.

A region that neither joins another nor parts, and keeps its size from frame to frame, is followed; each time
it has gone a part of its own size it counts once. So how much a region counts does not depend on what is
known of riders yet, nor on how slowly it goes; and what only flickers or trembles does not count.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.blobs import Blobs

Floats = NDArray[np.float64]

KEPT = 1.25
"""Ratio of widths or heights in successive frames from which a region has changed its size."""
WAY = 0.05
"""How far a region must have gone to count, as a share of the larger of its width and height."""
FRAMES = 3
"""And for how many frames it must have been followed since it counted last."""


class Travellers:
    """Follows the regions of an episode."""

    def __init__(self) -> None:
        self._labels: NDArray[np.int32] | None = None
        self._cores, self._origins = np.zeros((0, 4)), np.zeros((0, 4))
        self._followed = np.zeros(0, np.int64)

    def step(self, blobs: Blobs, cores: Floats, whole: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the regions (K,) of the next frame that count now.

        Args:
            blobs: The N regions.
            cores: (N, 4) their boxes without what sticks out.
            whole: (N,) whether the picture's border leaves a region whole.
        """
        count = len(blobs)
        origins, followed = cores.copy(), np.zeros(count, np.int64)
        if self._labels is not None:
            old, new = only_pairs(self._labels, blobs.labels, len(self._cores), count)
            change = np.abs(np.log(_sizes(cores[new]) / _sizes(self._cores[old]))).max(1, initial=0.0)
            kept = (change < np.log(KEPT)) & whole[new]
            old, new = old[kept], new[kept]
            origins[new], followed[new] = self._origins[old], self._followed[old] + 1
        way = 0.5 * np.hypot(*(cores[:, :2] + cores[:, 2:] - origins[:, :2] - origins[:, 2:]).T)
        counts = (followed >= FRAMES) & (way >= WAY * _sizes(cores).max(1, initial=0.0))
        origins[counts], followed[counts] = cores[counts], 0
        self._labels, self._cores, self._origins, self._followed = blobs.labels, cores, origins, followed
        return np.flatnonzero(counts)


def only_pairs(
    before: NDArray[np.int32], now: NDArray[np.int32], old: int, new: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the regions (K,) of two frames of which each overlaps the other and no third.

    Args:
        before: (H, W) labels, region k has k + 1.
        now: (H, W) those of the next frame.
        old: How many regions there were.
        new: How many there are.
    """
    overlaps = _overlaps(before, now, old, new)
    only = overlaps & (overlaps.sum(1) == 1)[:, None] & (overlaps.sum(0) == 1)[None]
    one, other = np.nonzero(only)
    return one, other


@njit(cache=True)
def _overlaps(before, now, old, new):  # type: ignore[no-untyped-def]
    """Return (old, new) whether regions of two frames have a pixel in common."""
    found = np.zeros((old, new), np.bool_)
    for y in range(now.shape[0]):
        for x in range(now.shape[1]):
            if now[y, x] > 0 and before[y, x] > 0:
                found[before[y, x] - 1, now[y, x] - 1] = True
    return found


def _sizes(boxes: Floats) -> Floats:
    return np.asarray(boxes[:, 2:] - boxes[:, :2])
