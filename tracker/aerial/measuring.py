"""What of the foreground is whose: the outlines of tracks in it, and what no track explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Labels = NDArray[np.int32]

REACH = 1.35
"""Half sides of an expected vehicle within which a pixel may be its own."""
SCRAP = 0.3
"""Share of an expected vehicle's area below which a region may be a part of it that has come off."""
LEAST_PIXELS = 10
"""Pixels of a measurement."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlines:
    """Rectangles along headings, of N things.

    Attributes:
        centres: (N, 2) px of the mosaic.
        headings: (N, 2) unit vectors.
        sizes: (N, 2) length and width, px.
        pixels: (N,) foreground in each, 0 where nothing was found.
    """

    centres: Floats
    headings: Floats
    sizes: Floats
    pixels: NDArray[np.int64]

    def corners(self) -> Floats:
        """Return (N, 4, 2), front left first, clockwise as seen."""
        return corners(self.centres, self.headings, self.sizes)


def corners(centres: Floats, headings: Floats, sizes: Floats) -> Floats:
    """Return the corners (N, 4, 2) of rectangles along headings (N, 2)."""
    along = 0.5 * sizes[:, :1] * headings
    across = 0.5 * sizes[:, 1:] * headings[:, ::-1] * np.array([-1.0, 1.0])
    return np.asarray(
        centres[:, None] + np.stack([along - across, along + across, across - along, -along - across], 1)
    )


def outline(
    labels: Labels,
    single: NDArray[np.bool_],
    senior: NDArray[np.bool_],
    centres: Floats,
    headings: Floats,
    sizes: Floats,
) -> tuple[Outlines, NDArray[np.bool_], Labels]:
    """Measure expected vehicles in a labelled foreground.

    Each labelled pixel goes to the one of the expected that lies nearest, in its own half sides, if any is
    near enough; a region that can be but one vehicle goes as a whole to who has most of it. A rectangle has
    its pixels' mean and variances.

    Args:
        labels: (H, W) of regions 1 to R, 0 is background.
        single: (R + 1,) which regions are one vehicle at most.
        senior: (N,) who comes before the others where a region is one vehicle's.
        centres: (N, 2) where they are expected, px of ``labels``.
        headings: (N, 2).
        sizes: (N, 2).

    Returns:
        What was found of each; (N,) who lost all to others in such regions; and (H, W) the labels that nobody
        claims.
    """
    sums, beaten, left = _claim(labels, single, senior, centres, headings, 0.5 * sizes)
    return _outlines(sums, headings), beaten, left


def free_outlines(labels: Labels, count: int) -> Outlines:
    """Measure what no track expects: along the principal axis of its pixels.

    Args:
        labels: (H, W), what is left of 1 ... ``count``.
        count: Labels.
    """
    headings = _axes(labels, count)
    return _outlines(_sums(labels, headings), headings)


def _outlines(sums: Floats, headings: Floats) -> Outlines:
    """Turn sums (N, 5) along and across headings into rectangles."""
    pixels = sums[:, 0]
    total = np.maximum(pixels, 1.0)[:, None]
    middles = sums[:, 1:3] / total
    # The variance of a uniform rectangle is a twelfth of its squared side; that of a pixel's own is in it.
    variances = np.maximum(sums[:, 3:] / total - middles**2, 0.0) + 1.0 / 12.0
    across = headings[:, ::-1] * np.array([-1.0, 1.0])
    return Outlines(
        centres=middles[:, :1] * headings + middles[:, 1:] * across,
        headings=headings,
        sizes=np.sqrt(12.0 * variances),
        pixels=np.where(pixels >= LEAST_PIXELS, pixels, 0).astype(np.int64),
    )


@njit(cache=True)
def _claim(labels, single, senior, centres, headings, halves):  # type: ignore[no-untyped-def]
    """As `outline`: sums (N, 5) as `_add` makes them, who is beaten (N,), and labels left (H, W)."""
    height, width = labels.shape
    count = centres.shape[0]
    owner = np.full((height, width), -1, np.int32)
    nearest = np.full((height, width), np.float32(np.inf))
    for n in range(count):
        reach = REACH * (np.abs(headings[n]) * halves[n, 0] + np.abs(headings[n][::-1]) * halves[n, 1]) + 2.0
        x0, x1 = int(max(centres[n, 0] - reach[0], 0)), int(min(centres[n, 0] + reach[0] + 1, width))
        y0, y1 = int(max(centres[n, 1] - reach[1], 0)), int(min(centres[n, 1] + reach[1] + 1, height))
        for i in range(y0, y1):
            for j in range(x0, x1):
                if labels[i, j] == 0:
                    continue
                x, y = j + 0.5 - centres[n, 0], i + 0.5 - centres[n, 1]
                along = abs(x * headings[n, 0] + y * headings[n, 1]) / halves[n, 0]
                across = abs(y * headings[n, 0] - x * headings[n, 1]) / halves[n, 1]
                away = np.float32(max(along, across))
                if away <= REACH and away < nearest[i, j]:
                    nearest[i, j], owner[i, j] = away, n
    votes, areas = np.zeros((single.size, count), np.int32), np.zeros(single.size, np.int32)
    for i in range(height):
        for j in range(width):
            if labels[i, j] > 0:
                areas[labels[i, j]] += 1
                if owner[i, j] >= 0:
                    votes[labels[i, j], owner[i, j]] += 1
    winner = np.full(single.size, -1, np.int32)
    allowed = np.zeros((single.size, count), np.bool_)
    for n in range(count):
        main = votes[:, n].argmax()
        for label in range(1, single.size):
            # Besides its own region a vehicle may have scraps, but no other region of some size.
            small = areas[label] < SCRAP * 4.0 * halves[n, 0] * halves[n, 1]
            allowed[label, n] = votes[label, n] > 0 and (label == main or small)
            other = winner[label]
            if (
                allowed[label, n]
                and single[label]
                and (
                    other < 0
                    or (senior[n] and not senior[other])
                    or (senior[n] == senior[other] and votes[label, n] > votes[label, other])
                )
            ):
                winner[label] = n
    sums, left = np.zeros((count, 5)), labels.copy()
    for i in range(height):
        for j in range(width):
            label = labels[i, j]
            if label > 0:
                n = winner[label] if winner[label] >= 0 else owner[i, j]
                if n >= 0 and allowed[label, n]:
                    left[i, j] = 0
                    _add(sums[n], headings[n], i, j)
    beaten = np.zeros(count, np.bool_)
    for n in range(count):
        beaten[n] = sums[n, 0] == 0 and votes[:, n].sum() > 0
    return sums, beaten, left


@njit(cache=True)
def _add(sums, heading, i, j):  # type: ignore[no-untyped-def]
    """Add a pixel: one, its place along and across a heading, and their squares."""
    along = (j + 0.5) * heading[0] + (i + 0.5) * heading[1]
    across = (i + 0.5) * heading[0] - (j + 0.5) * heading[1]
    sums[0] += 1.0
    sums[1] += along
    sums[2] += across
    sums[3] += along * along
    sums[4] += across * across


@njit(cache=True)
def _axes(labels, count):  # type: ignore[no-untyped-def]
    """Return (count, 2) the principal axis of each label's pixels."""
    sums = np.zeros((count, 6))
    for i in range(labels.shape[0]):
        for j in range(labels.shape[1]):
            n = labels[i, j] - 1
            if n >= 0:
                x, y = j + 0.5, i + 0.5
                sums[n] += np.array([1.0, x, y, x * x, x * y, y * y])
    axes = np.zeros((count, 2))
    for n in range(count):
        total = max(sums[n, 0], 1.0)
        x, y = sums[n, 1] / total, sums[n, 2] / total
        xx, xy, yy = sums[n, 3] / total - x * x, sums[n, 4] / total - x * y, sums[n, 5] / total - y * y
        angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
        axes[n] = np.array([np.cos(angle), np.sin(angle)])
    return axes


@njit(cache=True)
def _sums(labels, headings):  # type: ignore[no-untyped-def]
    """Return sums (N, 5) along and across headings (N, 2) of labels 1 to N."""
    sums = np.zeros((headings.shape[0], 5))
    for i in range(labels.shape[0]):
        for j in range(labels.shape[1]):
            if labels[i, j] > 0:
                _add(sums[labels[i, j] - 1], headings[labels[i, j] - 1], i, j)
    return sums
