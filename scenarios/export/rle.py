"""Masks as COCO's compressed run lengths.

A mask is read column by column; lengths of runs alternate between outside and inside, outside first. From the
fourth on, a length is written as its difference from the one two before; each number stands in characters of
five bits from 48 on, lowest bits first, the sixth bit says that more follow, and the sign is the last one's.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


def encode(mask: NDArray[np.bool_], *, at: tuple[int, int], size: tuple[int, int]) -> str:
    """Encode a mask that lies somewhere in an image.

    Args:
        mask: (h, w), the part of the image that holds all of it.
        at: Row and column of its first pixel in the image.
        size: Height and width of the image.

    Returns:
        What COCO's JSON has under ``counts``.
    """
    columns, rows = np.nonzero(mask.T)
    counts = _run_lengths((columns + at[1]) * size[0] + rows + at[0], size[0] * size[1])
    characters: NDArray[np.uint8] = _characters(counts)
    return characters.tobytes().decode("ascii")


def _run_lengths(places: NDArray[np.int64], pixels: int) -> NDArray[np.int64]:
    """Give lengths of runs, outside first, from the places inside, ascending."""
    if not len(places):
        return np.array([pixels], np.int64)
    last = np.flatnonzero(np.diff(places) != 1)
    starts = places[np.append(0, last + 1)]
    ends = places[np.append(last, len(places) - 1)] + 1
    edges = np.stack([starts, ends], axis=1).ravel()
    counts = np.diff(np.concatenate([[0], edges, [pixels]])).astype(np.int64)
    return counts if counts[-1] else counts[:-1]


@njit(cache=True)  # type: ignore[untyped-decorator]
def _characters(counts: NDArray[np.int64]) -> NDArray[np.uint8]:
    out = np.zeros(13 * len(counts), np.uint8)  # 64 bits take 13 characters
    used = 0
    for k in range(len(counts)):
        number = counts[k] - counts[k - 2] if k > 2 else counts[k]
        more = True
        while more:
            bits = number & 31
            number >>= 5
            more = number != -1 if bits & 16 else number != 0
            out[used] = 48 + (bits | 32 if more else bits)
            used += 1
    return out[:used]
