"""The ground without its traffic: a background in the mosaic, and what differs from it.

A window of the mosaic goes along with the view. Each of its pixels keeps a mean colour with its usual
deviation and a rival colour. A colour between those of a pixel's neighbours is nothing new: edges never lie
quite still, and what stands above the ground shifts as the camera moves. The rival takes over once it has
been seen more often: soon where the first sight was of a vehicle, late elsewhere, and never below a track,
since vehicles queue. What changes is much more than vehicles, and is told from them elsewhere
(`tracker.aerial.foreground`).
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.aerial.stabilisation import Floats, transform

MARGIN = 192
"""Px of the mosaic around a view that are kept."""
LEAST_CHANGE = 8.0
"""Grey levels of a channel that are always noise."""
DEVIATIONS = 2.5
"""Usual deviations that are noise."""
FAINT = 0.6
"""Share of what is more than noise from which on a change may be a vehicle's: in the shade it is faint."""
NEIGHBOURS = np.ones((3, 3), np.uint8)
RATE = 1.0 / 50.0
OFTEN = 1.0 / 64.0
"""Rate at which it is learnt how often a pixel changes."""
NEW_SPREAD = 4.0
"""Usual deviation of a new pixel, grey levels."""
KNOWN = 6
"""Frames of a colour from which on it may be the ground's."""
SOON, LATE = 12, 200
"""Frames of a colour from which on it is not given up below a track; and most that count in its favour."""


class Background:
    """The mosaic's window, and the picture laid onto it.

    Attributes:
        origin: (2,) px of the mosaic of the window's upper left corner.
        view: (x0, y0, x1, y1) of the last picture in the window.
        laid: (h, w, 3) the last picture in the mosaic, cut to ``view``.
        valid: (h, w) where it has anything.
        ground: (h, w, 3) the background image of the view, as it was before that picture.
        spread: (h, w) float32, usual deviations there, grey levels.
        often: (h, w) float32, how often each of its pixels changes lately.
    """

    def __init__(self) -> None:
        self.origin = np.zeros(2)
        self._mean = np.zeros((0, 0, 3), np.float32)

    def apply(
        self, image: NDArray[np.uint8], to_mosaic: Floats, kept: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Lay a picture onto the mosaic, find what is new in it, and learn.

        Args:
            image: (H, W, 3).
            to_mosaic: (3, 3).
            kept: (N, 4) boxes of the mosaic x0, y0, x1, y1 in which nothing is background.

        Returns:
            (h, w) foreground, raw, of the view.
        """
        height, width = image.shape[:2]
        corners = transform(to_mosaic, np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]))
        self._go_along(corners)
        low = np.floor(corners.min(0) - self.origin).astype(int)
        high = np.ceil(corners.max(0) - self.origin).astype(int)
        size = np.array(self._support.shape[::-1])
        low, high = np.clip(low, 0, size), np.clip(high, 0, size)
        self.view = x0, y0, x1, y1 = int(low[0]), int(low[1]), int(high[0]), int(high[1])
        here = self.origin + low
        self.laid = self.lay(image, to_mosaic)
        inner = corners + 2.0 * np.sign(corners.mean(0) - corners) - here
        valid = np.zeros(self.laid.shape[:2], np.uint8)
        cv2.fillConvexPoly(valid, np.round(inner).astype(np.int32), 1)
        self.valid = valid.view(np.bool_)
        protected = np.zeros(self.laid.shape[:2], np.bool_)
        for box in np.round(kept - np.tile(here, 2)).astype(int).tolist():
            protected[max(box[1], 0) : max(box[3], 0), max(box[0], 0) : max(box[2], 0)] = True
        part = np.s_[y0:y1, x0:x1]
        # Rounded to the nearest.
        self.ground = (self._mean[part] + np.float32(0.5)).astype(np.uint8)
        self.spread, self.often = self._spread[part], self._often[part]
        return np.asarray(
            _compare(
                self.laid,
                self.valid,
                protected,
                cv2.erode(self.ground, NEIGHBOURS),
                cv2.dilate(self.ground, NEIGHBOURS),
                self._mean[part],
                self._spread[part],
                self._support[part],
                self._rival[part],
                self._rivals[part],
                self.often,
            )
        )

    def lay(self, image: NDArray[np.uint8], to_mosaic: Floats) -> NDArray[np.uint8]:
        """Return (h, w) or (h, w, 3), a picture (H, W) or (H, W, 3) laid onto the mosaic, cut to the view."""
        x0, y0, x1, y1 = self.view
        here = self.origin + np.array([x0, y0])
        # OpenCV's pixel centres lie at whole numbers.
        move = np.array([[1.0, 0.0, -here[0] - 0.5], [0.0, 1.0, -here[1] - 0.5], [0.0, 0.0, 1.0]])
        place = move @ to_mosaic @ np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
        laid = cv2.warpPerspective(image, place, (x1 - x0, y1 - y0), flags=cv2.INTER_LINEAR)
        return np.asarray(laid, np.uint8)

    def mean(self, part: tuple[slice, slice]) -> NDArray[np.float32]:
        """Return (h, w, 3) the background of a part of the view."""
        x0, y0, x1, y1 = self.view
        return self._mean[y0:y1, x0:x1][part]

    def adopt(self, mask: NDArray[np.bool_]) -> None:
        """Take the last picture for the ground where a mask (h, w) of the view says so."""
        x0, y0, x1, y1 = self.view
        part = np.s_[y0:y1, x0:x1]
        mask = mask & self.valid
        self._mean[part][mask] = self.laid[mask]
        self._spread[part][mask] = NEW_SPREAD
        self._support[part][mask], self._rivals[part][mask] = KNOWN, 0

    def _go_along(self, corners: Floats) -> None:
        """Move the window if the view leaves it."""
        low, high = np.floor(corners.min(0)), np.ceil(corners.max(0))
        size = np.array(self._mean.shape[1::-1], float)
        if (low >= self.origin).all() and (high <= self.origin + size).all():
            return
        origin = low - MARGIN
        shape = (high + MARGIN - origin).astype(int)[::-1]
        fresh: list[NDArray[np.generic]] = [
            np.zeros((*shape, 3), np.float32),
            np.full(shape, NEW_SPREAD, np.float32),
            np.zeros(shape, np.uint8),
            np.zeros((*shape, 3), np.uint8),
            np.zeros(shape, np.uint8),
            np.zeros(shape, np.float32),
        ]
        if self._mean.size:
            shift = (self.origin - origin).astype(int)
            start, stop = np.maximum(shift, 0), np.minimum(shift + size.astype(int), shape[::-1])
            if (stop > start).all():
                (left, top), (right, bottom) = start, stop
                for new, old in zip(fresh, self._arrays(), strict=True):
                    new[top:bottom, left:right] = old[
                        top - shift[1] : bottom - shift[1], left - shift[0] : right - shift[0]
                    ]
        self.origin = origin
        self._mean, self._spread = fresh[0].astype(np.float32, copy=False), fresh[1].astype(np.float32)
        self._support, self._rival, self._rivals = (a.astype(np.uint8, copy=False) for a in fresh[2:5])
        self._often = fresh[5].astype(np.float32, copy=False)

    def _arrays(self) -> tuple[NDArray[np.generic], ...]:
        return self._mean, self._spread, self._support, self._rival, self._rivals, self._often


@njit(cache=True)
def _compare(laid, valid, protected, low, high, mean, spread, support, rival, rivals, often):  # type: ignore[no-untyped-def]
    """Return the foreground (h, w) and learn in place; see `Background`."""
    height, width = valid.shape
    found = np.zeros((height, width), np.bool_)
    for i in range(height):
        for j in range(width):
            if not valid[i, j]:
                continue
            if support[i, j] == 0:
                for c in range(3):
                    mean[i, j, c] = laid[i, j, c]
                support[i, j] = 1
                continue
            most, other = np.int32(0), np.int32(0)
            for c in range(3):
                now = np.int32(laid[i, j, c])
                most = max(most, now - np.int32(high[i, j, c]), np.int32(low[i, j, c]) - now)
                other = max(other, abs(now - np.int32(rival[i, j, c])))
            change = LEAST_CHANGE + DEVIATIONS * spread[i, j]
            # What has been seen for a moment only may have been a vehicle.
            found[i, j] = most > FAINT * change and support[i, j] >= KNOWN
            often[i, j] += np.float32(OFTEN) * (np.float32(found[i, j]) - often[i, j])
            if most <= change:
                if support[i, j] < LATE:
                    support[i, j] += 1
                if rivals[i, j] > 0:
                    rivals[i, j] -= 1
                rate = np.float32(max(1.0 / support[i, j], RATE))
                for c in range(3):
                    mean[i, j, c] += rate * (laid[i, j, c] - mean[i, j, c])
                spread[i, j] += np.float32(0.05) * (most - spread[i, j])
                continue
            if protected[i, j] and support[i, j] >= SOON:
                continue
            if rivals[i, j] == 0 or other > change:
                if rivals[i, j] > 0:
                    rivals[i, j] -= 1
                if rivals[i, j] == 0:
                    for c in range(3):
                        rival[i, j, c] = laid[i, j, c]
                    rivals[i, j] = 1
                continue
            rivals[i, j] += 1
            if rivals[i, j] > support[i, j]:
                for c in range(3):
                    mean[i, j, c] = rival[i, j, c]
                support[i, j], rivals[i, j] = rivals[i, j], 0
                spread[i, j] = NEW_SPREAD
    return found
