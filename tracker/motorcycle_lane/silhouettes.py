"""Placing silhouettes of known size in a region of foreground that holds several riders.

A silhouette explains foreground that no other explains, and must not lie on background (after Zhao, Nevatia,
Bayesian human segmentation in crowded situations, CVPR 2003); where it is not hidden by a nearer one, its
colours must be its rider's. Rider by rider it is moved to where that is best, beginning at the prediction.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ROWS, COLUMNS = 24, 12
ON_BACKGROUND = 1.0
"""What a pixel of background costs that a silhouette covers; one of foreground gains 1."""
COLOUR = 0.35
"""Weight of a visible pixel's log likelihood ratio of colour."""
PULL = 0.6
"""What a move by its own size costs; the whole silhouette on foreground gains 1."""
OWNED = 0.5


class Silhouette:
    """The mean shape of the riders seen alone.

    Attributes:
        shape: (ROWS, COLUMNS) float64, how often a part of the box is covered.
    """

    def __init__(self, rate: float = 0.02) -> None:
        y, x = np.mgrid[:ROWS, :COLUMNS] + 0.5
        radius = np.hypot(2.0 * x / COLUMNS - 1.0, 2.0 * y / ROWS - 1.0)
        self.shape: Floats = np.clip(4.0 * (1.1 - radius), 0.0, 1.0)
        self._rate = rate

    def learn(self, region: NDArray[np.bool_]) -> None:
        """Take in a rider that is seen alone: (h, w) what of its box is foreground."""
        drawn = cv2.resize(region.astype(np.float32), (COLUMNS, ROWS), interpolation=cv2.INTER_AREA)
        self.shape += self._rate * (drawn - self.shape)


@njit(cache=True)
def _cover(shape, x, y, centre, size):  # type: ignore[no-untyped-def]
    """Return how far a silhouette covers the pixel at column x, row y."""
    u = (x + 0.5 - centre[0]) / size[0] + 0.5
    v = (y + 0.5 - centre[1]) / size[1] + 0.5
    if u < 0.0 or v < 0.0 or u >= 1.0 or v >= 1.0:
        return 0.0
    return shape[int(v * shape.shape[0]), int(u * shape.shape[1])]


@njit(cache=True)
def _neighbours(centres, sizes, k, reach, found):  # type: ignore[no-untyped-def]
    count = 0
    for other in range(centres.shape[0]):
        across = abs(centres[other, 0] - centres[k, 0]) - 0.5 * (sizes[other, 0] + sizes[k, 0])
        down = abs(centres[other, 1] - centres[k, 1]) - 0.5 * (sizes[other, 1] + sizes[k, 1])
        if other != k and across < reach and down < reach:
            found[count] = other
            count += 1
    return count


@njit(cache=True)
def _value(shape, groups, group, bins, centres, sizes, k, place, table, others, count, stride):  # type: ignore[no-untyped-def]
    """Return how well silhouette k stands at ``place``, and which share of it is seen there."""
    height, width = groups.shape
    size = sizes[k]
    foot = place[1] + 0.5 * size[1]
    left, top = int(np.floor(place[0] - 0.5 * size[0])), int(np.floor(place[1] - 0.5 * size[1]))
    total, value, seen = 1e-9, 0.0, 0.0
    for y in range(top, int(np.ceil(place[1] + 0.5 * size[1])), stride):
        region = 0 if y + 0.5 < place[1] else 1
        for x in range(left, int(np.ceil(place[0] + 0.5 * size[0])), stride):
            covered = _cover(shape, x, y, place, size)
            if covered == 0.0:
                continue
            total += covered
            if x < 0 or y < 0 or x >= width or y >= height:
                continue
            here = groups[y, x]
            if here == 0:
                value -= ON_BACKGROUND * covered
            if here != group:
                continue
            free, shown = 1.0, 1.0
            for n in range(count):
                other = others[n]
                rest = 1.0 - _cover(shape, x, y, centres[other], sizes[other])
                free *= rest
                if centres[other, 1] + 0.5 * sizes[other, 1] > foot:
                    shown *= rest
            value += covered * (free + COLOUR * shown * table[region, bins[y, x]])
            seen += covered * shown
    return value / total, seen / total


@njit(cache=True)
def place(shape, groups, group, bins, centres, sizes, tables, sweeps):  # type: ignore[no-untyped-def]
    """Move K silhouettes, in place, to where they explain a group of regions best.

    Args:
        shape: (ROWS, COLUMNS) of a silhouette.
        groups: (H, W) int32, number of the group of each foreground pixel; 0 is background.
        group: Which one.
        bins: (H, W) colour bin of each foreground pixel.
        centres: (K, 2) where they are expected; on return where they are.
        sizes: (K, 2) width and height.
        tables: (K, 2, BINS) log likelihood ratio of each colour in the upper and the lower half.
        sweeps: How often each is moved.

    Returns:
        (K,) share of each silhouette that is seen: foreground, and not hidden by a nearer one.
    """
    count = centres.shape[0]
    expected = centres.copy()
    order = np.argsort(-(centres[:, 1] + 0.5 * sizes[:, 1]))
    others, trial, shares = np.empty(count, np.int64), np.empty(2), np.zeros(count)
    for _ in range(sweeps):
        for k in order:
            near = _neighbours(centres, sizes, k, 0.5 * sizes[k, 1], others)
            best, _ = _worth(
                shape, groups, group, bins, centres, sizes, k, centres[k], tables[k], others, near, expected
            )
            step = 2.0
            for _ in range(24):
                origin_x, origin_y = centres[k, 0], centres[k, 1]
                better = False
                for dy in range(-1, 2):
                    for dx in range(-1, 2):
                        trial[0], trial[1] = origin_x + step * dx, origin_y + step * dy
                        if dx == 0 and dy == 0:
                            continue
                        value, _ = _worth(
                            shape,
                            groups,
                            group,
                            bins,
                            centres,
                            sizes,
                            k,
                            trial,
                            tables[k],
                            others,
                            near,
                            expected,
                        )
                        if value > best + 1e-9:
                            best, better = value, True
                            centres[k, 0], centres[k, 1] = trial[0], trial[1]
                if not better:
                    if step == 1.0:
                        break
                    step = 1.0
    for k in range(count):
        near = _neighbours(centres, sizes, k, 0.0, others)
        _, shares[k] = _value(
            shape, groups, group, bins, centres, sizes, k, centres[k], tables[k], others, near, 1
        )
    return shares


@njit(cache=True)
def _worth(shape, groups, group, bins, centres, sizes, k, at, table, others, near, expected):  # type: ignore[no-untyped-def]
    stride = 2 if sizes[k, 0] >= 12.0 else 1
    value, seen = _value(shape, groups, group, bins, centres, sizes, k, at, table, others, near, stride)
    across = (at[0] - expected[k, 0]) / sizes[k, 0]
    down = (at[1] - expected[k, 1]) / sizes[k, 1]
    return value - PULL * (across * across + down * down), seen


@njit(cache=True)
def unexplained(shape, groups, group, window, centres, sizes, offsets, slopes):  # type: ignore[no-untyped-def]
    """Look for the place where one more silhouette would explain most of a group.

    Args:
        shape: (ROWS, COLUMNS) of a silhouette.
        groups: (H, W) int32 as in `place`.
        group: Which one.
        window: x0, y0, x1, y1, px: where its centre may lie.
        centres: (K, 2) of those that are placed.
        sizes: (K, 2) of those.
        offsets: (2,) width and height of one at row 0.
        slopes: (2,) by how much they grow a row.

    Returns:
        Its worth, at most 1, and its centre x, y.
    """
    height, width = groups.shape
    x0, y0, x1, y1 = window
    left, top = max(int(x0 - offsets[0] - slopes[0] * y1), 0), max(int(y0 - offsets[1] - slopes[1] * y1), 0)
    right = min(int(x1 + offsets[0] + slopes[0] * y1) + 1, width)
    bottom = min(int(y1 + offsets[1] + slopes[1] * y1) + 1, height)
    gain = np.zeros((max(bottom - top, 0), max(right - left, 0)))
    for y in range(top, bottom):
        for x in range(left, right):
            if groups[y, x] == group:
                gain[y - top, x - left] = 1.0
            elif groups[y, x] == 0:
                gain[y - top, x - left] = -ON_BACKGROUND
    for k in range(centres.shape[0]):
        for y in range(
            max(int(centres[k, 1] - 0.5 * sizes[k, 1]), top),
            min(int(centres[k, 1] + 0.5 * sizes[k, 1]) + 1, bottom),
        ):
            for x in range(
                max(int(centres[k, 0] - 0.5 * sizes[k, 0]), left),
                min(int(centres[k, 0] + 0.5 * sizes[k, 0]) + 1, right),
            ):
                if groups[y, x] == group:
                    gain[y - top, x - left] *= 1.0 - _cover(shape, x, y, centres[k], sizes[k])
    best, best_x, best_y = -1.0, 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    centre, size = np.empty(2), np.empty(2)
    step = max(2.0, 0.12 * (offsets[0] + slopes[0] * 0.5 * (y0 + y1)))
    rows = max(1, int((y1 - y0) / step) + 1)
    columns = max(1, int((x1 - x0) / step) + 1)
    for i in range(rows):
        for j in range(columns):
            centre[0], centre[1] = x0 + step * j, y0 + step * i
            for c in range(2):
                size[c] = max(offsets[c] + slopes[c] * centre[1], 4.0)
            total, value = 1e-9, 0.0
            stride = 3 if size[0] >= 18.0 else 2
            for y in range(int(centre[1] - 0.5 * size[1]), int(centre[1] + 0.5 * size[1]) + 1, stride):
                for x in range(int(centre[0] - 0.5 * size[0]), int(centre[0] + 0.5 * size[0]) + 1, stride):
                    covered = _cover(shape, x, y, centre, size)
                    total += covered
                    if top <= y < bottom and left <= x < right:
                        value += covered * gain[y - top, x - left]
            if value / total > best:
                best, best_x, best_y = value / total, centre[0], centre[1]
    return best, best_x, best_y


@njit(cache=True)
def colours(shape, groups, group, bins, centres, sizes, size_of_histogram):  # type: ignore[no-untyped-def]
    """Return (K, 2, size_of_histogram) colours of what is seen of each silhouette; each sums to 1."""
    count = centres.shape[0]
    height, width = groups.shape
    others = np.empty(count, np.int64)
    found = np.zeros((count, 2, size_of_histogram))
    for k in range(count):
        near = _neighbours(centres, sizes, k, 0.0, others)
        foot = centres[k, 1] + 0.5 * sizes[k, 1]
        for y in range(max(int(centres[k, 1] - 0.5 * sizes[k, 1]), 0), min(int(foot) + 1, height)):
            region = 0 if y + 0.5 < centres[k, 1] else 1
            for x in range(
                max(int(centres[k, 0] - 0.5 * sizes[k, 0]), 0),
                min(int(centres[k, 0] + 0.5 * sizes[k, 0]) + 1, width),
            ):
                if groups[y, x] != group:
                    continue
                shown = _cover(shape, x, y, centres[k], sizes[k])
                for n in range(near):
                    other = others[n]
                    if centres[other, 1] + 0.5 * sizes[other, 1] > foot:
                        shown *= 1.0 - _cover(shape, x, y, centres[other], sizes[other])
                if shown > OWNED:
                    found[k, region, bins[y, x]] += 1.0
        for region in range(2):
            total = found[k, region].sum()
            if total > 0.0:
                found[k, region] /= total
            else:
                found[k, region] = 1.0 / size_of_histogram
    return found
