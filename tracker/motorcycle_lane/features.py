"""Features of pixels, packed into 32 bits: colour, gradient, pair of successive colours (paper 3, II.B)."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Features = tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.uint32]]


def extract(image: NDArray[np.uint8], previous: NDArray[np.uint32] | None = None) -> Features:
    """Return the colours, gradients and pairs of colours of all pixels, (P,) uint32 each.

    Args:
        image: (H, W, 3) uint8 RGB.
        previous: (P,) colours of the frame before; without one the frame itself stands for it.
    """
    # Four bytes a pixel: the word of one is its colour, and what follows works on many at once.
    words = cv2.cvtColor(image, cv2.COLOR_RGB2BGRA).view(np.uint32).ravel()
    along, across = cv2.spatialGradient(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    return _pack(words, words if previous is None else previous, along.ravel(), across.ravel())  # type: ignore[no-any-return]


@njit(cache=True)
def _coarse(colour):  # type: ignore[no-untyped-def]
    """Return a colour in 32 levels a channel, 15 bits."""
    return ((colour >> 9) & 0x7C00) | ((colour >> 6) & 0x3E0) | ((colour >> 3) & 0x1F)


@njit(cache=True)
def _pack(words, previous, along, across):  # type: ignore[no-untyped-def]
    """Return the colours, gradients and pairs of colours of all pixels, (P,) uint32 each, packed.

    Gradients have 256 levels each of x (low byte) and y; 128 is none.
    """
    count = words.size
    colours, edges, pairs = (
        np.empty(count, np.uint32),
        np.empty(count, np.uint32),
        np.empty(count, np.uint32),
    )
    for i in range(count):
        colours[i] = words[i] & 0xFFFFFF
        edges[i] = (along[i] >> 3) + 128 | ((across[i] >> 3) + 128) << 8
        pairs[i] = (_coarse(previous[i]) << 15) | _coarse(words[i])
    return colours, edges, pairs
