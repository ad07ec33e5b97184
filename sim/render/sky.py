"""The sky as a picture of all directions, painted once an episode."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.models import Light
from sim.render.ground import fractal
from sim.rng import stream

HIGHEST = np.radians(50.0)
"""Elevation of the panorama's last row; its first is the horizon."""

_WIDTH, _HEIGHT = 4096, 512
_PLANE = 1024


def panorama(light: Light) -> NDArray[np.uint8]:
    """Paint the sky: a gradient, the glow around the sun, clouds on a plane overhead.

    Args:
        light: Sun, colours, cloud cover and the clouds' seed.

    Returns:
        (512, 4096, 4) uint8, as the film shows it; rows from the horizon up to `HIGHEST`, columns by
        azimuth counter-clockwise from east.
    """
    import cv2

    elevation = ((np.arange(_HEIGHT, dtype=np.float32) + 0.5) / _HEIGHT * np.float32(HIGHEST))[:, None]
    azimuth = ((np.arange(_WIDTH, dtype=np.float32) + 0.5) / _WIDTH * np.float32(2 * np.pi))[None, :]
    up = np.sin(elevation)
    east, north = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth)
    blend = (1 - np.exp(-up / 0.22))[..., None]
    sky = light.horizon.astype(np.float32) * (1 - blend) + light.zenith.astype(np.float32) * blend
    sky = np.broadcast_to(sky, (_HEIGHT, _WIDTH, 3)).copy()
    toward = east * light.sun[0] + north * light.sun[1] + up * light.sun[2]
    if not light.night:
        glow = 0.22 * np.clip(toward, 0, 1) ** 6 + 0.5 * np.clip(toward, 0, 1) ** 60 + 3.0 * (toward > 0.9996)
        sky += (1 - 0.8 * light.cloud) * glow[..., None] * light.sun_colour * 0.6
    rng = stream(light.seed, "sky")
    plane = fractal(rng, (_PLANE, _PLANE), 1.7, lowest=3) + 0.22 * fractal(
        rng, (_PLANE, _PLANE), 1.0, lowest=24
    )
    scale = _PLANE / 22.0 / np.maximum(up, 0.035)
    x, y = np.broadcast_arrays((east * scale) % _PLANE, (north * scale) % _PLANE)
    density = cv2.remap(
        plane.astype(np.float32),
        x.astype(np.float32),
        y.astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_WRAP,
    )
    threshold = np.quantile(plane, 1 - light.cloud) if light.cloud > 0 else np.inf
    cover = np.clip((density - threshold) / 0.9, 0, 1)
    cover = cover * cover * (3 - 2 * cover)
    thick = np.clip((density - threshold) / 2.6, 0, 1)
    brightness = 0.25 * light.sun_colour.mean() + 0.75 * np.mean(light.horizon + light.zenith)
    white = np.array([1.0, 1.0, 1.02]) * (0.62 if light.night else 1.0) * brightness
    cloud = white * (1.12 - 0.55 * thick - 0.25 * light.cloud)[..., None]
    fade = np.clip(up / 0.22, 0, 1)[..., None] * 0.92
    sky += (cloud - sky) * cover[..., None] * fade
    sky = np.clip(sky, 0, 4)
    shown = np.sqrt(sky * (1 + 0.12 * sky) / (1 + 0.42 * sky * sky))  # film() of the shaders
    shown *= 0.85 + shown * (0.45 - 0.30 * shown)
    out = np.full((_HEIGHT, _WIDTH, 4), 255, np.uint8)
    out[..., :3] = np.clip(shown, 0, 1) * 255 + 0.5
    return out


def screen_grid(columns: int = 16, rows: int = 12) -> NDArray[np.float32]:
    """Return (6 * columns * rows, 2) corners of the triangles of a grid over clip space."""
    x, y = np.linspace(-1, 1, columns + 1), np.linspace(-1, 1, rows + 1)
    corners = np.stack(np.meshgrid(x, y), axis=-1)
    a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:]
    return np.stack([a, b, c, c, b, d], axis=2).reshape(-1, 2).astype(np.float32)
