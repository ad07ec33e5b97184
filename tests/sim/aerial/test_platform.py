"""How the platform flies: it looks where it should, moves as fast as it may, and shakes."""

from __future__ import annotations

import numpy as np
import pytest

from sim.aerial.platform import Platform
from sim.camera import Camera, project
from sim.params import AerialCameraParams, PlatformParams

MOUNT = AerialCameraParams()
CAMERA = Camera(width=640, height=480, focal=MOUNT.focal, cx=320, cy=240, near=1.0, far=2000.0)
TIMES = np.arange(0.0, 20.0, 1 / 30)
AIM = np.array([40.0, -30.0])
STEADY = PlatformParams(roam=0.0, jitter=0.0, climb=0.0, turn=0.0)


def place_of_aim(platform: Platform, times: np.ndarray) -> np.ndarray:
    """Where in the picture the platform's aim lies, (T, 2) px."""
    aim = np.array([[*AIM, 0.0]])
    return np.array([project(CAMERA, platform.pose(float(t), AIM), aim)[0][0] for t in times])


def flight(params: PlatformParams, *, seed: int = 3, across: float = 0.4) -> Platform:
    return Platform(params, MOUNT, across=across, seed=seed)


def test_it_looks_at_its_aim_whatever_its_tilt_and_height():
    for params in (STEADY, STEADY.model_copy(update={"climb": 0.3, "turn": 0.5})):
        places = place_of_aim(flight(params), TIMES[::30])
        assert places == pytest.approx(np.tile([320.0, 240.0], (len(places), 1)), abs=0.5)


def test_the_shake_is_as_strong_as_asked_and_quick():
    shaken = place_of_aim(flight(STEADY.model_copy(update={"jitter": 2.0})), TIMES)
    spread = (shaken - [320.0, 240.0]).std(0)
    assert spread == pytest.approx([2.0, 2.0], rel=0.45)
    # From one frame to the next it moves the picture by less than itself: that can be followed.
    steps = np.hypot(*np.diff(shaken, axis=0).T)
    assert 0.1 < np.median(steps) < 2.0


def test_it_roams_and_climbs_no_farther_than_allowed():
    params = PlatformParams(altitude=200.0, climb=0.1, roam=12.0, jitter=0.0)
    poses = [flight(params).pose(float(t), AIM) for t in TIMES[::5]]
    heights = np.array([pose.position[2] for pose in poses])
    assert heights.min() >= 180.0
    assert heights.max() <= 220.0
    assert np.ptp(heights) > 10.0
    places = place_of_aim(flight(params), TIMES[::5]) - [320.0, 240.0]
    metres = np.hypot(*places.T) * 200.0 / MOUNT.focal
    assert 3.0 < metres.max() < np.hypot(12.0, 12.0) * 1.3


def test_it_swings_to_and_fro_along_the_road():
    platform = flight(PlatformParams(sway=30.0))
    swung = np.array([platform.sway(float(t)) for t in TIMES])
    assert swung.max() == pytest.approx(30.0, abs=0.2)
    assert swung.min() == pytest.approx(-30.0, abs=0.2)
    assert flight(PlatformParams()).sway(3.0) == 0.0


def test_the_road_runs_across_the_picture():
    for seed in range(8):
        platform = flight(STEADY, seed=seed, across=np.pi / 2)
        ends = np.array([[AIM[0] + way, AIM[1], 0.0] for way in (-40.0, 40.0)])
        (x0, y0), (x1, y1) = project(CAMERA, platform.pose(0.0, AIM), ends)[0]
        assert abs(x1 - x0) > 1.5 * abs(y1 - y0)


def test_another_seed_is_another_flight_and_the_same_one_the_same():
    a, b, other = (flight(PlatformParams(), seed=seed).pose(7.3, AIM) for seed in (1, 1, 2))
    assert (a.position == b.position).all()
    assert (a.rotation == b.rotation).all()
    assert not np.allclose(a.position, other.position)
