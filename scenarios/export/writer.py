"""Draws an episode and writes all of it: pictures, depth, truth, hashes, and what the format adds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scenarios import manifest as manifests
from scenarios.dataset import TRUTH, Dataset, Format, sequence_name
from scenarios.export.coco import CocoLayout
from scenarios.export.episode import Episode, Layout, record
from scenarios.export.frames import FrameFiles, open_frames, write_depth
from scenarios.export.kitti import KittiLayout
from scenarios.export.mot import MotLayout
from scenarios.export.truth import write_truth
from scenarios.loop import make_scene
from scenarios.manifest import Chain, Manifest
from scenarios.workers import Progress

if TYPE_CHECKING:
    from collections.abc import Mapping

LAYOUTS: Mapping[Format, Layout] = {"mot": MotLayout(), "coco": CocoLayout(), "kitti": KittiLayout()}


def write_episode(
    dataset: Dataset, seed: int, root: Path, environment: dict[str, str], progress: Progress | None
) -> None:
    """Draw an episode into an empty folder, laid out as the dataset.

    Args:
        dataset: That it is of.
        seed: Which.
        root: The folder.
        environment: Versions and driver, for its manifest.
        progress: Called after each frame.

    Raises:
        RenderUnavailableError: If there is no off-screen OpenGL here.
    """
    from sim.simulation import Simulation

    scenario, name, layout = dataset.scenario, sequence_name(seed), LAYOUTS[dataset.format]
    truth = root / TRUTH / name
    (truth / "depth").mkdir(parents=True)
    files = FrameFiles(folder=layout.folder(name), first=layout.first, coding=dataset.coding)
    scene, records, chain = make_scene(scenario, seed), [], Chain()
    camera = scene.camera
    with (
        Simulation(scene, scenario.params.sensor, seed=seed) as simulation,
        open_frames(root, files, width=camera.width, height=camera.height, rate=scenario.rate) as pictures,
    ):
        for observation in simulation.run(scenario.frames):
            pictures.write(observation.image)
            write_depth(truth / "depth" / f"{observation.tick:06d}.png", observation.depth)
            records.append(record(observation))
            chain.add(observation, {})
            if progress is not None:
                progress(1)
    episode = Episode(
        name=name,
        index=dataset.seeds.index(seed),
        camera=camera,
        rate=scenario.rate,
        images=files,
        frames=tuple(records),
    )
    write_truth(truth, episode)
    layout.write_episode(root, episode)
    manifests.write(
        truth / manifests.NAME,
        Manifest(
            scenario=scenario,
            trackers=(),
            odometry=False,
            environment=environment,
            episodes={seed: chain.frames},
        ),
    )
