"""A tracker on a recording of a real camera, of which no truth is known."""

from __future__ import annotations

import math
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenarios.errors import InputError
from scenarios.loop import TrackerLog
from scenarios.output import write_json
from scenarios.runs import make_tracker, peak_rss_mb
from scenarios.video import Video
from scenarios.workers import Progress
from tracker.types import Frame, Info, Intrinsics, Status

if TYPE_CHECKING:
    from scenarios.report.recorder import Recorder


def follow(
    video: Video,
    method: str,
    *,
    focal: float | None = None,
    directory: Path | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Let a tracker follow a recording and return the document that ``--json`` prints.

    Args:
        video: Opened; it is read to its end, one frame at a time.
        method: Name of the tracker.
        focal: Focal length in pixels of the recording; None where it is not known.
        directory: Where to write tracks, report and the document; None keeps nothing.
        progress: Called after each frame.

    Raises:
        InputError: If the video breaks off or is empty, the tracker unknown, or ``focal`` no length.
    """
    if focal is not None and not (math.isfinite(focal) and focal > 0):
        raise InputError(f"--focal {focal:g}: wanted pixels of the recording, more than 0 and finite")
    tracker = make_tracker(method)
    info = Info(
        width=video.width,
        height=video.height,
        rate=video.rate,
        intrinsics=None
        if focal is None
        else Intrinsics(focal=focal, cx=video.width / 2, cy=video.height / 2),
    )
    log = TrackerLog(tracker)
    tracker.start(info)
    decode_ms = []
    with ExitStack() as stack:
        recorder = stack.enter_context(_recorder(video, method, directory)) if directory else None
        started = time.perf_counter()
        for picture in video.frames():
            decode_ms.append(1e3 * (time.perf_counter() - started))
            image = picture.image.copy() if recorder else picture.image
            tracks, diagnostics = log.step(Frame(image=image, tick=picture.tick, time=picture.time))
            if recorder is not None:
                recorder.frame(picture.image, tracks, diagnostics)
            if progress is not None:
                progress(1)
            started = time.perf_counter()

        confirmed = [frame.ids[frame.status == Status.CONFIRMED] for frame in log.tracks]
        timing = {"decode": float(np.mean(decode_ms)), "track": float(np.mean(log.track_ms))}
        document = {
            "video": video.path.name,
            "method": method,
            "focal": focal,
            "width": video.width,
            "height": video.height,
            "rate": video.rate,
            "frames": len(log.tracks),
            "seconds": len(log.tracks) / video.rate,
            "tracks": len(np.unique(np.concatenate(confirmed))),
            "boxes": sum(map(len, confirmed)),
            "hashes": {"tracks": log.digest.hexdigest()},
            "timing_ms": timing,
            "fps": 1e3 / sum(timing.values()),
            "peak_rss_mb": peak_rss_mb(),
        }
        if directory is not None and recorder is not None:
            from scenarios.export.mot import write_tracks

            write_tracks(directory / "tracks.txt", log.tracks)
            write_json(directory / "summary.json", document)
            recorder.finish(None, document, None, focal=focal)
    return document


def _recorder(video: Video, method: str, directory: Path) -> Recorder:
    from scenarios.report.recorder import Recorder  # plots and video: only where a report is wanted

    title = f"{video.path.name}: {method}"
    return Recorder(directory, width=video.width, height=video.height, rate=video.rate, title=title)
