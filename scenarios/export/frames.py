"""The pictures of an episode: single PNG files, or one video; and depth as 16-bit PNG."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from types import TracebackType
from typing import Literal, Protocol, Self

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios.report.film import Film

Coding = Literal["png", "ffv1", "h264"]
"""PNG and FFV1 lose nothing; H.264 does."""
DEPTH_STEPS = 256
"""Steps of depth a metre, as KITTI has them; 0 says that it is not known: sky, or beyond 255.99 m."""

_SUFFIXES: dict[Coding, str] = {"png": "", "ffv1": ".mkv", "h264": ".mp4"}


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameFiles:
    """Where the pictures of an episode stand in a dataset.

    Attributes:
        folder: Of the single pictures; a video stands in its place, with an ending.
        first: Number of the first picture in its file's name.
        coding: How they are stored.
    """

    folder: PurePosixPath
    first: int
    coding: Coding

    @property
    def place(self) -> PurePosixPath:
        """The folder, or the video."""
        return self.folder.with_name(self.folder.name + _SUFFIXES[self.coding])

    def of(self, frame: int) -> str:
        """Return the path of the file that holds a frame, counted from 0."""
        return str(self.folder / f"{self.first + frame:06d}.png" if self.coding == "png" else self.place)


class FrameWriter(Protocol):
    """Writes pictures, one after another."""

    def write(self, image: NDArray[np.uint8]) -> None:
        """Append a frame, (height, width, 3) RGB."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def open_frames(root: Path, files: FrameFiles, *, width: int, height: int, rate: int) -> FrameWriter:
    """Open what writes the pictures of an episode.

    Args:
        root: Of the dataset.
        files: Where in it.
        width: Of the pictures, px.
        height: Of the pictures, px.
        rate: Frames a second.
    """
    place = root / files.place
    place.parent.mkdir(parents=True, exist_ok=True)
    if files.coding == "png":
        return _Pictures(place, files.first)
    if files.coding == "ffv1":
        return _Ffv1(place, width=width, height=height, rate=rate)
    return Film(place, width=width, height=height, rate=rate)


def write_depth(path: Path, depth: NDArray[np.float32]) -> None:
    """Write depth (H, W), metres, as 16-bit PNG in steps of 1/`DEPTH_STEPS` m, 0 where it is not known."""
    steps = np.rint(np.where(np.isfinite(depth), depth, 0) * DEPTH_STEPS)
    _write_png(path, np.where(steps <= np.iinfo(np.uint16).max, steps, 0).astype(np.uint16))


def _write_png(path: Path, image: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    if not cv2.imwrite(str(path), image):
        raise OSError(f"{path}: cannot be written")


class _Pictures:
    """One PNG file a frame."""

    def __init__(self, folder: Path, first: int) -> None:
        folder.mkdir()
        self._folder, self._next = folder, first

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass

    def write(self, image: NDArray[np.uint8]) -> None:
        _write_png(self._folder / f"{self._next:06d}.png", np.ascontiguousarray(image[..., ::-1]))
        self._next += 1


class _Ffv1:
    """One lossless video, the same bytes each time."""

    def __init__(self, path: Path, *, width: int, height: int, rate: int) -> None:
        # Without "bitexact", Matroska files get random identifiers.
        self._container = av.open(str(path), "w", format="matroska", options={"fflags": "+bitexact"})
        stream = self._container.add_stream("ffv1", rate=rate, options={"level": "3", "threads": "1"})
        stream.width, stream.height, stream.pix_fmt = width, height, "bgr0"
        self._stream = stream

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._container.mux(self._stream.encode())
        self._container.close()

    def write(self, image: NDArray[np.uint8]) -> None:
        self._container.mux(self._stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
