"""Colours of objects in two sub-regions, and what their distance tells: eqs. (31), (32) of paper 3.

The bins are those of Perez, Hue, Vermaak, Gangnet, Color-Based Probabilistic Tracking, ECCV 2002: hue and
saturation where there is colour, brightness where there is none. Of a rider the sub-regions are the upper and
the lower half of the box: clothes, and machine.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

HUES, SATURATIONS, VALUES = 8, 3, 8
BINS = HUES * SATURATIONS + VALUES
REGIONS = 2

# Below these, per cent and grey levels, a pixel has no colour that could be told.
_LEAST_SATURATION, _LEAST_VALUE = 15, 40


@njit(cache=True)
def _bin(red, green, blue):  # type: ignore[no-untyped-def]
    high, low = max(red, green, blue), min(red, green, blue)
    spread = high - low
    if high < _LEAST_VALUE or 100 * spread < _LEAST_SATURATION * high:
        return HUES * SATURATIONS + high * VALUES // 256
    # Hue in sixths of the circle, times the spread; in whole numbers, so that no rounding moves a limit.
    if high == red:
        hue = green - blue
    elif high == green:
        hue = blue - red + 2 * spread
    else:
        hue = red - green + 4 * spread
    # Red is the middle of the first bin.
    sector = (hue * HUES + 3 * spread) // (6 * spread) % HUES
    ring = (100 * spread - _LEAST_SATURATION * high) * SATURATIONS // ((100 - _LEAST_SATURATION) * high)
    return sector * SATURATIONS + min(ring, SATURATIONS - 1)


@njit(cache=True)
def bin_pixels(image, labels):  # type: ignore[no-untyped-def]
    """Return (H, W) uint8, the colour bin of each labelled pixel of an image (H, W, 3), RGB; 0 elsewhere."""
    height, width = labels.shape
    bins = np.zeros((height, width), np.uint8)
    for y in range(height):
        for x in range(width):
            if labels[y, x] > 0:
                red, green, blue = image[y, x, 0], image[y, x, 1], image[y, x, 2]
                bins[y, x] = _bin(np.int64(red), np.int64(green), np.int64(blue))
    return bins


@njit(cache=True)
def _count(bins, labels, numbers, boxes, counts):  # type: ignore[no-untyped-def]
    for k in range(boxes.shape[0]):
        middle = 0.5 * (boxes[k, 1] + boxes[k, 3])
        for y in range(int(boxes[k, 1]), int(boxes[k, 3])):
            region = 0 if y + 0.5 < middle else 1
            for x in range(int(boxes[k, 0]), int(boxes[k, 2])):
                if labels[y, x] == numbers[k]:
                    counts[k, region, bins[y, x]] += 1.0


def histograms(
    bins: NDArray[np.uint8], labels: NDArray[np.int32], numbers: NDArray[np.int64], boxes: Floats
) -> Floats:
    """Return the colour histograms of N labelled regions.

    Args:
        bins: (H, W) as from `bin_pixels`.
        labels: (H, W) int32.
        numbers: (N,) label of each region.
        boxes: (N, 4) of the regions, px.

    Returns:
        (N, 2, BINS), each sub-region's sums to 1; one without pixels is even.
    """
    counts = np.zeros((len(boxes), REGIONS, BINS))
    _count(bins, labels, numbers, boxes, counts)
    totals = counts.sum(2, keepdims=True)
    return np.asarray(np.where(totals > 0, counts / np.maximum(totals, 1.0), 1.0 / BINS))


def distances(candidates: Floats, references: Floats) -> Floats:
    """Return D_1^2 + D_2^2 of Bhattacharyya distances D = sqrt(1 - sum_u sqrt(p_u q_u)), eq. (31).

    Args:
        candidates: (M, 2, BINS).
        references: (N, 2, BINS).

    Returns:
        (N, M) in [0, 2].
    """
    overlap = np.einsum("nrb,mrb->nm", np.sqrt(references), np.sqrt(candidates))
    return np.asarray(np.clip(REGIONS - overlap, 0.0, REGIONS))


def likelihood_ratios(
    candidates: Floats,
    references: Floats,
    population: Floats,
    *,
    sharpness: float = 20.0,
    limit: float = 10.0,
) -> Floats:
    """Say how much better a reference explains a candidate's colours than another object would.

    p_col of eq. (32), exp(-lambda_c (D_1^2 + D_2^2)), over its mean for a population of other objects: a
    ratio, as `tracker.filtering.jpda.likelihoods` needs it. Common colours tell little, rare ones much.

    Args:
        candidates: (M, 2, BINS) of measurements.
        references: (N, 2, BINS) of targets.
        population: (K, 2, BINS) of what else there is, K >= 1: other targets, earlier objects.
        sharpness: lambda_c. Raising it trusts colours more.
        limit: Ratios lie within 1 / limit and limit. Raising it lets colours overrule positions.

    Returns:
        (N, M).
    """
    own = -sharpness * distances(candidates, references)
    other = -sharpness * distances(candidates, population)
    highest = other.max(0)
    common = highest + np.log(np.exp(other - highest).mean(0))
    return np.asarray(np.exp(np.clip(own - common, -np.log(limit), np.log(limit))))
