"""How actions move the platform: where it aims, how it is turned, how far its camera is zoomed in."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SPEED = 20.0
"""Metres a second over the ground at a full action, in each of the two directions."""
YAW_RATE = 0.5
"""Radians a second likewise."""
ZOOM_RATE = 0.7
"""Growth of the focal length, natural logarithm a second, likewise."""
ZOOM_MOST = 4.0
"""Longest focal length, in those of the scene; the shortest is the scene's own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Steering:
    """What actions have made of a platform so far.

    Attributes:
        place: (2,) world metres, the place on the ground that it aims at.
        velocity: (2,) m/s of that place, in the last tick.
        turn: Radians by which it has turned to the left.
        zoom: Focal length, in those of the scene.
    """

    place: Floats
    velocity: Floats = field(default_factory=lambda: np.zeros(2))
    turn: float = 0.0
    zoom: float = 1.0

    def after(
        self, action: NDArray[np.float32], heading: float, dt: float, bounds: tuple[Floats, Floats]
    ) -> Self:
        """Return what a tick makes of it.

        Args:
            action: (4,) in [-1, 1]: velocity to the right and ahead, toward the picture's upper edge;
                yaw rate, positive to the right; growth of the focal length. What lies outside is cut off.
            heading: Of the platform, radians counter-clockwise from east.
            dt: Seconds that a tick lasts.
            bounds: The lowest and the highest place, (2,) each, that can be aimed at; it stops there.
        """
        right, ahead, yaw_rate, zoom = (float(a) for a in np.clip(action, -1, 1))
        cos, sin = np.cos(heading), np.sin(heading)
        velocity = SPEED * np.array([right * sin + ahead * cos, ahead * sin - right * cos])
        place = np.clip(self.place + velocity * dt, *bounds)
        return type(self)(
            place=place,
            velocity=(place - self.place) / dt,
            turn=self.turn - YAW_RATE * yaw_rate * dt,
            zoom=float(np.clip(self.zoom * np.exp(ZOOM_RATE * zoom * dt), 1.0, ZOOM_MOST)),
        )
