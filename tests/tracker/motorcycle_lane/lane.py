"""A drawn lane with known boxes: riders on a textured road that shrink toward the far end, with shadows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

WIDTH, HEIGHT, RATE = 360, 240, 30.0
VANISHING = (180.0, -120.0)
RIDER = (24.0, 54.0)
"""Width and height at the picture's lower border."""


@dataclass(frozen=True, kw_only=True)
class Rider:
    """A rider on a straight path.

    Attributes:
        across: Place across the lane, px at the lower border from the middle; a pair is linear in time,
            first and last.
        start: Seconds at which it passes the lower border, or the far end if it comes the wrong way.
        speed: Distances of the lower border to the camera in a second; negative for the wrong way.
        colours: Of clothes and machine, RGB.
        stop: Seconds from and until which it stands, or None.
    """

    across: float | tuple[float, ...]
    start: float
    speed: float
    colours: tuple[tuple[int, int, int], tuple[int, int, int]]
    stop: tuple[float, float] | None = None

    def box(self, time: float) -> np.ndarray | None:
        """Return the whole box at a time, None where it is not on the drawn road."""
        driven = time - self.start
        if self.stop is not None and time > self.stop[0]:
            driven -= min(time, self.stop[1]) - self.stop[0]
        far = self.speed * driven if self.speed > 0 else 1.9 + self.speed * driven
        if not -0.15 < far < 1.95:
            return None
        scale = 1.0 / (1.0 + far)
        knots = np.atleast_1d(self.across)
        across = float(np.interp(far / 1.8, np.linspace(0, 1, len(knots)), knots))
        x, foot = VANISHING[0] + scale * across, VANISHING[1] + scale * (HEIGHT - VANISHING[1])
        w, h = scale * RIDER[0], scale * RIDER[1]
        return np.array([x - 0.5 * w, foot - h, x + 0.5 * w, foot])


def draw(riders: Sequence[Rider], seconds: float, *, seed: int = 0, shadows: bool = True, noise: float = 3.0):
    """Yield pictures (H, W, 3) and {number of the rider: its box} of those at least half in the picture."""
    rng = np.random.default_rng(seed)
    coarse = cv2.GaussianBlur(rng.normal(0, 1, (HEIGHT, WIDTH)).astype(np.float32), (0, 0), 4.0)
    fine = cv2.GaussianBlur(rng.normal(0, 1, (HEIGHT, WIDTH)).astype(np.float32), (0, 0), 1.2)
    road = 118 + 90 * coarse[..., None] + 20 * fine[..., None] + np.array([4.0, 0.0, -5.0])
    for tick in range(round(seconds * RATE)):
        picture = road.astype(np.float32)
        boxes = {n: box for n, rider in enumerate(riders) if (box := rider.box(tick / RATE)) is not None}
        if shadows:
            shade = np.ones((HEIGHT, WIDTH), np.float32)
            for x0, y0, x1, y1 in boxes.values():
                w, h = x1 - x0, y1 - y0
                corners = np.array(
                    [
                        [x0, y1],
                        [x1, y1 - 0.1 * h],
                        [x1 + 0.45 * w, y1 - 0.3 * h],
                        [x0 + 0.6 * w, y1 - 0.3 * h],
                    ]
                )
                cv2.fillConvexPoly(shade, np.round(8 * corners).astype(np.int32), 0.62, cv2.LINE_AA, 3)
            picture *= shade[..., None]
        for n in sorted(boxes, key=lambda k: boxes[k][3]):
            _draw_rider(picture, boxes[n], riders[n].colours)
        noisy = cv2.GaussianBlur(picture, (0, 0), 0.6) + rng.normal(0, noise, picture.shape)
        yield np.clip(noisy, 0, 255).astype(np.uint8), {n: b for n, b in boxes.items() if _inside(b) > 0.5}


def _draw_rider(picture, box, colours) -> None:
    x0, y0, x1, y1 = box
    w, h = x1 - x0, y1 - y0
    clothes, machine = (tuple(map(float, c)) for c in colours)

    def ellipse(x, y, across, down, colour):
        centre = (round(8 * (x0 + x * w)), round(8 * (y0 + y * h)))
        axes = (round(8 * across * w), round(8 * down * h))
        cv2.ellipse(picture, centre, axes, 0, 0, 360, colour, -1, cv2.LINE_AA, 3)

    ellipse(0.5, 0.8, 0.14, 0.2, (35.0, 35.0, 40.0))
    ellipse(0.5, 0.64, 0.36, 0.17, machine)
    ellipse(0.5, 0.38, 0.5, 0.22, clothes)
    ellipse(0.5, 0.1, 0.2, 0.1, tuple(0.5 * c + 110 for c in clothes))


def _inside(box) -> float:
    low, high = np.maximum(box[:2], 0), np.minimum(box[2:], [WIDTH, HEIGHT])
    return float(np.prod(np.maximum(high - low, 0)) / np.prod(box[2:] - box[:2]))
