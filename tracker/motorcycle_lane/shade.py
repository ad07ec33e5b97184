"""What of the foreground are riders, and what is their shadow: by its colour, and by where riders stand.

What a shadow falls on nearly keeps its colour: the three channels fall by about one factor, where the sun is
hidden and the sky still shines the blue one somewhat less, and below a machine, where the sky is hidden too,
all alike. Clothes, skin and lacquer change the colours as they like. So each pixel gives a likelihood ratio,
and a neighbourhood decides together (parametric, statistical and with a local decision, as Prati, Mikic,
Trivedi, Cucchiara, Detecting moving shadows, IEEE T-PAMI 25(7), 2003, sort such methods). Grey clothes look
like a shadow all the same; but where a rider is expected there is more likely one than a shadow, and a shadow
lies on the road: what is as high as a rider is upright, at least in its upper part.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.motorcycle_lane.silhouettes import Silhouette

REACH = 1
"""Half side of the window over which colours are averaged, px."""
DARKNESS, DARKNESS_SPREAD = 0.65, 0.14
"""Ratio to the background image that shadows have, and its standard deviation."""
BLUEST = 0.25
"""Tint of the bluest shadow: ratio of blue minus that of red, over their mean. Its light is the sky's."""
TINT_NOISE, GREEN_NOISE = 0.05, 0.04
"""Standard deviations of a shadow's tint beyond 0 to `BLUEST`, and of green against red and blue."""
TINT_SPREAD, GREEN_SPREAD = 0.5, 0.2
"""Those of riders."""
COMMON = 1.3
"""Log likelihood ratio that speaks for a shadow where its darkness is just that of one."""
MOST = 4.0
"""Log likelihood ratios of a pixel lie between this and its negative."""
NEIGHBOURHOOD = 2.0
"""Standard deviation of the Gaussian neighbourhood that decides, px."""
INSIDE, BESIDE, ELSEWHERE = 4.5, -0.5, 0.5
"""Log odds of rider against shadow in the middle of an expected rider, beside it, and where none is expected:
there a new rider must not be taken for a shadow before it is known."""
AROUND = 1.0, 0.5
"""How far the surroundings of a rider's box reach, in its widths and heights."""
TALL, UPPER = 0.7, 0.6
"""Share of a rider's height from which a column of foreground is upright, and which part of it surely is."""
UPRIGHT = 3.0
"""Log odds of rider against shadow there."""
STANDING = Silhouette().shape
"""How likely each part of a rider's box is covered, before any was seen: one that is learnt from foreground
lacks for ever what was once taken for shadow."""


@njit(cache=True)
def evidence(image, background, mask):  # type: ignore[no-untyped-def]
    """Tell how much each foreground pixel looks like the road in shadow.

    Args:
        image: (H, W, 3) uint8.
        background: (H, W, 3) uint8.
        mask: (H, W) bool, foreground.

    Returns:
        (H, W) float32 log likelihood ratio of shadow against rider; 0 off the foreground.
    """
    height, width = mask.shape
    found = np.zeros((height, width), np.float32)
    # A rider's colours spread wider, so each of them is the less likely.
    root = np.sqrt(2.0 * np.pi)
    narrower = np.log(GREEN_SPREAD / GREEN_NOISE) + np.log(root * TINT_SPREAD / (BLUEST + root * TINT_NOISE))
    now, then, ratio = np.zeros(3), np.zeros(3), np.zeros(3)
    for y in range(height):
        for x in range(width):
            if not mask[y, x]:
                continue
            now[:] = 0.0
            then[:] = 0.0
            count = 0
            for v in range(max(y - REACH, 0), min(y + REACH + 1, height)):
                for u in range(max(x - REACH, 0), min(x + REACH + 1, width)):
                    for c in range(3):
                        now[c] += image[v, u, c]
                        then[c] += background[v, u, c]
                    count += 1
            for c in range(3):
                ratio[c] = (now[c] + count) / (then[c] + count)
            mean = (ratio[0] + ratio[1] + ratio[2]) / 3.0
            tint = (ratio[2] - ratio[0]) / mean
            green = (ratio[1] - 0.5 * (ratio[0] + ratio[2])) / mean
            off = max(-tint, tint - BLUEST, 0.0)
            shadow = -0.5 * (
                (green / GREEN_NOISE) ** 2
                + (off / TINT_NOISE) ** 2
                + ((mean - DARKNESS) / DARKNESS_SPREAD) ** 2
            )
            rider = -0.5 * ((green / GREEN_SPREAD) ** 2 + (tint / TINT_SPREAD) ** 2)
            value = shadow - rider + narrower + COMMON
            found[y, x] = min(max(value, -MOST), MOST)
    return found


@njit(cache=True)
def _window(low, high, limit):  # type: ignore[no-untyped-def]
    return max(int(np.floor(low)), 0), max(min(int(np.ceil(high)), limit), 0)


@njit(cache=True)
def expectation(shape, boxes, height, width):  # type: ignore[no-untyped-def]
    """Return (height, width) float32 log odds of rider against shadow, from where riders are expected.

    Args:
        shape: (ROWS, COLUMNS) how likely a part of a rider's box is covered.
        boxes: (N, 4) of the riders, px.
        height: Of the picture, px.
        width: Of the picture, px.
    """
    found = np.full((height, width), np.float32(ELSEWHERE))
    for k in range(boxes.shape[0]):
        x0, y0, x1, y1 = boxes[k]
        left, right = _window(x0 - AROUND[0] * (x1 - x0), x1 + AROUND[0] * (x1 - x0), width)
        top, bottom = _window(y0 - AROUND[1] * (y1 - y0), y1 + AROUND[1] * (y1 - y0), height)
        found[top:bottom, left:right] = BESIDE
    for k in range(boxes.shape[0]):
        x0, y0, x1, y1 = boxes[k]
        left, right = _window(x0, x1, width)
        top, bottom = _window(y0, y1, height)
        for y in range(top, bottom):
            v = int(np.floor((y + 0.5 - y0) / (y1 - y0) * shape.shape[0]))
            for x in range(left, right):
                u = int(np.floor((x + 0.5 - x0) / (x1 - x0) * shape.shape[1]))
                if 0 <= v < shape.shape[0] and 0 <= u < shape.shape[1]:
                    value = BESIDE + (INSIDE - BESIDE) * max(2.0 * shape[v, u] - 1.0, 0.0)
                    found[y, x] = max(found[y, x], np.float32(value))
    return found


@njit(cache=True)
def raise_upright(odds, mask, offset, slope):  # type: ignore[no-untyped-def]
    """Raise log odds, in place, where a column of foreground is too high to lie on the road.

    Args:
        odds: (H, W) float32 as from `expectation`.
        mask: (H, W) bool, foreground, shadows with it.
        offset: Height of a rider whose centre is at row 0, px.
        slope: By how much it grows a row.
    """
    height, width = mask.shape
    for x in range(width):
        y = 0
        while y < height:
            if not mask[y, x]:
                y += 1
                continue
            top = y
            while y < height and mask[y, x]:
                y += 1
            usual = (offset + slope * top) / (1.0 - 0.5 * slope)
            if y - top >= TALL * usual:
                for v in range(top, min(int(top + UPPER * usual), y)):
                    odds[v, x] = max(odds[v, x], np.float32(UPRIGHT))


def shadow_of(
    image: NDArray[np.uint8],
    background: NDArray[np.uint8],
    mask: NDArray[np.bool_],
    odds: NDArray[np.float32],
) -> NDArray[np.bool_]:
    """Return (H, W) what of the foreground is shadow.

    Args:
        image: (H, W, 3) RGB.
        background: (H, W, 3) RGB, the background image.
        mask: (H, W) raw foreground.
        odds: (H, W) log odds of rider against shadow, before looking at colours.
    """
    found = cv2.GaussianBlur(evidence(image, background, mask), (0, 0), NEIGHBOURHOOD)
    return np.asarray(mask & (found > odds))
