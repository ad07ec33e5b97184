"""Runs what a manifest describes again, and finds the first frame and stage that come out otherwise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from scenarios.loop import run_episode
from scenarios.manifest import Chain, Links, Manifest, environment
from scenarios.runs import make_tracker
from scenarios.workers import Progress
from tracker.types import Diagnostics, Tracks

if TYPE_CHECKING:
    from sim.simulation import Observation

LENGTH = "length"
"""The stage that differs where one of the two has no such frame."""


@dataclass(frozen=True, slots=True)
class Divergence:
    """Where a replay first differs: the seed, the frame, counted from 0, and the stage."""

    seed: int
    frame: int
    stage: str


def replay(manifest: Manifest, progress: Progress | None = None) -> Divergence | None:
    """Run a manifest's episodes again, until one differs.

    Args:
        manifest: What was made.
        progress: Called after each frame.

    Returns:
        The first divergence; None where all agree.

    Raises:
        InputError: If there is no such tracker.
        RenderUnavailableError: If there is no off-screen OpenGL here.
    """
    for name in manifest.trackers:
        make_tracker(name, manifest.scenario)
    for seed, frames in manifest.episodes.items():
        found = _episode(manifest, seed, frames, progress)
        if found is not None:
            return found
    return None


def describe(manifest: Manifest, found: Divergence | None) -> dict[str, Any]:
    """Return the document that ``--json`` prints: with what was found, what is no longer as it was."""
    return {
        "agree": found is None,
        "episodes": len(manifest.episodes),
        "frames": manifest.frames,
        "diverges": asdict(found) if found else None,
        "environment_changed": {
            name: {"then": manifest.environment.get(name), "now": value}
            for name, value in environment().items()
            if manifest.environment.get(name) != value
        },
    }


def _episode(
    manifest: Manifest, seed: int, wanted: list[Links], progress: Progress | None
) -> Divergence | None:
    chain = Chain()

    def on_frame(observation: Observation, shown: Mapping[str, tuple[Tracks, Diagnostics]]) -> None:
        frame = len(chain.frames)
        links = chain.add(observation, {name: tracks for name, (tracks, _) in shown.items()})
        if frame == len(wanted):
            raise _Diverged(frame, LENGTH)
        for stage in dict.fromkeys([*links, *wanted[frame]]):
            if links.get(stage) != wanted[frame].get(stage):
                raise _Diverged(frame, stage)
        if progress is not None:
            progress(1)

    trackers = {name: make_tracker(name, manifest.scenario, seed) for name in manifest.trackers}
    try:
        run_episode(manifest.scenario, seed, trackers, odometry=manifest.odometry, on_frame=on_frame)
    except _Diverged as diverged:
        return Divergence(seed, diverged.frame, diverged.stage)
    return Divergence(seed, len(chain.frames), LENGTH) if len(chain.frames) < len(wanted) else None


class _Diverged(Exception):  # noqa: N818 (it ends an episode early, and is no error)
    def __init__(self, frame: int, stage: str) -> None:
        super().__init__(frame, stage)
        self.frame, self.stage = frame, stage
