import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.camera import Camera, Pose, centre_from_opencv, image_motion, project

CAMERA = Camera(width=640, height=480, focal=800.0, cx=320.0, cy=240.0)
angle = st.floats(-3.1, 3.1)
small = st.floats(-0.3, 0.3)


@given(yaw=angle, pitch=st.floats(-1.4, 1.4), roll=angle)
def test_a_pose_is_a_rotation(yaw, pitch, roll):
    rotation = Pose.looking([1, 2, 3], yaw=yaw, pitch=pitch, roll=roll).rotation
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.isclose(np.linalg.det(rotation), 1.0)


def test_a_level_camera_looks_along_its_yaw():
    pose = Pose.looking([0, 0, 1.2], yaw=0.0)
    assert np.allclose(pose.to_camera([10, 0, 1.2]), [0, 0, 10])
    assert np.allclose(pose.to_camera([10, -2, 1.2]), [2, 0, 10])  # south of an eastbound camera is right
    assert np.allclose(pose.to_camera([10, 0, 0.2]), [0, 1, 10])  # below is down


def test_signs_of_pitch_and_roll():
    ahead = [10.0, 0.0, 0.0]
    _, v = project(CAMERA, Pose.looking([0, 0, 0], yaw=0.0, pitch=0.1), ahead)[0]
    assert v > CAMERA.cy  # looking up moves the scene down in the image
    right = [10.0, -1.0, 0.0]
    _, v = project(CAMERA, Pose.looking([0, 0, 0], yaw=0.0, roll=0.1), right)[0]
    assert v < CAMERA.cy  # a camera that rolls clockwise sees its right side rise


def test_projection_of_a_known_point_and_behind_the_camera():
    pixels, depth = project(
        CAMERA, Pose.looking([0, 0, 0], yaw=np.pi / 2), [[-1.0, 8.0, 0.5], [0.0, -8.0, 0.0]]
    )
    assert np.allclose(pixels[0], [320 - 100, 240 - 50])
    assert np.allclose(depth, [8.0, -8.0])
    assert np.isnan(pixels[1]).all()


@given(
    x=st.floats(-300, 300),
    depth=st.floats(4, 150),
    speed=st.floats(0, 40),
    t_x=st.floats(-5, 5),
    t_z=st.floats(-20, 20),
    yaw_rate=st.floats(-0.5, 0.5),
    yaw=angle,
)
def test_image_motion_is_the_derivative_of_the_projection(x, depth, speed, t_x, t_z, yaw_rate, yaw):
    """A camera that drives and turns to the right sees a point that moves on its own."""
    right, ahead = x * depth / CAMERA.focal, depth
    eye = np.array([3.0, -2.0, 1.2])

    def axes(angle):
        return np.array([np.sin(angle), -np.cos(angle), 0]), np.array([np.cos(angle), np.sin(angle), 0])

    to_right, forward = axes(yaw)
    point = eye + right * to_right + ahead * forward
    velocity = t_x * to_right + (t_z + speed) * forward  # t_z is against the camera

    def abscissa(t):
        pose = Pose.looking(eye + speed * t * forward, yaw=yaw - yaw_rate * t)
        return project(CAMERA, pose, point + velocity * t)[0][0]

    dt = 1e-5
    measured = (abscissa(dt) - abscissa(-dt)) / (2 * dt)
    assert measured == pytest.approx(image_motion(800.0, x, depth, t_x, t_z, yaw_rate), rel=1e-5, abs=1e-3)


@given(X=st.floats(0.5, 30), Z=st.floats(5, 200), V=st.floats(1, 40), side=st.sampled_from([-1, 1]))
def test_a_static_point_moves_as_in_eq_8(X, Z, V, side):
    f = 800.0
    x = f * side * X / Z
    v = image_motion(f, x, Z, 0.0, -V)
    assert v == pytest.approx(f * side * X * V / Z**2)
    assert v == pytest.approx(V * x**2 / (f * side * X))
    assert np.sign(v) == np.sign(x)  # the background diverges


def test_a_right_turn_moves_the_picture_to_the_left():
    assert image_motion(800.0, 0.0, 30.0, 0.0, 0.0, 0.1) == pytest.approx(-80.0)


def test_image_motion_broadcasts():
    assert image_motion(800.0, np.zeros((3, 1)), np.full(4, 10.0), 1.0, 0.0).shape == (3, 4)


def test_opencv_centres_are_shifted_by_half_a_pixel():
    assert centre_from_opencv(319.5, 239.5) == (320.0, 240.0)
