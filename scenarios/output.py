"""Output directories that are whole or not there."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from scenarios.errors import InputError

MARK = ".testtrack"
"""An empty file in every directory written here: only such a directory, or an empty one, is ever replaced."""


@contextmanager
def whole_directory(target: Path) -> Iterator[Path]:
    """Give a directory to write into, and move it to ``target`` once the block has ended well.

    If the block raises (an interrupt too), nothing is left, and what was at ``target`` stays as it was.

    Args:
        target: Need not exist. A directory that was written this way is replaced.

    Raises:
        InputError: If ``target`` is a file or holds files that were not written here, or cannot be written.
    """
    target = Path(os.path.abspath(target))
    _refuse_foreign(target)
    # Near the target, so that the move is a rename; its parents are made only for what is whole.
    ancestor = next(parent for parent in target.parents if parent.exists())
    try:
        part = Path(tempfile.mkdtemp(prefix=f".{target.name}.part-", dir=ancestor))
    except OSError as error:
        raise InputError(f"--out {target}: cannot write there: {error.strerror}") from error
    try:
        part.chmod(0o755)
        yield part
        (part / MARK).touch()
        _refuse_foreign(target)
        target.parent.mkdir(parents=True, exist_ok=True)
        _exchange(part, target)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def write_json(path: Path, document: object) -> None:
    """Write a JSON document for people and programs; what is no number becomes null."""
    path.write_text(to_json(document) + "\n", "utf-8")


def to_json(document: object, *, indent: int | None = 2) -> str:
    """Return a document as strict JSON: NumPy's numbers as plain ones, infinite or no numbers as null.

    Args:
        document: Of dictionaries, sequences, arrays, numbers and text.
        indent: Spaces a level; None writes one line without any.
    """
    separators = (",", ":") if indent is None else None
    return json.dumps(_plain(document), indent=indent, separators=separators, allow_nan=False)


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):  # a NumPy array or scalar
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value


def _refuse_foreign(target: Path) -> None:
    if target.is_dir():
        if any(target.iterdir()) and not (target / MARK).is_file():
            raise InputError(
                f"--out {target}: holds files that testtrack did not write; wanted a new or empty directory"
            )
    elif target.exists() or target.is_symlink():
        raise InputError(f"--out {target}: is no directory; wanted a new or empty one")
    elif not next(parent for parent in target.parents if parent.exists()).is_dir():
        raise InputError(f"--out {target}: lies below a file; wanted a new or empty directory")


def _exchange(part: Path, target: Path) -> None:
    """Put ``part`` in the place of ``target``; the old one goes only after that."""
    if not target.is_dir():
        part.rename(target)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{target.name}.old-", dir=target.parent))
    target.rename(old / target.name)
    try:
        part.rename(target)
    except OSError:
        (old / target.name).rename(target)
        raise
    finally:
        shutil.rmtree(old, ignore_errors=True)
