"""Pinhole camera: pose, projection, and the image motion of a point (paper 1, eqs. 1 and 8, with yaw)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """Intrinsics. Pixel (row i, column j) covers [j, j+1) x [i, i+1): its centre lies at +0.5.

    Attributes:
        width: Pixels.
        height: Pixels.
        focal: Focal length, px.
        cx: Principal point, px from the image's left edge; ``width / 2`` is the middle.
        cy: Principal point, px from the image's upper edge.
        near: Metres: what lies closer along the axis is cut off.
        far: Metres.
    """

    width: int
    height: int
    focal: float
    cx: float
    cy: float
    near: float = 0.5
    far: float = 2000.0


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a camera is and how it is turned.

    Attributes:
        position: (3,) world metres.
        rotation: (3, 3) world to camera; its rows are the camera's right, down and forward axes.
    """

    position: Floats
    rotation: Floats

    @classmethod
    def looking(cls, position: ArrayLike, *, yaw: float, pitch: float = 0.0, roll: float = 0.0) -> Pose:
        """Build a pose from a heading.

        Args:
            position: (3,) world metres.
            yaw: Radians counter-clockwise from east.
            pitch: Radians, positive looks up.
            roll: Radians, positive turns the camera clockwise as seen from behind it.
        """
        cos_yaw, sin_yaw, cos_pitch, sin_pitch = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
        forward = np.array([cos_yaw * cos_pitch, sin_yaw * cos_pitch, sin_pitch])
        level_right = np.array([sin_yaw, -cos_yaw, 0.0])
        level_down = np.cross(forward, level_right)
        right = np.cos(roll) * level_right + np.sin(roll) * level_down
        down = np.cos(roll) * level_down - np.sin(roll) * level_right
        return cls(np.asarray(position, float), np.stack([right, down, forward]))

    def to_camera(self, points: ArrayLike) -> Floats:
        """Turn world points (..., 3) into camera coordinates X right, Y down, Z forward (..., 3)."""
        return (np.asarray(points, float) - self.position) @ self.rotation.T


def project(camera: Camera, pose: Pose, points: ArrayLike) -> tuple[Floats, Floats]:
    """Project world points (paper 1, eq. 1).

    Args:
        camera: The intrinsics.
        pose: The camera's pose.
        points: (..., 3) world metres.

    Returns:
        Pixels (..., 2), not a number behind the camera, and depth along the axis (...), metres.
    """
    local = pose.to_camera(points)
    depth = local[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = camera.focal * local[..., :2] / depth[..., None] + np.array([camera.cx, camera.cy])
    return np.where(depth[..., None] > 0, pixels, np.nan), depth


def ground_homography(camera: Camera, pose: Pose) -> Floats:
    """Return the homography (3, 3) from the ground plane, world x and y in metres, to pixels.

    Its third row gives the depth along the axis in metres, so that its scale is fixed. The product of one
    pose's with the inverse of another's is what takes the first picture of the ground into the second.
    """
    intrinsics = np.array([[camera.focal, 0, camera.cx], [0, camera.focal, camera.cy], [0, 0, 1.0]])
    plane = np.column_stack([pose.rotation[:, :2], -pose.rotation @ pose.position])
    return np.asarray(intrinsics @ plane)


def image_motion(
    focal: float, x: ArrayLike, depth: ArrayLike, t_x: ArrayLike, t_z: ArrayLike, yaw_rate: ArrayLike = 0.0
) -> Floats:
    """Horizontal image speed of a point (paper 1; methods.md 1.2).

    A static point seen from a camera of speed V has ``t_x = 0, t_z = -V``, which is eq. (8).

    Args:
        focal: Focal length, px.
        x: Image abscissa from the principal point, px.
        depth: Z, metres.
        t_x: Sideways velocity of the point against the camera, without its rotation, m/s.
        t_z: Forward velocity likewise, m/s.
        yaw_rate: R_y of the camera, rad/s, positive turns the nose to the right.

    Returns:
        v = (f T_X - x T_Z) / Z - R_y (x^2 + f^2) / f, px/s, broadcast.
    """
    x, depth = np.asarray(x, float), np.asarray(depth, float)
    translation = (focal * np.asarray(t_x, float) - x * np.asarray(t_z, float)) / depth
    return np.asarray(translation - np.asarray(yaw_rate, float) * (x * x + focal * focal) / focal)


def centre_from_opencv(cx: float, cy: float) -> tuple[float, float]:
    """Turn an OpenCV calibration's principal point (pixel centres at integers) into this module's."""
    return cx + 0.5, cy + 0.5
