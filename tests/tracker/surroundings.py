"""What `tracker.surroundings` does, said plainly, pixel by pixel."""

from __future__ import annotations

import numpy as np

from tracker.surroundings import BRIGHTEST, DIM, UNIT


def smoothed(picture):
    """Means over 3 x 3 pixels, the picture mirrored at its border."""
    wide = np.pad(picture.astype(float), ((1, 1), (1, 1), (0, 0)), mode="reflect")
    height, width = picture.shape[:2]
    return np.rint(sum(wide[y : y + height, x : x + width] for y in range(3) for x in range(3)) / 9)


def window(middle, half, limit):
    """What of an axis lies so near; beyond the picture its outermost pixel."""
    inside = [w for w in range(middle - half, middle + half + 1) if 0 <= w < limit]
    return inside or [0 if middle < 0 else limit - 1]


def floored(part):
    return np.floor(part.astype(np.float32) * UNIT) / UNIT


def average(part, y, x, half):
    """The mean of the square about a pixel."""
    rows, columns = (window(middle, half, limit) for middle, limit in zip((y, x), part.shape, strict=True))
    return part[np.ix_(rows, columns)].mean()


def differences(now, then):
    """How many times as bright each pixel is as the background, and how steep beyond its pattern."""
    ratios = np.minimum(((now + 1) / (then + 1)).mean(2), BRIGHTEST)
    grey, ground = now.mean(2), then.mean(2)
    edges = np.zeros_like(grey)
    for y in range(1, len(grey) - 1):
        for x in range(1, len(grey[0]) - 1):
            steep = [
                grey[y + dy, x + dx]
                - grey[y - dy, x - dx]
                - ratios[y, x] * (ground[y + dy, x + dx] - ground[y - dy, x - dx])
                for dy, dx in ((0, 1), (1, 0))
            ]
            edges[y, x] = min(np.hypot(*steep) / (grey[y, x] + DIM), 1)
    return floored(ratios), floored(edges)


def reaches(mask, y, x):
    """How far it goes on from a pixel, with it: up, down, left and right."""
    found = []
    for dy, dx in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        steps, v, u = 0, y, x
        while 0 <= v < len(mask) and 0 <= u < len(mask[0]) and mask[v, u]:
            steps, v, u = steps + 1, v + dy, u + dx
        found.append(steps)
    return found
