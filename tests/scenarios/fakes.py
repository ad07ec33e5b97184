"""Small stand-ins for the simulation and for trackers."""

from collections.abc import Iterator

import numpy as np

from sim.camera import Camera, Pose
from sim.simulation import Observation, Odometer
from sim.truth.types import FrameTruth
from sim.world import FIRST_VEHICLE_ID, Bodies, Ego, Kind, Role, WorldState
from tracker.types import Diagnostics, Frame, Info, Label, Status, Traces, Tracks

CAMERA = Camera(width=64, height=48, focal=80.0, cx=32.0, cy=24.0)
CAR = FIRST_VEHICLE_ID + 3


def truth_of(ids, boxes, distances, *, tick=0) -> FrameTruth:
    n = len(ids)
    boxes = np.asarray(boxes, float).reshape(n, 4)
    pixels = np.full(n, 100, np.int64)
    return FrameTruth(
        tick=tick,
        ids=np.asarray(ids, np.uint32),
        kinds=np.full(n, Kind.CAR, np.uint8),
        roles=np.full(n, Role.SAME_WAY, np.uint8),
        visible_px=pixels,
        amodal_px=pixels,
        amodal_px_full=pixels,
        box_visible=boxes,
        box_amodal=boxes,
        occluder_ids=np.zeros(n, np.uint32),
        distances=np.asarray(distances, float),
        positions=np.tile([0.0, 0.0, 10.0], (n, 1)),
        velocities=np.zeros((n, 3)),
    )


def observations(frames: int, *, seed: int = 0, car: int = CAR, noise: float = 3.0) -> Iterator[Observation]:
    """Yield frames in which one car moves to the right by a pixel each."""
    rng = np.random.default_rng(seed)
    for tick in range(frames):
        ids = np.zeros((CAMERA.height, CAMERA.width), np.uint32)
        ids[24:] = 1
        x0 = 10 + tick % 30
        ids[20:32, x0 : x0 + 16] = car
        image = np.where(ids == car, 200, 90)[..., None] + noise * rng.standard_normal((*ids.shape, 3))
        ego = Ego(
            position=np.array([float(tick), 0.0, 0.0]),
            yaw=0.0,
            speed=20.0,
            yaw_rate=0.0,
            pitch=0.0,
            heave=0.0,
        )
        yield Observation(
            tick=tick,
            time=tick / 30,
            image=image.clip(0, 255).astype(np.uint8),
            ids=ids,
            depth=np.full(ids.shape, 10.0, np.float32),
            state=WorldState(tick=tick, rate=30, vehicles=Bodies.empty(), ego=ego),
            pose=Pose(np.zeros(3), np.eye(3)),
            odometer=Odometer(speed=20.5, yaw_rate=0.01),
            truth=truth_of([car], [[x0, 20, x0 + 16, 32]], [10.0], tick=tick),
            timing_ms={"world": 1.0, "render": 2.0, "sensor": 3.0, "truth": 4.0},
        )


class BrightTracker:
    """Boxes what is bright, with a trace in its middle; writes into one buffer and into the image."""

    def start(self, info: Info) -> None:
        self.info = info
        self.frames: list[Frame] = []
        self._box = np.zeros((1, 4))
        self.diagnostics = Diagnostics()

    def step(self, frame: Frame) -> Tracks:
        self.frames.append(frame)
        rows, columns = np.nonzero(frame.image.mean(axis=2) > 150)
        frame.image[:] = 0
        self._box[0] = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
        x, y = self._box[0, [0, 2]].mean(), self._box[0, [1, 3]].mean()
        self.diagnostics = Diagnostics(
            traces=Traces(
                ids=np.array([1, 2]),
                x=np.array([x, 2.0]),
                v=np.zeros(2),
                labels=np.array([Label.CAR, Label.BACKGROUND], np.uint8),
                p_car=np.array([0.9, 0.1]),
                owners=np.array([1, 0]),
                points=np.array([[x, y], [x, y - 4], [2.0, 40.0]]),
                point_traces=np.array([1, 1, 2]),
            )
        )
        return Tracks(ids=np.array([1]), boxes=self._box, status=np.array([Status.CONFIRMED], np.uint8))


class SilentTracker:
    """Finds nothing and shows nothing."""

    has_boxes = False

    def start(self, info: Info) -> None:
        self.info = info

    def step(self, frame: Frame) -> Tracks:  # noqa: ARG002
        return Tracks.none()
