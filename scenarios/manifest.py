"""Manifests: what a run or a dataset was made of, and a chain of hashes by which it can be checked again.

Each link is the hash of the link before and of one stage of one frame: the truth, the picture, the tracks of
each tracker. The first link that differs names the first frame and stage that do.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios import digest, spec
from scenarios.errors import InputError
from scenarios.files import moved_in
from scenarios.output import write_json
from tracker.types import Tracks

if TYPE_CHECKING:
    from scenarios.spec import Scenario
    from sim.simulation import Observation

NAME = "manifest.json"
FORMAT = "testtrack manifest 1"
PACKAGES = ("testtrack", "numpy", "moderngl", "highway-env", "opencv-python-headless", "av")
"""What truth and pictures, and the files that hold them, depend on."""
TRUTH, IMAGE = "truth", "image"

Links = dict[str, str]
"""Of one frame, by stage, in the order in which the stages follow: truth, image, ``tracks of NAME``."""


class Chain:
    """Hashes the frames of an episode as they come.

    Attributes:
        frames: Links so far.
    """

    def __init__(self) -> None:
        self.frames: list[Links] = []

    def add(self, observation: Observation, tracks: Mapping[str, Tracks]) -> Links:
        """Add a frame and what each tracker made of it; return its links."""
        state = observation.state
        truth = (
            *(observation.truth, state.vehicles, state.ego, observation.pose),
            *(observation.odometer, observation.ids, observation.depth),
        )
        links = {TRUTH: self._link(TRUTH, *truth), IMAGE: self._link(IMAGE, observation.image)}
        for name, found in tracks.items():
            stage = f"tracks of {name}"
            links[stage] = self._link(stage, found)
        self.frames.append(links)
        return links

    def _link(self, stage: str, *values: object) -> str:
        link = hashlib.sha256(self.frames[-1][stage].encode() if self.frames else b"")
        for value in values:
            if value is not None:
                digest.add(link, value)
        return link.hexdigest()[:32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What was made, of what, and with what.

    Attributes:
        scenario: Resolved.
        trackers: Names of the trackers that ran, none in a dataset.
        odometry: Whether they got the car's odometry.
        environment: Versions and the OpenGL driver.
        episodes: Links of the frames by seed.
    """

    scenario: Scenario
    trackers: tuple[str, ...]
    odometry: bool
    environment: dict[str, str]
    episodes: dict[int, list[Links]]

    @property
    def frames(self) -> int:
        """Frames of all episodes together."""
        return sum(map(len, self.episodes.values()))


def environment() -> dict[str, str]:
    """Return versions and the OpenGL driver's own name.

    Raises:
        RenderUnavailableError: If there is no off-screen OpenGL here.
    """
    from sim.render.context import context

    info = context().info
    versions = {name: metadata.version(name) for name in PACKAGES}
    driver = f"{info['GL_VENDOR']}, {info['GL_RENDERER']}, {info['GL_VERSION']}"
    return {"python": platform.python_version(), **versions, "driver": driver}


def write(path: Path, manifest: Manifest) -> None:
    """Write a manifest; the file is moved in when it is whole."""
    document = {
        "format": FORMAT,
        "scenario": manifest.scenario.model_dump(mode="json"),
        "seeds": list(manifest.episodes),
        "trackers": manifest.trackers,
        "odometry": manifest.odometry,
        "environment": manifest.environment,
        "episodes": [{"seed": seed, "frames": frames} for seed, frames in manifest.episodes.items()],
    }
    with moved_in(path) as part:
        write_json(part, document)


def read(path: Path) -> Manifest:
    """Read a manifest.

    Raises:
        InputError: If there is none, or it is not a whole one.
    """
    try:
        document = json.loads(path.read_text("utf-8"))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file; wanted a {NAME}") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as a manifest: {error}") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InputError(f"{path}: is no manifest; wanted a file with the format {FORMAT!r}")
    scenario = spec.from_document(document.get("scenario"), str(path))
    try:
        return Manifest(
            scenario=scenario,
            trackers=tuple(str(name) for name in document["trackers"]),
            odometry=bool(document["odometry"]),
            environment={str(name): str(value) for name, value in document["environment"].items()},
            episodes={_seed(episode["seed"]): _links(episode["frames"]) for episode in document["episodes"]},
        )
    except KeyError as error:
        raise InputError(f"{path}: is no whole manifest: it lacks {error}") from error
    except (TypeError, AttributeError, ValueError) as error:
        raise InputError(f"{path}: is no whole manifest: {error}") from error


def join(manifests: Sequence[Manifest]) -> Manifest:
    """Make one manifest of those of single episodes.

    Raises:
        InputError: If they were not made with the same versions and driver.
    """
    first = manifests[0]
    for other in manifests[1:]:
        check_environment(other.environment, first.environment)
    return Manifest(
        scenario=first.scenario,
        trackers=first.trackers,
        odometry=first.odometry,
        environment=first.environment,
        episodes={seed: frames for each in manifests for seed, frames in each.episodes.items()},
    )


def check_environment(found: Mapping[str, str], wanted: Mapping[str, str]) -> None:
    """Raise `InputError` if ``found`` has another version or driver than ``wanted``."""
    for name, value in wanted.items():
        if found.get(name) != value:
            raise InputError(f"{name} is {found.get(name)}, but other episodes were made with {value}")


def _seed(value: object) -> int:
    if not isinstance(value, int) or value < 0:
        raise ValueError(f"the seed {value!r} is no whole number of at least 0")
    return value


def _links(value: object) -> list[Links]:
    if not isinstance(value, list) or not all(isinstance(links, dict) for links in value):
        raise ValueError("an episode's frames are no list of hashes")
    return value
