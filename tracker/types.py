"""What goes into a tracker and what comes out: arrays, their shapes stated once."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Status(IntEnum):
    """How sure a tracker is of a track in this frame. Only confirmed tracks are scored."""

    TENTATIVE = 0
    CONFIRMED = 1
    COASTING = 2


class Label(IntEnum):
    """What a trace was found to be."""

    UNDECIDED = 0
    BACKGROUND = 1
    CAR = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Intrinsics:
    """Focal length and principal point in pixels; pixel centres lie at +0.5."""

    focal: float
    cx: float
    cy: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Info:
    """All that a tracker is told before the first frame.

    Attributes:
        width: Pixels.
        height: Pixels.
        rate: Frames a second.
        intrinsics: Of the camera, or None where they are not known.
    """

    width: int
    height: int
    rate: float
    intrinsics: Intrinsics | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Odometry:
    """What the camera car measured of its own motion, with noise: m/s, and rad/s, positive to the right."""

    speed: float
    yaw_rate: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """One picture.

    Attributes:
        image: (H, W, 3) uint8, RGB.
        tick: Number of the frame, from 0.
        time: Seconds.
        odometry: Where the recording has it.
    """

    image: NDArray[np.uint8]
    tick: int
    time: float
    odometry: Odometry | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Detections:
    """The M detections in one frame: what a tracker without eyes of its own starts at.

    Attributes:
        boxes: (M, 4) float64 x0, y0, x1, y1, px, half-open.
        scores: (M,) float64 in [0, 1].
        tick: Number of the frame, from 0.
        time: Seconds.
    """

    boxes: NDArray[np.float64]
    scores: NDArray[np.float64]
    tick: int
    time: float

    def __len__(self) -> int:
        return len(self.boxes)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tracks:
    """The N tracks of one frame. Equal ones agree in every number.

    Attributes:
        ids: (N,) int64, >= 1, unique in the frame, never used again for another object.
        boxes: (N, 4) float64 x0, y0, x1, y1, px, half-open.
        status: (N,) uint8, a `Status`.
        score: (N,) float64 in [0, 1], or None.
        state: (N, 4) float64 cx, cy, vx, vy in px and px/s, or None.
        covariance: (N, 4, 4) float64 of ``state``, or None.
    """

    ids: NDArray[np.int64]
    boxes: NDArray[np.float64]
    status: NDArray[np.uint8]
    score: NDArray[np.float64] | None = None
    state: NDArray[np.float64] | None = None
    covariance: NDArray[np.float64] | None = None

    __hash__ = None  # type: ignore[assignment]

    def __len__(self) -> int:
        return len(self.ids)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Tracks):
            return NotImplemented
        pairs = ((getattr(self, f.name), getattr(other, f.name)) for f in fields(self))
        return all((a is None) == (b is None) and np.array_equal(a, b) for a, b in pairs)

    @classmethod
    def confirmed(cls, ids: ArrayLike, boxes: ArrayLike) -> Tracks:
        """Return confirmed tracks of ids (N,) and boxes (N, 4)."""
        numbers = np.asarray(ids, np.int64).reshape(-1)
        return cls(
            ids=numbers,
            boxes=np.asarray(boxes, np.float64).reshape(-1, 4),
            status=np.full(len(numbers), Status.CONFIRMED, np.uint8),
        )

    @classmethod
    def none(cls) -> Tracks:
        """Return no tracks."""
        return cls(ids=np.zeros(0, np.int64), boxes=np.zeros((0, 4)), status=np.zeros(0, np.uint8))


@dataclass(frozen=True, slots=True, kw_only=True)
class Traces:
    """The N feature traces of one frame (paper 1), and the image points that carry them.

    Attributes:
        ids: (N,) int64, >= 1, never used again.
        x: (N,) float64, px from the image's left edge.
        v: (N,) float64, px/s.
        labels: (N,) uint8, a `Label`.
        p_car: (N,) float64 in [0, 1].
        owners: (N,) int64, id of the track that the trace belongs to, 0 for none.
        points: (K, 2) float64 x, y, px: the support points of all traces in this frame.
        point_traces: (K,) int64, the id of the trace that each point supports.
    """

    ids: NDArray[np.int64]
    x: NDArray[np.float64]
    v: NDArray[np.float64]
    labels: NDArray[np.uint8]
    p_car: NDArray[np.float64]
    owners: NDArray[np.int64]
    points: NDArray[np.float64]
    point_traces: NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Predictions:
    """Where a tracker expects what it does not see: (N,) ids, (N, 2) centres, (N, 2, 2) covariances, px."""

    ids: NDArray[np.int64]
    centres: NDArray[np.float64]
    covariances: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Association:
    """How probably each of N tracks is where each of M detections is.

    Attributes:
        ids: (N,) int64, of the tracks that the frame began with.
        beta: (N, M + 1) float64: that it was missed, then that each detection is its own; rows sum to 1.
    """

    ids: NDArray[np.int64]
    beta: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnostics:
    """What a tracker may show of its inner state after a step; every field is optional.

    Attributes:
        traces: Paper 1's traces.
        detections: (M, 4) float64 boxes.
        mask: (H, W) bool, foreground.
        background: (H, W, 3) uint8, RGB, what is learnt to lie behind the foreground.
        association: Of the tracks that the frame began with and ``detections``.
        predictions: Of hidden objects.
        homography: (3, 3) from this frame to the mosaic.
        flags: (F,) int64, ids of tracks flagged as going the wrong way.
        innovations: (K,) float64, of K tracks that were updated: how far the centre of its detection lay from
            where the track expected it, squared, in units of the expected covariance.
        profiles: (W,) float32 arrays by name, such as "segments", "intensity", "peaks".
    """

    traces: Traces | None = None
    detections: NDArray[np.float64] | None = None
    mask: NDArray[np.bool_] | None = None
    background: NDArray[np.uint8] | None = None
    association: Association | None = None
    predictions: Predictions | None = None
    homography: NDArray[np.float64] | None = None
    flags: NDArray[np.int64] | None = None
    innovations: NDArray[np.float64] | None = None
    profiles: dict[str, NDArray[np.float32]] = field(default_factory=dict)
