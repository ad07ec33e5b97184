"""Features of pixels, packed into 32 bits: colour, gradient, pair of successive colours (paper 3, II.B)."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Features = tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.uint32]]


def extract(image: NDArray[np.uint8], previous: NDArray[np.uint8]) -> Features:
    """Return the colours, gradients and pairs of colours of all pixels, (P,) uint32 each.

    Args:
        image: (H, W, 3) uint8 RGB.
        previous: The frame before, of the same shape.
    """
    colours, gradients, pairs = _pack(image.reshape(-1, 3), previous.reshape(-1, 3), _gradient(image))
    return colours, gradients, pairs


def _gradient(image: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return (P,) gradients of the grey image: 256 levels each of x (low byte) and y, 128 is none."""
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    along = cv2.Sobel(grey, cv2.CV_16S, 1, 0, ksize=3)
    across = cv2.Sobel(grey, cv2.CV_16S, 0, 1, ksize=3)
    return np.asarray((along.ravel() // 8 + 128) | (across.ravel() // 8 + 128) << 8).view(np.uint16)


@njit(cache=True)
def _colour(pixels, i):  # type: ignore[no-untyped-def]
    return (np.uint32(pixels[i, 0]) << 16) | (np.uint32(pixels[i, 1]) << 8) | np.uint32(pixels[i, 2])


@njit(cache=True)
def _coarse(colour):  # type: ignore[no-untyped-def]
    """Return a colour in 32 levels a channel, 15 bits."""
    return ((colour >> 9) & 0x7C00) | ((colour >> 6) & 0x3E0) | ((colour >> 3) & 0x1F)


@njit(cache=True)
def _pack(pixels, previous, gradients):  # type: ignore[no-untyped-def]
    """Return the colours, gradients and pairs of colours of all pixels, (P,) uint32 each, packed."""
    count = pixels.shape[0]
    colours, edges, pairs = (
        np.empty(count, np.uint32),
        np.empty(count, np.uint32),
        np.empty(count, np.uint32),
    )
    for i in range(count):
        colours[i] = _colour(pixels, i)
        edges[i] = gradients[i]
        pairs[i] = (_coarse(_colour(previous, i)) << 15) | _coarse(_colour(pixels, i))
    return colours, edges, pairs
