"""Files that are never left looking whole when they are not."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def moved_in(path: Path) -> Iterator[Path]:
    """Give a name beside ``path`` to write to, and move the file in when the block ends well.

    If the block raises, what was written is removed and ``path`` stays as it was.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
