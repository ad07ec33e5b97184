"""Stabilisation against homographies that are known, on drawn pictures."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tracker.aerial.stabilisation import Stabiliser, inverse, jacobian, transform

WIDTH, HEIGHT = 320, 240
GRID = np.stack(np.meshgrid(np.linspace(10, WIDTH - 10, 12), np.linspace(10, HEIGHT - 10, 9)), -1).reshape(
    -1, 2
)


def ground(seed: int) -> np.ndarray:
    """Draw a picture (H, W) of patches, several times as large as what is seen of it."""
    rng = np.random.default_rng(seed)
    picture = np.full((3 * HEIGHT, 3 * WIDTH), 110, np.uint8)
    for _ in range(900):
        corner = rng.integers(0, [3 * WIDTH, 3 * HEIGHT])
        size = rng.integers(4, 30, 2)
        cv2.rectangle(picture, corner.tolist(), (corner + size).tolist(), int(rng.integers(40, 210)), -1)
    return cv2.GaussianBlur(picture, (3, 3), 0.8)


def view(picture: np.ndarray, to_ground: np.ndarray) -> np.ndarray:
    """Return what is seen (H, W), given where its points lie on the ground, px at centres +0.5."""
    half = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
    place = np.linalg.inv(half) @ to_ground @ half
    return cv2.warpPerspective(picture, place, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)


def poses(kind: str, frames: int) -> list[np.ndarray]:
    """Return the homographies to the ground of a flight."""
    found = []
    for k in range(frames):
        turn, zoom, tilt, shift = 0.0, 1.0, 0.0, np.array([300.0, 220.0])
        if kind == "along":
            shift += [5.0 * k, -1.5 * k]
        elif kind == "turning":
            turn, zoom = 0.004 * k, 1.0 + 0.002 * k
            shift += [1.3 * k, 0.4 * k]
        elif kind == "tilting":
            tilt = 4e-6 * k
            shift += [2.0 * np.sin(0.2 * k), 3.0 * np.cos(0.15 * k)]
        elif kind == "to and fro":
            shift += [180.0 * np.sin(2 * np.pi * k / frames), 0.0]
        c, s = zoom * np.cos(turn), zoom * np.sin(turn)
        found.append(np.array([[c, -s, shift[0]], [s, c, shift[1]], [tilt, 0.5 * tilt, 1.0]]))
    return found


def errors(kind: str, *, frames: int = 40, traffic: int = 0, seed: int = 3) -> np.ndarray:
    """Return (frames, G) px by which points of each picture are laid in the wrong place."""
    picture, stabiliser, found = ground(seed), Stabiliser(), []
    rng = np.random.default_rng(seed)
    begins, speeds = rng.uniform(0, [WIDTH, HEIGHT], (traffic, 2)), rng.uniform(-4, 4, (traffic, 2))
    flight = poses(kind, frames)
    for k, to_ground in enumerate(flight):
        seen = view(picture, to_ground)
        for corner in np.mod(begins + k * speeds, [WIDTH, HEIGHT]).astype(int):
            cv2.rectangle(seen, corner.tolist(), (corner + np.array([24, 11])).tolist(), 240, -1)
            cv2.rectangle(
                seen, (corner + np.array([6, 2])).tolist(), (corner + np.array([12, 8])).tolist(), 30, -1
            )
        to_mosaic = stabiliser.step(seen)
        right = inverse(flight[0]) @ to_ground
        found.append(np.hypot(*(transform(to_mosaic, GRID) - transform(right, GRID)).T))
    return np.array(found)


@pytest.mark.parametrize("kind", ["still", "along", "turning", "tilting", "to and fro"])
def test_points_are_laid_where_they_belong(kind):
    wrong = errors(kind, frames=120 if kind == "to and fro" else 40)
    assert np.median(wrong) < 0.5
    assert np.quantile(wrong, 0.95) < 2.0


def test_vehicles_that_move_do_not_carry_the_ground_along():
    assert np.median(errors("along", traffic=14)) < 0.5


def test_where_the_camera_comes_back_the_first_key_frame_serves_again():
    wrong = errors("to and fro", frames=120)
    assert np.median(wrong[-3:]) < 0.3


def test_a_picture_without_anything_in_it_leaves_the_camera_where_it_was():
    stabiliser = Stabiliser()
    picture = ground(1)
    for to_ground in poses("along", 5):
        last = stabiliser.step(view(picture, to_ground))
    again = stabiliser.step(np.full((HEIGHT, WIDTH), 90, np.uint8))
    assert np.allclose(again, last)


def test_the_jacobian_is_the_derivative():
    rng = np.random.default_rng(0)
    for _ in range(20):
        homography = np.eye(3) + rng.normal(0, [0.2, 0.2, 20], (3, 3)) * [[1], [1], [1e-3]]
        point, step = rng.uniform(0, 300, 2), 1e-4
        near = point + step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        at = transform(homography, near)
        numeric = np.column_stack([at[0] - at[1], at[2] - at[3]]) / (2 * step)
        assert np.allclose(jacobian(homography, point), numeric, rtol=1e-4, atol=1e-6)
        assert np.allclose(jacobian(homography, near), [jacobian(homography, one) for one in near])
        assert np.allclose(transform(inverse(homography), transform(homography, point)), point)
