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

from tracker.motorcycle_lane.sizes import SMALLEST

Floats = NDArray[np.float64]

ROWS, COLUMNS = 24, 12
ON_BACKGROUND = 1.3
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
def _cells(start, stop, stride, centre, size, cells):  # type: ignore[no-untyped-def]
    """Return the first pixel of a row or column, from ``start``, in a silhouette, and the cells of all there.

    The same as `_cover` reads, for one axis at once.
    """
    first, count = start, 0
    found = np.empty(max(stop - start, 0) // stride + 1, np.int64)
    for pixel in range(start, stop, stride):
        u = (pixel + 0.5 - centre) / size + 0.5
        if u >= 1.0:
            break
        if u < 0.0:
            first = pixel + stride
            continue
        found[count] = int(u * cells)
        count += 1
    return first, found[:count]


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
        left, right = centres[n, 0] - 0.5 * sizes[n, 0], centres[n, 0] + 0.5 * sizes[n, 0]
        top, bottom = centres[n, 1] - 0.5 * sizes[n, 1], centres[n, 1] + 0.5 * sizes[n, 1]
        start, stop = max(int(np.floor(left)), x0), min(int(np.ceil(right)), x0 + across)
        first_x, columns = _cells(start, stop, 1, centres[n, 0], sizes[n, 0], shape.shape[1])
        start, stop = max(int(np.floor(top)), y0), min(int(np.ceil(bottom)), y0 + down)
        first_y, rows = _cells(start, stop, 1, centres[n, 1], sizes[n, 1], shape.shape[0])
        for i in range(rows.size):
            for j in range(columns.size):
                rest = 1.0 - shape[rows[i], columns[j]]
                free[first_y - y0 + i, first_x - x0 + j] *= rest
                if nearer:
                    shown[first_y - y0 + i, first_x - x0 + j] *= rest
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
    right, bottom = int(np.ceil(place[0] + 0.5 * size[0])), int(np.ceil(place[1] + 0.5 * size[1]))
    first_x, columns = _cells(left, right, stride, place[0], size[0], shape.shape[1])
    first_y, rows = _cells(top, bottom, stride, place[1], size[1], shape.shape[0])
    for i in range(rows.size):
        y = first_y + i * stride
        half = upper if y + 0.5 < place[1] else lower
        for j in range(columns.size):
            x = first_x + j * stride
            covered = shape[rows[i], columns[j]]
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
        groups: (H, W) int32, number of the group of each foreground pixel; 0 is background, -1 what may be it
            or a rider: it costs nothing here, and as much as background to a rider whom nobody expects.
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
            # Moves are whole pixels: what was tried once is not better the second time.
            span, step, best = int(reach), 2, -np.inf
            tried = np.zeros((2 * span + 1, 2 * span + 1), np.bool_)
            start_x, start_y, at_x, at_y = centres[k, 0], centres[k, 1], 0, 0
            while True:
                from_x, from_y, better = at_x, at_y, False
                for move in range(9):
                    dx, dy = from_x + step * (move % 3 - 1), from_y + step * (move // 3 - 1)
                    if max(abs(dx), abs(dy)) > span or tried[span + dy, span + dx]:
                        continue
                    tried[span + dy, span + dx] = True
                    trial[0], trial[1] = start_x + dx, start_y + dy
                    off = ((trial[0] - expected[k, 0]) / size[0]) ** 2 + (
                        (trial[1] - expected[k, 1]) / size[1]
                    ) ** 2
                    value = _mean(shape, upper, lower, x0, y0, trial, size, stride) - PULL * off
                    if value > best + 1e-9:
                        best, better, at_x, at_y = value, True, dx, dy
                if not better:
                    if step == 1:
                        break
                    step = 1
            centres[k, 0], centres[k, 1] = start_x + at_x, start_y + at_y
    for k in range(count):
        x0, y0, across, down = _window(centres[k], sizes[k], 0.0)
        _, _, shown = _gains(shape, groups, group, bins, centres, sizes, k, tables[k], x0, y0, across, down)
        shares[k] = _mean(shape, shown, shown, x0, y0, centres[k], sizes[k], 1)
    return shares


@njit(cache=True)
def needed(shape, groups, group, bins, centres, sizes, least):  # type: ignore[no-untyped-def]
    """Tell which of K placed silhouettes explain what no other does; the least needed go first, one by one.

    Args:
        shape: (ROWS, COLUMNS) of a silhouette.
        groups: (H, W) int32 as in `place`.
        group: Which one.
        bins: (H, W) colour bin of each foreground pixel.
        centres: (K, 2) where they are.
        sizes: (K, 2) width and height.
        least: Share of a silhouette that must be foreground which the others do not cover.

    Returns:
        (K,) bool.
    """
    kept = np.ones(centres.shape[0], np.bool_)
    even = np.zeros((2, bins.max() + 1))
    while kept.sum() > 1:
        left = np.flatnonzero(kept)
        others, theirs = centres[left], sizes[left]
        worst, which = least, -1
        for n in range(left.size):
            x0, y0, across, down = _window(others[n], theirs[n], 0.0)
            own, _, _ = _gains(shape, groups, group, bins, others, theirs, n, even, x0, y0, across, down)
            own = np.maximum(own, 0.0)
            share = _mean(shape, own, own, x0, y0, others[n], theirs[n], 1)
            if share < worst:
                worst, which = share, left[n]
        if which < 0:
            break
        kept[which] = False
    return kept


@njit(cache=True)
def _claim(shape, gain, left, top, centre, size):  # type: ignore[no-untyped-def]
    """Take what a silhouette explains from the foreground in ``gain``, whose first pixel is left, top."""
    low_x, low_y = int(centre[0] - 0.5 * size[0]), int(centre[1] - 0.5 * size[1])
    high_x, high_y = int(centre[0] + 0.5 * size[0]) + 1, int(centre[1] + 0.5 * size[1]) + 1
    for y in range(max(low_y, top), min(high_y, top + gain.shape[0])):
        for x in range(max(low_x, left), min(high_x, left + gain.shape[1])):
            if gain[y - top, x - left] > 0.0:
                gain[y - top, x - left] *= 1.0 - _cover(shape, x, y, centre, size)


@njit(cache=True)
def _worth(shape, gain, left, top, centre, size):  # type: ignore[no-untyped-def]
    """Return how well a silhouette would explain what is left in ``gain``."""
    stride = 3 if size[0] >= 18.0 else 2
    total, value = 1e-9, 0.0
    low_x, low_y = int(centre[0] - 0.5 * size[0]), int(centre[1] - 0.5 * size[1])
    high_x, high_y = int(centre[0] + 0.5 * size[0]) + 1, int(centre[1] + 0.5 * size[1]) + 1
    first_x, columns = _cells(low_x, high_x, stride, centre[0], size[0], shape.shape[1])
    first_y, rows = _cells(low_y, high_y, stride, centre[1], size[1], shape.shape[0])
    for i in range(rows.size):
        y = first_y - top + i * stride
        for j in range(columns.size):
            x = first_x - left + j * stride
            covered = shape[rows[i], columns[j]]
            total += covered
            if 0 <= y < gain.shape[0] and 0 <= x < gain.shape[1]:
                value += covered * gain[y, x]
    return value / total


@njit(cache=True)
def unexplained(  # type: ignore[no-untyped-def]
    shape, groups, group, window, centres, sizes, offsets, slopes, least, most
):
    """Look for the places where more silhouettes would explain most of a group, one after another.

    Args:
        shape: (ROWS, COLUMNS) of a silhouette.
        groups: (H, W) int32 as in `place`.
        group: Which one.
        window: x0, y0, x1, y1, px: where its centre may lie.
        centres: (K, 2) of those that are placed.
        sizes: (K, 2) of those.
        offsets: (2,) width and height of one at row 0.
        slopes: (2,) by how much they grow a row.
        least: Worth of which one must be to be found.
        most: How many are looked for.

    Returns:
        (N, 3), N <= most: the worth of each, at most 1, given those before, and its centre x, y.
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
            elif groups[y, x] <= 0:
                gain[y - top, x - left] = -ON_BACKGROUND
    for k in range(centres.shape[0]):
        _claim(shape, gain, left, top, centres[k], sizes[k])
    step = max(2.0, 0.12 * (offsets[0] + slopes[0] * 0.5 * (y0 + y1)))
    rows = max(1, int((y1 - y0) / step) + 1)
    columns = max(1, int((x1 - x0) / step) + 1)
    worths = np.empty((rows, columns))
    found = np.empty((most, 3))
    centre, size, new, new_size = np.empty(2), np.empty(2), np.empty(2), np.empty(2)
    for n in range(most):
        best = -np.inf
        for i in range(rows):
            centre[1] = y0 + step * i
            for c in range(2):
                size[c] = max(offsets[c] + slopes[c] * centre[1], SMALLEST)
            for j in range(columns):
                centre[0] = x0 + step * j
                # Only what the last one that was found reaches is worth another now.
                if n == 0 or (
                    abs(centre[0] - new[0]) < 0.5 * (size[0] + new_size[0]) + 1.0
                    and abs(centre[1] - new[1]) < 0.5 * (size[1] + new_size[1]) + 1.0
                ):
                    worths[i, j] = _worth(shape, gain, left, top, centre, size)
                if worths[i, j] > best:
                    best = worths[i, j]
                    found[n, 0], found[n, 1], found[n, 2] = best, centre[0], centre[1]
        if best < least:
            return found[:n]
        new[0], new[1] = found[n, 1], found[n, 2]
        for c in range(2):
            new_size[c] = max(offsets[c] + slopes[c] * new[1], SMALLEST)
        _claim(shape, gain, left, top, new, new_size)
    return found


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
