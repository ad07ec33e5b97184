"""The contract of a tracker."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from tracker.types import Detections, Diagnostics, Frame, Info, Intrinsics, Odometry, Status, Traces, Tracks


@runtime_checkable
class Tracker(Protocol):
    """Takes the frames of one episode in order and returns the tracks of each.

    A tracker without boxes (paper 1's printed rules label traces only) sets ``has_boxes = False`` on its
    class and returns `Tracks.none()`; its box scores are null.
    """

    def start(self, info: Info) -> None:
        """Forget everything and get ready for an episode."""

    def step(self, frame: Frame) -> Tracks:
        """Return the tracks of this frame; what was returned is final."""


@runtime_checkable
class DetectionTracker(Protocol):
    """Takes the detections of one episode's frames in order, and no pictures."""

    def start(self, info: Info) -> None:
        """Forget everything and get ready for an episode."""

    def follow(self, detections: Detections) -> Tracks:
        """Return the tracks of this frame; what was returned is final."""


@runtime_checkable
class Diagnosable(Protocol):
    """A tracker that shows its inner state."""

    @property
    def diagnostics(self) -> Diagnostics:
        """What was found in the last step."""


class ContractError(ValueError):
    """A tracker breaks the contract; the message lists every rule that it breaks, one a line."""


def check_tracker(tracker: object, *, frames: int = 8) -> None:
    """Run the contract of a tracker, of frames or of detections, on small made-up episodes.

    The pictures are noise with moving bright blocks in them: whether a tracker finds these does not
    matter, what it returns does. A tracker that needs more than it is promised (`tracker.types.Info`,
    `tracker.types.Frame`) fails here.

    Args:
        tracker: What a user brings.
        frames: Length of the episodes.

    Raises:
        ContractError: If a rule is broken.
    """
    if not isinstance(tracker, Tracker):
        if not isinstance(tracker, DetectionTracker):
            raise ContractError(
                f"a {type(tracker).__name__} has no start(info) with step(frame) or follow(detections)"
            )
        tracker = _ByBlocks(tracker)
    broken: list[str] = []
    episodes = [
        _episode(frames, width=160, height=120, known=True),
        _episode(frames, width=192, height=96, known=False),
    ]
    order = (episodes[0], episodes[1], episodes[0])
    results = [_run(tracker, info, shown, broken) for info, shown in order]
    if len(results[0]) == len(results[2]) and any(
        first != again for first, again in zip(results[0], results[2], strict=True)
    ):
        broken.append(
            "start: an episode run again after another one gives other tracks; start must reset everything"
        )
    if broken:
        raise ContractError("\n".join(dict.fromkeys(broken)))


def _episode(frames: int, *, width: int, height: int, known: bool) -> tuple[Info, list[Frame]]:
    """Make an episode up: noise, and bright blocks that move."""
    rng = np.random.default_rng(width)
    rate = 25.0
    intrinsics = Intrinsics(focal=1.25 * width, cx=width / 2, cy=height / 2) if known else None
    shown = []
    for tick in range(frames):
        image = rng.integers(60, 110, (height, width, 3), np.uint8)
        for block, (x0, y0, x1, y1) in enumerate(_blocks(tick, height)):
            image[y0:y1, x0:x1] = 230 - 40 * block
        odometry = Odometry(speed=12.0, yaw_rate=0.0) if known and tick % 2 == 0 else None
        shown.append(Frame(image=image, tick=tick, time=tick / rate, odometry=odometry))
    return Info(width=width, height=height, rate=rate, intrinsics=intrinsics), shown


def _blocks(tick: int, height: int) -> NDArray[np.int64]:
    """Give the boxes (3, 4) of the blocks in a picture."""
    block = np.arange(3)
    x, y = np.maximum(20 + 40 * block + 2 * tick * (block - 1), 0), height // 2 + 4 * block
    return np.column_stack([x, y, x + 18, y + 14]).astype(np.int64)


class _ByBlocks:
    """A tracker of detections that is given the blocks: ``step`` stands for its ``follow``."""

    def __init__(self, tracker: DetectionTracker) -> None:
        self._tracker = tracker

    def start(self, info: Info) -> None:
        self._tracker.start(info)

    def step(self, frame: Frame) -> Tracks:
        boxes = _blocks(frame.tick, len(frame.image)).astype(np.float64)
        return self._tracker.follow(
            Detections(boxes=boxes, scores=np.full(3, 0.9), tick=frame.tick, time=frame.time)
        )


def _run(tracker: Tracker, info: Info, frames: list[Frame], broken: list[str]) -> list[Tracks]:
    results: list[Tracks] = []
    snapshots: list[Tracks] = []
    try:
        tracker.start(info)
    except Exception as error:  # whatever a user's tracker raises is the finding
        broken.append(f"start: raises {type(error).__name__}: {error}")
        return results
    for frame in frames:
        before = frame.image.copy()
        try:
            tracks: object = tracker.step(frame)
        except Exception as error:
            broken.append(f"step: raises {type(error).__name__}: {error}")
            return results
        if not np.array_equal(before, frame.image):
            broken.append("step: writes into the frame's image; it belongs to the caller")
            frame.image[:] = before
        if not isinstance(tracks, Tracks):
            broken.append(f"step: returns a {type(tracks).__name__}, wanted tracker.types.Tracks")
            return results
        broken.extend(_faults(tracks))
        if isinstance(tracker, Diagnosable):
            broken.extend(_diagnostic_faults(tracker.diagnostics))
        snapshots.append(deepcopy(tracks))
        results.append(tracks)
    try:
        tracker.step(frames[-1])
    except Exception as error:
        broken.append(f"step: raises {type(error).__name__} on a repeated picture: {error}")
    if any(one != snapshot for one, snapshot in zip(results, snapshots, strict=True)):
        broken.append("step: changes tracks that it returned before; what was returned is final")
    return snapshots


def _faults(tracks: Tracks) -> list[str]:
    """List what is wrong with the tracks of a frame."""
    count = len(np.atleast_1d(np.asarray(tracks.ids)))
    faults = [
        *_array_faults("ids", tracks.ids, (count,), np.int64),
        *_array_faults("boxes", tracks.boxes, (count, 4), np.float64),
        *_array_faults("status", tracks.status, (count,), np.uint8),
    ]
    optional: Sequence[tuple[str, NDArray[np.float64] | None, tuple[int, ...]]] = (
        ("score", tracks.score, (count,)),
        ("state", tracks.state, (count, 4)),
        ("covariance", tracks.covariance, (count, 4, 4)),
    )
    for name, array, shape in optional:
        if array is not None:
            faults += _array_faults(name, array, shape, np.float64)
    if faults:
        return faults
    if (tracks.ids < 1).any():
        faults.append(f"ids: {tracks.ids.min()} is below 1")
    if len(np.unique(tracks.ids)) < count:
        faults.append("ids: one id twice in a frame")
    if not np.isin(tracks.status, [int(status) for status in Status]).all():
        faults.append(f"status: {sorted(set(tracks.status.tolist()))} holds what is no tracker.types.Status")
    if (tracks.boxes[:, 2] <= tracks.boxes[:, 0]).any() or (tracks.boxes[:, 3] <= tracks.boxes[:, 1]).any():
        faults.append("boxes: x1 <= x0 or y1 <= y0; wanted x0, y0, x1, y1")
    if tracks.score is not None and ((tracks.score < 0) | (tracks.score > 1)).any():
        faults.append("score: outside [0, 1]")
    return faults


def _diagnostic_faults(diagnostics: object) -> list[str]:
    """List what is wrong with the inner state that a tracker shows."""
    if not isinstance(diagnostics, Diagnostics):
        return [f"diagnostics: a {type(diagnostics).__name__}, wanted tracker.types.Diagnostics"]
    return [*_association_faults(diagnostics), *_trace_faults(diagnostics.traces)]


def _association_faults(diagnostics: Diagnostics) -> list[str]:
    if diagnostics.association is None:
        return []
    if diagnostics.detections is None:
        return ["association: without detections"]
    ids, beta = diagnostics.association.ids, diagnostics.association.beta
    shape = (len(ids), len(diagnostics.detections) + 1)
    faults = [
        *_array_faults("association.ids", ids, shape[:1], np.int64),
        *_array_faults("association.beta", beta, shape, np.float64),
    ]
    if not faults and not np.allclose(beta.sum(1), 1.0, atol=1e-6):
        faults.append("association.beta: rows do not sum to 1")
    return faults


def _trace_faults(traces: Traces | None) -> list[str]:
    if traces is None:
        return []
    count, points = len(traces.ids), len(traces.points)
    faults = [
        *_array_faults("traces.ids", traces.ids, (count,), np.int64),
        *_array_faults("traces.x", traces.x, (count,), np.float64),
        *_array_faults("traces.v", traces.v, (count,), np.float64),
        *_array_faults("traces.labels", traces.labels, (count,), np.uint8),
        *_array_faults("traces.p_car", traces.p_car, (count,), np.float64),
        *_array_faults("traces.owners", traces.owners, (count,), np.int64),
        *_array_faults("traces.points", traces.points, (points, 2), np.float64),
        *_array_faults("traces.point_traces", traces.point_traces, (points,), np.int64),
    ]
    if not faults and not np.isin(traces.point_traces, traces.ids).all():
        faults.append("traces.point_traces: the id of no trace")
    if not faults and len(np.unique(traces.ids)) < count:
        faults.append("traces.ids: one id twice in a frame")
    return faults


def _array_faults(name: str, array: object, shape: tuple[int, ...], kind: type[np.generic]) -> list[str]:
    if not isinstance(array, np.ndarray):
        return [f"{name}: a {type(array).__name__}, wanted an array"]
    if array.dtype != kind:
        return [f"{name}: {array.dtype}, wanted {np.dtype(kind)}"]
    if array.shape != shape:
        return [f"{name}: shape {array.shape}, wanted {shape}"]
    return [f"{name}: not finite"] if not np.isfinite(array).all() else []
