"""The road without its traffic: a background image that vehicles leave no traces in.

The background model shows what each pixel has shown most often; where riders are many or slow, that is the
riders, or their shadows, and who passes over such traces is seen badly. So here whatever is told to be a
vehicle is left out, and what else is changed leads the image on: upwards at once, as traffic hides a road
or darkens it, and hardly downwards.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

RISE, FALL = 8.0, 0.5
"""Grey levels a frame by which the image follows a changed pixel that is lighter, and one that is darker."""
RATE = 0.1
"""How far it follows a pixel that is not changed, as a share of the difference."""
START = 16
"""Frames over which it follows faster at first: in frame n so many n-ths as fast, but no more than..."""
FASTEST = 0.5
"""... this share of the difference, where the pixel is not changed."""
MARGIN = 5
"""Width of the square around each pixel in which no vehicle may be, px."""
RELIT = 4
"""Grey levels by more than which most of the background model's image changes at once if the light does."""
UNSURE = 60
"""Frames after that in which vehicles hold the ground only where they move: shadows lie elsewhere now, and
where they did or do is taken for vehicles."""
MOVED, CALM = 10, 8
"""Grey levels by which a pixel moves from frame to frame; frames without from which on it stands still."""


def lead(
    ground: Floats,
    image: Image,
    held: NDArray[np.uint8],
    changed: Mask,
    rise: np.float32,
    fall: np.float32,
    rate: np.float32,
) -> Image:
    """Let the ground, in place, follow a picture.

    Args:
        ground: (H, W, 3).
        image: (H, W, 3).
        held: (H, W), not 0 where it stays as it is.
        changed: (H, W), where it goes up by ``rise`` and down by ``fall`` at most; elsewhere by a share
            ``rate`` of the difference.
        rise: See above.
        fall: See above.
        rate: See above.

    Returns:
        (H, W, 3), the ground in bytes.
    """
    # A value for each channel: all are alike then, and many are done at a time.
    each = (cv2.merge((mask, mask, mask)).ravel() for mask in (held, changed.view(np.uint8)))
    found: Image = _lead(ground.reshape(-1), image.reshape(-1), *each, rise, fall, rate)
    return found.reshape(ground.shape)


@njit(cache=True)
def _lead(ground, image, held, changed, rise, fall, rate):  # type: ignore[no-untyped-def]
    """Do the same for each of (N,) values."""
    found = np.empty(ground.size, np.uint8)
    for i in range(ground.size):
        off = np.float32(image[i]) - ground[i]
        step = off if off < rise else rise
        step = step if step > -fall else -fall
        step = step if changed[i] else rate * off
        ground[i] += step if held[i] == 0 else np.float32(0.0)
        found[i] = np.uint8(np.int32(ground[i] + np.float32(0.5)))
    return found


class Ground:
    """The ground of an episode."""

    def __init__(self) -> None:
        self._exact: Floats = np.zeros((0, 0, 3), np.float32)
        self._image: Image = np.zeros((0, 0, 3), np.uint8)
        self._background: Image = self._image
        self._frames = self._unsure = 0
        self._previous: Image = self._image
        self._still: Image = np.zeros((0, 0), np.uint8)

    def image(self, background: Image) -> Image:
        """Return (H, W, 3) the ground; the background model's image (H, W, 3) tells of sudden light."""
        again = self._frames > 0 and relit(self._background, background)
        if self._frames == 0 or again:
            self._exact, self._image = background.astype(np.float32), background
        if again:
            self._unsure, self._still = UNSURE, np.zeros(background.shape[:2], np.uint8)
        self._background = background
        return self._image

    def learn(self, image: Image, raw: Mask, vehicles: Mask) -> None:
        """Take in a picture (H, W, 3), but where there are vehicles (H, W).

        Args:
            image: RGB.
            raw: (H, W) raw foreground.
            vehicles: What of it is a vehicle.
        """
        haste = max(1.0, START / (self._frames + 1))
        held = cv2.dilate(vehicles.view(np.uint8), np.ones((MARGIN, MARGIN), np.uint8))
        if self._unsure:
            self._unsure -= 1
            moved = cv2.absdiff(image, self._previous).max(2) > MOVED
            self._still = np.where(moved, 0, np.minimum(self._still + 1, CALM)).astype(np.uint8)
            held *= self._still < CALM
        self._previous = image.copy()
        steps = (RISE * haste, FALL * haste, min(RATE * haste, FASTEST))
        self._image = lead(self._exact, image, held, raw, *map(np.float32, steps))
        self._frames += 1


def relit(before: Image, now: Image) -> bool:
    """Tell whether most of a background image (H, W, 3) has changed at once."""
    coarse = np.abs(now[::4, ::4].astype(np.int16) - before[::4, ::4])
    return bool(np.count_nonzero(coarse > RELIT) > coarse.size // 2)
