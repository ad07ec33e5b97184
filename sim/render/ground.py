"""The ground, cut into stretches of road, and the textures that its shader paints from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.models import Ground
from sim.render.instances import COMMAND
from sim.rng import stream

PERIOD = 240.0
"""Metres of road after which the baked textures repeat; arc lengths in shaders are taken modulo this."""

MARGIN = 4.0
"""Metres beyond the paved band that the baked texture of the road covers."""

STRETCH = np.dtype([("offset", "<f4", 3), ("arc", "<f4")])
"""One stretch, as the shader reads it: its origin relative to the camera, what to add to its arc lengths."""

_STRETCH_LENGTH = 128.0
_HALF_LINE = 0.075
_ACROSS, _ALONG = 512, 2048


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretches:
    """The ground's faces in stretches of road, each with an origin of its own, for float32's sake.

    Attributes:
        vertices: (V, 5) float32: position relative to the stretch's origin, arc length relative to it,
            offset d.
        faces: (F, 3) int32, counted from each stretch's ``base_vertex``.
        first: (C,) first index.
        count: (C,) indices.
        paved: (C,) how many of them, from the first, make the paved band.
        base_vertex: (C,).
        origins: (C, 3) float64, world metres.
        arcs: (C,) float64 arc length of the origins, modulo `PERIOD`.
        lower: (C, 3) float64 corner of the bounding box, world metres.
        upper: (C, 3) float64.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    first: NDArray[np.uint32]
    count: NDArray[np.uint32]
    paved: NDArray[np.uint32]
    base_vertex: NDArray[np.int32]
    origins: NDArray[np.float64]
    arcs: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]

    def select(self, camera: Camera, pose: Pose) -> NDArray[np.intp]:
        """Return the stretches that may be seen, nearest first."""
        nearest = np.clip(pose.position, self.lower, self.upper)
        distance = np.hypot(*(nearest - pose.position)[:, :2].T)
        corners = np.stack(
            [np.where([a, b, c], self.upper, self.lower) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
        )
        right, _, ahead = np.moveaxis(pose.to_camera(corners), -1, 0)
        seen = (ahead > camera.near).any(axis=0) & (distance < camera.far)
        for sign, edge in ((1.0, camera.width - camera.cx), (-1.0, camera.cx)):
            seen &= (sign * right - edge / camera.focal * ahead < 0).any(axis=0)
        rows = np.flatnonzero(seen)
        return rows[np.argsort(distance[rows], kind="stable")]

    def stretches(self, rows: NDArray[np.intp], pose: Pose) -> NDArray[np.void]:
        """Return (C,) `STRETCH` records."""
        out = np.zeros(len(rows), STRETCH)
        out["offset"] = self.origins[rows] - pose.position
        out["arc"] = self.arcs[rows]
        return out

    def commands(self, rows: NDArray[np.intp]) -> NDArray[np.void]:
        """Return (2 C,) `COMMAND` records: first all paved bands, then all the land."""
        out = np.zeros((2, len(rows)), COMMAND)
        out["count"] = self.paved[rows], self.count[rows] - self.paved[rows]
        out["instances"] = 1
        out["first"] = self.first[rows], self.first[rows] + self.paved[rows]
        out["base_vertex"] = self.base_vertex[rows]
        out["base_instance"] = np.arange(len(rows))
        return out.ravel()


def vertex_layout(shader: Any, vertices: Any, stretches: Any) -> list[tuple[Any, ...]]:
    """Return what a ground's shader reads of both buffers: one that paints a photo needs no arc lengths."""
    if "in_road" in shader:
        return [(vertices, "3f 2f", "in_position", "in_road"), (stretches, "3f 1f/i", "i_offset", "i_arc")]
    return [(vertices, "3f 8x", "in_position"), (stretches, "3f 4x/i", "i_offset")]


def cut(ground: Ground) -> Stretches:
    """Cut a ground into stretches by the arc length of its faces' middles."""
    arc = ground.coordinates[ground.faces, 0].mean(axis=1)
    bins = np.floor(arc / _STRETCH_LENGTH).astype(np.int64)
    order = np.argsort(bins, kind="stable")
    edges = np.flatnonzero(np.diff(bins[order], prepend=bins[order[0]] - 1))
    offset = ground.coordinates[ground.faces, 1]
    paved = ((offset > ground.paved[0] - 0.01) & (offset < ground.paved[1] + 0.01)).all(axis=1)
    vertices, faces, origins, arcs, lower, upper, counts, roads = [], [], [], [], [], [], [], []
    for members in np.split(order, edges[1:]):
        members = members[np.argsort(~paved[members], kind="stable")]
        roads.append(3 * np.count_nonzero(paved[members]))
        used, local = np.unique(ground.faces[members], return_inverse=True)
        points = ground.vertices[used].astype(np.float64)
        origin = points.mean(axis=0)
        start = np.floor(ground.coordinates[used, 0].min() / PERIOD) * PERIOD
        vertices.append(
            np.column_stack(
                [points - origin, ground.coordinates[used, 0] - start, ground.coordinates[used, 1]]
            )
        )
        faces.append(local.reshape(-1, 3))
        origins.append(origin)
        arcs.append(0.0)
        lower.append(points.min(axis=0))
        upper.append(points.max(axis=0))
        counts.append(len(used))
    face_counts = np.array([3 * len(part) for part in faces])
    return Stretches(
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=np.concatenate(faces).astype(np.int32),
        first=np.concatenate([[0], np.cumsum(face_counts)[:-1]]).astype(np.uint32),
        count=face_counts.astype(np.uint32),
        paved=np.array(roads, np.uint32),
        base_vertex=np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int32),
        origins=np.array(origins),
        arcs=np.array(arcs),
        lower=np.array(lower),
        upper=np.array(upper),
    )


def fractal(
    rng: np.random.Generator, shape: tuple[int, int], slope: float, *, lowest: float = 1.0
) -> NDArray[np.float64]:
    """Make noise that repeats without a seam, of mean 0 and standard deviation 1.

    Args:
        rng: The random stream.
        shape: Rows and columns.
        slope: The amplitude falls as frequency ** -slope.
        lowest: Cycles a repeat below which there is nothing.
    """
    rows = np.fft.fftfreq(shape[0])[:, None] * shape[0]
    columns = np.fft.rfftfreq(shape[1])[None, :] * shape[1]
    frequency = np.hypot(rows, columns)
    amplitude = np.where(frequency >= lowest, np.maximum(frequency, 1e-9) ** -slope, 0.0)
    noise = np.fft.irfft2(np.fft.rfft2(rng.standard_normal(shape)) * amplitude, s=shape)
    return np.asarray(noise / noise.std())


def grain_texture(seed: int) -> NDArray[np.uint8]:
    """Make the fine texture of the ground, (512, 512, 4), repeating: stones, mottle, cracks, broad noise."""
    rng = stream(seed, "ground", "grain")
    shape = (512, 512)
    stones = 0.75 * fractal(rng, shape, 0.15) + 0.6 * fractal(rng, shape, 0.8, lowest=8)
    mottle = fractal(rng, shape, 1.3, lowest=2)
    veins = np.abs(fractal(rng, shape, 1.5, lowest=3))
    cracks = np.clip(1 - veins / 0.035, 0, 1) * (fractal(rng, shape, 1.2) > 0.4)
    broad = fractal(rng, shape, 1.6)
    channels = np.stack([0.5 + 0.16 * stones, 0.5 + 0.18 * mottle, cracks, 0.5 + 0.18 * broad], axis=-1)
    return (np.clip(channels, 0, 1) * 255 + 0.5).astype(np.uint8)


def road_texture(ground: Ground, seed: int) -> NDArray[np.uint8]:
    """Bake the worn surface of one period of road.

    Args:
        ground: Its lines say where the lanes are.
        seed: Of patches, seams and stains.

    Returns:
        (2048, 512, 4) uint8, rows along the road over `PERIOD`, columns from the lowest to the highest d
        with `MARGIN` on both sides: albedo (0.5 is that of plain asphalt), tar and cracks, wear of the
        marks, dust.
    """
    rng = stream(seed, "ground", "road")
    low, high = ground.paved[0] - MARGIN, ground.paved[1] + MARGIN
    d = low + (np.arange(_ACROSS) + 0.5) / _ACROSS * (high - low)
    s = (np.arange(_ALONG) + 0.5) / _ALONG * PERIOD
    shape = (_ALONG, _ACROSS)
    albedo = (
        np.full(shape, 0.5) + 0.022 * fractal(rng, shape, 1.4) + 0.012 * fractal(rng, shape, 0.6, lowest=6)
    )
    tar = np.zeros(shape)
    lanes = [
        (right, left)
        for left, right in zip(ground.lane_edges[:-1], ground.lane_edges[1:], strict=True)
        if left - right > 2.4
    ]
    wobble = 0.06 * fractal(rng, (_ALONG, 2), 1.5)[:, :1]
    for right, left in lanes:
        middle = 0.5 * (left + right)
        across = d[None, :] - middle - wobble
        strength = rng.uniform(0.6, 1.3)
        tracks = np.exp(-(((np.abs(across) - 0.78) / 0.30) ** 2))
        oil = np.exp(-((across / 0.28) ** 2))
        streaks = np.clip(1 + 0.35 * fractal(rng, (_ALONG, 1), 1.0), 0, 2)
        albedo += strength * (0.035 * tracks - 0.06 * oil * streaks)
        inside = (d > right) & (d < left)
        albedo[:, inside] += rng.normal(0, 0.02)
        for _ in range(rng.poisson(2.2)):
            start, length = rng.uniform(0, PERIOD), rng.uniform(3, 30)
            where = ((s - start) % PERIOD < length)[:, None] & inside[None, :]
            albedo[where] += rng.choice([-0.09, -0.05, 0.05])
            rim = (np.abs((s - start) % PERIOD) < 0.12) | (np.abs((s - start) % PERIOD - length) < 0.12)
            tar[rim[:, None] & inside[None, :]] = 0.8
    for _ in range(rng.poisson(9)):
        row = rng.integers(_ALONG)
        tar[row, (d > ground.paved[0]) & (d < ground.paved[1])] = rng.uniform(0.3, 0.9)
    for _ in range(rng.poisson(7)):
        walk = rng.uniform(*ground.paved) + np.cumsum(rng.normal(0, 0.035, 400))
        rows = (rng.integers(_ALONG) + np.arange(400)) % _ALONG
        columns = np.clip((walk - low) / (high - low) * _ACROSS, 0, _ACROSS - 1).astype(int)
        tar[rows, columns] = rng.uniform(0.4, 1.0)
    for _ in range(rng.poisson(14)):
        where_s, where_d = rng.uniform(0, PERIOD), rng.uniform(*ground.paved)
        gap = (s - where_s + PERIOD / 2) % PERIOD - PERIOD / 2
        spot = np.exp(-((gap / rng.uniform(0.3, 1.5)) ** 2))[:, None] * np.exp(
            -(((d - where_d) / rng.uniform(0.15, 0.5)) ** 2)
        )
        albedo -= rng.uniform(0.04, 0.12) * spot
    shoulder = np.clip(np.maximum(ground.paved[0] + 0.7 - d, d - ground.paved[1] + 0.7) / 0.7, 0, 1)
    dust = np.clip(shoulder[None, :] * (0.6 + 0.3 * fractal(rng, shape, 1.0)), 0, 1)
    wear = np.clip(0.5 + 0.2 * fractal(rng, shape, 0.7, lowest=4), 0, 1)
    channels = np.stack([albedo, tar, wear, dust], axis=-1)
    return (np.clip(channels, 0, 1) * 255 + 0.5).astype(np.uint8)


def ground_texture(ground: Ground, seed: int) -> NDArray[np.uint8]:
    """Return what the paved band is painted from, (H, W, 4): the ground's photo, or a worn road."""
    if ground.photo is None:
        return road_texture(ground, seed)
    image = ground.photo.image
    return np.concatenate([image, np.full_like(image[..., :1], 255)], axis=-1)


def mark_table(ground: Ground) -> NDArray[np.float32]:
    """Tell for each place across the road which painted line is nearest.

    Args:
        ground: Its lines.

    Returns:
        (1, 2048, 4) float32 over the paved band with `MARGIN`: offset of the line's middle, its half width
        (0 where there is none at all), 1 if dashed, 1 if yellow.
    """
    lines = []
    for edge, style in zip(ground.lane_edges.tolist(), ground.line_styles.tolist(), strict=True):
        if style == 4:
            lines += [(edge - 0.15, _HALF_LINE, 0.0, 1.0), (edge + 0.15, _HALF_LINE, 0.0, 1.0)]
        elif style:
            lines.append((edge, _HALF_LINE, float(style == 2), float(style == 3)))
    if not lines:
        return np.zeros((1, 2048, 4), np.float32)
    table = np.array(lines, np.float32)
    low, high = ground.paved[0] - MARGIN, ground.paved[1] + MARGIN
    d = low + (np.arange(2048) + 0.5) / 2048 * (high - low)
    return np.asarray(table[np.abs(d[:, None] - table[:, 0]).argmin(axis=1)][None])
