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
def differences(colours, background, previous):  # type: ignore[no-untyped-def]
    """Return the largest difference of a channel to two images.

    Args:
        colours: (P,) uint32, as from `tracker.motorcycle_lane.features.extract`.
        background: (3, P) float32.
        previous: (P,) uint32, colours.

    Returns:
        (P,) uint8 to the background and to the previous frame.
    """
    count = colours.size
    reds, greens, blues = background[0], background[1], background[2]
    far, moved = np.empty(count, np.uint8), np.empty(count, np.uint8)
    for i in range(count):
        now, then = np.int32(colours[i]), np.int32(previous[i])
        red, green, blue = now >> 16, (now >> 8) & 255, now & 255
        # Chosen, not by max(), which heeds what is no number, and then does one pixel at a time.
        a, b = abs(np.float32(red) - reds[i]), abs(np.float32(green) - greens[i])
        c = abs(np.float32(blue) - blues[i])
        most = a if a > b else b
        far[i] = np.uint8(np.int32((most if most > c else c) + np.float32(0.5)))
        moved[i] = max(abs(red - (then >> 16)), abs(green - ((then >> 8) & 255)), abs(blue - (then & 255)))
    return far, moved


@njit(cache=True)
def histogram(values):  # type: ignore[no-untyped-def]
    """Return (256,) int64 how often each of (P,) uint8 values occurs."""
    # Neighbours are alike; counted apart, none waits for the other's count.
    counts = np.zeros((4, 256), np.int64)
    for i in range(values.size):
        counts[i & 3, values[i]] += 1
    return counts.sum(0)


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


@njit(cache=True, fastmath={"reassoc"})
def keep(background, colours, is_background, changed, rate):  # type: ignore[no-untyped-def]
    """Keep the background image up to date, in place: eqs. (17), (18).

    Args:
        background: (3, P) float32.
        colours: (P,) uint32, of the frame.
        is_background: (P,) bool.
        changed: (P,) bool; where it has, the background becomes the image at once.
        rate: beta.

    Returns:
        (3,) factor by which each channel of the background that is seen grew.
    """
    nothing, whole, part = np.float32(0.0), np.float32(1.0), np.float32(rate)
    light = np.ones(3, np.float32)
    for c in range(3):
        channel, shift = background[c], 16 - 8 * c
        before = after = np.float64(0.0)
        for i in range(colours.size):
            old = channel[i]
            weight = whole if changed[i] else part
            new = old + weight * (np.float32((np.int32(colours[i]) >> shift) & 255) - old)
            seen = is_background[i]
            channel[i] = new if seen else old
            before += old if seen else nothing
            after += new if seen else nothing
        if before > 0.0:
            light[c] = after / before
    return light


@njit(cache=True)
def carry(background, foreground, light):  # type: ignore[no-untyped-def]
    """Let the background behind the foreground follow the light of what is seen, in place.

    Args:
        background: (3, P) float32.
        foreground: (P,) bool.
        light: (3,) as from `keep`.
    """
    for c in range(3):
        channel = background[c]
        for i in range(foreground.size):
            grown = channel[i] * light[c]
            grown = grown if grown < np.float32(255.0) else np.float32(255.0)
            channel[i] = grown if foreground[i] else channel[i]


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
