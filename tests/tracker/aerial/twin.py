"""What the compiled loops of the aerial tracker do, said plainly, pixel by pixel."""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np

from tracker.aerial.background import (
    DEVIATIONS,
    FAINT,
    KNOWN,
    LATE,
    LEAST_CHANGE,
    NEW_SPREAD,
    OFTEN,
    RATE,
    SOON,
)
from tracker.aerial.measuring import REACH, SCRAP


def claim(labels, single, senior, centres, headings, halves):
    """Who owns which pixels: (i, j) -> track; who is beaten; and labels left."""
    count = len(centres)
    owner = {}
    for i, j in np.argwhere(labels > 0).tolist():
        away = []
        for centre, (c, s), half in zip(centres, headings, halves, strict=True):
            x, y = np.array([j, i]) + 0.5 - centre
            away.append(max(abs(x * c + y * s) / half[0], abs(y * c - x * s) / half[1]))
        if away and min(away) <= REACH:
            owner[i, j] = int(np.argmin(np.float32(away)))
    votes = Counter((int(labels[at]), n) for at, n in owner.items())
    areas = Counter(labels[labels > 0].tolist())
    allowed = defaultdict(list)
    for n in range(count):
        own = [(-votes[label, n], label) for label in areas if votes[label, n]]
        for _, label in own:
            if label == min(own)[1] or areas[label] < SCRAP * 4.0 * halves[n].prod():
                allowed[label].append(n)
    winner = {
        label: max(tracks, key=lambda n: (senior[n], votes[label, n], -n))
        for label, tracks in allowed.items()
        if single[label]
    }
    left, pixels = labels.copy(), defaultdict(list)
    for i, j in np.argwhere(labels > 0).tolist():
        label = int(labels[i, j])
        n = winner.get(label, owner.get((i, j)))
        if n is not None and n in allowed[label]:
            left[i, j] = 0
            pixels[n].append((j + 0.5, i + 0.5))
    voted = {n for _, n in votes}
    beaten = np.array([n in voted and n not in pixels for n in range(count)], bool)
    return pixels, beaten, left


def moments(points, heading):
    """One, places along and across a heading, and their squares, summed over points (K, 2)."""
    points = np.asarray(points, float).reshape(-1, 2)
    along = points @ heading
    across = points @ np.array([-heading[1], heading[0]])
    return np.array([len(points), along.sum(), across.sum(), (along**2).sum(), (across**2).sum()])


class Pixel:
    """One pixel of the background."""

    def __init__(self):
        self.mean, self.spread, self.support = np.zeros(3, np.float32), np.float32(NEW_SPREAD), 0
        self.rival, self.rivals, self.often = np.zeros(3), 0, 0.0

    def see(self, colour, protected, low, high):
        """Take in a colour (3,), given bounds of the neighbours' means; return whether it is foreground."""
        colour = np.asarray(colour, np.float32)
        if not self.support:
            self.mean, self.support = colour.copy(), 1
            return False
        apart = np.maximum(np.maximum(colour - high, low - colour), 0).max()
        change = LEAST_CHANGE + DEVIATIONS * self.spread
        foreground = apart > FAINT * change and self.support >= KNOWN
        self.often += OFTEN * (foreground - self.often)
        if apart <= change:
            self.support, self.rivals = min(self.support + 1, LATE), max(self.rivals - 1, 0)
            self.mean = self.mean + np.float32(max(1 / self.support, RATE)) * (colour - self.mean)
            self.spread = self.spread + np.float32(0.05) * (apart - self.spread)
            return foreground
        if not (protected and self.support >= SOON):
            self._weigh(colour, change)
        return foreground

    def _weigh(self, colour, change):
        if self.rivals and np.abs(colour - self.rival).max() <= change:
            self.rivals += 1
            if self.rivals > self.support:
                self.mean, self.spread = self.rival.astype(np.float32), np.float32(NEW_SPREAD)
                self.support, self.rivals = self.rivals, 0
            return
        self.rivals = max(self.rivals - 1, 0)
        if not self.rivals:
            self.rival, self.rivals = colour.astype(float), 1
