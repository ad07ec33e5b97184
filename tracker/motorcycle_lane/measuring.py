"""Measurements from the regions of the foreground: one of each rider, also where riders hang together.

A region that one track or none expects, and that has the size of one rider, is one measurement. Any other is
explained by silhouettes, one for each track that expects to be there and as many more as its foreground
calls for (`tracker.motorcycle_lane.silhouettes`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.filtering.matchings import components
from tracker.motorcycle_lane import colour, silhouettes
from tracker.motorcycle_lane.front_end import Sight
from tracker.motorcycle_lane.silhouettes import Silhouette
from tracker.motorcycle_lane.sizes import Samples, SizeModel
from tracker.motorcycle_lane.travellers import Travellers

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

TOO_LARGE = 1.4
"""A region so many times as wide or as high as a rider holds more than one, or one and something else."""
TOO_SHORT = 1.2
"""A region by so much narrower or lower than its track is only a part of the rider."""
TOO_SMALL = 0.25
"""A region of a smaller share of a rider's box, not at the border, is no rider."""
LEAST_WORTH = 0.65
"""How well a silhouette that no track expects must explain foreground."""
LEAST_SEEN = 0.25
"""Smallest share of a silhouette that must be seen to measure where it is."""
LEAST_OWN = 0.15
"""Share of a silhouette that must be foreground which no other explains: less is no sign of a rider."""
MOST_ADDED = 4
CORE, FEET = 0.04, 0.1
"""Least share of a box that a row or column of a region's core fills; lowest share of it, where the rest of
a shadow lies."""
DRAWN = 0.3
"""Share of a row that must be doubtful for a rider to reach down to it."""
EATEN = 1.0
"""What the median filter takes off each end of a rider, px."""
TRAINING = 15
"""Frames in which it is not yet known what each pixel shows most often, nor then what is a rider."""
LIMIT = 1.5
"""Log likelihood ratios of a pixel's colour lie between this and its negative."""
SWEEPS = 2
ROUNDS = 2
"""Of guessing a rider's size by its row, and the row of its middle, beyond the border, by its size."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Expected:
    """The N riders that are expected in a frame.

    Attributes:
        centres: (N, 2) of their boxes, px.
        sizes: (N, 2) width and height, px.
        references: (N, 2, BINS) their colours.
        moved: (N,) whether it has gone so far that it must be traffic.
    """

    centres: Floats
    sizes: Floats
    references: Floats
    moved: Flags

    @property
    def boxes(self) -> Floats:
        """(N, 4) x0, y0, x1, y1."""
        return np.concatenate([self.centres - 0.5 * self.sizes, self.centres + 0.5 * self.sizes], 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurements:
    """The M riders that are seen in a frame.

    Attributes:
        centres: (M, 2) of their whole boxes, px.
        sizes: (M, 2) width and height, px.
        histograms: (M, 2, BINS) colours of what is seen of each.
        alone: (M,) whether the rider is a region by itself, so that its size is measured, too.
        sized: (M,) whether one rider could be told from two by the region's size.
        shares: (M,) how much of it is seen.
        joined: (N,) whether an expected rider's region was explained by silhouettes.
    """

    centres: Floats
    sizes: Floats
    histograms: Floats
    alone: Flags
    sized: Flags
    shares: Floats
    joined: Flags

    def __len__(self) -> int:
        return len(self.centres)

    @property
    def boxes(self) -> Floats:
        """(M, 4) x0, y0, x1, y1."""
        return np.concatenate([self.centres - 0.5 * self.sizes, self.centres + 0.5 * self.sizes], 1)


@njit(cache=True)
def count_inside(labels, boxes, regions):  # type: ignore[no-untyped-def]
    """Return (N, regions) int64, how many pixels of each labelled region lie in each box (N, 4)."""
    height, width = labels.shape
    counts = np.zeros((boxes.shape[0], regions), np.int64)
    for k in range(boxes.shape[0]):
        for y in range(max(int(boxes[k, 1]), 0), min(int(np.ceil(boxes[k, 3])), height)):
            for x in range(max(int(boxes[k, 0]), 0), min(int(np.ceil(boxes[k, 2])), width)):
                if labels[y, x] > 0:
                    counts[k, labels[y, x] - 1] += 1
    return counts


@njit(cache=True)
def owners(labels, numbers, doubtful):  # type: ignore[no-untyped-def]
    """Return (H, W) int32 the number of each pixel's region, or -1 where it is 0 and the pixel doubtful.

    Args:
        labels: (H, W) int32, region k has k + 1.
        numbers: (N + 1,) int32 by label; 0 is nobody's.
        doubtful: (H, W) bool.
    """
    found = np.empty(labels.shape, np.int32)
    for y in range(labels.shape[0]):
        for x in range(labels.shape[1]):
            number = numbers[labels[y, x]]
            found[y, x] = -1 if number == 0 and doubtful[y, x] else number
    return found


@njit(cache=True)
def core_boxes(labels, boxes):  # type: ignore[no-untyped-def]
    """Return the boxes (N, 4) of labelled regions without what sticks out: rests of shadows, and specks.

    A column belongs to the core if it holds `CORE` of the box's height or more above the feet: a shadow lies
    on the road, so that beside a rider it is low. A row belongs to it if it holds as much of those columns.

    Args:
        labels: (H, W) int32, region k has k + 1.
        boxes: (N, 4) of the regions.
    """
    found = boxes.copy()
    for k in range(boxes.shape[0]):
        x0, y0, x1, y1 = int(boxes[k, 0]), int(boxes[k, 1]), int(boxes[k, 2]), int(boxes[k, 3])
        columns, rows = np.zeros(x1 - x0), np.zeros(y1 - y0)
        for y in range(y0, int(np.ceil(y1 - FEET * (y1 - y0)))):
            for x in range(x0, x1):
                if labels[y, x] == k + 1:
                    columns[x - x0] += 1.0
        wide = np.flatnonzero(columns >= CORE * (y1 - y0))
        if not wide.size:
            continue
        left, right = x0 + wide[0], x0 + wide[-1] + 1
        for y in range(y0, y1):
            for x in range(left, right):
                if labels[y, x] == k + 1:
                    rows[y - y0] += 1.0
        tall = np.flatnonzero(rows >= CORE * (right - left))
        if not tall.size:
            continue
        found[k, 0], found[k, 1], found[k, 2], found[k, 3] = left, y0 + tall[0], right, y0 + tall[-1] + 1
    return found


@njit(cache=True)
def reach_down(doubtful, boxes, heights):  # type: ignore[no-untyped-def]
    """Return the boxes (N, 4) drawn downwards over what may be a part of them or their shadow.

    Args:
        doubtful: (H, W) bool, what was taken for shadow.
        boxes: (N, 4) x0, y0, x1, y1.
        heights: (N,) how high they may become, px.
    """
    found = boxes.copy()
    for k in range(boxes.shape[0]):
        x0, x1 = max(int(boxes[k, 0]), 0), min(int(np.ceil(boxes[k, 2])), doubtful.shape[1])
        bottom = min(boxes[k, 1] + heights[k], float(doubtful.shape[0]))
        y = int(boxes[k, 3])
        while y < bottom and np.sum(doubtful[y, x0:x1]) >= DRAWN * (x1 - x0):
            y += 1
        found[k, 3] = max(boxes[k, 3], min(float(y), bottom))
    return found


def complete(visible: Floats, touches: Flags, sizes: Floats) -> Floats:
    """Return the whole boxes (N, 4) of riders that the picture's border cuts off.

    Args:
        visible: (N, 4) what is seen of them.
        touches: (N, 4) whether that touches the left, upper, right and lower border.
        sizes: (N, 2) how large they are.
    """
    whole = visible.copy()
    for axis in range(2):
        low, high = touches[:, axis], touches[:, axis + 2]
        size = sizes[:, axis]
        # One that is cut off across may show too little of its breadth; it goes to both sides.
        across = touches[:, 1 - axis] | touches[:, 3 - axis]
        lacking = np.maximum(size - (visible[:, axis + 2] - visible[:, axis]), 0.0)
        both = np.where((low == high) & across, 0.5, 0.0)
        whole[:, axis] -= lacking * np.where(low & ~high, 1.0, both)
        whole[:, axis + 2] += lacking * np.where(high & ~low, 1.0, both)
    return whole


class Measurer:
    """Measures riders, and learns from those alone how large they are and what shape they have."""

    def __init__(self, width: int, height: int) -> None:
        self.sizes = SizeModel(height)
        self.silhouette = Silhouette()
        self._travellers = Travellers()
        self._frame = np.array([width, height], float)
        self._frames = 0

    def measure(self, sight: Sight, expected: Expected) -> Measurements:
        """Return what is seen, given what is expected."""
        blobs = sight.blobs
        bins = colour.bin_pixels(sight.image, blobs.labels)
        inside = count_inside(blobs.labels, expected.boxes, len(blobs))
        linked = inside >= 0.2 * (expected.sizes.prod(1))[:, None]
        linked |= (inside >= 0.5 * blobs.areas) & (blobs.areas > 0)
        of_track, of_blob = components(linked)
        touches = np.concatenate([blobs.boxes[:, :2] <= 0, blobs.boxes[:, 2:] >= self._frame], 1)
        at_border = np.asarray(touches.any(1))
        # Tracks of a group, and its regions; regions that nobody expects are groups of their own.
        groups = [
            (np.flatnonzero(of_track == k), np.flatnonzero(of_blob == k))
            for k in np.unique(of_blob[of_blob >= 0])
        ]
        groups += [(np.zeros(0, np.int64), np.array([b])) for b in np.flatnonzero(of_blob < 0)]
        cores = core_boxes(blobs.labels, blobs.boxes)
        visible = cores + EATEN * np.array([-1.0, -1.0, 1.0, 1.0])
        known = self.sizes.known(0.5 * (cores[:, 1] + cores[:, 3]))
        whole = visible
        for _ in range(ROUNDS):
            usual = self.sizes.sizes(0.5 * (whole[:, 1] + whole[:, 3]))
            whole = complete(visible, touches & known[:, None], usual)
        small = (blobs.areas < TOO_SMALL * usual.prod(1)) & known & ~at_border
        numbers = np.zeros(len(blobs) + 1, np.int32)
        joined = np.zeros(len(expected.centres), np.bool_)
        alone: list[int] = []
        apart: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
        moved: list[int] = []
        for tracks, regions in groups:
            b = int(regions[0])
            if expected.moved[tracks].any():
                moved.extend(regions[~at_border[regions]].tolist())
            if len(tracks) == 0 and small[b]:
                continue
            if len(tracks) < 2 and len(regions) == 1:
                size = expected.sizes[tracks[0]] if len(tracks) else usual[b]
                if known[b]:
                    whole[b] = reach_down(sight.doubtful, whole[b : b + 1], size[1:])[0]
                if len(tracks) and at_border[b]:
                    whole[b] = complete(visible[b : b + 1], touches[b : b + 1], size[None])[0]
                shown = whole[b, 2:] - whole[b, :2]
                fits = (shown <= TOO_LARGE * size).all()
                fits &= len(tracks) == 0 or (shown >= size / TOO_SHORT).all()
                if fits or not known[b]:
                    alone.append(b)
                    continue
            joined[tracks] = True
            numbers[regions + 1] = len(apart) + 1
            apart.append((tracks, regions))
        chosen = np.array(alone, np.int64)
        found = [
            Measurements(
                centres=0.5 * (whole[chosen, :2] + whole[chosen, 2:]),
                sizes=whole[chosen, 2:] - whole[chosen, :2],
                histograms=colour.histograms(bins, blobs.labels, chosen + 1, blobs.boxes[chosen]),
                alone=~at_border[chosen],
                sized=known[chosen] & ~at_border[chosen],
                shares=np.ones(len(chosen)),
                joined=joined,
            )
        ]
        owner = owners(blobs.labels, numbers, sight.doubtful) if apart else blobs.labels
        for number, (tracks, regions) in enumerate(apart):
            x0, y0 = blobs.boxes[regions, :2].min(0)
            x1, y1 = blobs.boxes[regions, 2:].max(0)
            found.append(self._explain(owner, number + 1, bins, (x0, y0, x1, y1), expected, tracks, joined))
        travelled = self._travellers.step(blobs, cores, ~at_border)
        if self._frames >= TRAINING:
            boxes = cores[travelled]
            shown = boxes[:, 2:] - boxes[:, :2] + 2.0 * EATEN
            self.sizes.learn(Samples(0.5 * (boxes[:, 1] + boxes[:, 3]), shown), travelled=True)
            for b in np.intersect1d(moved, alone):
                x0, y0, x1, y1 = cores[b].astype(int)
                self.silhouette.learn(blobs.labels[y0:y1, x0:x1] == b + 1)
        self._frames += 1
        return _together(found, joined)

    def _explain(
        self,
        owner: NDArray[np.int32],
        number: int,
        bins: NDArray[np.uint8],
        box: tuple[float, float, float, float],
        expected: Expected,
        tracks: NDArray[np.int64],
        joined: Flags,
    ) -> Measurements:
        """Explain a group of regions, within ``box``, by silhouettes."""
        shape = self.silhouette.shape
        centres, sizes = expected.centres[tracks].copy(), expected.sizes[tracks]
        tables = _tell_apart(expected.references[tracks])
        shares = silhouettes.place(shape, owner, number, bins, centres, sizes, tables, SWEEPS)
        kept = silhouettes.needed(shape, owner, number, bins, centres, sizes, LEAST_OWN)
        if not kept.all():
            tracks = tracks[kept]
            centres, sizes = expected.centres[tracks].copy(), expected.sizes[tracks]
            tables = _tell_apart(expected.references[tracks])
            shares = silhouettes.place(shape, owner, number, bins, centres, sizes, tables, SWEEPS)
        if self.sizes.known(np.array([0.5 * (box[1] + box[3])]))[0]:
            more = silhouettes.unexplained(
                shape,
                owner,
                number,
                self._window(box),
                centres,
                sizes,
                *self.sizes.line,
                LEAST_WORTH,
                MOST_ADDED,
            )
            if len(more):
                centres = np.concatenate([centres, more[:, 1:]])
                sizes = np.concatenate([sizes, self.sizes.sizes(more[:, 2])])
                tables = np.concatenate([tables, np.zeros((len(more), *tables.shape[1:]))])
                shares = silhouettes.place(shape, owner, number, bins, centres, sizes, tables, SWEEPS)
        histograms = silhouettes.colours(shape, owner, number, bins, centres, sizes, colour.BINS)
        seen = shares >= LEAST_SEEN
        return Measurements(
            centres=centres[seen],
            sizes=sizes[seen],
            histograms=histograms[seen],
            alone=np.zeros(int(seen.sum()), np.bool_),
            sized=np.zeros(int(seen.sum()), np.bool_),
            shares=shares[seen],
            joined=joined,
        )

    def _window(self, box: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        """Return where the centre of a rider may lie of a group within ``box``."""
        x0, y0, x1, y1 = box
        (w_top, h_top), (w_bottom, h_bottom) = self.sizes.sizes(np.array([y0, y1]))
        w = min(w_top, w_bottom)
        left = x0 + (0.35 * w if x0 > 0 else 0.0)
        right = x1 - (0.35 * w if x1 < self._frame[0] else 0.0)
        top = y0 + (0.35 * h_top if y0 > 0 else 0.0)
        bottom = y1 - (0.35 * h_bottom if y1 < self._frame[1] else 0.0)
        return left, top, max(left, right), max(top, bottom)


def _tell_apart(references: Floats) -> Floats:
    """Return (K, 2, BINS) log likelihood ratios of colours: each rider's against the others'."""
    if len(references) < 2:
        return np.zeros(references.shape)
    floor = 0.5 / colour.BINS
    others = (references.sum(0) - references) / (len(references) - 1)
    return np.asarray(np.clip(np.log((references + floor) / (others + floor)), -LIMIT, LIMIT))


def _together(parts: list[Measurements], joined: Flags) -> Measurements:
    return Measurements(
        centres=np.concatenate([part.centres for part in parts]),
        sizes=np.concatenate([part.sizes for part in parts]),
        histograms=np.concatenate([part.histograms for part in parts]),
        alone=np.concatenate([part.alone for part in parts]),
        sized=np.concatenate([part.sized for part in parts]),
        shares=np.concatenate([part.shares for part in parts]),
        joined=joined,
    )
