"""Small pictures and their reliefs, and the plain form of what a relief answers."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from tracker.in_car.relief import ACROSS, BRIGHT, DOWN, RED, SIGNED, make_relief


@st.composite
def pictures(draw, least=4, most=24):
    """Small grey pictures, busy or flat."""
    height, width = draw(st.integers(least, most)), draw(st.integers(least, most))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return rng.integers(0, draw(st.sampled_from([2, 40, 256])), (height, width)).astype(np.uint8)


def layers(grey, red=None):
    """The five layers of a picture, pixel by pixel, in half grey levels."""
    height, width = grey.shape
    found = np.zeros((5, height, width), int)
    if red is not None:
        found[RED] = 2 * red.astype(int)
    at = grey.astype(int)
    for i in range(height):
        for j in range(width):
            found[BRIGHT, i, j] = 2 * at[i, j]
            if 2 <= j <= width - 2:
                # The edge left of column j: two columns on either side.
                found[ACROSS, i, j] = abs(at[i, j] + at[i, j + 1] - at[i, j - 1] - at[i, j - 2])
            if 2 <= i <= height - 2:
                found[SIGNED, i, j] = at[i, j] + at[i + 1, j] - at[i - 1, j] - at[i - 2, j]
                found[DOWN, i, j] = abs(found[SIGNED, i, j])
    return found


def plain_mean(found, layer, x0, y0, x1, y1):
    """A layer's mean over the part of a rectangle that lies in the picture, in grey levels."""
    inside = found[layer][max(y0, 0) : max(y1, 0), max(x0, 0) : max(x1, 0)]
    return 0.5 * inside.mean() if inside.size else 0.0


def drawn_cars(cars, shape=(240, 320), horizon=110, seed=0):
    """A grey road with dark cars (x0, x1, contact row) seen from behind on it, and a bright sky.

    Returns:
        The picture, and the boxes of the cars.
    """
    rng = np.random.default_rng(seed)
    grey = np.full(shape, 190.0)
    grey[horizon:] = 120.0
    boxes = []
    for x0, x1, row in cars:
        wide = x1 - x0
        top = row - round(0.77 * wide)
        body = slice(top, row - max(1, round(0.06 * wide)))
        grey[body, x0:x1] = 60.0
        grey[top + round(0.1 * wide) : top + round(0.3 * wide), x0 + wide // 8 : x1 - wide // 8] = 95.0
        grey[row - max(1, round(0.06 * wide)) : row, x0:x1] = 25.0
        boxes.append((x0, top, x1, row))
    grey += rng.normal(0.0, 1.5, shape)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8), np.array(boxes, float)


def redness(grey):
    """Some redness for a picture."""
    return np.ascontiguousarray(grey[::-1, ::-1] // 2)


def relief_of(grey, horizon=None, middle=None, focal=300.0, red=None):
    """A picture's relief, grey and its horizon and middle in the middle where none are given."""
    height, width = grey.shape
    horizon = 0.45 * height if horizon is None else horizon
    red = np.zeros_like(grey) if red is None else red
    middle = 0.5 * width if middle is None else middle
    return make_relief(grey, red, horizon=horizon, middle=middle, focal=focal)
