"""Vertical condensing: a frame's features summed down the columns into profiles (paper 1, section III).

The paper merges whatever stands above one x. Here the segments are first gathered into clusters that agree in
x and lie close together in y, so that a pole before a far car, or two cars in line, keep centres of their
own; the profile stays what decides whether a centre is strong enough to be one.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car import segments as seg
from tracker.in_car.features import Features, Picture

Floats = NDArray[np.float64]
Profile = NDArray[np.float32]

SEGMENT, LAMP = 0, 1
# Smoothing of the profiles, px at a width of 640 (paper 1, Fig. 7).
SMOOTHING = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Centres:
    """The N centres of feature clusters in one frame, working px.

    Attributes:
        x: (N,) weighted middle.
        y: (N,) weighted mean row.
        width: (N,) px.
        weight: (N,) strength on the profile.
        kind: (N,) uint8, `SEGMENT` or `LAMP`.
        points: (K, 2) the image points of the features behind the centres.
        owners: (K,) index of the centre that a point belongs to.
    """

    x: Floats
    y: Floats
    width: Floats
    weight: Floats
    kind: NDArray[np.uint8]
    points: Floats
    owners: NDArray[np.int64]


def band_rows(horizon: float, height: int, width: int) -> tuple[int, int]:
    """Return the rows [top, bottom) in which vehicles show, by p(x, y | C) (`tracker.in_car.occurrence`).

    From the roof of a near van above the horizon down to the ground some five metres ahead; in units of
    the picture's width, since the focal length scales with it.
    """
    top = int(np.clip(horizon - 0.09 * width, 0, height - 16))
    bottom = int(np.clip(horizon + 0.30 * width, top + 16, height))
    return top, bottom


@njit(cache=True)
def _condense(spans, weights, width):  # type: ignore[no-untyped-def]
    begun, ended = np.zeros(width + 1), np.zeros(width + 1)
    for k in range(weights.size):
        begun[min(max(int(spans[k, 0]), 0), width)] += weights[k]
        ended[min(max(int(spans[k, 1]), 0), width)] += weights[k]
    profile = np.empty(width, np.float32)
    total = 0.0
    for column in range(width):
        total += begun[column] - ended[column]
        profile[column] = total
    return profile


def condense(spans: Floats, weights: Floats, width: int) -> Profile:
    """Sum weighted spans [x0, x1) over the columns.

    Args:
        spans: (M, 2) px.
        weights: (M,).
        width: Columns.

    Returns:
        (width,) profile: at each column the weights of the spans that cover it.
    """
    found: Profile = _condense(spans, weights, width)
    return found


def smooth(profile: Profile, sigma: float) -> Profile:
    """Smooth a profile with a Gaussian, px."""
    rows = cv2.GaussianBlur(profile[None], (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(rows, np.float32).reshape(-1)


def intensity(picture: Picture, top: int, bottom: int) -> Profile:
    """Return the mean intensity of every column over rows [top, bottom): (W,)."""
    mean = cv2.reduce(picture.grey[top:bottom], 0, cv2.REDUCE_AVG, dtype=cv2.CV_32F)
    return np.asarray(mean, np.float32).reshape(-1)


@njit(cache=True)
def _cluster(x0, x1, y):  # type: ignore[no-untyped-def]
    """Union-find over segments that share their middle and lie close in y.

    Returns:
        (M,) group of each segment, in the order of the groups' first segments, and (G, 5): length, mean
        middle and row weighted by length, mean length likewise, segments.
    """
    total = x0.size
    parent = np.arange(total)
    order = np.argsort(y, kind="mergesort")
    rows, lengths, doubles = y[order], (x1 - x0)[order], (x0 + x1)[order]
    for at in range(total):
        row, length, double = rows[at], lengths[at], doubles[at]
        # The lengths of two that belong together differ by 2.5 at most.
        farthest = 0.45 * 2.5 * length + 2.0
        for before in range(at - 1, -1, -1):
            if row - rows[before] > farthest:
                break
            longer, shorter = max(length, lengths[before]), min(length, lengths[before])
            apart = abs(double - doubles[before]) > 0.4 * longer
            if apart | (shorter < 0.4 * longer) | (row - rows[before] > 0.45 * longer + 2.0):
                continue
            a, b = order[at], order[before]
            while parent[a] != a:
                parent[a] = parent[parent[a]]
                a = parent[a]
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            parent[max(a, b)] = min(a, b)
    group = np.empty(total, np.int64)
    sums = np.zeros((total, 5))
    count = 0
    for i in range(total):
        root = i
        while parent[root] != root:
            root = parent[root]
        # The root is the first of its group, so it has its number already.
        if root == i:
            group[i] = count
            count += 1
        else:
            group[i] = group[root]
        length = x1[i] - x0[i]
        one = sums[group[i]]
        one[0] += length
        one[1] += length * 0.5 * (x0[i] + x1[i])
        one[2] += length * y[i]
        one[3] += length * length
        one[4] += 1.0
    for k in range(count):
        sums[k, 1:4] /= max(sums[k, 0], 1e-9)
    return group, sums[:count]


@njit(cache=True)
def local_maxima(profile, least, radius):  # type: ignore[no-untyped-def]
    """Return the columns where a profile is at least ``least`` and highest within ``radius``."""
    places = np.empty(profile.size, np.int64)
    used = 0
    for column in range(profile.size):
        value = profile[column]
        if value < least:
            continue
        highest = True
        for other in range(max(0, column - radius), min(profile.size, column + radius + 1)):
            if profile[other] > value or (other < column and profile[other] == value):
                highest = False
                break
        if highest:
            places[used] = column
            used += 1
    return places[:used]


@njit(cache=True)
def _strongest(middle, weight, peaks, reach, layers):  # type: ignore[no-untyped-def]
    """Choose the heaviest clusters at each maximum of the profile.

    Args:
        middle: (G,) px, of the clusters.
        weight: (G,).
        peaks: (P,) columns of the maxima, ascending.
        reach: A chosen cluster is no farther from its maximum, px.
        layers: Clusters chosen at a maximum.

    Returns:
        (G,) bool.
    """
    chosen = np.zeros(middle.size, np.bool_)
    if peaks.size == 0:
        return chosen
    room = np.full(peaks.size, layers)
    for k in np.argsort(-weight, kind="mergesort"):
        nearest = min(np.searchsorted(peaks, middle[k]), peaks.size - 1)
        if nearest > 0 and middle[k] - peaks[nearest - 1] <= abs(peaks[nearest] - middle[k]):
            nearest -= 1
        if room[nearest] > 0:
            room[nearest] -= 1
            chosen[k] = abs(middle[k] - (peaks[nearest] + 0.5)) <= reach
    return chosen


def find_centres(
    features: Features,
    segment_profile: Profile,
    horizon: float,
    *,
    longest: float = 2.8,
    share: float = 0.6,
    reach: float = 6.0,
    layers: int = 3,
    stack: int = 3,
) -> Centres:
    """Gather features into centres.

    Args:
        features: Of the frame.
        segment_profile: (W,) smoothed profile of the segments.
        horizon: Row of the horizon, px.
        longest: Segments longer than this many times their height below the horizon (and 40 px) are wider
            than any
            vehicle that stands there: kerbs, bridges, shadows across the road. They make no centre.
        share: A maximum of the profile counts above this share of the profile's mean over the picture.
        reach: A cluster belongs to a maximum this near, px.
        layers: Clusters kept above one maximum: the strongest ones.
        stack: A cluster of so many segments, one above the other, counts without a maximum of the whole
            profile: what
            else stands in its columns may drown it.

    Returns:
        The centres.
    """
    found = features.segments
    length = found[:, seg.X1] - found[:, seg.X0]
    found = found[length <= np.maximum(longest * np.abs(found[:, seg.Y] - horizon), 40.0)]
    x0, x1, y = found[:, seg.X0].copy(), found[:, seg.X1].copy(), found[:, seg.Y].copy()
    group, sums = _cluster(x0, x1, y)
    weight, middle, row, wide, size = sums.T
    peaks: NDArray[np.int64] = local_maxima(
        segment_profile, share * float(segment_profile.mean()), round(SMOOTHING)
    )
    strong = _strongest(middle, weight, peaks, reach, layers) | (size >= stack)
    renumber = np.cumsum(strong) - 1
    member = strong[group]
    lamps = features.lamps
    kept = int(strong.sum())
    return Centres(
        x=np.concatenate([middle[strong], lamps[:, 0]]),
        y=np.concatenate([row[strong], lamps[:, 1]]),
        width=np.concatenate([wide[strong], np.full(len(lamps), 6.0)]),
        weight=np.concatenate([weight[strong], lamps[:, 2] / 4.0]),
        kind=np.repeat(np.array([SEGMENT, LAMP], np.uint8), [kept, len(lamps)]),
        points=np.concatenate([np.stack([0.5 * (x0 + x1), y], 1)[member], lamps[:, :2]]),
        owners=np.concatenate([renumber[group[member]], kept + np.arange(len(lamps))]),
    )
