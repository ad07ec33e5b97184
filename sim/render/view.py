"""The camera as OpenGL wants it."""

from __future__ import annotations

from typing import Any

import numpy as np

from sim.camera import Camera, Pose


def view_matrices(camera: Camera, pose: Pose) -> dict[str, Any]:
    """Return a view's uniforms: ``u_clip``, from camera-relative metres to clip space, and ``u_forward``.

    Image rows run downward and so do the target's: row 0 is the first that is read back, and nothing is
    flipped.
    """
    near, far = camera.near, camera.far
    projection = np.array(
        [
            [2 * camera.focal / camera.width, 0, 2 * camera.cx / camera.width - 1, 0],
            [0, 2 * camera.focal / camera.height, 2 * camera.cy / camera.height - 1, 0],
            [0, 0, (far + near) / (far - near), -2 * far * near / (far - near)],
            [0, 0, 1, 0],
        ]
    )
    turned = np.eye(4)
    turned[:3, :3] = pose.rotation
    clip = projection @ turned
    return {"u_clip": clip.T.astype("<f4").tobytes(), "u_forward": tuple(pose.rotation[2])}


def look_matrix(camera: Camera, pose: Pose) -> bytes:
    """Return a view's uniform ``u_look``.

    Its columns are what a unit of clip space's x, one of its y, and its middle add to a pixel's direction in
    the world.
    """
    right, down, ahead = pose.rotation
    width, height = camera.width, camera.height
    middle = (
        ahead
        + right * ((0.5 * width - camera.cx) / camera.focal)
        + down * ((0.5 * height - camera.cy) / camera.focal)
    )
    look = np.stack([right * (0.5 * width / camera.focal), down * (0.5 * height / camera.focal), middle])
    return look.astype("<f4").tobytes()
