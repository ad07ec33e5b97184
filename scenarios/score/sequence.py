"""What measures of tracking are computed from: who was there, who was claimed, how well they agree."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Sequence:
    """T frames of objects and tracks, whose ids are numbered from 0 without gaps.

    Attributes:
        truths: T arrays (G_t,) of object numbers, each once a frame.
        tracks: T arrays (P_t,) of track numbers, each once a frame.
        similarities: T arrays (G_t, P_t) in [0, 1].
        truth_count: How many objects there are.
        track_count: How many tracks there are.
    """

    truths: tuple[NDArray[np.intp], ...]
    tracks: tuple[NDArray[np.intp], ...]
    similarities: tuple[NDArray[np.float64], ...]
    truth_count: int
    track_count: int

    @classmethod
    def of(
        cls, truths: Iterable[ArrayLike], tracks: Iterable[ArrayLike], similarities: Iterable[ArrayLike]
    ) -> Self:
        """Number arbitrary ids.

        Args:
            truths: A frame's object ids (G_t,).
            tracks: A frame's track ids (P_t,).
            similarities: (G_t, P_t).

        Raises:
            ValueError: If an id stands twice in a frame, or a shape does not fit.
        """
        truth_ids = [np.asarray(ids).reshape(-1) for ids in truths]
        track_ids = [np.asarray(ids).reshape(-1) for ids in tracks]
        matrices = [np.asarray(matrix, float) for matrix in similarities]
        if not len(truth_ids) == len(track_ids) == len(matrices):
            raise ValueError(
                f"{len(truth_ids)} frames of truth, {len(track_ids)} of tracks, {len(matrices)} matrices"
            )
        for frame, (truth, track, matrix) in enumerate(zip(truth_ids, track_ids, matrices, strict=True)):
            for ids in (truth, track):
                if len(np.unique(ids)) != len(ids):
                    raise ValueError(f"frame {frame} has an id twice: {ids.tolist()}")
            if matrix.shape != (len(truth), len(track)):
                raise ValueError(
                    f"frame {frame}: similarities {matrix.shape}, wanted {(len(truth), len(track))}"
                )
        truth_numbers, truth_count = _number(truth_ids)
        track_numbers, track_count = _number(track_ids)
        return cls(
            truths=truth_numbers,
            tracks=track_numbers,
            similarities=tuple(matrices),
            truth_count=truth_count,
            track_count=track_count,
        )

    @property
    def truth_boxes(self) -> int:
        """Boxes of truth in all frames together."""
        return sum(map(len, self.truths))

    @property
    def track_boxes(self) -> int:
        """Boxes of tracks in all frames together."""
        return sum(map(len, self.tracks))


def _number(frames: list[NDArray[np.generic]]) -> tuple[tuple[NDArray[np.intp], ...], int]:
    if not frames:
        return (), 0
    known, numbers = np.unique(np.concatenate(frames), return_inverse=True)
    cuts = np.cumsum([len(ids) for ids in frames])[:-1]
    return tuple(np.split(numbers.astype(np.intp), cuts)), len(known)


def frequencies(frames: Iterable[NDArray[np.intp]], count: int) -> NDArray[np.int64]:
    """Count in how many frames each of ``count`` numbers stands."""
    return np.bincount(np.concatenate([np.zeros(0, np.intp), *frames]), minlength=count).astype(np.int64)
