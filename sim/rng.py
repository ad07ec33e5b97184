"""Named random streams: one seed, one independent generator per purpose."""

from __future__ import annotations

import hashlib

import numpy as np


def stream(seed: int, *names: str | int) -> np.random.Generator:
    """Return the random stream of one purpose.

    Streams of different names are independent, so that adding a sensor does not move a car. The names are
    digested with SHA-256 and not with ``hash()``, so that the stream is the same in every process.

    Args:
        seed: The episode's seed, >= 0.
        names: The purpose, from the general to the particular, such as ``"scenery", "trees"``.

    Returns:
        A generator that depends on ``seed`` and ``names`` alone.

    Raises:
        ValueError: If ``seed`` is negative.
    """
    if seed < 0:
        raise ValueError(f"a seed is a whole number >= 0, not {seed}")
    digest = hashlib.sha256("/".join(str(name) for name in names).encode()).digest()
    words = np.frombuffer(digest, dtype=np.uint32)
    return np.random.default_rng(np.random.SeedSequence([seed, *words.tolist()]))
