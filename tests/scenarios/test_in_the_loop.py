"""Trackers in the environments' loop."""

from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from scenarios.in_the_loop import TrackerInTheLoop
from scenarios.score.frames import Selector
from scenarios.score.params import ScoringParams
from sim.render.context import RenderUnavailableError, context
from sim.world import Role
from tests.scenarios.fakes import SilentTracker
from tracker.types import Frame, Info, Tracks

SMALL = ("camera.width=96", "camera.height=64")
LANE = "sim:testtrack/MotorcycleLane-v0"


@pytest.fixture(scope="module", autouse=True)
def _needs_gl():
    try:
        context()
    except RenderUnavailableError as error:
        pytest.skip(str(error))


def lane(tracker, *overrides: str) -> TrackerInTheLoop:
    return TrackerInTheLoop(
        gymnasium.make(LANE, overrides=(*SMALL, "scenery.density=0.1", *overrides)), tracker
    )


def rewards(env: gymnasium.Env, steps: int, *, seed: int = 500) -> list[float]:
    env.reset(seed=seed)
    still = np.zeros(env.action_space.shape, np.float32)
    return [env.step(still)[1] for _ in range(steps)]


class ShiftedTracker(SilentTracker):
    """Writes into its picture, and keeps what it saw."""

    def start(self, info: Info) -> None:
        super().start(info)
        self.images: list[np.ndarray] = []

    def step(self, frame: Frame) -> Tracks:
        self.images.append(frame.image.copy())
        frame.image[:] = 0
        return Tracks.confirmed([1], [[0, 0, 5, 5]])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Aerial", "InCar", "MotorcycleLane"])
def test_gymnasium_finds_only_that_it_is_a_wrapper(name):
    env = gymnasium.make(f"sim:testtrack/{name}-v0", overrides=(*SMALL, "seconds=0.3"))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(TrackerInTheLoop(env, "association@noisy"), skip_render_check=True)
    said = [str(one.message) for one in caught]
    assert len(said) == 1, said
    assert "different from the unwrapped version" in said[0]


def test_perfect_tracks_earn_one_and_none_earn_nothing():
    overrides = ("seconds=2", "camera.width=360", "camera.height=240")
    true = rewards(lane("association@perfect", *overrides), 35)
    silent = rewards(lane(SilentTracker(), *overrides), 35)
    assert true[:29] == silent[:29] == [0.0] * 29, "in training"
    assert true[29:] == [1.0] * 6
    assert silent[29:] == [0.0] * 6


def from_above(tracker, *overrides: str) -> TrackerInTheLoop:
    bare = ("seconds=2", "traffic.density=0", "traffic.oncoming_density=0", "scenery.trees=0.1")
    env = gymnasium.make("sim:testtrack/Aerial-v0", overrides=(*SMALL, *bare, *overrides))
    return TrackerInTheLoop(env, tracker)


@pytest.mark.parametrize("tracker", [SilentTracker, ShiftedTracker])
def test_looking_where_nobody_drives_earns_nothing(tracker):
    env = from_above(tracker(), "traffic.convoy=0")
    assert rewards(env, 3) == [0.0] * 3
    assert not len(env.unwrapped.observation.truth.ids)


def test_who_of_a_convoy_is_out_of_the_picture_is_missed():
    env = from_above("association@perfect", "camera.focal=220", "platform.jitter=0")
    env.reset(seed=500)
    still, sideward = np.zeros(4, np.float32), np.array([1, 0, 0, 0], np.float32)
    seen = []
    for action in [still] * 3 + [sideward] * 30:
        _, reward, _, _, info = env.step(action)
        vehicles = info["truth"].vehicles
        assert (info["truth"].state.vehicles.roles == Role.CONVOY).sum() == 8
        followed = int((vehicles.visible >= 0.3).sum())
        away = 8 - int((vehicles.in_frame >= 0.3).sum())
        assert reward == pytest.approx(2 * followed / (2 * followed + away))
        seen.append((followed, away))
    assert len(set(seen)) > 1
    assert all(followed and away for followed, away in seen)


def test_the_reward_is_the_f1_of_a_frame():
    env = lane("association@noisy", "seconds=2", "camera.width=360", "camera.height=240")
    env.reset(seed=500)
    selector = Selector("motorcycle-lane", rate=30, width=360, height=240, params=ScoringParams())
    selector.select(env.unwrapped.observation.truth)
    earned = []
    for _ in range(40):
        _, reward, _, _, info = env.step(np.zeros(2, np.float32))
        frame = selector.take(info["truth"].vehicles, info["tracks"])
        if frame is None:
            continue
        # The boxes are true ones moved a little, and clutter: no box is near two of them at once.
        _, found, overlap = selector.compare(frame)
        hits = int((overlap >= 0.5).any(axis=0).sum())
        assert reward == pytest.approx(2 * hits / (len(overlap) + len(found)))
        earned.append(reward)
    assert 0 < min(earned) < max(earned) <= 1


def test_the_tracker_sees_what_the_environment_shows_and_starts_anew():
    tracker = ShiftedTracker()
    env = lane(tracker)
    image, info = env.reset(seed=500)
    shown = [image, *(env.step(np.zeros(2, np.float32))[0] for _ in range(2))]
    assert image.any()
    np.testing.assert_array_equal(tracker.images, shown)
    assert info["tracks"] == Tracks.confirmed([1], [[0, 0, 5, 5]])
    env.reset(seed=500)
    np.testing.assert_array_equal(tracker.images, shown[:1])


def test_only_testtracks_environments_are_taken():
    with pytest.raises(TypeError, match="none of testtrack's"):
        TrackerInTheLoop(gymnasium.make("CartPole-v1"), SilentTracker())
