"""Where the camera looks: homographies from its pictures to the mosaic, the plane of the ground.

Corners of key frames are found again in each picture by optical flow that begins where the last picture had
them, and a homography is fitted to the most of them, which lie on the ground. Errors do not add up while a
key frame lasts. Two key frames serve at a time, those of which most is in view: what one has seen at its
border the other has seen in its middle, and where the camera comes back, those of then serve again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8]

CELLS = (8, 6)
"""Columns and rows of a picture, which all have their share of its corners: trees have the sharpest ones, and
do not lie on the ground."""
CORNERS, SPACING = 8, 9
"""Corners of a cell, and px between them."""
LEAST_SHARPNESS = 0.002
"""Of a corner, as a share of the sharpest of the picture."""
WINDOW, LEVELS = (15, 15), 2
"""Of the optical flow."""
ON_PLANE = 0.6
"""Px within which a corner must lie of where the homography has it."""
LEAST_VIEW = 0.75
"""Share of the corners of a key frame in view; where none has as many a new one is made."""
AT_ONCE = 2
"""Key frames that serve at a time."""
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

    @property
    def places(self) -> Floats:
        """(K, 2) of the corners in the mosaic."""
        return transform(self.to_mosaic, self.corners)


def transform(homography: Floats, points: Floats) -> Floats:
    """Map points (..., 2) by a homography (3, 3)."""
    homogeneous = points @ homography[:, :2].T + homography[:, 2]
    return np.asarray(homogeneous[..., :2] / homogeneous[..., 2:])


def inverse(homography: Floats) -> Floats:
    """Return the homography (3, 3) back."""
    return np.asarray(np.linalg.inv(homography), np.float64)


def jacobian(homography: Floats, points: Floats) -> Floats:
    """Return (..., 2, 2), the derivative of `transform` at points (..., 2)."""
    homogeneous = points @ homography[:, :2].T + homography[:, 2]
    shown, w = homogeneous[..., :2, None], homogeneous[..., 2:, None]
    return np.asarray((homography[:2, :2] * w - shown * homography[2, :2]) / w**2)


class Stabiliser:
    """Follows the camera of one episode; the first picture is the mosaic's."""

    def __init__(self) -> None:
        self._keys: list[KeyFrame] = []
        self._to_mosaic: Floats = np.eye(3)

    def step(self, grey: Grey) -> Floats:
        """Take the next picture (H, W); return its homography (3, 3) to the mosaic, px at centres +0.5."""
        if not self._keys:
            self._add(grey)
            return self._to_mosaic
        views = np.array([self._in_view(key, grey) for key in self._keys])
        serving = [self._keys[k] for k in np.argsort(-views, kind="stable")[:AT_ONCE] if views[k] > 0]
        found = self._register(grey, serving)
        if found is None:
            # Nothing is found again: the camera is taken to stand still, and all begins anew from there.
            self._add(grey)
            return self._to_mosaic
        self._to_mosaic = found
        if views.max() < LEAST_VIEW:
            self._add(grey)
        return self._to_mosaic

    def _register(self, grey: Grey, keys: list[KeyFrame]) -> Floats | None:
        """Fit a homography to the corners of key frames; None where too few are found again."""
        pairs = [_flow(key, grey, self._to_mosaic) for key in keys]
        now = np.concatenate([np.zeros((0, 2)), *(there for _, there in pairs)])
        then = np.concatenate(
            [np.zeros((0, 2)), *(k.places[at] for k, (at, _) in zip(keys, pairs, strict=True))]
        )
        if len(now) < LEAST_ON_PLANE:
            return None
        fit, on_plane = cv2.findHomography(now, then, cv2.RANSAC, ON_PLANE, maxIters=500)
        if fit is None or on_plane.sum() < LEAST_ON_PLANE:
            return None
        begin = 0
        for key, (at, _) in zip(keys, pairs, strict=True):
            key.trust[at] += 0.1 * (on_plane[begin : begin + len(at), 0] - key.trust[at])
            begin += len(at)
        return np.asarray(fit / fit[2, 2], np.float64)

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
        self._keys = [*self._keys[-MOST_KEYS + 1 :], KeyFrame(grey.copy(), _corners(grey), self._to_mosaic)]


def _flow(key: KeyFrame, grey: Grey, to_mosaic: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Find corners of a key frame in a picture: which (M,), and where (M, 2), given about where it looks."""
    chosen = np.flatnonzero(key.trust > 0.2)
    guess = transform(inverse(to_mosaic) @ key.to_mosaic, key.corners[chosen])
    size = np.array(grey.shape[::-1])
    near = ((guess > -20.0) & (guess < size + 20.0)).all(1)
    chosen, guess = chosen[near], guess[near]
    if not len(chosen):
        return chosen, guess
    now, status, _ = cv2.calcOpticalFlowPyrLK(
        key.grey,
        grey,
        (key.corners[chosen] - 0.5).astype(np.float32),
        (guess - 0.5).astype(np.float32),
        winSize=WINDOW,
        maxLevel=LEVELS,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 15, 0.02),
    )
    now = now.astype(np.float64) + 0.5
    good = (status[:, 0] > 0) & ((now > 2.0) & (now < size - 2.0)).all(1)
    return chosen[good], now[good]


def _corners(grey: Grey) -> Floats:
    """Return (K, 2) the sharpest corners of each cell of a picture, px at centres +0.5."""
    sharpness = cv2.cornerMinEigenVal(grey, 5)
    peaks = (sharpness >= cv2.dilate(sharpness, np.ones((SPACING, SPACING), np.uint8))) & (
        sharpness > LEAST_SHARPNESS * sharpness.max()
    )
    y, x = np.nonzero(peaks)
    order = np.argsort(-sharpness[y, x], kind="stable")
    x, y = x[order], y[order]
    cells = x * CELLS[0] // grey.shape[1] + CELLS[0] * (y * CELLS[1] // grey.shape[0])
    kept = [np.flatnonzero(cells == cell)[:CORNERS] for cell in range(CELLS[0] * CELLS[1])]
    chosen = np.concatenate(kept)
    return np.column_stack([x[chosen], y[chosen]]).astype(np.float64) + 0.5
