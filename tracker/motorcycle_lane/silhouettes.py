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
def _gains(shape, groups, group, bins, centres, sizes, k, table, x0, y0, across, down):  # type: ignore[no-untyped-def]
    """Return what each pixel of a window is worth to silhouette k, given where the others stand.

    Returns:
        (down, across) for its upper half, for its lower half, and how far the pixel is foreground that no
        nearer silhouette covers.
    """
    height, width = groups.shape
    free, shown = np.ones((down, across)), np.ones((down, across))
    foot = centres[k, 1] + 0.5 * sizes[k, 1]
    for n in range(centres.shape[0]):
        if n == k:
            continue
        nearer = centres[n, 1] + 0.5 * sizes[n, 1] > foot
        left, top = (
            int(np.floor(centres[n, 0] - 0.5 * sizes[n, 0])),
            int(np.floor(centres[n, 1] - 0.5 * sizes[n, 1])),
        )
        right, bottom = (
            int(np.ceil(centres[n, 0] + 0.5 * sizes[n, 0])),
            int(np.ceil(centres[n, 1] + 0.5 * sizes[n, 1])),
        )
        for y in range(max(top, y0), min(bottom, y0 + down)):
            for x in range(max(left, x0), min(right, x0 + across)):
                rest = 1.0 - _cover(shape, x, y, centres[n], sizes[n])
                free[y - y0, x - x0] *= rest
                if nearer:
                    shown[y - y0, x - x0] *= rest
    upper, lower = np.zeros((down, across)), np.zeros((down, across))
    for i in range(down):
        for j in range(across):
            y, x = i + y0, j + x0
            if x < 0 or y < 0 or x >= width or y >= height or groups[y, x] != group:
                shown[i, j] = 0.0
                if 0 <= x < width and 0 <= y < height and groups[y, x] == 0:
                    upper[i, j] = lower[i, j] = -ON_BACKGROUND
            else:
                upper[i, j] = free[i, j] + COLOUR * shown[i, j] * table[0, bins[y, x]]
                lower[i, j] = free[i, j] + COLOUR * shown[i, j] * table[1, bins[y, x]]
    return upper, lower, shown


@njit(cache=True)
def _mean(shape, upper, lower, x0, y0, place, size, stride):  # type: ignore[no-untyped-def]
    """Return the mean of a window's pixels, weighed by a silhouette that stands at ``place``."""
    down, across = upper.shape
    total, value = 1e-9, 0.0
    left, top = int(np.floor(place[0] - 0.5 * size[0])), int(np.floor(place[1] - 0.5 * size[1]))
    for y in range(top, int(np.ceil(place[1] + 0.5 * size[1])), stride):
        half = upper if y + 0.5 < place[1] else lower
        for x in range(left, int(np.ceil(place[0] + 0.5 * size[0])), stride):
            covered = _cover(shape, x, y, place, size)
            total += covered
            if x0 <= x < x0 + across and y0 <= y < y0 + down:
                value += covered * half[y - y0, x - x0]
    return value / total


@njit(cache=True)
def _window(centre, size, reach):  # type: ignore[no-untyped-def]
    x0, y0 = int(centre[0] - 0.5 * size[0] - reach), int(centre[1] - 0.5 * size[1] - reach)
    return x0, y0, int(size[0] + 2 * reach) + 3, int(size[1] + 2 * reach) + 3


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
    trial, shares = np.empty(2), np.zeros(count)
    for _ in range(sweeps):
        for k in order:
            size, stride = sizes[k], 2 if sizes[k, 0] >= 12.0 else 1
            reach = 2.0 + 0.3 * size[1]
            x0, y0, across, down = _window(centres[k], size, reach)
            upper, lower, _ = _gains(
                shape, groups, group, bins, centres, sizes, k, tables[k], x0, y0, across, down
            )
            start_x, start_y, step, best = centres[k, 0], centres[k, 1], 2.0, -np.inf
            while True:
                origin_x, origin_y, better = centres[k, 0], centres[k, 1], False
                for move in range(9):
                    trial[0] = origin_x + step * (move % 3 - 1)
                    trial[1] = origin_y + step * (move // 3 - 1)
                    if max(abs(trial[0] - start_x), abs(trial[1] - start_y)) > reach:
                        continue
                    off = ((trial[0] - expected[k, 0]) / size[0]) ** 2 + (
                        (trial[1] - expected[k, 1]) / size[1]
                    ) ** 2
                    value = _mean(shape, upper, lower, x0, y0, trial, size, stride) - PULL * off
                    if value > best + 1e-9:
                        best, better = value, True
                        centres[k, 0], centres[k, 1] = trial[0], trial[1]
                if not better:
                    if step == 1.0:
                        break
                    step = 1.0
    for k in range(count):
        x0, y0, across, down = _window(centres[k], sizes[k], 0.0)
        _, _, shown = _gains(shape, groups, group, bins, centres, sizes, k, tables[k], x0, y0, across, down)
        shares[k] = _mean(shape, shown, shown, x0, y0, centres[k], sizes[k], 1)
    return shares


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
    found = np.zeros((count, 2, size_of_histogram))
    even = np.zeros((2, size_of_histogram))
    for k in range(count):
        x0, y0, across, down = _window(centres[k], sizes[k], 0.0)
        _, _, shown = _gains(shape, groups, group, bins, centres, sizes, k, even, x0, y0, across, down)
        for i in range(down):
            region = 0 if i + y0 + 0.5 < centres[k, 1] else 1
            for j in range(across):
                if shown[i, j] * _cover(shape, j + x0, i + y0, centres[k], sizes[k]) > OWNED:
                    found[k, region, bins[i + y0, j + x0]] += 1.0
        for region in range(2):
            total = found[k, region].sum()
            if total > 0.0:
                found[k, region] /= total
            else:
                found[k, region] = 1.0 / size_of_histogram
    return found
