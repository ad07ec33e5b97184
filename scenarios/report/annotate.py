"""Draws what a tracker says upon the frame that it saw."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios.report.palette import LABELS, TRUTH, Rgb, identity, rgb
from tracker.types import Label, Status, Traces, Tracks

STRIP = 24
"""Height of the strip below the picture in which the traces stand as ticks, px."""

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_DASH = 6
_LABELS = {int(label): rgb(colour) for label, colour in LABELS.items()}


def annotate(
    image: NDArray[np.uint8],
    *,
    tracks: Tracks,
    traces: Traces | None,
    truth_boxes: NDArray[np.float64] | None,
    caption: str,
    scale: int = 1,
    strip: int = STRIP,
) -> NDArray[np.uint8]:
    """Draw boxes, support points and trace ticks.

    Confirmed tracks are boxes coloured by id, with the id; coasting ones are dashed, tentative ones thin.
    Scored objects of the truth are thin white boxes beneath them. Each trace is a tick in the strip below the
    picture, coloured by its label, and so are its support points in the picture.

    Args:
        image: (H, W, 3) uint8 RGB; it is not changed.
        tracks: What the tracker returned for it.
        traces: What else it showed, or None.
        truth_boxes: (N, 4) boxes of the scored objects, px, or None.
        caption: Written into the upper left corner.
        scale: The picture is drawn so many times as large; lines and letters stay as they are.
        strip: Height of the strip of ticks, px; 0 for a tracker without traces.

    Returns:
        (scale H + strip, scale W, 3) uint8 RGB.
    """
    if scale > 1:
        image = enlarged(image, scale)
    height, width = image.shape[:2]
    canvas = np.empty((height + strip, width, 3), np.uint8)
    canvas[:height] = image
    canvas[height:] = 22
    picture = canvas[:height]
    for box in truth_boxes if truth_boxes is not None else ():
        _rectangle(picture, scale * box, TRUTH, 1)
    if traces is not None and strip:
        _draw_traces(canvas, height, traces)
    for track, box, status in zip(tracks.ids, scale * tracks.boxes, tracks.status, strict=True):
        colour = rgb(identity(int(track)))
        if status == Status.CONFIRMED:
            _rectangle(picture, box, colour, 2)
            _tag(picture, box, str(track), colour)
        elif status == Status.COASTING:
            _dashed(picture, box, colour)
        else:
            _rectangle(picture, box, colour, 1)
    (wide, _), _ = cv2.getTextSize(caption, _FONT, 0.4, 1)
    cv2.rectangle(canvas, (0, 0), (wide + 11, 17), (22, 22, 22), cv2.FILLED)
    cv2.putText(canvas, caption, (6, 13), _FONT, 0.4, (235, 238, 242), 1, cv2.LINE_AA)
    return canvas


def draw_ellipse(
    canvas: NDArray[np.uint8],
    centre: NDArray[np.float64],
    covariance: NDArray[np.float64],
    colour: Rgb,
    *,
    deviations: float = 2.0,
) -> None:
    """Draw where something is expected: its place (2,), and so many standard deviations of its (2, 2)."""
    values, vectors = np.linalg.eigh(covariance)
    axes = tuple(round(deviations * float(np.sqrt(max(value, 0.0)))) for value in values)
    angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
    middle = (round(float(centre[0])), round(float(centre[1])))
    cv2.ellipse(canvas, middle, (axes[0], axes[1]), angle, 0, 360, colour, 2, cv2.LINE_AA)
    cv2.circle(canvas, middle, 2, colour, cv2.FILLED, cv2.LINE_AA)


def enlarged(image: NDArray[np.uint8], scale: int) -> NDArray[np.uint8]:
    """Return a picture ``scale`` times as wide and high."""
    return np.asarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC), np.uint8)


def draw_measurements(
    image: NDArray[np.uint8], boxes: NDArray[np.float64], names: Sequence[str]
) -> NDArray[np.uint8]:
    """Return a copy of ``image`` with thin white boxes (N, 4), px, and as many names as are given."""
    canvas = image.copy()
    for box in boxes:
        _rectangle(canvas, box, TRUTH, 1)
    for box, name in zip(boxes, names, strict=False):
        _tag(canvas, box, name, TRUTH)
    return canvas


def _corners(box: NDArray[np.float64]) -> tuple[int, int, int, int]:
    x0, y0, x1, y1 = (round(float(value)) for value in np.clip(box, -1e5, 1e5))
    return x0, y0, x1 - 1, y1 - 1


def _rectangle(canvas: NDArray[np.uint8], box: NDArray[np.float64], colour: Rgb, thickness: int) -> None:
    x0, y0, x1, y1 = _corners(box)
    cv2.rectangle(canvas, (x0, y0), (x1, y1), colour, thickness)


def _dashed(canvas: NDArray[np.uint8], box: NDArray[np.float64], colour: Rgb) -> None:
    height, width = canvas.shape[:2]
    x0, y0, x1, y1 = _corners(box)
    for x in range(max(x0, 0), min(x1, width), 2 * _DASH):
        for y in (y0, y1):
            cv2.line(canvas, (x, y), (min(x + _DASH, x1), y), colour, 1)
    for y in range(max(y0, 0), min(y1, height), 2 * _DASH):
        for x in (x0, x1):
            cv2.line(canvas, (x, y), (x, min(y + _DASH, y1)), colour, 1)


def _tag(canvas: NDArray[np.uint8], box: NDArray[np.float64], text: str, colour: Rgb) -> None:
    """Write black on colour, above the box or, where there is no room, inside it."""
    x0, y0, _, _ = _corners(box)
    (width, height), _ = cv2.getTextSize(text, _FONT, 0.4, 1)
    bottom = y0 if y0 > height + 5 else y0 + height + 6
    cv2.rectangle(canvas, (x0 - 1, bottom - height - 5), (x0 + width + 4, bottom), colour, cv2.FILLED)
    cv2.putText(canvas, text, (x0 + 2, bottom - 3), _FONT, 0.4, (10, 10, 14), 1, cv2.LINE_AA)


def _draw_traces(canvas: NDArray[np.uint8], horizon: int, traces: Traces) -> None:
    labels = dict(zip(traces.ids.tolist(), traces.labels.tolist(), strict=True))
    width = canvas.shape[1]
    for (x, y), trace in zip(traces.points, traces.point_traces.tolist(), strict=True):
        if 0 <= x < width and 0 <= y < horizon:
            colour = _LABELS[labels.get(trace, int(Label.UNDECIDED))]
            cv2.circle(canvas, (int(x), int(y)), 1, colour, cv2.FILLED)
    for x, label in zip(traces.x, traces.labels.tolist(), strict=True):
        if 0 <= x < width:
            cv2.line(canvas, (int(x), horizon + 2), (int(x), horizon + STRIP - 3), _LABELS[label], 2)
