"""The in-car tracker: paper 1's idea with its limits mended (registry name ``in-car``).

Traces come from the shared front end. What they are is decided by more than (x, v): the camera's rotation is
estimated and removed, points on and around a trace are followed in both axes, and their motion is weighed
against what a static thing at that row must do (`tracker.in_car.evidence`); the evidence is accumulated over
time. Points that move as one body and fill a vehicle's outline become a vehicle with a box; its traces belong
to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracker.boosting import Trees, learnt
from tracker.in_car.evidence import motion_evidence
from tracker.in_car.features import stiffness, working_picture
from tracker.in_car.front_end import FrontEnd
from tracker.in_car.points import PointStore
from tracker.in_car.traces import TraceSet
from tracker.in_car.vehicles import CORRELATION, Sighting, VehicleStore
from tracker.in_car.yaw import EgoMotion
from tracker.types import Diagnostics, Frame, Info, Label, Status, Traces, Tracks

Floats = NDArray[np.float64]

# Least height of the horizon above a vehicle's contact row, as a share of the picture's width: farther
# ones are too small to be told from anything else.
FARTHEST = 0.0145
# Rows below the horizon, as a share of the width, from which on a point that stands still in the picture is
# no vehicle's.
NEAR_ROWS = 0.11
# A trace so far inside a vehicle's sides, and no farther above it, is the vehicle's, as shares of its width
# and height; one around it may be its edge, or the roof of one that is taller than its box, or background.
INNER, RIM = (0.05, 0.1), (-0.06, 0.75)
# What speaks against a trace in no vehicle's box being a car's, as log odds.
UNBOXED = 1.8
# Bound of a trace's log odds: one that reaches it in a sure vehicle's box stays with that vehicle, in its box
# and so far around it, as shares of its width and of its height. One that first was surely none is nobody's.
FIRM, NOBODY = 5.0, 0
AROUND_X, AROUND_Y = 0.15, 0.2
# Frames that a point must have been followed before its motion says anything.
RIPE = 4


class InCarTracker:
    """Finds and tracks the vehicles that go the ego's way."""

    def __init__(self, trees: Trees | None = None) -> None:
        """Build the tracker; `start` begins an episode.

        Args:
            trees: By which outlines are weighed; those that come with the tracker if None.
        """
        self._trees = trees if trees is not None else learnt("tracker.in_car", "outline_odds")
        self._diagnostics = Diagnostics()

    def start(self, info: Info) -> None:
        """Forget everything and get ready for an episode."""
        self._info = info
        self._front = FrontEnd(info)
        self._points = PointStore(memory=max(5, round(CORRELATION * info.rate)) + 1)
        self._vehicles = VehicleStore(rate=info.rate, trees=self._trees)
        self._ego: EgoMotion | None = None
        self._odds: dict[int, float] = {}
        self._bodies: dict[int, int] = {}
        self._diagnostics = Diagnostics()

    @property
    def diagnostics(self) -> Diagnostics:
        """Traces and profiles of the last frame."""
        return self._diagnostics

    @property
    def sighting(self) -> Sighting | None:
        """The outlines that were weighed in the last frame, if any were."""
        return self._vehicles.sighting

    def step(self, frame: Frame) -> Tracks:
        """Return the tracks of this frame; what was returned is final."""
        picture = working_picture(frame.image)
        scale, grey = picture.scale, picture.grey
        focal = self._front.focal / scale
        ego = self._ego
        if ego is None:
            focus = (self._front.centre_x / scale, self._front.horizon / scale)
            sure = self._info.intrinsics is not None
            ego = self._ego = EgoMotion(focal=focal, focus=focus, sure=sure, rate=self._info.rate)
        points = self._points
        points.follow(grey)
        turned = ego.rotate(points.position, points.flow, self._static_weight())
        turned[points.age < 1] = 0.0
        points.remember(turned)
        moved, frames = points.displacement()
        seconds = frames / self._info.rate
        relative = points.position - ego.focus
        direction = relative / np.maximum(np.hypot(relative[:, 0], relative[:, 1]), 1.0)[:, None]
        trust = np.clip((stiffness(grey, points.position, direction) - 0.05) / 0.15, 0.0, 1.0)
        ripe = points.age >= RIPE
        # So near, no vehicle keeps its place to a fraction of a pixel: the bonnet does, and dirt,
        # and writing in the picture.
        painted = points.frozen() & (relative[:, 1] > NEAR_ROWS * grey.shape[1])
        still = ripe & ~painted & (points.evidence < 2.0) & (points.owner == 0)
        speed = frame.odometry.speed if frame.odometry else None
        ego.learn(points.position, moved, seconds, still * trust, speed)
        relative = points.position - ego.focus
        ratios = trust * motion_evidence(
            relative, moved, seconds, ground=ego.ground, focal=focal, yaw_rate=ego.yaw_rate
        )
        ratios[painted] = np.minimum(ratios[painted], -1.0)
        gain = np.where(ripe, np.clip(ratios, -4.0, 4.0), 0.0) / (self._info.rate * CORRELATION)
        points.evidence = np.clip(points.evidence + gain, -6.0, 6.0)
        horizon = float(ego.focus[1])
        self._front.horizon, self._front.centre_x = horizon * scale, float(ego.focus[0]) * scale
        self._front.look(picture)
        self._vehicles.step(
            picture,
            points,
            moved * (CORRELATION / np.maximum(seconds, 1e-3))[:, None],
            ego,
            FARTHEST * grey.shape[1],
        )
        traces = self._front.trace(float(ego.shift[1]), self._bounds())
        tracks = self._tracks(scale)
        self._label(traces, tracks, scale)
        points.refill(grey, horizon)
        return tracks

    def _bounds(self) -> dict[int, Floats]:
        """Return the boxes (4,), working px, in which traces of sure vehicles stay, by the traces' ids."""
        boxes = {vehicle.id: _stretched(vehicle.box) for vehicle in self._vehicles.vehicles}
        return {trace: boxes[body] for trace, body in self._bodies.items() if body in boxes}

    def _static_weight(self) -> Floats:
        """Return (N,) how far a point's flow tells the camera's rotation."""
        points = self._points
        return np.where((points.evidence > 2.0) | (points.owner > 0), 0.1, 1.0) * (points.age >= 1)

    def _tracks(self, scale: float) -> Tracks:
        found = self._vehicles.vehicles
        boxes = np.array([vehicle.box for vehicle in found]).reshape(-1, 4) * scale
        velocity = np.array([vehicle.velocity for vehicle in found]).reshape(-1, 2) * scale * self._info.rate
        middle = 0.5 * (boxes[:, :2] + boxes[:, 2:])
        odds = np.array([vehicle.odds for vehicle in found], float)
        return Tracks(
            ids=np.array([vehicle.id for vehicle in found], np.int64),
            boxes=boxes,
            status=np.array([vehicle.status for vehicle in found], np.uint8),
            score=1.0 / (1.0 + np.exp(-odds)),
            state=np.concatenate([middle, velocity], 1),
        )

    def _label(self, traces: TraceSet, tracks: Tracks, scale: float) -> None:
        """Decide what each trace is, and fill the diagnostics."""
        owners = _in_boxes(traces, tracks, INNER)
        rims = _in_boxes(traces, tracks, RIM)
        near = self._nearby_evidence(traces, scale)
        cast = _at_feet(traces, tracks)
        labels = np.zeros(len(traces), np.uint8)
        chances = np.full(len(traces), 0.5)
        sure = dict(zip(tracks.ids.tolist(), (tracks.status != Status.TENTATIVE).tolist(), strict=True))
        odds_now: dict[int, float] = {}
        bodies: dict[int, int] = {}
        for index, (trace, owner) in enumerate(zip(traces.ids.tolist(), owners.tolist(), strict=True)):
            odds = self._odds.get(trace, 0.0)
            if owner and sure[owner]:
                gain = 3.0
            elif owner:
                gain = 0.5 * near[index]
            elif cast[index]:
                gain = min(near[index], 0.0) - UNBOXED
            elif rims[index] and sure[rims[index]]:
                gain = near[index]
            else:
                gain = near[index] - UNBOXED
            odds = float(np.clip(odds + gain / (self._info.rate * CORRELATION), -FIRM, FIRM))
            odds_now[trace] = odds
            body = self._bodies.get(trace)
            if odds == -FIRM:
                body = NOBODY
            elif odds == FIRM and owner and sure[owner] and body != NOBODY:
                body = owner
            if body is not None:
                bodies[trace] = body
            if traces.age[index] >= 0.3:
                labels[index] = Label.CAR if odds > 0 else Label.BACKGROUND
            chances[index] = 1.0 / (1.0 + np.exp(-odds))
        self._odds, self._bodies = odds_now, bodies
        self._diagnostics = Diagnostics(
            traces=Traces(
                ids=traces.ids,
                x=traces.x,
                v=traces.v,
                labels=labels,
                p_car=chances,
                owners=owners,
                points=traces.points,
                point_traces=traces.point_traces,
            ),
            profiles=self._front.profiles,
        )

    def _nearby_evidence(self, traces: TraceSet, scale: float) -> Floats:
        """Return (N,) the mean log odds, in [-2, 2], of the points around each trace.

        0 where there are none.
        """
        points = self._points
        ripe = points.age >= RIPE
        position, evidence = points.position[ripe] * scale, np.clip(points.evidence[ripe], -2.0, 2.0)
        reach = np.maximum(0.6 * traces.width, 6.0 * scale)
        close = (np.abs(position[None, :, 0] - traces.x[:, None]) < reach[:, None]) & (
            np.abs(position[None, :, 1] - traces.y[:, None]) < reach[:, None]
        )
        count = close.sum(1)
        return np.asarray((close * evidence[None]).sum(1) / np.maximum(count, 1))


def _stretched(box: Floats) -> Floats:
    """Return a box (4,) with what is around it where its traces may be."""
    aside, beyond = AROUND_X * (box[2] - box[0]), AROUND_Y * (box[3] - box[1])
    stretched: Floats = box + np.array([-aside, -beyond, aside, beyond])
    return stretched


def _at_feet(traces: TraceSet, tracks: Tracks) -> NDArray[np.bool_]:
    """Tell which traces (N,) lie on the road around or before a track's foot.

    There its shadow and its mirror image in a wet road move along with it.
    """
    boxes = tracks.boxes[tracks.status != Status.TENTATIVE]
    wide, tall = boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]
    x, y = traces.x[:, None], traces.y[:, None]
    beside = (x > boxes[:, 0] - wide) & (x < boxes[:, 2] + wide)
    return np.asarray((beside & (y > boxes[:, 3] - 0.1 * tall) & (y < boxes[:, 3] + 1.5 * tall)).any(1))


def _in_boxes(traces: TraceSet, tracks: Tracks, margins: tuple[float, float]) -> NDArray[np.int64]:
    """Return (N,) the id of the track in whose box a trace lies, 0 for none; of several the nearest.

    Args:
        traces: N of them.
        tracks: Of the frame.
        margins: What of a box is left out at each side, as a share of its width, negative adds to it; and
            what is added above, as a share of its height.
    """
    owners = np.zeros(len(traces), np.int64)
    if not len(tracks) or not len(traces):
        return owners
    boxes = tracks.boxes
    wide, tall = boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]
    x, y = traces.x[:, None], traces.y[:, None]
    aside, above = margins
    inside = (x > boxes[:, 0] + aside * wide) & (x < boxes[:, 2] - aside * wide)
    inside &= (y > boxes[:, 1] - above * tall) & (y < boxes[:, 3] + 0.08 * tall)
    # A cluster much wider than the vehicle is something behind it.
    inside &= traces.width[:, None] < 1.3 * wide
    away = np.where(inside, np.abs(x - 0.5 * (boxes[:, 0] + boxes[:, 2])) / wide, np.inf)
    nearest = away.argmin(1)
    found = np.isfinite(away[np.arange(len(traces)), nearest])
    owners[found] = tracks.ids[nearest[found]]
    return owners
