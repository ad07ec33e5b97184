"""Where a frame differs from the background image and from the frame before, and the upkeep of that image.

Paper 3, sections II.D.1 and II.E. The threshold is the corner of the histogram of differences (Rosin,
Unimodal thresholding, Pattern Recognition 34, 2001): nearly all pixels only carry noise, and the corner is
where their peak ends and the tail of changed ones begins.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

ROUND = 4
"""What hides the background has gone no farther than so many pixels since it was last told."""
NEARBY = 30
"""Half side of the window that tells how the light has changed at a pixel, px."""


@njit(cache=True)
def differences(image, background, previous):  # type: ignore[no-untyped-def]
    """Return the largest difference of a channel to two images, and its histograms.

    Args:
        image: (P, 3) uint8.
        background: (P, 3) float32.
        previous: (P, 3) uint8.

    Returns:
        (P,) uint8 to the background and to the previous frame, and (256,) int64 of each.
    """
    count = image.shape[0]
    far, moved = np.empty(count, np.uint8), np.empty(count, np.uint8)
    for i in range(count):
        most_far, most_moved = np.float32(0.0), np.int32(0)
        for c in range(3):
            value = np.int32(image[i, c])
            most_far = max(most_far, abs(np.float32(value) - background[i, c]))
            most_moved = max(most_moved, np.int32(abs(value - np.int32(previous[i, c]))))
        far[i], moved[i] = np.uint8(most_far + np.float32(0.5)), np.uint8(most_moved)
    far_counts, moved_counts = np.zeros(256, np.int64), np.zeros(256, np.int64)
    for i in range(count):
        far_counts[far[i]] += 1
        moved_counts[moved[i]] += 1
    return far, moved, far_counts, moved_counts


def corner(counts: NDArray[np.int64], least: int, most: int) -> int:
    """Return the largest difference that still is noise: Rosin's corner of a histogram.

    The corner is the bin that lies furthest below the straight line from the peak to the last bin in use.

    Args:
        counts: (256,) histogram of differences.
        least: Never below: compression adds errors that come and go in blocks. Raising it loses pale objects.
        most: Never above, and no peak is looked for above: after a change of the whole light the peak itself
            has moved. Raising it lets such a change pass as noise.
    """
    peak = int(np.argmax(counts[: most + 1]))
    last = int(np.flatnonzero(counts)[-1])
    if last <= peak:
        return least
    bins = np.arange(peak, last + 1)
    below = (counts[peak] - counts[bins]) * (last - peak) - (counts[peak] - counts[last]) * (bins - peak)
    return int(np.clip(peak + np.argmax(below), least, most))


@njit(cache=True)
def keep(background, image, is_background, changed, rate):  # type: ignore[no-untyped-def]
    """Keep the background image up to date, in place: eqs. (17), (18).

    Args:
        background: (P, 3) float32.
        image: (P, 3) uint8.
        is_background: (P,) bool.
        changed: (P,) bool; where it has, the background becomes the image at once.
        rate: beta.

    Returns:
        (3,) factor by which each channel of the background that is seen grew.
    """
    red, green, blue, red_after, green_after, blue_after = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(is_background.size):
        if is_background[i]:
            red += background[i, 0]
            green += background[i, 1]
            blue += background[i, 2]
            weight = np.float32(1.0 if changed[i] else rate)
            for c in range(3):
                background[i, c] += weight * (np.float32(image[i, c]) - background[i, c])
            red_after += background[i, 0]
            green_after += background[i, 1]
            blue_after += background[i, 2]
    light = np.ones(3, np.float32)
    for c, before, after in ((0, red, red_after), (1, green, green_after), (2, blue, blue_after)):
        if before > 0.0:
            light[c] = after / before
    return light


@njit(cache=True)
def carry(background, foreground, light):  # type: ignore[no-untyped-def]
    """Let the background behind the foreground follow the light of what is seen, in place.

    Args:
        background: (P, 3) float32.
        foreground: (P,) bool.
        light: (3,) as from `keep`.
    """
    for i in range(foreground.size):
        if foreground[i]:
            for c in range(3):
                background[i, c] = min(background[i, c] * light[c], np.float32(255.0))


def unhide(image: Bytes, background: Bytes, hidden: NDArray[np.bool_]) -> Bytes:
    """Return a picture without what hides its background, after the light has changed at once.

    What was known of the background stands there, in the light that has come to what is seen nearby: the
    mean of the picture over that of the known background.

    Args:
        image: (H, W, 3) RGB, in the new light.
        background: (H, W, 3) RGB, in the old light.
        hidden: (H, W) where the background was hidden.
    """
    if not hidden.any():
        return image
    wide = cv2.dilate(hidden.astype(np.uint8), np.ones((2 * ROUND + 1, 2 * ROUND + 1), np.uint8))
    seen = (wide == 0)[..., None]
    window = (2 * NEARBY + 1, 2 * NEARBY + 1)
    now, then = (
        cv2.boxFilter(picture * seen, cv2.CV_64F, window, normalize=False, borderType=cv2.BORDER_CONSTANT)
        for picture in (image, background)
    )
    expected = np.round(background * ((now + 1.0) / (then + 1.0)))
    return np.where(seen, image, np.minimum(expected, 255.0).astype(np.uint8))
