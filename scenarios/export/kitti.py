"""KITTI's tracking layout: pictures, labels, calibration and inertial data.

After the readme of the tracking devkit and the data format of the raw data devkit (Geiger et al., "Vision
meets robotics: the KITTI dataset", IJRR 2013). Frames count from 0. KITTI's pixel centres lie at integers
and its boxes name the last pixel inside: principal points are half a pixel less than ours, right and bottom
a whole one. The inertial unit sits in the camera, and so does the absent laser: their axes are forward, left
and up.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from scenarios.export.episode import Episode, FrameRecord
from scenarios.files import moved_in
from scenarios.score.preprocess import clip
from sim.world import Kind
from tracker.boxes import box_area

Floats = NDArray[np.float64]

SPLIT = "training"
EARTH_RADIUS = 6378137.0
"""Metres, of the devkit's Mercator projection; the world's origin lies at 0 N, 0 E, where its scale is 1."""
SEEN, HALF = 0.95, 0.5
"""Fully visible, or wholly in the frame, counts from the first share on; partly from the second."""
TYPES = {
    Kind.CAR: "Car",
    Kind.VAN: "Van",
    Kind.LORRY: "Truck",
    Kind.BUS: "Misc",
    Kind.MOTORCYCLE: "Cyclist",
}
"""KITTI's nearest types; its readme has no bus and no motorcycle."""
GRAVITY = np.array([0.0, 0.0, 9.80665])
"""What an accelerometer at rest feels, m/s^2."""
TO_CAMERA = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Forward, left, up to right, down, forward."""


class KittiLayout:
    """See the module."""

    first: ClassVar[int] = 0

    def folder(self, name: str) -> PurePosixPath:
        """See `Layout.folder`."""
        return PurePosixPath(SPLIT, "image_02", name)

    def write_episode(self, root: Path, episode: Episode) -> None:
        """See `Layout.write_episode`."""
        labels = (line for k, frame in enumerate(episode.frames) for line in _labels(k, frame, episode))
        texts = {
            "label_02": "".join(labels),
            "calib": _calibration(episode),
            "oxts": "".join(f"{line}\n" for line in _inertial(episode)),
        }
        for folder, text in texts.items():
            (root / SPLIT / folder).mkdir(parents=True)
            (root / SPLIT / folder / f"{episode.name}.txt").write_text(text, "ascii")

    def write_index(self, root: Path, names: Sequence[str], frames: int) -> None:
        """Write the devkit's list of the sequences: name, first frame, and the one after the last."""
        with moved_in(root / SPLIT / f"evaluate_tracking.seqmap.{SPLIT}") as part:
            part.write_text("".join(f"{name} empty {0:06d} {frames:06d}\n" for name in names), "ascii")


def _labels(number: int, frame: FrameRecord, episode: Episode) -> Iterator[str]:
    """Give the lines of one frame: every vehicle of which the frame holds a part."""
    truth, bodies = frame.truth, frame.bodies
    boxes = clip(truth.box_amodal, episode.camera.width, episode.camera.height)
    locations = frame.pose.to_camera(bodies.positions)
    headings = np.stack([np.cos(bodies.yaws), np.sin(bodies.yaws), np.zeros(len(bodies))], axis=1)
    forward = headings @ frame.pose.rotation.T
    turns = np.arctan2(-forward[:, 2], forward[:, 0])
    alphas = _wrapped(turns - np.arctan2(locations[:, 0], locations[:, 2]))
    truncated, occluded = _level(truth.in_frame), _level(truth.visibility_in_frame)
    for k in np.flatnonzero(box_area(boxes) > 0):
        length, width, height = bodies.sizes[k]
        x0, y0, x1, y1 = boxes[k]
        box = (x0, y0, x1 - 1, y1 - 1)
        numbers = (alphas[k], *box, height, width, length, *locations[k], turns[k])
        kind = TYPES[Kind(truth.kinds[k])]
        yield (
            f"{number} {frame.track_ids[k]} {kind} {truncated[k]} {occluded[k]} "
            f"{' '.join(f'{value:.6f}' for value in numbers)}\n"
        )


def _level(shares: Floats) -> NDArray[np.int64]:
    """Turn shares that can be seen into KITTI's 0 (all), 1 (most) and 2 (little)."""
    return np.where(shares >= SEEN, 0, np.where(shares >= HALF, 1, 2))


def _calibration(episode: Episode) -> str:
    """Give the calibration file: only the left colour camera, 2, exists; the others stand where it does."""
    camera = episode.camera
    projection = np.array(
        [
            [camera.focal, 0.0, camera.cx - 0.5, 0.0],
            [0.0, camera.focal, camera.cy - 0.5, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )
    nowhere = np.zeros((3, 1))
    matrices = {f"P{k}:": projection for k in range(4)} | {
        "R_rect": np.eye(3),
        "Tr_velo_cam": np.hstack([TO_CAMERA, nowhere]),
        "Tr_imu_velo": np.hstack([np.eye(3), nowhere]),
    }
    return "".join(f"{name} {' '.join(map(_exact, matrix.ravel()))}\n" for name, matrix in matrices.items())


def _inertial(episode: Episode) -> Iterator[str]:
    """Give a line of 30 values a frame; rates are central differences of the poses."""
    positions = np.array([frame.pose.position for frame in episode.frames])
    axes = np.array(
        [frame.pose.rotation.T @ TO_CAMERA for frame in episode.frames]
    )  # of the unit in the world
    angles = np.unwrap([_roll_pitch_yaw(own) for own in axes], axis=0)
    velocities = _rate(positions, episode.rate)
    turning = _rate(angles, episode.rate)
    accelerations = _rate(velocities, episode.rate) + GRAVITY
    accuracy, status = (0.0, 0.0), (4, 10, 4, 4, 4)  # nothing is uncertain
    for position, own, (roll, pitch, yaw), velocity, turn, acceleration in zip(
        positions, axes, angles, velocities, turning, accelerations, strict=True
    ):
        latitude = np.degrees(2 * np.arctan(np.exp(position[1] / EARTH_RADIUS)) - np.pi / 2)
        longitude = np.degrees(position[0] / EARTH_RADIUS)
        level = np.array([[np.cos(yaw), np.sin(yaw), 0], [-np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        rates = _body_rates(roll, pitch, turn)
        numbers = (
            *(latitude, longitude, position[2], roll, pitch, _wrapped(yaw)),
            *(velocity[1], velocity[0], *(level @ velocity)),
            *(*(own.T @ acceleration), *(level @ acceleration)),
            *(*rates, *(level @ own @ rates)),
            *accuracy,
        )
        yield " ".join([*map(_exact, numbers), *map(str, status)])


def _roll_pitch_yaw(axes: Floats) -> Floats:
    """Give the angles with axes = R_z(yaw) R_y(pitch) R_x(roll): left side up, front down, to the left."""
    return np.array(
        [
            np.arctan2(axes[2, 1], axes[2, 2]),
            np.arcsin(np.clip(-axes[2, 0], -1, 1)),
            np.arctan2(axes[1, 0], axes[0, 0]),
        ]
    )


def _body_rates(roll: float, pitch: float, turn: Floats) -> Floats:
    """Turn rates of roll, pitch and yaw into rates about the unit's own axes, rad/s."""
    rolling, pitching, yawing = turn
    across = np.cos(pitch) * yawing
    return np.array(
        [
            rolling - np.sin(pitch) * yawing,
            np.cos(roll) * pitching + np.sin(roll) * across,
            np.cos(roll) * across - np.sin(roll) * pitching,
        ]
    )


def _rate(values: Floats, rate: int) -> Floats:
    """Differentiate (T, 3) by time; a single frame stands still."""
    return rate * np.gradient(values, axis=0) if len(values) > 1 else np.zeros_like(values)


def _wrapped(angles: Floats) -> Floats:
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)


def _exact(value: float) -> str:
    """Write twelve decimals, and no negative zero."""
    return f"{round(float(value), 12) + 0.0:.12f}"
