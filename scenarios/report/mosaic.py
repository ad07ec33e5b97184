"""The mosaic of a flight with the tracks upon it, before and after they are repaired (paper 2, figure 4)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios.report.flight import HIDDEN, KeptFrame, Path
from scenarios.report.palette import identity, rgb
from tracker.aerial.stabilisation import transform

Floats = NDArray[np.float64]

LARGEST = 1500
"""Px of the mosaic's longer side; it is drawn smaller than the frames if need be."""
DIM = 0.62
"""How dark the ground is drawn: the tracks have to stand out."""
SHORTEST = 15
"""Frames of a track below which it is not drawn."""
PLAIN = (170, 174, 182)
"""Of tracks that needed no repair."""
_DASH, _GAP = 9.0, 6.0


@dataclass(frozen=True, slots=True)
class Mosaic:
    """A picture of all ground that was seen.

    Attributes:
        image: (H, W, 3) uint8, RGB, dimmed.
        from_mosaic: (3, 3) from the tracker's mosaic to the pixels of ``image``.
        scale: Pixels a mosaic px.
    """

    image: NDArray[np.uint8]
    from_mosaic: Floats
    scale: float


def compose(frames: Sequence[KeptFrame], keep: NDArray[np.float64] | None = None) -> Mosaic:
    """Lay frames upon each other: where several show the ground it is their mean, and what moves fades.

    Args:
        frames: One or more.
        keep: (2, 2) least and greatest x, y of the mosaic to show, px; None for all of it.
    """
    images = [frame.image() for frame in frames]
    height, width = images[0].shape[:2]
    corners = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    if keep is None:
        outlines = np.concatenate([transform(frame.to_mosaic, corners) for frame in frames])
        keep = np.array([outlines.min(0), outlines.max(0)])
    size = keep[1] - keep[0]
    scale = min(1.0, LARGEST / float(size.max())) if size.max() > LARGEST / 2 else LARGEST / 2 / size.max()
    place = np.array([[scale, 0.0, -scale * keep[0, 0]], [0.0, scale, -scale * keep[0, 1]], [0.0, 0.0, 1.0]])
    shape = max(int(np.ceil(scale * size[0])), 2), max(int(np.ceil(scale * size[1])), 2)
    total = np.zeros((shape[1], shape[0], 3), np.float32)
    weight = np.zeros((shape[1], shape[0]), np.float32)
    whole = np.ones((height, width), np.float32)
    for frame, image in zip(frames, images, strict=True):
        onto = place @ frame.to_mosaic
        total += cv2.warpPerspective(image.astype(np.float32), onto, shape)
        weight += cv2.warpPerspective(whole, onto, shape)
    ground = DIM * total / np.maximum(weight, 1e-3)[..., None]
    ground[weight < 0.5] = 24.0
    return Mosaic(ground.clip(0, 255).astype(np.uint8), place, scale)


def broken(mosaic: Mosaic, paths: Mapping[int, Path]) -> tuple[NDArray[np.uint8], int]:
    """Draw every stretch in which a vehicle was seen as a track of its own; return how many there are."""
    canvas, count = mosaic.image.copy(), 0
    for path in paths.values():
        pieces = _long_pieces(path)
        for begin, end in pieces:
            colour, thickness = (rgb(identity(5 * count + 1)), 3) if len(pieces) > 1 else (PLAIN, 1)
            draw_way(canvas, mosaic, path.points[begin:end], colour, thickness=thickness)
            count += 1
    return canvas, count


def repaired(mosaic: Mosaic, paths: Mapping[int, Path]) -> tuple[NDArray[np.uint8], int]:
    """Draw each track in one colour, dashed where it was hidden; return how many there are."""
    canvas, count = mosaic.image.copy(), 0
    for track, path in paths.items():
        pieces = _long_pieces(path)
        count += len(pieces) > 0
        if len(pieces) < 2:
            for begin, end in pieces:
                draw_way(canvas, mosaic, path.points[begin:end], PLAIN, thickness=1)
            continue
        colour = rgb(identity(track))
        for begin, end in pieces:
            draw_way(canvas, mosaic, path.points[begin:end], colour, thickness=3)
        for (_, end), (begin, _) in itertools.pairwise(pieces):
            draw_way(canvas, mosaic, path.points[end - 1 : begin + 1], colour, dashed=True)
        x, y = transform(mosaic.from_mosaic, path.points[pieces[-1][1] - 1])
        cv2.putText(
            canvas,
            str(track),
            (int(x) + 4, int(y) - 4),
            cv2.FONT_HERSHEY_SIMPLEX,
            0.36,
            colour,
            1,
            cv2.LINE_AA,
        )
    return canvas, count


def _long_pieces(path: Path) -> list[tuple[int, int]]:
    """Return the stretches in which a track was seen; gaps too short to be drawn are closed."""
    pieces: list[tuple[int, int]] = []
    for begin, end in path.pieces():
        if pieces and path.ticks[begin] - path.ticks[pieces[-1][1] - 1] <= HIDDEN:
            pieces[-1] = (pieces[-1][0], end)
        else:
            pieces.append((begin, end))
    return [(begin, end) for begin, end in pieces if end - begin >= SHORTEST]


def draw_way(
    canvas: NDArray[np.uint8],
    mosaic: Mosaic,
    points: Floats,
    colour: tuple[int, int, int],
    *,
    dashed: bool = False,
    thickness: int = 2,
) -> None:
    """Draw a way through mosaic points (K, 2)."""
    places = transform(mosaic.from_mosaic, points)
    if not dashed:
        way = np.round(16 * places).astype(np.int32)
        cv2.polylines(canvas, [way.reshape(-1, 1, 2)], False, colour, thickness, cv2.LINE_AA, shift=4)
        return
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))])
    for start in np.arange(0.0, along[-1], _DASH + _GAP):
        ends = [
            tuple(int(np.interp(s, along, places[:, k])) for k in (0, 1))
            for s in (start, min(start + _DASH, along[-1]))
        ]
        cv2.line(canvas, ends[0], ends[1], colour, thickness, cv2.LINE_AA)
