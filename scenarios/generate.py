"""Datasets: the episodes of a scenario, drawn and written in a format that others' tools read.

Each episode is drawn into a folder of its own below `STAGING`, which gets its final name there when it is
whole; its parts are then moved to where the format wants them, what is true of it last. Whatever is
interrupted, and however: what has been moved is whole, and the same command goes on with the rest.
"""

from __future__ import annotations

import fcntl
import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from scenarios import manifest as manifests
from scenarios.dataset import TRUTH, Dataset, sequence_name
from scenarios.errors import InputError
from scenarios.files import moved_in
from scenarios.output import to_json, write_json
from scenarios.workers import Progress, Workers

PLAN = ".dataset.json"
"""What a directory is to hold: another dataset is never mixed into it."""
STAGING = ".staging"


def generate(
    dataset: Dataset, directory: Path, workers: Workers, progress: Progress | None = None
) -> dict[str, Any]:
    """Write a dataset, or what is left to do of it. The bytes do not depend on the workers.

    Args:
        dataset: What to write.
        directory: Where: new, empty, or begun by the same command.
        workers: Who draws the episodes; all must see the directory.
        progress: Told about frames, those of finished episodes too.

    Returns:
        What ``--json`` prints.

    Raises:
        InputError: If the directory holds anything else, or another process writes it.
        RenderUnavailableError: If there is no off-screen OpenGL here.
        WorkersLostError: If workers die again and again.
    """
    with _claimed(dataset, directory):
        staging = directory / STAGING
        if staging.is_dir():
            _clear(dataset, directory)
        left = [seed for seed in dataset.seeds if not _done(directory, seed)]
        drawn = len(left)
        if progress is not None:
            progress((len(dataset.seeds) - drawn) * dataset.scenario.frames)
        if left:
            staging.mkdir(exist_ok=True)
            work = partial(draw, dataset, directory, _known_environment(dataset, directory))
            for seed, _ in workers.each(work, left, frames=dataset.scenario.frames, progress=progress):
                if not (staging / sequence_name(seed)).is_dir():
                    raise InputError(f"--out {directory}: the workers do not write to the same folder")
                _publish(directory, sequence_name(seed))
        shutil.rmtree(staging, ignore_errors=True)
        _finish(dataset, directory)
    return {
        "scenario": dataset.scenario.name,
        "format": dataset.format,
        "frames_as": dataset.coding,
        "seeds": list(dataset.seeds),
        "episodes": len(dataset.seeds),
        "drawn": drawn,
        "frames": dataset.frames,
        "directory": str(directory),
    }


def draw(
    dataset: Dataset,
    directory: Path,
    expected: dict[str, str] | None,
    seed: int,
    *,
    progress: Progress | None = None,
) -> None:
    """Draw one episode, whole, below the staging folder; what already stands there is left as it is.

    Raises:
        InputError: If versions or driver are not the ``expected`` ones.
    """
    from scenarios.export.writer import write_episode  # with all that draws

    name = sequence_name(seed)
    whole = directory / STAGING / name
    if whole.is_dir() or _done(directory, seed):
        return
    if not whole.parent.is_dir():
        raise InputError(f"--out {directory}: a worker does not see it; wanted a folder that all share")
    found = manifests.environment()
    if expected is not None:
        manifests.check_environment(found, expected)
    part = Path(tempfile.mkdtemp(prefix=f".{name}.", dir=whole.parent))
    try:
        write_episode(dataset, seed, part, found, progress)
        try:
            part.rename(whole)
        except OSError:
            if not whole.is_dir():  # else another worker, thought dead, was faster
                raise
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _done(directory: Path, seed: int) -> bool:
    return (directory / TRUTH / sequence_name(seed)).is_dir()


def _known_environment(dataset: Dataset, directory: Path) -> dict[str, str] | None:
    """Return what the episodes that are done were made with."""
    for seed in dataset.seeds:
        if _done(directory, seed):
            return manifests.read(directory / TRUTH / sequence_name(seed) / manifests.NAME).environment
    return None


def _clear(dataset: Dataset, directory: Path) -> None:
    """Move in what was whole when the last command ended, and remove what was not."""
    for entry in sorted((directory / STAGING).iterdir()):
        if entry.name in dataset.names:
            _publish(directory, entry.name)
        else:
            shutil.rmtree(entry)


def _publish(directory: Path, name: str) -> None:
    """Move a whole episode's parts to their places; a move that was interrupted is gone on with."""
    whole = directory / STAGING / name
    parts = sorted(_own(whole, name), key=lambda part: part.relative_to(whole).parts[0] == TRUTH)
    for part in parts:
        target = directory / part.relative_to(whole)
        target.parent.mkdir(parents=True, exist_ok=True)
        part.rename(target)
    shutil.rmtree(whole)


def _own(folder: Path, name: str) -> Iterator[Path]:
    """Find the files and folders that have an episode's name, with or without an ending."""
    for entry in sorted(folder.iterdir()):
        if entry.name.partition(".")[0] == name:
            yield entry
        elif entry.is_dir():
            yield from _own(entry, name)


def _finish(dataset: Dataset, directory: Path) -> None:
    """Write the files that name all episodes, the manifest last."""
    from scenarios.export.writer import LAYOUTS

    path = directory / manifests.NAME
    if path.is_file():
        return
    LAYOUTS[dataset.format].write_index(directory, dataset.names, dataset.scenario.frames)
    made = [manifests.read(directory / TRUTH / name / manifests.NAME) for name in dataset.names]
    manifests.write(path, manifests.join(made))


@contextmanager
def _claimed(dataset: Dataset, directory: Path) -> Iterator[None]:
    """Hold a directory for this dataset alone; a lock that a killed process held is free again."""
    plan = {
        "format": dataset.format,
        "frames": dataset.coding,
        "seeds": list(dataset.seeds),
        "scenario": dataset.scenario.model_dump(mode="json"),
    }
    path = directory / PLAN
    if not path.is_file():
        _refuse_foreign(directory)
        try:
            directory.mkdir(parents=True, exist_ok=True)
            with moved_in(path) as part:
                write_json(part, plan)
        except OSError as error:
            raise InputError(f"--out {directory}: cannot write there: {error.strerror}") from error
    with path.open("r+", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise InputError(f"--out {directory}: another process is writing it") from error
        held = file.read()
        if held != to_json(plan) + "\n":
            raise InputError(f"--out {directory}: holds another dataset: {_difference(held, plan)}")
        yield


def _refuse_foreign(directory: Path) -> None:
    """Raise unless a directory is new or empty; a plan that died while it was written is nothing."""
    if directory.is_dir():
        if any(not entry.name.startswith(f".{PLAN}.") for entry in directory.iterdir()):
            raise InputError(f"--out {directory}: holds other files; wanted a new or empty directory")
    elif directory.exists() or directory.is_symlink():
        raise InputError(f"--out {directory}: is no directory; wanted a new or empty one")


def _difference(held: str, plan: dict[str, Any]) -> str:
    """Say in what the plan that a directory holds differs from the wanted one."""
    try:
        pairs = dict(_flat("", json.loads(held)))
    except ValueError:
        return f"its {PLAN} cannot be read"
    for key, value in _flat("", json.loads(json.dumps(plan))):
        if pairs.get(key) != value:
            return f"its {key} is {pairs.get(key)}, not {value}"
    return f"its {PLAN} has other keys"


def _flat(prefix: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _flat(f"{prefix}.{key}" if prefix else key, item)
    else:
        yield prefix, value
