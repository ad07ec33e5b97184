"""Where the camera looks: homographies from its pictures to the mosaic, the plane of the ground.

Corners of a key frame are found again in each picture by optical flow that begins where the last picture had
them, and a homography is fitted to the most of them, which lie on the ground. Errors do not add up while a
key frame lasts; where the camera comes back, the key frame of then serves again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8]

CORNERS, SPACING = 400, 12
"""Corners of a key frame, and px between them."""
WINDOW, LEVELS = (17, 17), 2
"""Of the optical flow."""
ON_PLANE = 0.6
"""Px within which a corner must lie of where the homography has it."""
LEAST_VIEW, BETTER_VIEW = 0.6, 0.8
"""Share of a key frame's corners in view below which another one is wanted, and that it must have."""
LEAST_ON_PLANE = 25
MOST_KEYS = 40


@dataclass(slots=True)
class KeyFrame:
    """A picture with its corners, and its homography to the mosaic.

    Attributes:
        grey: (H, W).
        corners: (K, 2) px, pixel centres at +0.5.
        to_mosaic: (3, 3).
        trust: (K,) how often a corner has been on the plane lately.
    """

    grey: Grey
    corners: Floats
    to_mosaic: Floats
    trust: Floats = field(init=False)

    def __post_init__(self) -> None:
        self.trust = np.ones(len(self.corners))


def transform(homography: Floats, points: Floats) -> Floats:
    """Map points (..., 2) by a homography (3, 3)."""
    homogeneous = points @ homography[:, :2].T + homography[:, 2]
    return np.asarray(homogeneous[..., :2] / homogeneous[..., 2:])


def inverse(homography: Floats) -> Floats:
    """Return the homography (3, 3) back."""
    return np.asarray(np.linalg.inv(homography), np.float64)


def jacobian(homography: Floats, point: Floats) -> Floats:
    """Return (2, 2), the derivative of `transform` at a point (2,)."""
    x, y, w = homography @ np.append(point, 1.0)
    numerator = homography[:2, :2] * w - np.outer([x, y], homography[2, :2])
    return np.asarray(numerator / w**2)


class Stabiliser:
    """Follows the camera of one episode; the first picture is the mosaic's."""

    def __init__(self) -> None:
        self._keys: list[KeyFrame] = []
        self._key = 0
        self._to_mosaic: Floats = np.eye(3)

    def step(self, grey: Grey) -> Floats:
        """Take the next picture (H, W); return its homography (3, 3) to the mosaic, px at centres +0.5."""
        if not self._keys:
            self._add(grey)
            return self._to_mosaic
        key = self._keys[self._key]
        found = self._register(grey, key)
        if found is None:
            # Nothing is found again: the camera is taken to stand still, and all begins anew from there.
            self._add(grey)
            return self._to_mosaic
        self._to_mosaic = found
        if self._in_view(key, grey) < LEAST_VIEW:
            views = [self._in_view(other, grey) for other in self._keys]
            best = int(np.argmax(views))
            if views[best] >= BETTER_VIEW:
                self._key = best
            else:
                self._add(grey)
        return self._to_mosaic

    def _register(self, grey: Grey, key: KeyFrame) -> Floats | None:
        chosen = np.flatnonzero(key.trust > 0.2)
        corners = key.corners[chosen]
        guess = transform(inverse(self._to_mosaic) @ key.to_mosaic, corners)
        now, status, _ = cv2.calcOpticalFlowPyrLK(
            key.grey,
            grey,
            (corners - 0.5).astype(np.float32),
            (guess - 0.5).astype(np.float32),
            winSize=WINDOW,
            maxLevel=LEVELS,
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
            criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 15, 0.02),
        )
        now = now.astype(np.float64) + 0.5
        inside = ((now > 2.0) & (now < np.array(grey.shape[::-1]) - 2.0)).all(1)
        good = np.flatnonzero((status[:, 0] > 0) & inside)
        if len(good) < LEAST_ON_PLANE:
            return None
        fit, on_plane = cv2.findHomography(now[good], corners[good], cv2.RANSAC, ON_PLANE, maxIters=500)
        if fit is None or on_plane.sum() < LEAST_ON_PLANE:
            return None
        at = chosen[good]
        key.trust[at] += 0.1 * (on_plane[:, 0] - key.trust[at])
        found = key.to_mosaic @ fit
        return np.asarray(found / found[2, 2], np.float64)

    def _in_view(self, key: KeyFrame, grey: Grey) -> float:
        """Return the share of a key frame's corners in the picture; 0 where it is much turned."""
        to_picture = inverse(self._to_mosaic) @ key.to_mosaic
        middle = 0.5 * np.array(grey.shape[::-1], float)
        change = jacobian(to_picture, transform(inverse(to_picture), middle)) - np.eye(2)
        if np.abs(change).max() > 0.25:
            return 0.0
        places = transform(to_picture, key.corners)
        return float(((places > 0) & (places < 2.0 * middle)).all(1).mean())

    def _add(self, grey: Grey) -> None:
        """Make the picture a key frame."""
        corners = cv2.goodFeaturesToTrack(grey, CORNERS, 0.005, SPACING, blockSize=5)
        places = np.zeros((0, 2)) if corners is None else corners.reshape(-1, 2).astype(np.float64) + 0.5
        self._keys = [*self._keys[-MOST_KEYS + 1 :], KeyFrame(grey.copy(), places, self._to_mosaic)]
        self._key = len(self._keys) - 1
