"""Recordings of real cameras, read frame by frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError

LOST_SHARE = 0.02
"""A file that holds less of what it announces than all but this share counts as truncated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoFrame:
    """A picture: (H, W, 3) uint8 RGB, its number from 0, and seconds since the first."""

    image: NDArray[np.uint8]
    tick: int
    time: float


class Video:
    """A video file, decoded as it is read; use it as a context manager.

    Attributes:
        path: The file.
        width: Pixels.
        height: Pixels.
        rate: Frames a second, on average.
        announced: How many coded frames the file says it has; 0 where it does not say.
    """

    def __init__(self, path: Path) -> None:
        """Open a file.

        Raises:
            InputError: If it is missing or no video.
        """
        self.path = path
        if not path.is_file():
            raise InputError(f"{path}: {'is no file' if path.exists() else 'no such file'}; wanted a video")
        try:
            self._container = av.open(str(path))
        except (av.FFmpegError, OSError) as error:
            raise InputError(f"{path}: cannot be read as a video ({_reason(error)}); is it whole?") from error
        try:
            if not self._container.streams.video:
                raise InputError(f"{path}: holds no video stream")
            self._stream = self._container.streams.video[0]
            self._stream.thread_type = "AUTO"
            rate = self._stream.average_rate or self._stream.guessed_rate
            self.width, self.height = self._stream.width, self._stream.height
            self.announced = self._stream.frames
            self._packets, self._end = 0, 0.0
            if not rate or not self.width or not self.height:
                raise InputError(f"{path}: its video stream has no frames")
            self.rate = float(rate)
        except BaseException:
            self._container.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._container.close()

    def frames(self) -> Iterator[VideoFrame]:
        """Yield the frames in order, once.

        Raises:
            InputError: If there is none, the file breaks off, or the picture changes its size.
        """
        tick, first, last = 0, None, -1.0
        try:
            for frame in self._decoded():
                if (frame.width, frame.height) != (self.width, self.height):
                    raise InputError(
                        f"{self.path}: frame {tick} is {frame.width} x {frame.height}, "
                        f"wanted {self.width} x {self.height} as before"
                    )
                if first is None:
                    first = frame.time
                time = tick / self.rate if frame.time is None or first is None else frame.time - first
                # Broken time stamps do not make time stand still or run backwards.
                last = time if time > last else last + 1 / self.rate
                image = np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)
                yield VideoFrame(image=image, tick=tick, time=last)
                tick += 1
        except av.FFmpegError as error:
            raise InputError(f"{self.path}: breaks off after {tick} frames ({_reason(error)})") from error
        if tick == 0:
            raise InputError(f"{self.path}: its video stream has no frames")
        if self._missing():
            raise InputError(f"{self.path}: breaks off after {tick} frames, at {last:.2f} s")

    def _decoded(self) -> Iterator[av.VideoFrame]:
        for packet in self._container.demux(self._stream):
            self._packets += packet.size > 0
            for frame in packet.decode():
                self._end = max(self._end, frame.time or 0.0)
                yield frame

    def _missing(self) -> bool:
        """Say whether less came than the file announces: coded frames (not all are shown), or seconds."""
        few = self._packets < (1 - LOST_SHARE) * self.announced
        seconds = 0.0
        if self._stream.duration and self._stream.time_base:
            seconds = float(((self._stream.start_time or 0) + self._stream.duration) * self._stream.time_base)
        elif self._container.duration and len(self._container.streams) == 1:
            seconds = self._container.duration / av.time_base
        return few or self._end + 1 / self.rate < (1 - LOST_SHARE) * seconds - 1 / self.rate


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error).lower()
