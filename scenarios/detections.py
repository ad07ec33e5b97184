"""Detections for trackers that start at them, and the ladder of stages that pins an error to one of them.

A tracker named ``TRACKER@DETECTOR`` is fed by that detector. From rung to rung one stage more is true:

    bytetrack@motorcycle-lane      the detections of one of our trackers
    bytetrack@mask                 the regions of the true foreground: what touches in the image is one
    bytetrack@noisy                true boxes with misses, clutter and jitter
    bytetrack@perfect              the boxes that are scored (if no detector is named)
    association@motorcycle-lane    any detector, and the true association: what is lost is the detector's
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scenarios.score.frames import Selector
from scenarios.score.params import ScoringParams
from scenarios.score.preprocess import Selection, clip
from sim.rng import stream
from tracker.base import DetectionTracker, Tracker
from tracker.boxes import box_area, iou
from tracker.registry import build, make
from tracker.types import Detections, Diagnostics, Frame, Info, Tracks

if TYPE_CHECKING:
    from sim.simulation import Observation

Floats = NDArray[np.float64]
PERFECT = "perfect"
ASSOCIATION = "association"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """One frame as a detector may look at it.

    Attributes:
        frame: What a tracker is given.
        observation: With the truth.
        selection: What of the truth is scored.
    """

    frame: Frame
    observation: Observation
    selection: Selection


class Detector(Protocol):
    """Finds boxes in the frames of one episode, in order."""

    def start(self, info: Info) -> None:
        """Forget everything and get ready for an episode."""

    def detect(self, sight: Sight) -> tuple[Floats, Floats]:
        """Return boxes (M, 4) and their scores (M,)."""


class Perfect:
    """Finds the boxes that are scored, and nothing else."""

    def start(self, info: Info) -> None:
        """Nothing to forget."""

    def detect(self, sight: Sight) -> tuple[Floats, Floats]:
        """Return the scored boxes, in the truth's order, with scores of 1."""
        boxes = sight.selection.boxes[sight.selection.scored]
        return boxes, np.ones(len(boxes))


class Noisy:
    """Finds the boxes that are scored as a detector with errors would.

    The errors of a frame depend on the seed and the tick alone, and are independent from frame to frame.

    Args:
        seed: The episode's.
        misses: Share of the boxes that are not found.
        clutter: False boxes a frame, on average; as large as true ones in the same frame.
        jitter: Standard deviation of each edge, as a share of the box's width or height.
    """

    def __init__(self, seed: int, *, misses: float = 0.1, clutter: float = 0.5, jitter: float = 0.05) -> None:
        self._seed, self._misses, self._clutter, self._jitter = seed, misses, clutter, jitter

    def start(self, info: Info) -> None:
        """Take the size of the frames."""
        self._size = info.width, info.height

    def detect(self, sight: Sight) -> tuple[Floats, Floats]:
        """Return what is left of the true boxes, then the clutter; both draw their scores about .8 and .5."""
        rng = stream(self._seed, "detections", sight.frame.tick)
        true = sight.selection.boxes[sight.selection.scored]
        sizes = np.tile(true[:, 2:] - true[:, :2], 2)
        moved = true + self._jitter * sizes * rng.normal(size=true.shape)
        moved = moved[rng.random(len(true)) >= self._misses]
        false = self._false(true, rng)
        boxes = clip(np.concatenate([moved, false]), *self._size)
        scores = np.concatenate([rng.normal(0.8, 0.1, len(moved)), rng.normal(0.5, 0.15, len(false))])
        whole = (boxes[:, 2] > boxes[:, 0]) & (boxes[:, 3] > boxes[:, 1])
        return boxes[whole], scores.clip(0.05, 1.0)[whole]

    def _false(self, true: Floats, rng: np.random.Generator) -> Floats:
        count = int(rng.poisson(self._clutter))
        if not len(true):
            return np.zeros((0, 4))
        half = (true[:, 2:] - true[:, :2])[rng.integers(0, len(true), count)] / 2
        middle = rng.uniform(0, self._size, (count, 2))
        return np.hstack([middle - half, middle + half])


class Mask:
    """Finds the regions of the true foreground, cleaned and cut out as our lane trackers do it."""

    def start(self, info: Info) -> None:
        """Nothing to forget."""

    def detect(self, sight: Sight) -> tuple[Floats, Floats]:
        """Return the regions' boxes, with scores of 1."""
        from tracker.motorcycle_lane.front_end import look

        selection, seen = sight.selection, sight.observation
        vehicles = seen.truth.ids[selection.scored | selection.ignored]
        boxes = look(seen.image, np.isin(seen.ids, vehicles)).blobs.boxes
        return np.asarray(boxes, np.float64), np.ones(len(boxes))


class Own:
    """Finds what a tracker shows as its detections.

    Args:
        tracker: It is given every frame.
    """

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker

    def start(self, info: Info) -> None:
        """Start the tracker."""
        self._tracker.start(info)

    def detect(self, sight: Sight) -> tuple[Floats, Floats]:
        """Return its detections; of a tracker that shows none, the boxes of its tracks."""
        tracks = self._tracker.step(sight.frame)
        diagnostics = getattr(self._tracker, "diagnostics", None) or Diagnostics()
        boxes = tracks.boxes if diagnostics.detections is None else diagnostics.detections
        boxes = np.array(boxes, np.float64).reshape(-1, 4)
        boxes = boxes[box_area(boxes) > 0]
        return boxes, np.ones(len(boxes))


class TrueAssociation:
    """Gives each detection the id of the object that it is on: the best that association can do.

    It stands on both sides of a `Fed`: as the detector it sees the truth, as the tracker it uses it.
    Detections on nothing, by an IoU of .5, get an id each that is used only once.

    Args:
        detector: Finds the boxes.
    """

    def __init__(self, detector: Detector) -> None:
        self._detector = detector

    def start(self, info: Info) -> None:
        """Forget all ids."""
        self._detector.start(info)
        self._ids: dict[int, int] = {}
        self._last = 0

    def detect(self, sight: Sight) -> tuple[Floats, Floats]:
        """Return what the detector finds, and remember what is there."""
        scored = sight.selection.scored
        self._objects = sight.observation.truth.ids[scored]
        self._true = sight.selection.boxes[scored]
        return self._detector.detect(sight)

    def follow(self, detections: Detections) -> Tracks:
        """Return the detections as tracks."""
        overlap = iou(self._true, detections.boxes)
        overlap[overlap < ScoringParams().match_iou] = 0.0
        rows, columns = linear_sum_assignment(overlap, maximize=True)
        owner = {
            int(c): int(self._objects[r]) for r, c in zip(rows, columns, strict=True) if overlap[r, c] > 0
        }
        return Tracks.confirmed([self._id(owner.get(k)) for k in range(len(detections))], detections.boxes)

    def _id(self, owner: int | None) -> int:
        if owner is None or owner not in self._ids:
            self._last += 1
        return self._last if owner is None else self._ids.setdefault(owner, self._last)


class Fed:
    """A tracker of detections together with its detector: a tracker of frames, but for `look`."""

    def __init__(self, tracker: DetectionTracker, detector: Detector, scene: str, rate: int) -> None:
        """Join the two.

        Args:
            tracker: Is given the detections, and never sees the truth.
            detector: Makes them.
            scene: Its name; it decides what is scored, and so what there is to be detected.
            rate: Frames a second.
        """
        self._tracker, self._detector, self._scene, self._rate = tracker, detector, scene, rate

    def start(self, info: Info) -> None:
        """Start tracker and detector."""
        self._selector = Selector(
            self._scene, rate=self._rate, width=info.width, height=info.height, params=ScoringParams()
        )
        self._detector.start(info)
        self._tracker.start(info)
        self._detections = Detections(boxes=np.zeros((0, 4)), scores=np.zeros(0), tick=0, time=0.0)

    def look(self, frame: Frame, observation: Observation) -> None:
        """Detect what is in a frame; `step` follows it."""
        selection = self._selector.select(observation.truth)
        sight = Sight(frame=frame, observation=observation, selection=selection)
        boxes, scores = self._detector.detect(sight)
        self._detections = Detections(boxes=boxes, scores=scores, tick=frame.tick, time=frame.time)

    @property
    def diagnostics(self) -> Diagnostics:
        """What it was fed with, and what the tracker shows of itself."""
        shown = getattr(self._tracker, "diagnostics", None) or Diagnostics()
        return replace(shown, detections=self._detections.boxes)

    def step(self, frame: Frame) -> Tracks:  # noqa: ARG002
        """Return the tracks of the frame that was looked at last."""
        return self._tracker.follow(self._detections)


def make_fed(name: str, scene: str, *, rate: int, seed: int) -> Tracker:
    """Build a tracker of frames, or one of detections with its detector.

    Args:
        name: A tracker's, or ``TRACKER@DETECTOR`` where the tracker starts at detections. The detector is
            "perfect", "noisy", "mask", or a tracker whose detections are taken.
        scene: Name of the scene.
        rate: Frames a second.
        seed: Of the episode: errors are drawn from its stream ``detections``.

    Raises:
        ValueError: If there is no such tracker or detector, or the tracker starts at frames.
    """
    first, fed, second = name.partition("@")
    if first == ASSOCIATION:
        both = TrueAssociation(_detector(second or PERFECT, seed))
        return Fed(both, both, scene, rate)
    tracker = build(first)
    if not fed and isinstance(tracker, Tracker):
        return tracker
    if not isinstance(tracker, DetectionTracker):
        wanted = "follow(detections)" if fed else "step(frame) or follow(detections)"
        raise ValueError(f"{first!r} gives a {type(tracker).__name__}, without start(info) and {wanted}")
    return Fed(tracker, _detector(second or PERFECT, seed), scene, rate)


def _detector(name: str, seed: int) -> Detector:
    if name == PERFECT:
        return Perfect()
    if name == "noisy":
        return Noisy(seed)
    if name == "mask":
        return Mask()
    return Own(make(name))
