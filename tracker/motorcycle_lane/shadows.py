"""Cast shadows in the foreground: the road, only darker, and all shadows of a scene about equally dark.

What a shadow falls on keeps its texture and nearly its colour: over a small window the ratio to the
background image hardly varies (Jacques, Jung, Musse, Background subtraction and shadow detection in grayscale
video sequences, SIBGRAPI 2005). Dark clothes may do the same; but the shadows of all riders share one
darkness, which is learnt as the mode of what looks like one.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

REACH = 2
"""Half side of the window, px."""
DARKEST, BRIGHTEST = 0.3, 0.95
"""Ratios to the background image that a shadow may have."""
COLOURED = 0.14
"""Greatest difference between the channels' mean ratios, over their mean: light from the sky."""
UNEVEN = 0.1
"""Greatest relative standard deviation of the ratio in the window."""
BINS = 65
FADING = 0.98
TOLERANCE = 0.12
"""How much darker than the mode a shadow may be; brighter is its rim."""


@njit(cache=True)
def darkness(image, background, mask):  # type: ignore[no-untyped-def]
    """Return (H, W) float32 by how much each foreground pixel is the road darkened; 0 where it is not.

    Args:
        image: (H, W, 3) uint8.
        background: (H, W, 3) uint8.
        mask: (H, W) bool, foreground.
    """
    height, width = mask.shape
    found = np.zeros((height, width), np.float32)
    ratios = np.empty(3)
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
            mean = (now0 + now1 + now2) / (then0 + then1 + then2 + 1.0)
            if mean < DARKEST or mean > BRIGHTEST:
                continue
            ratios[0], ratios[1], ratios[2] = now0 / (then0 + 1.0), now1 / (then1 + 1.0), now2 / (then2 + 1.0)
            first /= count
            variance = second / count - first * first
            if ratios.max() - ratios.min() <= COLOURED * mean and variance <= (UNEVEN * mean) ** 2:
                found[y, x] = mean
    return found


class Shadows:
    """Takes the cast shadows of one scene out of its foreground."""

    def __init__(self) -> None:
        self._counts = np.zeros(BINS)

    def remove(
        self, image: NDArray[np.uint8], background: NDArray[np.uint8], mask: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Return (H, W) the foreground without shadows, and learn how dark these are.

        Args:
            image: (H, W, 3) RGB.
            background: (H, W, 3) RGB, the background image.
            mask: (H, W) raw foreground.
        """
        ratios = darkness(image, background, mask)
        values = ratios[ratios > 0.0]
        counts, edges = np.histogram(values, BINS, (DARKEST, BRIGHTEST))
        self._counts = FADING * self._counts + counts
        if not self._counts.any():
            return mask
        smooth = np.convolve(self._counts, np.ones(7), "same")
        mode = 0.5 * (edges[smooth.argmax()] + edges[smooth.argmax() + 1])
        return np.asarray(mask & ~(ratios > mode - TOLERANCE))
