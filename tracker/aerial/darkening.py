"""Cast shadows in the foreground: the road, only darker, and all shadows of a scene about equally dark.

What a shadow falls on keeps its texture and nearly its colour: over a small window the ratio to the
background image hardly varies (Jacques, Jung, Musse, Background subtraction and shadow detection in grayscale
video sequences, SIBGRAPI 2005). Dark paint may do the same; but all vehicles have their shadows on one side
and of one darkness. So the darkness is learnt that pulls the most to one side, seen from the middles of
regions: paint of many colours pulls little to the other.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.blobs import find_blobs

Floats = NDArray[np.float64]

REACH = 1
"""Half side of the window, px."""
DARKEST, BRIGHTEST = 0.3, 0.95
"""Ratios to the background image that a shadow may have."""
BLUEST, REDDEST = 0.35, -0.1
"""Tints that a shadow may have: ratio of blue minus that of red, over their mean. Its light is the sky's."""
GREENEST = 0.08
"""How far green may lie from the middle of red and blue, over the mean."""
UNEVEN = 0.12
"""Greatest relative standard deviation of the ratio in the window."""
BINS = (26, 18)
"""Of darkness and tint."""
NOISE = 8.0
"""Grey levels by which a shadow may be off the range of its neighbours."""
EDGE = 7
"""Side of the neighbourhood, px, in which a shadow may be uneven."""
FADING = 0.98
BRIGHTER, BLACKER, COLOURED = 1.15, 0.2, 0.15
"""Ratio to the background, ratio below that of shadows, and excess of green (half of that of blue), that
shadows never have."""
DARKER, OFF_TINT = 0.1, 0.12
"""How much darker than the learnt one a shadow may be, and how far off its tint; its rim is brighter."""


@njit(cache=True)
def darkness(image, background, mask):  # type: ignore[no-untyped-def]
    """Tell by how much each foreground pixel is the road darkened.

    Args:
        image: (H, W, 3) uint8.
        background: (H, W, 3) uint8.
        mask: (H, W) bool, foreground.

    Returns:
        (K, 4) float32 of the K pixels of the mask, row by row: of a window's ratio to the background its
        mean, tint, excess of green, and relative standard deviation.
    """
    height, width = mask.shape
    found = np.empty((mask.sum(), 4), np.float32)
    k = 0
    for y in range(height):
        for x in range(width):
            if not mask[y, x]:
                continue
            count, first, second = 0, 0.0, 0.0
            now0, now1, now2, then0, then1, then2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for v in range(max(y - REACH, 0), min(y + REACH + 1, height)):
                for u in range(max(x - REACH, 0), min(x + REACH + 1, width)):
                    if not mask[v, u]:
                        continue
                    a0, a1, a2 = float(image[v, u, 0]), float(image[v, u, 1]), float(image[v, u, 2])
                    b0, b1, b2 = (
                        float(background[v, u, 0]),
                        float(background[v, u, 1]),
                        float(background[v, u, 2]),
                    )
                    now0, now1, now2 = now0 + a0, now1 + a1, now2 + a2
                    then0, then1, then2 = then0 + b0, then1 + b1, then2 + b2
                    ratio = (a0 + a1 + a2 + 3.0) / (b0 + b1 + b2 + 3.0)
                    first += ratio
                    second += ratio * ratio
                    count += 1
            mean = (now0 + now1 + now2 + 1.0) / (then0 + then1 + then2 + 1.0)
            red, green, blue = now0 / (then0 + 1.0), now1 / (then1 + 1.0), now2 / (then2 + 1.0)
            tint = (blue - red) / mean
            first /= count
            spread = np.sqrt(max(second / count - first * first, 0.0)) / mean
            found[k] = mean, tint, (green - 0.5 * (red + blue)) / mean, spread
            k += 1
    return found


def _pull(ratios: NDArray[np.float32], tints: NDArray[np.float32], away: Floats) -> Floats:
    """Return (2, *BINS) the sums by darkness and tint of how far pixels (K,) lie from their regions' middles.

    Args:
        ratios: (K,) to the background.
        tints: (K,).
        away: (2, K) px.
    """
    row = ((ratios - DARKEST) * (BINS[0] / (BRIGHTEST - DARKEST))).astype(np.intp)
    column = ((tints - REDDEST) * (BINS[1] / (BLUEST - REDDEST))).astype(np.intp)
    at = np.minimum(row, BINS[0] - 1) * BINS[1] + np.minimum(column, BINS[1] - 1)
    return np.array([np.bincount(at, part, BINS[0] * BINS[1]).reshape(BINS) for part in away])


def _from_middles(labels: NDArray[np.int32], at: tuple[NDArray[np.intp], ...]) -> Floats:
    """Return (2, K) how far right of and below the middles of their regions pixels lie, px."""
    numbers = labels[at]
    count = np.maximum(np.bincount(numbers), 1)
    return np.array([part - (np.bincount(numbers, part) / count)[numbers] for part in at[::-1]])


class Shadows:
    """Takes the cast shadows of one scene out of its foreground."""

    def __init__(self) -> None:
        self._pull = np.zeros((2, *BINS))

    def remove(
        self,
        image: NDArray[np.uint8],
        background: NDArray[np.uint8],
        mask: NDArray[np.bool_],
        bounds: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return (H, W) the foreground without shadows, and what of it is a vehicle for sure.

        How dark shadows are is learnt.

        Args:
            image: (H, W, 3) RGB.
            background: (H, W, 3) RGB, the background image.
            mask: (H, W) raw foreground.
            bounds: (H, W, 3) each, the least and the most of the background about each pixel: lines and other
                edges of the ground never lie quite still.
        """
        at = np.nonzero(mask)
        labels = find_blobs(mask, 1).labels
        ratios, tints, greens, spread = darkness(image, background, mask).T
        grey = (ratios > DARKEST) & (ratios < BRIGHTEST) & (tints > REDDEST) & (tints < BLUEST)
        grey &= np.abs(greens) <= GREENEST
        likely = grey & (spread < UNEVEN)
        away = _from_middles(labels, at)[:, likely]
        self._pull = FADING * self._pull + _pull(ratios[likely], tints[likely], away)
        if not self._pull.any():
            return mask, mask
        smooth = [cv2.blur(part, (3, 3), borderType=cv2.BORDER_CONSTANT) for part in self._pull]
        i, j = np.unravel_index(np.hypot(*smooth).argmax(), BINS)
        dark = DARKEST + (i + 0.5) / BINS[0] * (BRIGHTEST - DARKEST)
        tint = REDDEST + (j + 0.5) / BINS[1] * (BLUEST - REDDEST)
        # A rim has less of both: a part of the sun still shines there.
        expected = tint * (1.0 - ratios) / (1.0 - dark)
        dim = grey & (ratios > dark - DARKER) & (np.abs(tints - expected) < OFF_TINT)
        sure = np.zeros(mask.shape, np.uint8)
        sure[at] = dim & likely
        # At its edges the window reaches beyond a shadow.
        near = cv2.dilate(sure, np.ones((EDGE, EDGE), np.uint8))
        share = dark * np.array([1.0 - 0.5 * tint, 1.0, 1.0 + 0.5 * tint])
        low, high = (share * bound[at] for bound in bounds)
        ranged = ((image[at] >= low - NOISE) & (image[at] <= high + NOISE)).all(1)
        left = mask.copy()
        left[at] = ~((dim | ranged) & (near[at] > 0))
        own = left.copy()
        own[at] &= (
            (ratios > BRIGHTER)
            | (ratios < dark - BLACKER)
            | (np.abs(greens) > COLOURED)
            | (np.abs(tints - expected) > 2.0 * COLOURED)
        )
        return left, own
