"""One moment of a lane as its tracker saw it: learnt background, foreground, tracks, associations."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios.report.annotate import annotate, draw_ellipse, draw_measurements, enlarged
from scenarios.report.palette import FOREGROUND, identity, rgb
from scenarios.report.pictures import Picture, jpeg
from tracker.types import Association, Diagnostics, Tracks

Floats = NDArray[np.float64]

TRAINED = 60
"""Frames from the first in which a background is still being learnt."""
SCALE = 2
"""The pictures are drawn so many times as large: what is written on them has to be read."""
MOST_TRACKS = 12
"""Rows of the table of associations: those that were least sure."""
LEAST_SHOWN = 0.005
"""Probabilities below it are 0 for people."""


@dataclass(frozen=True, slots=True)
class Moment:
    """A frame and what its tracker made of it; arrays of its own."""

    index: int
    image: NDArray[np.uint8]
    tracks: Tracks
    diagnostics: Diagnostics


class MomentChooser:
    """Keeps the frame whose associations were least sure; without associations, the fullest one."""

    def __init__(self) -> None:
        self.chosen: Moment | None = None
        self._worth = -1.0

    def consider(
        self, index: int, image: NDArray[np.uint8], tracks: Tracks, diagnostics: Diagnostics
    ) -> None:
        """Take in frame ``index``: copied if it is the best so far, else forgotten."""
        if index < TRAINED or diagnostics.mask is None or diagnostics.detections is None:
            return
        worth = float(len(tracks))
        if diagnostics.association is not None:
            worth += 1e3 * float(doubt(diagnostics.association.beta).sum())
        if worth > self._worth:
            self._worth = worth
            kept = replace(
                diagnostics,
                mask=diagnostics.mask.copy(),
                detections=diagnostics.detections.copy(),
                background=None if diagnostics.background is None else diagnostics.background.copy(),
            )
            self.chosen = Moment(index, image.copy(), tracks, kept)


def doubt(beta: Floats) -> Floats:
    """Return (N,) how unsure each row of (N, M + 1) probabilities is: its entropy, nats."""
    return np.asarray(-(beta * np.log(np.maximum(beta, 1e-12))).sum(axis=1))


@dataclass(frozen=True, slots=True)
class Cell:
    """A probability: its share for the shade, and its digits, empty where it is nothing."""

    share: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AssociationRow:
    """A track: its id, the colour of it, and the probabilities of a miss and of each detection shown."""

    track: int
    colour: str
    cells: list[Cell]


@dataclass(frozen=True, slots=True, kw_only=True)
class AssociationTable:
    """Rows of tracks, columns of detections.

    Attributes:
        detections: Numbers of those shown, from 1, with what of the picture is inside each.
        rows: The tracks.
        of: How many tracks there were.
    """

    detections: list[tuple[int, Picture]]
    rows: list[AssociationRow]
    of: int


def pictures(moment: Moment, truth_boxes: Floats | None, second: float) -> list[Picture]:
    """Return the picture, what is learnt to lie behind, the foreground and the tracks."""
    shown = moment.diagnostics
    image = moment.image
    found = [Picture(f"Frame at {second:.2f} s", jpeg(enlarged(image, SCALE)), "image/jpeg")]
    if shown.background is not None:
        found.append(Picture("Learnt background", jpeg(enlarged(shown.background, SCALE)), "image/jpeg"))
    if shown.mask is not None and shown.detections is not None:
        dark = (0.35 * image).astype(np.uint8)
        dark[shown.mask] = (0.45 * image[shown.mask] + 0.55 * np.array(rgb(FOREGROUND))).astype(np.uint8)
        drawn = draw_measurements(enlarged(dark, SCALE), SCALE * shown.detections, ())
        found.append(Picture("Foreground, and the detections in it", jpeg(drawn), "image/jpeg"))
    canvas = annotate(
        image,
        tracks=moment.tracks,
        traces=None,
        truth_boxes=truth_boxes,
        caption=f"{second:.2f} s",
        scale=SCALE,
        strip=0,
    )
    found.append(Picture("Tracks", jpeg(canvas), "image/jpeg"))
    return found


def association(moment: Moment) -> tuple[Picture, AssociationTable] | None:
    """Return the picture with numbered detections, and the table of probabilities; None without any."""
    shown = moment.diagnostics
    if shown.association is None or shown.detections is None or not len(shown.detections):
        return None
    rows = _rows(shown.association)
    beta = shown.association.beta[rows]
    columns = np.flatnonzero((beta[:, 1:] >= LEAST_SHOWN).any(axis=0))
    # Along the diagonal as far as it goes: a track's likeliest detection stands where the track does.
    columns = columns[np.argsort(beta[:, 1:][:, columns].argmax(axis=0), kind="stable")]
    table = AssociationTable(
        detections=[
            (int(k) + 1, Picture(f"z{k + 1}", _crop(moment.image, shown.detections[k]), "image/jpeg"))
            for k in columns
        ],
        rows=[
            AssociationRow(
                track=int(track),
                colour=identity(int(track)),
                cells=[_cell(float(values[0])), *(_cell(float(values[k + 1])) for k in columns)],
            )
            for track, values in zip(shown.association.ids[rows], beta, strict=True)
        ],
        of=len(shown.association.ids),
    )
    canvas = draw_measurements(
        enlarged(moment.image, SCALE), SCALE * shown.detections[columns], [f"z{k + 1}" for k in columns]
    )
    predictions = shown.predictions
    if predictions is not None:
        for track, centre, covariance in zip(
            predictions.ids, predictions.centres, predictions.covariances, strict=True
        ):
            if track in shown.association.ids[rows]:
                colour = rgb(identity(int(track)))
                draw_ellipse(canvas, SCALE * centre, SCALE**2 * covariance, colour)
    return Picture("Detections and where tracks expected them", jpeg(canvas), "image/jpeg"), table


def _rows(association: Association) -> NDArray[np.intp]:
    """Pick the tracks that were least sure, in the order of their ids."""
    least_sure = np.argsort(-doubt(association.beta), kind="stable")[:MOST_TRACKS]
    return np.asarray(least_sure[np.argsort(association.ids[least_sure])])


def _cell(value: float) -> Cell:
    text = "" if value < LEAST_SHOWN else "1" if value > 1.0 - LEAST_SHOWN else f"{value:.2f}"[1:]
    return Cell(value, text)


def _crop(image: NDArray[np.uint8], box: Floats) -> bytes:
    """Cut a detection out, 56 px high."""
    height, width = image.shape[:2]
    x0, y0 = np.clip(np.floor(box[:2]).astype(int), 0, [width - 1, height - 1])
    x1, y1 = np.clip(np.ceil(box[2:]).astype(int), [x0 + 1, y0 + 1], [width, height])
    part = image[y0:y1, x0:x1]
    across = int(np.clip(round(56 * part.shape[1] / part.shape[0]), 16, 72))
    return jpeg(np.asarray(cv2.resize(part, (across, 56), interpolation=cv2.INTER_CUBIC), np.uint8))
