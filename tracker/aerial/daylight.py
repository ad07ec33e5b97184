"""Pictures of vehicles in one light: what stands in the shade of a bridge or a tree is known by its ground.

A shade darkens a vehicle by about as much as the ground below it. How light the ground of roads usually is
shows below all the vehicles; where it is much darker, cell by cell, the picture is made as much lighter. Pale
ground is left alone: lines and decks are pale by themselves.
"""

from __future__ import annotations

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.aerial.appearance import PATCH

Floats = NDArray[np.float64]

MEMORY = 200
"""Grounds whose median is the usual one."""
SHADE = 0.8
"""Share of the usual light below which ground is in the shade."""
DARKEST = 0.3
"""Least share of a channel's usual light that is made up for."""


class Daylight:
    """The usual light on the roads of one scene."""

    def __init__(self) -> None:
        self._grounds: deque[Floats] = deque(maxlen=MEMORY)

    def restore(self, picture: Floats, ground: Floats) -> Floats:
        """Return a picture as it would be in the usual light, which is learnt.

        Args:
            picture: (D,) as from `tracker.aerial.appearance.cut`.
            ground: (D,) the same of the background image.

        Returns:
            (D,), grey levels.
        """
        cells = ground.reshape(*PATCH, 3)
        self._grounds.append(_median(cells.reshape(-1, 3)))
        usual = np.maximum(self._usual(), 1.0)
        share = cv2.blur(cells, (3, 3), borderType=cv2.BORDER_REPLICATE) / usual
        dark = share.mean(2, keepdims=True) < SHADE
        gain = np.where(dark, 1.0 / np.maximum(share, DARKEST), 1.0)
        return np.minimum(picture * gain.reshape(-1), 255.0)

    def _usual(self) -> Floats:
        """Return (3,) the usual colour of the ground below vehicles."""
        return _median(np.array(self._grounds))


def _median(colours: Floats) -> Floats:
    """Return the median (3,) of colours (N, 3), by channel: NumPy's own takes several times as long."""
    ordered = np.sort(colours, axis=0)
    return np.asarray(0.5 * (ordered[(len(colours) - 1) // 2] + ordered[len(colours) // 2]))
