"""gymnasium environments over the scenes: frames out, truth in ``info``, actions for what holds the camera.

    gymnasium.make("sim:testtrack/InCar-v0", scenario="in-car-curve", overrides=["traffic.density=30"])

A reward is not the world's to give: it is 0.0. Scenarios come by name from whatever package offers them
(entry point group `SCENARIOS`), so that the simulator need not know who reads them.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import entry_points
from typing import Any, ClassVar, Protocol

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from sim.params import AerialParams, InCarParams, MotorcycleLaneParams
from sim.scenes import make_scene
from sim.simulation import Observation, Simulation
from sim.truth.snapshot import Snapshot

Image = NDArray[np.uint8]
Action = NDArray[np.float32]
AnyParams = AerialParams | InCarParams | MotorcycleLaneParams

SCENARIOS = "testtrack.scenarios"
"""Entry point group of functions ``load(name, overrides) -> Course``; the first one found is asked."""
_OPTIONS = ("scenario", "overrides")


class Course(Protocol):
    """What an environment needs of a scenario."""

    @property
    def params(self) -> AnyParams:
        """Of its scene."""

    @property
    def rate(self) -> int:
        """Frames a second."""

    @property
    def seconds(self) -> float:
        """Length of an episode."""

    @property
    def frames(self) -> int:
        """Frames in an episode."""


class SceneEnv(gymnasium.Env[Image, Action]):
    """One scene as an environment.

    Observations are frames, (H, W, 3) uint8 RGB. ``info["truth"]`` is a `sim.truth.snapshot.Snapshot`. An
    episode is truncated at the scenario's last frame, and terminated when the scene is over by itself
    (`sim.simulation.Scene.over`): after a collision, in a car also off the paved road; the lane never is.

    ``reset(seed=N)`` gives the world that ``testtrack run --seed N`` gives, but for who drives; without a
    seed the next one is drawn from the environment's generator. ``reset(options=...)`` takes ``"scenario"``,
    a name or a file, and ``"overrides"``, ``table.key=value`` each, for that episode only.

    Args:
        scenario: A name of the scenarios' library, or the path of a TOML file.
        overrides: ``table.key=value`` each, for every episode; whatever sets the size of the frames belongs
            here, since the observation space cannot change later.
        render_mode: "rgb_array" or None.

    Raises:
        ValueError: If there is no such scenario, it is of another scene, or an override is wrong.
        RenderUnavailableError: From ``reset``, if there is no off-screen OpenGL here.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 30}  # noqa: RUF012

    scene: ClassVar[str]
    """Its name."""
    actions: ClassVar[tuple[str, ...]]
    """What each number of an action means; all lie in [-1, 1], and zero leaves alone."""
    of: ClassVar[type[AnyParams]]
    """The scene's parameters."""

    def __init__(
        self, *, scenario: str, overrides: Sequence[str] = (), render_mode: str | None = None
    ) -> None:
        self._scenario, self._overrides = scenario, tuple(overrides)
        self._simulation: Simulation | None = None
        self._observation: Observation | None = None
        course = self._course(scenario, ())
        camera = course.params.camera
        self.course = self._first = course
        self.render_mode = render_mode
        self.metadata = {**type(self).metadata, "render_fps": course.rate}
        self.observation_space = Box(0, 255, (camera.height, camera.width, 3), np.uint8)
        self.action_space = Box(-1.0, 1.0, (len(self.actions),), np.float32)
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode is {render_mode!r}: wanted 'rgb_array' or None")

    @property
    def observation(self) -> Observation:
        """The last frame, with its truth.

        Raises:
            gymnasium.error.ResetNeeded: Before the first ``reset``.
        """
        if self._observation is None:
            raise gymnasium.error.ResetNeeded("there is no frame before the first reset")
        return self._observation

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Image, dict[str, Any]]:
        """Begin an episode and return its first frame.

        Raises:
            ValueError: If an option or a scenario is wrong, or its frames have another size.
        """
        super().reset(seed=seed)
        given = options or {}
        if unknown := [key for key in given if key not in _OPTIONS]:
            raise ValueError(f"reset option {unknown[0]!r} is unknown: wanted {' or '.join(_OPTIONS)}")
        course = self._course(given.get("scenario", self._scenario), given.get("overrides", ()))
        camera, first = course.params.camera, self._first.params.camera
        if (camera.width, camera.height) != (first.width, first.height):
            raise ValueError(
                f"its frames are {camera.width} x {camera.height}, this environment's {first.width} x "
                f"{first.height}: give what sets the size to make(..., overrides=[...])"
            )
        drawn = int(self.np_random.integers(1 << 31)) if seed is None else seed
        self.close()
        self.course, params = course, self._driven(course.params)
        scene = make_scene(params, seed=drawn, rate=course.rate, seconds=course.seconds)
        self._simulation = Simulation(scene, params.sensor, seed=drawn)
        return self._see(self._simulation, None)

    def step(self, action: Action) -> tuple[Image, float, bool, bool, dict[str, Any]]:
        """Advance one tick.

        Args:
            action: As `actions` names; what lies outside [-1, 1] is cut off.

        Raises:
            gymnasium.error.ResetNeeded: Before the first ``reset``.
            ValueError: If the action has another shape or is not finite.
        """
        if self._simulation is None:
            raise gymnasium.error.ResetNeeded("step was called before reset")
        told = np.asarray(action, np.float32)
        if told.shape != self.action_space.shape or not np.isfinite(told).all():
            raise ValueError(f"action is {action}: wanted {len(self.actions)} finite numbers")
        image, info = self._see(self._simulation, told)
        truncated = self.observation.tick >= self.course.frames - 1
        return image, 0.0, self._simulation.scene.over, truncated, info

    def render(self) -> Image | None:
        """Return the last frame, where the render mode is "rgb_array"."""
        return self.observation.image.copy() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Give back what the renderer holds. A second call does nothing."""
        if self._simulation is not None:
            self._simulation.close()
            self._simulation = None

    def _driven(self, params: AnyParams) -> AnyParams:
        """Let actions drive what they can."""
        return params

    def _course(self, scenario: str, overrides: Sequence[str]) -> Course:
        course = load_course(scenario, (*self._overrides, *overrides))
        if not isinstance(course.params, self.of):
            raise ValueError(f"scenario {scenario!r} is of another scene: wanted one of {self.scene}")
        return course

    def _see(self, simulation: Simulation, action: Action | None) -> tuple[Image, dict[str, Any]]:
        seen = self._observation = simulation.step(action)
        odometer = seen.odometer
        truth = Snapshot(
            tick=seen.tick,
            time=seen.time,
            vehicles=seen.truth,
            ids=seen.ids,
            depth=seen.depth,
            state=seen.state,
            camera=simulation.scene.camera,
            pose=seen.pose,
            speed=None if odometer is None else odometer.speed,
            yaw_rate=None if odometer is None else odometer.yaw_rate,
        )
        return seen.image.copy(), {"truth": truth}


class InCarEnv(SceneEnv):
    """A camera car in traffic: the action drives it."""

    scene = "in-car"
    actions = ("acceleration", "yaw rate, positive to the right")
    of = InCarParams

    def _driven(self, params: AnyParams) -> AnyParams:
        if not isinstance(params, InCarParams):
            return params
        return params.model_copy(update={"ego": params.ego.model_copy(update={"driver": "actions"})})


class AerialEnv(SceneEnv):
    """A platform over traffic, which wind moves a little: the action flies it and zooms its camera.

    It hovers where it is left alone, whatever drives below: to keep a convoy in view is the action's task.
    Velocity is that of the place that the camera aims at. A tracker is told the focal length that an episode
    begins with.
    """

    scene = "aerial"
    actions = (
        "velocity to the right",
        "velocity ahead, toward the picture's upper edge",
        "yaw rate, positive to the right",
        "zoom, positive to the longer focal length",
    )
    of = AerialParams

    def _driven(self, params: AnyParams) -> AnyParams:
        if not isinstance(params, AerialParams):
            return params
        platform = params.platform.model_copy(update={"driver": "actions"})
        return params.model_copy(update={"platform": platform})


class MotorcycleLaneEnv(SceneEnv):
    """A camera over a lane of motorcycles: the action turns and exposes it."""

    scene = "motorcycle-lane"
    actions = ("pan, positive to the right", "exposure")
    of = MotorcycleLaneParams


def load_course(name: str, overrides: Sequence[str]) -> Course:
    """Read a scenario by its name, through the package that offers scenarios.

    Raises:
        LookupError: If no package offers any.
        ValueError: If there is no such scenario.
    """
    offered = entry_points(group=SCENARIOS)
    if not offered:
        raise LookupError(f"no installed package offers scenarios (entry point group {SCENARIOS!r})")
    course: Course = next(iter(offered)).load()(name, overrides)
    return course
