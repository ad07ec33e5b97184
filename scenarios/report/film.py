"""H.264 video for people: yuv420p with the index in front, which every browser plays."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from numpy.typing import NDArray

CRF = 26
"""x264's constant quality: 0 loses nothing, 51 is worst; each 6 more halves the file."""


class Film:
    """Writes frames into an MP4 file as they come; use it as a context manager.

    H.264's halved chroma wants even sides: an odd one is made even by repeating its last row or column.
    """

    def __init__(self, path: Path, *, width: int, height: int, rate: float) -> None:
        """Open the file.

        Args:
            path: Where to write.
            width: Of the frames, px.
            height: Of the frames, px.
            rate: Frames a second.
        """
        self.path = path
        self.frames = 0
        self._pad = ((0, height % 2), (0, width % 2), (0, 0))
        # The index in front lets a browser play before it has read the whole.
        self._container = av.open(str(path), "w", format="mp4", options={"movflags": "faststart"})
        frequency = Fraction(rate).limit_denominator(1001)
        stream = self._container.add_stream("libx264", rate=frequency)
        stream.width, stream.height = width + width % 2, height + height % 2
        stream.pix_fmt = "yuv420p"
        # As many threads on any machine: the coding depends on their number.
        stream.options = {"crf": str(CRF), "preset": "superfast", "threads": "2"}
        self._stream = stream
        self._tick = 1 / frequency
        self._open = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def write(self, image: NDArray[np.uint8]) -> None:
        """Append a frame, (height, width, 3) RGB."""
        if self._pad != ((0, 0), (0, 0), (0, 0)):
            image = np.pad(image, self._pad, mode="edge")
        frame = av.VideoFrame.from_ndarray(image, format="rgb24")
        frame.pts, frame.time_base = self.frames, self._tick
        self._container.mux(self._stream.encode(frame))
        self.frames += 1

    def close(self) -> None:
        """Write what is left and close the file."""
        if not self._open:
            return
        self._open = False
        self._container.mux(self._stream.encode())
        self._container.close()
