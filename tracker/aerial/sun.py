"""The side to which shadows fall, and how far: all vehicles of a scene have one sun.

A vehicle with its shadow covers what it would if it were slid along an offset. Of the right offset the part
that it adds is dark, and nothing else is; so each vehicle of which much cannot be shadow votes for the offset
that leaves out the most of the dark and the least of its own.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.blobs import find_blobs

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

DIRECTIONS: Floats = np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0.0, 2.0 * np.pi, 32, False)])
LONGEST = 24
"""Px of the longest offset."""
COST = 2.0
"""What a vehicle's own pixel that is left out counts against an offset, in dark ones."""
LEAST_AREA = 60
OWN = (0.3, 0.8)
"""Share of a region that is a vehicle's for sure, where it votes."""
LEAST_GAIN = 0.05
"""Share of its region that an offset must gain to be voted for."""
LORRY = 2.5
"""Usual areas from which on a vehicle is a lorry, whose shadow is longer than most."""
ENOUGH, MEMORY = 8, 120
AGREED = 2
"""Directions beside the chosen one that mean the same."""
LOW = 0.35
"""Quantile of the lengths voted for: most vehicles are cars, but tall ones show their shadows best."""


class Sun:
    """What is known of the shadows of one scene.

    Attributes:
        offset: (2,) px from the edge of a usual vehicle to that of its shadow.
    """

    def __init__(self) -> None:
        self.offset: Floats = np.zeros(2)
        self._votes: deque[tuple[int, int]] = deque(maxlen=MEMORY)

    def learn(self, whole: Mask, dark: Mask, own: Mask, valid: Mask, usual: float) -> None:
        """Let the regions of a picture vote.

        Args:
            whole: (H, W) foreground, solid regions.
            dark: (H, W) what of it may be shadow.
            own: (H, W) what of it cannot.
            valid: (H, W) where the picture is.
            usual: Px^2 of a vehicle without its shadow.
        """
        blobs = find_blobs(whole, LEAST_AREA)
        for k, box in enumerate(blobs.boxes.astype(int).tolist()):
            part = np.s_[box[1] : box[3], box[0] : box[2]]
            region = blobs.labels[part] == k + 1
            share = np.count_nonzero(region & own[part]) / blobs.areas[k]
            if not OWN[0] < share < OWN[1] or not valid[part].all():
                continue
            gains = left_out(region, dark[part] - COST * own[part], DIRECTIONS)
            direction, length = np.unravel_index(gains.argmax(), gains.shape)
            shadow = left_out(region, np.ones(region.shape), DIRECTIONS[direction, None])[0, length]
            if (
                gains[direction, length] > LEAST_GAIN * blobs.areas[k]
                and blobs.areas[k] - shadow < LORRY * usual
            ):
                self._votes.append((int(direction), int(length)))
        if len(self._votes) >= ENOUGH:
            self.offset = elect(*np.array(self._votes).T)

    def reach(self, region: Mask, dark: Mask, own: Mask) -> int:
        """Return how far, px, the shadow of one region falls to the known side; all (H, W)."""
        side = (self.offset / np.hypot(*self.offset))[None]
        return int(left_out(region, dark - COST * own, side)[0].argmax())


def elect(directions: NDArray[np.int64], lengths: NDArray[np.int64]) -> Floats:
    """Return the offset (2,), px, that most votes (N,) for directions and lengths agree on."""
    count = len(DIRECTIONS)
    votes = np.bincount(directions, lengths, count)
    side = int((np.roll(votes, -1) + votes + np.roll(votes, 1)).argmax())
    apart = (directions - side + count // 2) % count - count // 2
    agreed = np.abs(apart) <= AGREED
    angle = 2.0 * np.pi / count * (side + np.average(apart[agreed], weights=lengths[agreed]))
    return np.quantile(lengths[agreed], LOW) * np.array([np.cos(angle), np.sin(angle)])


@njit(cache=True)
def left_out(region, worth, directions):  # type: ignore[no-untyped-def]
    """Sum what lies in a region's shadow if it falls so far to a side: from there the offset leads out of it.

    Args:
        region: (H, W) bool.
        worth: (H, W) of each pixel.
        directions: (D, 2) unit vectors.

    Returns:
        (D, `LONGEST` + 1) the sums of offsets of 0, 1, ... px.
    """
    height, width = region.shape
    sums = np.zeros((len(directions), LONGEST + 1))
    for i in range(height):
        for j in range(width):
            if not region[i, j]:
                continue
            for d in range(len(directions)):
                for step in range(1, LONGEST + 1):
                    x = int(np.floor(j + 0.5 + step * directions[d, 0]))
                    y = int(np.floor(i + 0.5 + step * directions[d, 1]))
                    if x < 0 or y < 0 or x >= width or y >= height or not region[y, x]:
                        # All offsets as long as this one, and longer ones, leave the pixel out.
                        sums[d, step] += worth[i, j]
                        break
    for step in range(1, LONGEST + 1):
        sums[:, step] += sums[:, step - 1]
    return sums
