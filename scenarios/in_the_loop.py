"""A tracker in an environment's loop: it sees every frame, and is rewarded for how well it follows."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from scenarios import bridge
from scenarios.detections import Fed, make_fed
from scenarios.score.clear import clear
from scenarios.score.frames import Selector
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.sequence import Sequence
from sim.env import Action, Image, SceneEnv
from sim.truth.types import FrameTruth
from sim.world import Role, WorldState
from tracker.base import Tracker
from tracker.types import Tracks


class TrackerInTheLoop(gymnasium.Wrapper[Image, Action, Image, Action], RecordConstructorArgs):
    """Runs a tracker on every frame that an environment shows.

    ``info["tracks"]`` holds the tracks. The reward of a frame is the F1 of its confirmed boxes against its
    scored truth (scoring.md 4 to 6), in [0, 1]. Actions aim the camera, and nothing is to be earned by aiming
    it where there is little to do: vehicles of a convoy that are out of the picture count as missed; where
    nothing is to be found and nothing is claimed, which leaves F1 undefined, the reward is 0. It is 0 too in
    frames that are not scored, the training of the lane.

    Args:
        env: One of `sim.env`, wrapped in others or not: the tracker sees what they show.
        tracker: A tracker, or the name of one, or ``module:object``, ``@`` a detector where it starts at
            detections (`scenarios.detections`).
        odometry: Whether the tracker gets the car's noisy odometry.
        boxes: Which boxes of the truth are scored.
        params: Thresholds.

    Raises:
        ValueError: If there is no such tracker.
        TypeError: If the environment is not one of `sim.env`.
    """

    def __init__(
        self,
        env: gymnasium.Env[Image, Action],
        tracker: Tracker | str,
        *,
        odometry: bool = False,
        boxes: Boxes = "amodal",
        params: ScoringParams | None = None,
    ) -> None:
        RecordConstructorArgs.__init__(self, tracker=tracker, odometry=odometry, boxes=boxes, params=params)
        gymnasium.Wrapper.__init__(self, env)
        scene = env.unwrapped
        if not isinstance(scene, SceneEnv):
            raise TypeError(f"{env} is none of testtrack's environments")
        self._scene = scene
        self._given = tracker
        self._odometry, self._boxes, self._params = odometry, boxes, params or ScoringParams()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Image, dict[str, Any]]:
        """Begin an episode; the tracker forgets the last one."""
        image, info = self.env.reset(seed=seed, options=options)
        camera, rate = info["truth"].camera, self._scene.course.rate
        self._tracker = self._built(seed or 0)
        self._tracker.start(bridge.tracker_info(camera, rate))
        self._selector = Selector(
            self._scene.scene,
            rate=rate,
            width=camera.width,
            height=camera.height,
            boxes=self._boxes,
            params=self._params,
        )
        tracks, _ = self._follow(image)
        return image, {**info, "tracks": tracks}

    def step(self, action: Action) -> tuple[Image, float, bool, bool, dict[str, Any]]:
        """Advance one tick, let the tracker follow, and reward it."""
        image, _, terminated, truncated, info = self.env.step(action)
        tracks, reward = self._follow(image)
        return image, reward, terminated, truncated, {**info, "tracks": tracks}

    def _built(self, seed: int) -> Tracker:
        if not isinstance(self._given, str):
            return self._given
        return make_fed(self._given, self._scene.scene, rate=self._scene.course.rate, seed=seed)

    def _follow(self, image: Image) -> tuple[Tracks, float]:
        shown = replace(self._scene.observation, image=image)
        given = bridge.tracker_frame(shown, odometry=self._odometry)
        if isinstance(self._tracker, Fed):
            self._tracker.look(given, shown)
        tracks = deepcopy(self._tracker.step(given))
        frame = self._selector.take(shown.truth, tracks)
        if frame is None:
            return tracks, 0.0
        truth, found, overlap = self._selector.compare(frame)
        hits = clear(
            Sequence.of([truth], [found], [overlap]), threshold=self._params.match_iou
        ).true_positives
        astray = out_of_picture(shown.state, shown.truth, self._params)
        return tracks, 2 * hits / max(1, len(truth) + astray + len(found))


def out_of_picture(state: WorldState, truth: FrameTruth, params: ScoringParams) -> int:
    """Count the vehicles of a convoy of which too little lies in the picture to be scored."""
    convoy = state.vehicles.ids[state.vehicles.roles == Role.CONVOY]
    inside = truth.ids[truth.in_frame >= params.min_visible]
    return int((~np.isin(convoy, inside)).sum())
