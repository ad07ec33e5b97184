"""The background model written down plainly: every value fades in every frame, float64, pixel by pixel."""

from __future__ import annotations

from fractions import Fraction

import cv2
import numpy as np

from tracker.motorcycle_lane.background import StatMode
from tracker.motorcycle_lane.change import NEARBY, ROUND


class PlainTable:
    """Entries [p(v), p(v|b), feature], most frequent first."""

    def __init__(self, sizes, same):
        self.used, self.kept = sizes
        self.same = same
        self.entries = []

    def evidence(self, feature):
        matching = [e for e in self.entries[: self.used] if self.same(e[2], feature)]
        return sum(e[0] for e in matching), sum(e[1] for e in matching)

    def learn(self, feature, is_b, rate, mode):
        for entry in self.entries:
            entry[0] *= 1 - rate
            if mode is StatMode.JOINT or is_b:
                entry[1] *= 1 - rate
        known = [k for k, e in enumerate(self.entries) if self.same(e[2], feature)]
        if known:
            entry = self.entries.pop(known[0])
        else:
            del self.entries[self.kept - 1 :]
            entry = [0.0, 0.0, feature]
        entry[0] += rate
        entry[1] += rate * is_b
        # Of equals the latest comes first.
        above = known[0] if known else len(self.entries)
        while above and self.entries[above - 1][0] <= entry[0] * 1.0001:
            above -= 1
        self.entries.insert(above, entry)


def vector_same(tolerance, floor):
    def same(a, b):
        a, b = np.array(a, float), np.array(b, float)
        return ((a - b) ** 2).sum() <= max(tolerance * ((a**2).sum() + (b**2).sum()), floor**2)

    return same


def pair_same(tolerance):
    return lambda a, b: max(abs(p - q) for p, q in zip(a, b, strict=True)) <= tolerance


def sobel(grey):
    """Quantised gradients (H, W, 2), edges mirrored without the edge itself."""
    wide = np.pad(grey.astype(int), 1, mode="reflect")
    smooth = wide[:-2] + 2 * wide[1:-1] + wide[2:]
    along = smooth[:, 2:] - smooth[:, :-2]
    smooth = wide[:, :-2] + 2 * wide[:, 1:-1] + wide[:, 2:]
    across = smooth[2:] - smooth[:-2]
    return np.stack([along // 8, across // 8], -1)


def plain_corner(counts, least, most):
    """The largest bin gap below the line from the peak to the last bin in use."""
    peak = max(range(most + 1), key=lambda k: (counts[k], -k))
    last = max(k for k in range(256) if counts[k])
    if last <= peak:
        return least
    gaps = [
        Fraction(int(counts[peak] * (last - k) + counts[last] * (k - peak)), last - peak) - int(counts[k])
        for k in range(peak, last + 1)
    ]
    return min(max(peak + gaps.index(max(gaps)), least), most)


def with_rims(mask, changed):
    """Foreground, and what is changed beside a pixel that most of its neighbourhood agrees with."""
    height, width = mask.shape
    wide = np.pad(mask, 1, mode="edge")
    median = [[wide[y : y + 3, x : x + 3].sum() > 4 for x in range(width)] for y in range(height)]
    wide = np.pad(np.array(median), 1)
    near = [[wide[y : y + 3, x : x + 3].any() for x in range(width)] for y in range(height)]
    return mask | (changed & np.array(near))


def unhidden(image, background, hidden):
    """The picture, and where it may hide the background that in the light of what is seen nearby."""
    height, width = hidden.shape
    found = image.copy()

    def window(y, x, reach):
        return slice(max(y - reach, 0), y + reach + 1), slice(max(x - reach, 0), x + reach + 1)

    seen = [[not hidden[window(y, x, ROUND)].any() for x in range(width)] for y in range(height)]
    seen = np.array(seen)
    for y, x in np.argwhere(~seen):
        near = window(y, x, NEARBY)
        now, then = (picture[near][seen[near]].sum(0) for picture in (image, background))
        found[y, x] = np.minimum(np.round(background[y, x] * ((now + 1.0) / (then + 1.0))), 255)
    return found


class PlainModel:
    """What `tracker.motorcycle_lane.background.BackgroundModel` is, slowly."""

    def __init__(self, width, height, parameters):
        self.parameters = p = parameters
        self.shape = height, width
        self.tables = [
            [
                (
                    PlainTable(p.colours, vector_same(p.tolerance, p.colour_floor)),
                    PlainTable(p.gradients, vector_same(p.tolerance, p.gradient_floor)),
                    PlainTable(p.pairs, pair_same(p.pair_tolerance)),
                )
                for _ in range(width)
            ]
            for _ in range(height)
        ]
        self.p_b = np.ones(self.shape)
        self.background = self.previous = None
        self.frames = self.flashing = 0
        self.calm = 0.0
        self.foreground = np.zeros(self.shape, bool)

    def apply(self, image, grey):
        p = self.parameters
        if self.frames == 0:
            self.begin(image)
            self.frames = 1
            return np.zeros(self.shape, bool)
        training = self.frames < p.start_frames
        mask = self.step(image, grey)
        flash = mask.mean() > self.calm + p.flash_share and not training
        self.flashing = self.flashing + 1 if flash else 0
        self.frames += 1
        if self.flashing == p.flash_frames:
            self.flashing = 0
            if p.follow_light:
                self.begin(unhidden(image, self.background.round().astype(np.uint8), self.foreground))
                self.frames = p.start_frames
                mask = self.step(image, grey)
                self.frames += 1
            else:
                self.frames = 0
        if not self.flashing:
            self.foreground, self.calm = mask, mask.mean()
        self.previous = image
        return mask

    def begin(self, image):
        edges = sobel(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
        self.background = image.astype(float)
        self.previous = image
        self.p_b[:] = 1
        self.clear(lambda table: table.entries.clear())
        self.earlier = 0.0
        for at in np.ndindex(self.shape):
            for table, feature in zip(
                self.tables[at[0]][at[1]], self.features(image, edges, at), strict=True
            ):
                table.learn(feature, True, 1.0, self.parameters.mode)

    def step(self, image, grey):
        p = self.parameters
        edges = sobel(grey)
        mask = np.zeros(self.shape, bool)
        far = np.floor(np.abs(image - self.background).max(-1) + 0.5).astype(int)
        moved = np.abs(image.astype(int) - self.previous).max(-1)
        far, moved = (
            d > plain_corner(np.bincount(d.ravel(), minlength=256), p.least_change, p.most_change)
            for d in (far, moved)
        )
        training = self.frames < p.start_frames
        if self.frames == p.start_frames // 2:
            # Only now is it known what each pixel shows most often.
            self.clear(lambda table: [entry.__setitem__(1, 0.0) for entry in table.entries])
            self.p_b[:] = 0
            self.earlier = 1.0
        if self.frames == p.start_frames:
            self.settle()
        rate = max(p.rate, 1 / (self.frames + 1))
        self.earlier *= 1 - rate
        before = self.background.copy()
        changed = np.zeros(self.shape, bool)
        for at in np.ndindex(self.shape):
            features = self.features(image, edges, at)
            changed[at] = far[at] or (moved[at] and not p.uncovered)
            mask[at] = changed[at] and not self.looks_like_background(at, features, moved[at], training)
        learnt = with_rims(mask, changed) if p.rims else mask
        for at in np.ndindex(self.shape):
            features = self.features(image, edges, at)
            self.learn(at, image, features, changed[at], not learnt[at], training, rate)
        seen = ~learnt
        if p.follow_light and seen.any():
            sums, old = self.background[seen].sum(0), before[seen].sum(0)
            growth = np.where(old > 0, sums / np.maximum(old, 1e-9), 1)
            self.background[learnt] = np.minimum(self.background[learnt] * growth, 255)
        if p.revise and not training and self.frames * p.rate < 1:
            for at in np.argwhere(mask):
                self.revise(tuple(at), image, self.features(image, edges, tuple(at)))
        return mask

    def revise(self, at, image, features):
        tables = self.tables[at[0]][at[1]]
        usual = tables[0].entries[0]
        if not tables[0].same(usual[2], features[0]):
            return
        self.p_b[at] = max(self.p_b[at], usual[0])
        for table, feature in zip(tables, features, strict=True):
            entry = next(e for e in table.entries if table.same(e[2], feature))
            entry[1] = 1.0 if self.parameters.mode is StatMode.CONDITIONAL else self.p_b[at]
        self.background[at] = image[at]

    def clear(self, what):
        for at in np.ndindex(self.shape):
            for table in self.tables[at[0]][at[1]]:
                what(table)

    def settle(self):
        self.p_b /= 1 - self.earlier
        for at in np.ndindex(self.shape):
            for table in self.tables[at[0]][at[1]]:
                for entry in table.entries:
                    entry[1] /= 1 - self.earlier
                    if self.parameters.mode is StatMode.CONDITIONAL and self.p_b[at]:
                        entry[1] /= self.p_b[at]

    def features(self, image, edges, at):
        now = tuple(int(v) for v in image[at])
        last = tuple(int(v) for v in self.previous[at])
        return now, tuple(edges[at]), tuple(v // 8 for v in last + now)

    def looks_like_background(self, at, features, moved, training):
        tables, p_b = self.tables[at[0]][at[1]], self.p_b[at]
        if training:
            return tables[0].same(tables[0].entries[0][2], features[0])
        if moved:
            v, vb = tables[2].evidence(features[2])
            return 2 * vb * p_b > v
        (c, cb), (e, eb) = tables[0].evidence(features[0]), tables[1].evidence(features[1])
        return 2 * cb * eb * p_b > c * e

    def learn(self, at, image, features, changed, is_b, training, rate):
        p = self.parameters
        tables, p_b = self.tables[at[0]][at[1]], self.p_b[at]
        if is_b and changed:
            self.background[at] = image[at]
        elif is_b:
            self.background[at] += p.image_rate * (image[at] - self.background[at])
        self.p_b[at] = p_b = p_b + rate * (is_b - p_b)
        for table, feature in zip(tables, features, strict=True):
            table.learn(feature, is_b, rate, StatMode.JOINT if training else p.mode)
        seen, shared = (sum(e[k] for e in tables[0].entries[: tables[0].used]) for k in (0, 1))
        if not is_b and not training and seen - p_b * shared > p.once_off:
            for table in tables:
                for entry in table.entries[: table.used]:
                    if 2 * entry[1] * p_b <= entry[0]:
                        entry[1] = (entry[0] - p_b * entry[1]) / (1 - p_b)
            self.p_b[at] = 1 - p_b
