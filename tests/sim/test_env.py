"""The environments as gymnasium wants them: checked, seeded, steered, ended, and run in other processes."""

from __future__ import annotations

import pickle
import warnings
from dataclasses import replace

import av
import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv
from gymnasium.wrappers import RecordVideo

import sim  # registers the environments
from sim.aerial import photo
from sim.camera import ground_homography
from sim.env import SceneEnv
from sim.render import ground, sky
from sim.render.context import RenderUnavailableError, context
from sim.scenes import make_scene
from sim.simulation import Simulation

AERIAL, IN_CAR, LANE = (f"sim:testtrack/{name}-v0" for name in ("Aerial", "InCar", "MotorcycleLane"))
ALL = sorted(name for name in gymnasium.registry if name.startswith("testtrack/"))
SMALL = ("camera.width=96", "camera.height=64", "seconds=0.3")
SPARSE = {
    "Aerial": (
        "traffic.density=3",
        "traffic.oncoming_density=2",
        "scenery.trees=0.1",
        "scenery.buildings=0.1",
    ),
    "InCar": ("traffic.density=3", "traffic.oncoming_density=2", "scenery.density=0.1"),
    "MotorcycleLane": ("scenery.density=0.1",),
}
COARSE = {
    sky: {"_WIDTH": 256, "_HEIGHT": 32, "_PLANE": 128},
    ground: {"_ALONG": 256, "_ACROSS": 64},
    photo: {"TEXEL": 1.8},
}


@pytest.fixture(scope="module", autouse=True)
def _needs_gl():
    try:
        context()
    except RenderUnavailableError as error:
        pytest.skip(str(error))


@pytest.fixture
def fine():
    """Skies and grounds are painted in full, as other processes do."""


@pytest.fixture(autouse=True)
def _coarse(request, monkeypatch):
    """To paint skies and grounds takes longest of all, and nobody here looks at them closely."""
    if "fine" not in request.fixturenames:
        for module, constants in COARSE.items():
            for name, value in constants.items():
                monkeypatch.setattr(module, name, value)


def small(name: str, *overrides: str, **kwargs) -> SceneEnv:
    sparse = SPARSE[name.rpartition("/")[2].removesuffix("-v0")]
    made = gymnasium.make(name, overrides=(*SMALL, *sparse, *overrides), **kwargs).unwrapped
    assert isinstance(made, SceneEnv)
    return made


def level(axis: np.ndarray) -> np.ndarray:
    """Give an axis of a camera, laid on the ground."""
    flat = np.array([axis[0], axis[1], 0.0])
    return flat / np.linalg.norm(flat)


def rollout(env: gymnasium.Env, seed: int, steps: int = 3) -> list:
    """Take the same actions every time; give frames and truths."""
    actions = np.random.default_rng(7).uniform(-1, 1, (steps, *env.action_space.shape)).astype(np.float32)
    image, info = env.reset(seed=seed)
    found = [(image, info["truth"])]
    for action in actions:
        image, _, _, _, info = env.step(action)
        found.append((image, info["truth"]))
    return found


def same(one: list, other: list) -> bool:
    return all(
        np.array_equal(image, again) and truth == truth_again
        for (image, truth), (again, truth_again) in zip(one, other, strict=True)
    )


def test_the_scenes_are_registered():
    assert sim.__name__ == "sim"
    assert ALL == ["testtrack/Aerial-v0", "testtrack/InCar-v0", "testtrack/MotorcycleLane-v0"]


@pytest.mark.parametrize("name", ALL)
def test_gymnasium_finds_nothing_wrong(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(small(name, render_mode="rgb_array"), skip_render_check=True)


@pytest.mark.parametrize("name", ALL)
def test_an_episode_of_random_actions_is_whole(name):
    env = small(name, render_mode="rgb_array")
    env.action_space.seed(1)
    image, info = env.reset(seed=500)
    ticks, ended = [info["truth"].tick], False
    while not ended:
        assert env.observation_space.contains(image)
        np.testing.assert_array_equal(env.render(), image)
        image, reward, terminated, truncated, info = env.step(env.action_space.sample())
        ticks.append(info["truth"].tick)
        assert (reward, list(info)) == (0.0, ["truth"])
        ended = terminated or truncated
    assert ticks == list(range(env.course.frames))
    assert truncated
    assert not terminated
    assert env.metadata["render_fps"] == env.course.rate == 30


@pytest.mark.usefixtures("fine")
@pytest.mark.parametrize("name", ALL)
def test_a_seed_is_a_rollout_in_one_process_and_in_others(name):
    one, two = small(name), small(name)
    first, other = rollout(one, 500), rollout(two, 501)
    assert not same(first, other)
    assert same(first, rollout(two, 500)), "after use"
    # Frame by frame in turn, in processes of their own.
    vector = AsyncVectorEnv([lambda: small(name)] * 2, context="spawn")
    try:
        shape = one.action_space.shape
        actions = np.random.default_rng(7).uniform(-1, 1, (3, *shape)).astype(np.float32)
        images, infos = vector.reset(seed=[500, 501])
        for k in range(4):
            for row, wanted in enumerate((first, other)):
                np.testing.assert_array_equal(images[row], wanted[k][0])
                assert infos["truth"][row] == wanted[k][1]
            if k < 3:
                images, _, _, _, infos = vector.step(np.stack([actions[k]] * 2))
    finally:
        vector.close()


@pytest.mark.parametrize("name", ALL)
def test_gymnasium_records_a_video_of_an_episode(name, tmp_path):
    env = RecordVideo(small(name, render_mode="rgb_array"), str(tmp_path / "videos"), disable_logger=True)
    env.reset(seed=500)
    while not env.step(np.zeros(env.action_space.shape, np.float32))[3]:
        pass
    env.close()
    (video,) = tmp_path.glob("videos/*.mp4")
    with av.open(str(video)) as container:
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(pictures) == 9
    assert pictures[0].shape == (64, 96, 3)
    assert pictures[0].std() > 5


def test_without_a_seed_the_next_episode_follows_from_the_last_seed():
    env = small(LANE)
    env.reset(seed=500)
    second = env.reset()[1]["truth"]
    env.reset(seed=500)
    assert env.reset()[1]["truth"] == second
    env.reset(seed=501)
    assert env.reset()[1]["truth"] != second


def test_options_hold_for_one_episode():
    env = small(IN_CAR)
    plain = env.reset(seed=500)[1]["truth"]
    curve = env.reset(seed=500, options={"scenario": "in-car-curve", "overrides": ["rate=15"]})[1]["truth"]
    assert (curve.state.rate, curve == plain) == (15, False)
    assert env.reset(seed=500)[1]["truth"] == plain


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"speed": 3}, "'speed' is unknown"),
        ({"scenario": "lane-day"}, "unknown key 'traffic': wanted one of camera, lane, riders"),
        ({"scenario": "in-car-dai"}, "did you mean 'in-car-day'"),
        ({"overrides": ["camera.width=128"]}, "128 x 64, this environment's 96 x 64"),
    ],
)
def test_options_that_cannot_be_met_are_refused(options, message):
    env = small(IN_CAR)
    with pytest.raises(ValueError, match=message):
        env.reset(options=options)


def test_misuse_is_refused():
    env = small(LANE)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(2, np.float32))
    with pytest.raises(gymnasium.error.ResetNeeded):
        _ = env.observation
    env.reset(seed=500)
    for action in (np.zeros(3, np.float32), np.array([np.nan, 0.0], np.float32)):
        with pytest.raises(ValueError, match="2 finite numbers"):
            env.step(action)
    env.close()
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(2, np.float32))


def test_actions_drive_the_camera_car():
    env = small(IN_CAR, "ego.pitch_vibration=0")
    start = env.reset(seed=500)[1]["truth"].state.ego

    def after(acceleration: float, yaw: float):
        env.reset(seed=500)
        for _ in range(4):
            info = env.step(np.array([acceleration, yaw], np.float32))[-1]
        return info["truth"].state.ego

    assert after(0, 0).speed == pytest.approx(start.speed)
    assert after(1, 0).speed > start.speed > after(-1, 0).speed
    assert after(0, 1).yaw_rate > 0 > after(0, -1).yaw_rate
    assert after(9, 0).speed == after(1, 0).speed, "what lies outside is cut off"


def test_a_car_that_leaves_the_road_ends_the_episode():
    env = small(IN_CAR, "seconds=20", "traffic.density=0", "traffic.oncoming_density=0")
    env.reset(seed=500)
    for _ in range(env.course.frames):
        _, _, terminated, truncated, info = env.step(np.array([0.0, 1.0], np.float32))
        if terminated:
            break
    assert terminated
    assert not truncated
    d = env._simulation.scene.road.locate(*info["truth"].state.ego.position[:2])[1]
    assert d < env._simulation.scene.road.paved[0]


def test_actions_pan_and_expose_the_lanes_camera():
    env = small(LANE, "light.passing=0")
    first = env.reset(seed=500)[1]["truth"]

    def after(pan: float, stops: float):
        env.reset(seed=500)
        for _ in range(4):
            image, *_, info = env.step(np.array([pan, stops], np.float32))
        return image.mean(), info["truth"]

    (plain, still), (bright, _), (dark, _) = after(0, 0), after(0, 1), after(0, -1)
    assert dark + 10 < plain < bright - 10
    right = after(1, 0)[1]
    np.testing.assert_array_equal(still.pose.rotation, first.pose.rotation)
    np.testing.assert_array_equal(right.pose.position, first.pose.position)
    turned = np.arccos(np.clip(right.pose.rotation[2] @ first.pose.rotation[2], -1, 1))
    assert turned == pytest.approx(4 * 0.5 / 30 * np.cos(0.43), rel=0.02)
    assert right.pose.rotation[2] @ first.pose.rotation[0] > 0, "to the right"
    np.testing.assert_array_equal(right.state.vehicles.positions, still.state.vehicles.positions)


def test_an_action_of_zero_leaves_the_lanes_frames_as_they_are():
    env = small(LANE)
    params = env.course.params
    scene = make_scene(params, seed=500, rate=30, seconds=1.0)
    with Simulation(scene, params.sensor, seed=500) as simulation:
        plain = [seen.image for seen in simulation.run(3)]
    images = [env.reset(seed=500)[0], *(env.step(np.zeros(2, np.float32))[0] for _ in range(2))]
    for image, wanted in zip(images, plain, strict=True):
        np.testing.assert_array_equal(image, wanted)


def test_actions_fly_turn_and_zoom_the_platform():
    env = small(AERIAL, "platform.jitter=0")
    first = env.reset(seed=500)[1]["truth"]

    def after(*action: float):
        env.reset(seed=500)
        for _ in range(6):
            info = env.step(np.array(action, np.float32))[-1]
        return info["truth"]

    still, right, ahead, turned, nearer = (after(*row) for row in np.eye(5, 4, -1))
    # Wind moves a platform that is left alone, by far less than it flies in a fifth of a second.
    assert 0 < np.abs(still.pose.position - first.pose.position)[:2].max() < 2
    aside, forward = still.pose.rotation[0], -still.pose.rotation[1]
    np.testing.assert_allclose(right.pose.position - still.pose.position, 4 * level(aside), atol=0.02)
    np.testing.assert_allclose(ahead.pose.position - still.pose.position, 4 * level(forward), atol=0.02)
    np.testing.assert_array_equal(right.pose.rotation, still.pose.rotation)
    assert turned.pose.rotation[0] @ still.pose.rotation[0] == pytest.approx(np.cos(0.5 * 6 / 30), abs=1e-3)
    assert turned.pose.rotation[1] @ aside < 0, "the picture's upper edge turns to the right"
    assert nearer.camera.focal / still.camera.focal == pytest.approx(np.exp(0.7 * 6 / 30))
    assert still.camera == first.camera
    for steered in (right, ahead, turned, nearer):
        np.testing.assert_array_equal(steered.state.vehicles.positions, still.state.vehicles.positions)
    velocity = right.state.aloft.velocity - still.state.aloft.velocity
    np.testing.assert_allclose(velocity, 20 * level(aside), atol=0.3)
    np.testing.assert_allclose(
        nearer.vehicles.ground_to_image, ground_homography(nearer.camera, nearer.pose), rtol=1e-12
    )


def test_a_platform_that_is_left_alone_follows_no_convoy():
    def flown(env: SceneEnv) -> float:
        start = env.reset(seed=500)[1]["truth"].pose.position
        for _ in range(env.course.frames - 1):
            info = env.step(np.zeros(4, np.float32))[-1]
        return float(np.hypot(*(info["truth"].pose.position - start)[:2]))

    hovering = small(AERIAL, "seconds=3", "platform.jitter=0")
    assert hovering.course.params.traffic.convoy
    assert flown(hovering) < 15 < 3 * hovering.course.params.traffic.speed


def test_snapshots_compare_by_every_number_and_go_anywhere():
    env = small(IN_CAR)
    one = env.reset(seed=500)[1]["truth"]
    copy = pickle.loads(pickle.dumps(one))
    assert copy == one
    assert copy is not one
    assert one != 3
    depth = one.depth.copy()
    depth[-1, -1] += 1
    assert replace(one, depth=depth) != one
    assert replace(one, state=replace(one.state, tick=1)) != one
    assert replace(one, vehicles=replace(one.vehicles, ids=one.vehicles.ids.astype(np.int64))) != one
