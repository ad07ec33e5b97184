"""MOTChallenge text: one line a box, ``frame, id, left, top, width, height, confidence, -1, -1, -1``.

Frames count from 1. Left and top are x0 and y0 as they are, unshifted, in truth and tracks alike
(scoring.md 3). The truth of a dataset, ``gt.txt``, has amodal boxes clipped to the frame, and its lines end
with ``mark, class, visibility``: marked 1 where so much of the vehicle can be seen that it is to be found,
else 0. The class is always 1, the one that the benchmark and TrackEval evaluate.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import ClassVar

import numpy as np

from scenarios.export.episode import Episode, FrameRecord
from scenarios.files import moved_in
from scenarios.score.params import ScoringParams
from scenarios.score.preprocess import clip
from tracker.boxes import box_area
from tracker.types import Status, Tracks

SPLIT = "testtrack-train"
"""Folder of the sequences, as TrackEval names it: benchmark and split."""
MIN_VISIBLE = ScoringParams().min_visible


class MotLayout:
    """Sequences as MOTChallenge lays them out."""

    first: ClassVar[int] = 1

    def folder(self, name: str) -> PurePosixPath:
        """See `Layout.folder`."""
        return PurePosixPath(SPLIT, name, "img1")

    def write_episode(self, root: Path, episode: Episode) -> None:
        """See `Layout.write_episode`."""
        folder = root / SPLIT / episode.name
        (folder / "gt").mkdir(parents=True)
        lines = (line for k, frame in enumerate(episode.frames, start=1) for line in _gt(k, frame, episode))
        (folder / "gt" / "gt.txt").write_text("".join(lines), "ascii")
        place = episode.images.place
        info = {
            "name": episode.name,
            "imDir": place.name,
            "frameRate": episode.rate,
            "seqLength": len(episode.frames),
            "imWidth": episode.camera.width,
            "imHeight": episode.camera.height,
            "imExt": place.suffix or ".png",
        }
        text = "".join(f"{key}={value}\n" for key, value in info.items())
        (folder / "seqinfo.ini").write_text(f"[Sequence]\n{text}", "ascii")

    def write_index(self, root: Path, names: Sequence[str], frames: int) -> None:  # noqa: ARG002
        """Write TrackEval's list of the sequences."""
        (root / "seqmaps").mkdir(exist_ok=True)
        with moved_in(root / "seqmaps" / f"{SPLIT}.txt") as part:
            part.write_text("".join(f"{line}\n" for line in ("name", *names)), "ascii")


def _gt(number: int, frame: FrameRecord, episode: Episode) -> Iterator[str]:
    truth = frame.truth
    boxes = clip(truth.box_amodal, episode.camera.width, episode.camera.height)
    for k in np.flatnonzero(box_area(boxes) > 0):
        x0, y0, x1, y1 = boxes[k]
        mark = int(truth.visible[k] >= MIN_VISIBLE)
        numbers = ",".join(f"{value:.4f}" for value in (x0, y0, x1 - x0, y1 - y0))
        yield f"{number},{frame.track_ids[k]},{numbers},{mark},1,{truth.visible[k]:.4f}\n"


def write_tracks(path: Path | str, frames: Iterable[Tracks]) -> None:
    """Write the confirmed tracks of an episode; the file is moved in when it is whole.

    Args:
        path: The text file.
        frames: Of the episode, in order, from the first.

    Raises:
        OSError: If it cannot be written.
    """
    with moved_in(Path(path)) as part, part.open("w", encoding="ascii", newline="\n") as file:
        for number, tracks in enumerate(frames, start=1):
            for k in np.flatnonzero(tracks.status == Status.CONFIRMED):
                x0, y0, x1, y1 = tracks.boxes[k]
                score = 1.0 if tracks.score is None else tracks.score[k]
                numbers = ",".join(f"{value:.4f}" for value in (x0, y0, x1 - x0, y1 - y0, score))
                file.write(f"{number},{tracks.ids[k]},{numbers},-1,-1,-1\n")


def read_tracks(path: Path | str, *, frames: int | None = None) -> tuple[Tracks, ...]:
    """Read a MOTChallenge file; truth and tracks look alike.

    Args:
        path: The text file. Lines may stand in any order.
        frames: Length of the episode; up to the last frame with a box if it is not given.

    Returns:
        The confirmed tracks of each frame. What follows the seventh column is left out.

    Raises:
        ValueError: If the file cannot be read or a line is no box, with its number.
    """
    try:
        lines = Path(path).read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} cannot be read as MOTChallenge text: {error}") from error
    rows: dict[int, list[tuple[int, list[float], float]]] = {}
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        frame, identity, box, confidence = _parse(line, f"{path}, line {number}")
        if frames is not None and frame > frames:
            raise ValueError(f"{path}, line {number}: frame {frame} of an episode of {frames}")
        if any(identity == other for other, _, _ in rows.get(frame, ())):
            raise ValueError(f"{path}, line {number}: id {identity} stands twice in frame {frame}")
        rows.setdefault(frame, []).append((identity, box, confidence))
    length = max(rows, default=0) if frames is None else frames
    return tuple(_tracks(rows.get(frame, ())) for frame in range(1, length + 1))


def _parse(line: str, where: str) -> tuple[int, int, list[float], float]:
    try:
        values = [float(column) for column in line.split(",")]
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error
    if len(values) < 6 or not all(map(math.isfinite, values)):
        raise ValueError(f"{where}: wanted frame, id, left, top, width, height, ... as finite numbers")
    frame, identity, left, top, width, height = values[:6]
    if frame < 1 or frame % 1 or identity % 1:
        raise ValueError(f"{where}: frames are whole numbers from 1, ids whole numbers")
    if width < 0 or height < 0:
        raise ValueError(f"{where}: a box of {width:g} by {height:g} px")
    confidence = values[6] if len(values) > 6 else 1.0
    return int(frame), int(identity), [left, top, left + width, top + height], confidence


def _tracks(rows: Sequence[tuple[int, list[float], float]]) -> Tracks:
    return Tracks(
        ids=np.array([identity for identity, _, _ in rows], np.int64),
        boxes=np.array([box for _, box, _ in rows], float).reshape(-1, 4),
        status=np.full(len(rows), Status.CONFIRMED, np.uint8),
        score=np.array([confidence for _, _, confidence in rows], float),
    )
