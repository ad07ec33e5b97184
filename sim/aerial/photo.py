"""The ground as a picture from straight above: land by its use, verges, asphalt with its wear, paint."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.aerial.networks import Network, Strip
from sim.aerial.parcels import Parcel, Use
from sim.models import Photo
from sim.render.ground import fractal

Floats = NDArray[np.float64]
Image = NDArray[np.float32]
Mask = NDArray[np.uint8]

TEXEL = 0.18
"""Metres."""
_SHIFT = 4
_LINE = 0.15
_TONES = {
    Use.CROP: ((0.37, 0.44, 0.22), (0.46, 0.50, 0.25), (0.31, 0.40, 0.20)),
    Use.STUBBLE: ((0.63, 0.57, 0.40), (0.68, 0.61, 0.43), (0.57, 0.52, 0.37)),
    Use.SOIL: ((0.47, 0.40, 0.32), (0.53, 0.45, 0.35), (0.42, 0.37, 0.31)),
    Use.MEADOW: ((0.40, 0.45, 0.25), (0.45, 0.47, 0.28), (0.50, 0.49, 0.31)),
    Use.WOOD: ((0.28, 0.31, 0.19), (0.31, 0.33, 0.21), (0.26, 0.30, 0.19)),
    Use.GARDEN: ((0.42, 0.48, 0.28), (0.46, 0.50, 0.30), (0.49, 0.48, 0.33)),
    Use.YARD: ((0.52, 0.52, 0.51), (0.46, 0.46, 0.46), (0.57, 0.56, 0.53)),
    Use.STREET: ((0.45, 0.45, 0.46), (0.47, 0.47, 0.47), (0.43, 0.43, 0.44)),
}
"""What the land looks like, coded by the square root, three shades a use."""
_ROUGH = {Use.CROP: 0.025, Use.STUBBLE: 0.03, Use.SOIL: 0.035, Use.YARD: 0.02, Use.STREET: 0.015}
_ROWS = {Use.CROP: (3.0, 0.022), Use.STUBBLE: (4.5, 0.030), Use.SOIL: (2.2, 0.030), Use.MEADOW: (5.5, 0.010)}
"""Metres between a field's rows, and how strongly they show."""
_VERGE = (0.44, 0.46, 0.29)
_SOIL = (0.55, 0.51, 0.45)
_ASPHALT = 0.45
_WHITE = (0.80, 0.80, 0.78)
_YELLOW = (0.76, 0.62, 0.26)


def photograph(
    area: tuple[float, float, float, float],
    parcels: Sequence[Parcel],
    networks: Sequence[Network],
    *,
    kerbs: bool,
    rng: np.random.Generator,
) -> Photo:
    """Paint the ground.

    Args:
        area: West, south, east, north, metres.
        parcels: The land, all of ``area``.
        networks: The roads on it, the upper ones of which come last.
        kerbs: Whether pavements run along the roads, and not verges.
        rng: Draws all wear and noise.
    """
    canvas = _Canvas(area, rng)
    _paint_land(canvas, parcels)
    strips = [strip for network in networks for strip in network.strips]
    _paint_verges(canvas, strips, kerbs=kerbs)
    _paint_asphalt(canvas, strips)
    for network in networks:
        _paint_marks(canvas, network)
    image = (np.clip(canvas.image, 0.02, 0.98) * 255 + 0.5).astype(np.uint8)
    return Photo(low=(area[0], area[1]), texel=TEXEL, image=image)


class _Canvas:
    """The picture while it is painted: (H, W, 3) float32, coded by the square root."""

    def __init__(self, area: tuple[float, float, float, float], rng: np.random.Generator) -> None:
        west, south, east, north = area
        self.low = np.array([west, south])
        self.shape = (int(np.ceil((north - south) / TEXEL)), int(np.ceil((east - west) / TEXEL)))
        self.rng = rng
        self.image: Image = np.zeros((*self.shape, 3), np.float32)
        tile = (512, 512)
        self._tiles = {
            "fine": fractal(rng, tile, 0.5, lowest=12).astype(np.float32),
            "broad": fractal(rng, tile, 1.35, lowest=2).astype(np.float32),
        }

    def noise(self, kind: str, period: float) -> Image:
        """Return (H, W) noise of unit variance that repeats every ``period`` metres."""
        size = max(int(period / TEXEL), 16)
        tile = cv2.resize(self._tiles[kind], (size, size), interpolation=cv2.INTER_LINEAR)
        height, width = self.shape
        return np.tile(tile, (-(-height // size), -(-width // size)))[:height, :width]

    def pixels(self, points: ArrayLike) -> NDArray[np.int32]:
        """Turn (N, 2) world metres into OpenCV's fixed-point pixels."""
        texels = (np.asarray(points, float) - self.low) / TEXEL - 0.5
        return np.asarray(np.round(texels * (1 << _SHIFT)), np.int32)

    def mask(self) -> Mask:
        """Return an empty mask."""
        return np.zeros(self.shape, np.uint8)

    def fill(self, mask: Mask, polygon: ArrayLike, value: int = 255) -> None:
        """Draw a polygon (N, 2), metres, into a mask."""
        cv2.fillPoly(mask, [self.pixels(polygon)], value, cv2.LINE_AA, _SHIFT)

    def stroke(self, mask: Mask, points: ArrayLike, width: float, value: int = 255) -> None:
        """Draw a line through (N, 2) points, metres, into a mask."""
        points = np.asarray(points, float)
        along = np.gradient(points, axis=0)
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
        normal *= width / 2 / np.maximum(np.hypot(*normal.T), 1e-9)[:, None]
        left, right = points + normal, points - normal
        quads = np.stack([left[:-1], left[1:], right[1:], right[:-1]], axis=1)
        for quad in quads:
            cv2.fillConvexPoly(mask, self.pixels(quad), value, cv2.LINE_AA, _SHIFT)

    def blend(self, mask: Mask | Image, colour: ArrayLike | Image) -> None:
        """Lay a colour, (3,) or (H, W, 3), over the picture where a mask says how much."""
        share = np.asarray(mask, np.float32) * np.float32(1 / 255 if mask.dtype == np.uint8 else 1)
        rows, columns = np.flatnonzero(share.any(axis=1)), np.flatnonzero(share.any(axis=0))
        if not len(rows):
            return
        part = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
        paint = np.asarray(colour, np.float32)
        if paint.ndim == 3:
            paint = paint[part]
        self.image[part] += share[part][..., None] * (paint - self.image[part])

    def shade(self, mask: Mask | Image, change: float) -> None:
        """Lighten, or darken, the picture where a mask says how much."""
        share = np.asarray(mask, np.float32) * np.float32(1 / 255 if mask.dtype == np.uint8 else 1)
        self.image += (change * share)[..., None]


def _share(mask: Mask, strength: float = 1.0) -> Image:
    """Turn a mask into the part that what lies beneath gives up."""
    return mask.astype(np.float32) * np.float32(strength / 255)


def _paint_land(canvas: _Canvas, parcels: Sequence[Parcel]) -> None:
    """Fill the parcels with their tones, rows and mottle."""
    labels = np.zeros(canvas.shape, np.int32)
    tones = np.zeros((len(parcels) + 1, 3), np.float32)
    rough = np.full(len(parcels) + 1, 0.02, np.float32)
    tones[0] = _TONES[Use.MEADOW][0]
    rows: Image = np.zeros(canvas.shape, np.float32)
    north, east = np.meshgrid(
        *(np.arange(size, dtype=np.float32) * TEXEL for size in canvas.shape), indexing="ij"
    )
    ordered = sorted(range(len(parcels)), key=lambda k: parcels[k].use is Use.STREET)
    for k in ordered:
        parcel = parcels[k]
        corners = canvas.pixels(parcel.corners())
        cv2.fillPoly(labels, [corners], k + 1, cv2.LINE_8, _SHIFT)
        shades = _TONES[parcel.use]
        tones[k + 1] = np.array(shades[int(parcel.roll[0] * len(shades))]) * (0.94 + 0.12 * parcel.roll[1])
        rough[k + 1] = _ROUGH.get(parcel.use, 0.03)
        if parcel.use in _ROWS:
            (x0, y0), (x1, y1) = (corners >> _SHIFT).min(axis=0), (corners >> _SHIFT).max(axis=0) + 1
            part = (slice(max(y0, 0), max(y1, 0)), slice(max(x0, 0), max(x1, 0)))
            period, strength = _ROWS[parcel.use]
            angle = parcel.heading + (np.pi / 2 if parcel.roll[2] < 0.5 else 0.0)
            place = north[part] * np.cos(angle) - east[part] * np.sin(angle)
            period *= 0.8 + 0.4 * parcel.roll[3]
            here = labels[part] == k + 1
            rows[part] += np.where(here, strength * np.sin(2 * np.pi / period * place), 0.0)
    mottle = canvas.noise("broad", 95.0) + 0.6 * canvas.noise("broad", 33.0)
    grain = canvas.noise("fine", 47.0)
    canvas.image[:] = tones[labels]
    canvas.image += (rough[labels] * (mottle + 0.5 * grain) + rows)[..., None]
    # Dry and wet patches change the hue, too.
    canvas.image[..., 0] += 0.8 * rough[labels] * canvas.noise("broad", 71.0)
    _paint_details(canvas, parcels)


def _paint_details(canvas: _Canvas, parcels: Sequence[Parcel]) -> None:
    """Draw what gives the land its lines: edges of fields, paths and drives, bays of car parks, pavements."""
    hedges, paths, kerbs, bays = (canvas.mask() for _ in range(4))
    for parcel in parcels:
        ring = np.concatenate([parcel.corners(), parcel.corners()[:1]])
        if parcel.use in (Use.CROP, Use.STUBBLE, Use.SOIL, Use.MEADOW):
            canvas.stroke(hedges, ring, 1.6)
        elif parcel.use is Use.GARDEN:
            canvas.stroke(hedges, ring, 0.7)
            a = (parcel.roll[2] - 0.5) * 0.6 * parcel.length
            drive = [parcel.at(a, -parcel.width / 2), parcel.at(a, 0.0)]
            canvas.stroke(paths, drive, 2.6 + 1.5 * parcel.roll[3])
            terrace = parcel.at(0.0, 0.18 * parcel.width)
            canvas.stroke(
                paths, [terrace, np.array(terrace) + np.array(parcel.at(5.0, 0)) - parcel.at(0, 0)], 5.0
            )
        elif parcel.use is Use.YARD:
            canvas.stroke(kerbs, ring, 0.4)
            for across in car_rows(parcel):
                for along in np.arange(-parcel.length / 2 + 4.0, parcel.length / 2 - 3.0, 2.6):
                    ends = [parcel.at(along, across - 2.5), parcel.at(along, across + 2.5)]
                    canvas.stroke(bays, ends, 0.12)
        elif parcel.use is Use.STREET:
            for side in (-1, 1):
                y = side * (parcel.width / 2 - 0.8)
                line = [parcel.at(-parcel.length / 2, y), parcel.at(parcel.length / 2, y)]
                canvas.stroke(kerbs, line, 1.6)
    grain = canvas.noise("fine", 29.0)
    canvas.blend(_share(hedges) * np.clip(0.5 + 0.3 * grain, 0, 1), (0.33, 0.36, 0.22))
    canvas.blend(_share(paths, 0.85), (0.60, 0.57, 0.53))
    canvas.blend(_share(kerbs, 0.8), (0.62, 0.61, 0.59))
    canvas.blend(_share(bays, 0.6), _WHITE)


def car_rows(parcel: Parcel) -> tuple[float, ...]:
    """Return the offsets across a yard, metres, of the rows in which cars park."""
    half = parcel.width / 2
    return (half - 4.0, half - 15.5) if parcel.roll[4] < 0.7 else ()


def _outline(strip: Strip, more: float) -> Floats:
    """Give the polygon of a strip, ``more`` metres wider on either side."""
    low, high = strip.paved
    return np.concatenate([strip.beside(high + more), strip.beside(low - more)[::-1]])


def _paint_verges(canvas: _Canvas, strips: Sequence[Strip], *, kerbs: bool) -> None:
    """Lay grass, then bare soil or pavements, along the roads."""
    grass, soil = canvas.mask(), canvas.mask()
    for strip in strips:
        canvas.fill(grass, _outline(strip, 5.5 if kerbs else 9.0))
        canvas.fill(soil, _outline(strip, 2.6 if kerbs else 0.9))
    rough = canvas.noise("broad", 19.0)
    edge = cv2.GaussianBlur(grass, (0, 0), 1.2 / TEXEL).astype(np.float32) / 255
    edge = np.clip((edge - 0.5) * 2.5 + 0.5 + 0.25 * rough, 0, 1)
    verge = np.array(_VERGE, np.float32) + (0.022 * (rough + canvas.noise("broad", 61.0)))[..., None]
    canvas.blend(edge, verge)
    if kerbs:
        canvas.blend(soil, (0.61, 0.60, 0.58))
    else:
        dust = cv2.GaussianBlur(soil, (0, 0), 0.35 / TEXEL).astype(np.float32) / 255
        canvas.blend(np.clip(dust * (0.75 + 0.2 * rough), 0, 1), _SOIL)


def _paint_asphalt(canvas: _Canvas, strips: Sequence[Strip]) -> None:
    """Lay the asphalt and wear it: tracks and oil along the lanes, patches, joints, cracks."""
    rng, asphalt = canvas.rng, canvas.mask()
    light, dark, seams = (canvas.mask() for _ in range(3))
    for strip in strips:
        canvas.fill(asphalt, _outline(strip, 0.0))
        for left, right in zip(strip.edges[:-1], strip.edges[1:], strict=True):
            if left - right < 2.4:
                continue
            middle = (left + right) / 2
            for side in (-0.8, 0.8):
                canvas.stroke(light, strip.beside(middle + side), 0.5, int(rng.uniform(90, 200)))
            canvas.stroke(dark, strip.beside(middle), 0.7, int(rng.uniform(110, 255)))
            for _ in range(rng.poisson(len(strip.line) / 90)):
                first = int(rng.integers(0, max(len(strip.line) - 12, 1)))
                piece = slice(first, first + int(rng.integers(3, 12)))
                lane = np.concatenate([strip.beside(right)[piece], strip.beside(left)[piece][::-1]])
                canvas.fill(dark if rng.random() < 0.65 else light, lane, int(rng.uniform(150, 255)))
        for edge in strip.edges[1:-1]:
            canvas.stroke(seams, strip.beside(edge + 0.12), 0.10, 140)
        for _ in range(rng.poisson(len(strip.line) / 14)):
            k = int(rng.integers(len(strip.line)))
            low, high = strip.paved
            ends = [strip.beside(d)[k] for d in (low, high)]
            canvas.stroke(seams, ends, 0.14, int(rng.uniform(70, 190)))
        for _ in range(rng.poisson(len(strip.line) / 30)):
            first = int(rng.integers(0, max(len(strip.line) - 20, 1)))
            run = slice(first, first + 20)
            wander = rng.uniform(*strip.paved) + np.cumsum(rng.normal(0, 0.25, len(strip.line)))
            canvas.stroke(seams, strip.beside(np.clip(wander, *strip.paved))[run], 0.10, 150)
    tone = _ASPHALT + 0.02 * canvas.noise("broad", 130.0) + 0.012 * canvas.noise("broad", 27.0)
    tone += 0.016 * canvas.noise("fine", 21.0)
    canvas.blend(asphalt, tone[..., None] * np.array([0.985, 0.99, 1.01], np.float32))
    soft = 0.3 / TEXEL
    canvas.shade(cv2.GaussianBlur(light, (0, 0), soft), 0.045)
    canvas.shade(cv2.GaussianBlur(dark, (0, 0), soft), -0.065)
    canvas.shade(seams, -0.12)


def _paint_marks(canvas: _Canvas, network: Network) -> None:
    """Paint lines, stop lines and zebra crossings."""
    white, yellow = canvas.mask(), canvas.mask()
    for strip in network.strips:
        for edge, style in zip(strip.edges.tolist(), strip.styles.tolist(), strict=True):
            if style == 2:
                for first in np.arange(1.0, strip.s[-1] - 4.0, 12.0):
                    places = np.linspace(first, first + 3.0, 4)
                    line = strip.beside(edge)
                    dash = np.column_stack([np.interp(places, strip.s, line[:, k]) for k in (0, 1)])
                    canvas.stroke(white, dash, _LINE)
            elif style == 4:
                for side in (-0.14, 0.14):
                    canvas.stroke(yellow, strip.beside(edge + side), _LINE)
            elif style:
                canvas.stroke(yellow if style == 3 else white, strip.beside(edge), _LINE)
    for ends in network.stop_lines:
        canvas.stroke(white, ends, 0.5)
    for start, end in network.crossings:
        along = (end - start) / np.hypot(*(end - start))
        across = np.array([-along[1], along[0]])
        for place in np.arange(0.6, np.hypot(*(end - start)) - 0.4, 1.1):
            middle = start + place * along
            canvas.stroke(white, [middle - 1.6 * across, middle + 1.6 * across], 0.55)
    wear = np.clip(0.86 + 0.14 * canvas.noise("fine", 17.0), 0.3, 1)
    canvas.blend(white.astype(np.float32) / 255 * wear, _WHITE)
    canvas.blend(yellow.astype(np.float32) / 255 * wear, _YELLOW)
