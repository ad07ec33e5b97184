"""Small video files."""

from pathlib import Path

import av
import numpy as np


def write_clip(
    path: Path, frames: int, *, rate: int = 25, size: tuple[int, int] = (64, 48), **options: str
) -> Path:
    """Write frames whose mean brightness rises by 4 each."""
    width, height = size
    texture = np.random.default_rng(0).integers(0, 60, (height, width, 3), dtype=np.uint8)
    with av.open(str(path), "w", options=options) as container:
        stream = container.add_stream("libx264", rate=rate)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        if frames == 0:
            container.start_encoding()
        for k in range(frames):
            frame = av.VideoFrame.from_ndarray(texture + np.uint8(4 * k), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def cut(path: Path, share: float) -> Path:
    """Write the first part of a file beside it."""
    data = path.read_bytes()
    part = path.with_name(f"cut-{share}-{path.name}")
    part.write_bytes(data[: int(share * len(data))])
    return part
