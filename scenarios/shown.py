"""What a tracker showed of its inner state, as far as scores are computed from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.truth.boxes import visible_parts
from sim.truth.types import FrameTruth
from tracker.types import Diagnostics

NO_MASK = -1
"""Stands for the count of a frame in which no mask was shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownLog:
    """What one tracker showed in T frames; None of what it never showed. Masks are kept as counts.

    Attributes:
        detections: T arrays (M_t, 4) of boxes, px.
        flags: T arrays (F_t,) int64, ids of tracks flagged as going the wrong way.
        mask_px: (T,) int64 pixels of the foreground mask, `NO_MASK` in a frame without one.
        object_px: T arrays (N_t,) int64, how many visible pixels of each vehicle of the truth the mask holds.
        innovations: T arrays (K_t,), squared, in units of the covariances (`tracker.types.Diagnostics`).
    """

    detections: tuple[NDArray[np.float64], ...] | None
    flags: tuple[NDArray[np.int64], ...] | None
    mask_px: NDArray[np.int64] | None
    object_px: tuple[NDArray[np.int64], ...] | None
    innovations: tuple[NDArray[np.float64], ...] | None = None


class ShownRows:
    """Gathers a `ShownLog` frame by frame."""

    def __init__(self) -> None:
        self._detections: list[NDArray[np.float64] | None] = []
        self._flags: list[NDArray[np.int64] | None] = []
        self._innovations: list[NDArray[np.float64] | None] = []
        self._mask_px: list[int] = []
        self._object_px: list[NDArray[np.int64]] = []

    def add(self, diagnostics: Diagnostics, ids: NDArray[np.uint32], truth: FrameTruth) -> None:
        """Take in what was shown of a frame, given its id map (H, W) and truth."""
        boxes, flags, mask = diagnostics.detections, diagnostics.flags, diagnostics.mask
        self._detections.append(None if boxes is None else np.array(boxes, float).reshape(-1, 4))
        self._flags.append(None if flags is None else np.array(flags, np.int64).reshape(-1))
        innovations = diagnostics.innovations
        self._innovations.append(None if innovations is None else np.array(innovations, float).reshape(-1))
        if mask is None:
            self._mask_px.append(NO_MASK)
            self._object_px.append(np.zeros(len(truth), np.int64))
        else:
            marked = np.asarray(mask, bool)
            self._mask_px.append(int(np.count_nonzero(marked)))
            self._object_px.append(visible_parts(np.where(marked, ids, np.uint32(0)), truth.ids)[0])

    def finish(self) -> ShownLog:
        """Return all frames."""
        masked = any(count != NO_MASK for count in self._mask_px)
        return ShownLog(
            detections=_filled(self._detections, np.zeros((0, 4))),
            flags=_filled(self._flags, np.zeros(0, np.int64)),
            mask_px=np.array(self._mask_px, np.int64) if masked else None,
            object_px=tuple(self._object_px) if masked else None,
            innovations=_filled(self._innovations, np.zeros(0)),
        )


def _filled(frames: list[Any], empty: NDArray[Any]) -> Any:
    """Return a tuple with ``empty`` where nothing was shown; None if nothing ever was."""
    if all(frame is None for frame in frames):
        return None
    return tuple(empty if frame is None else frame for frame in frames)


def to_arrays(shown: ShownLog) -> dict[str, NDArray[Any]]:
    """Return a log as flat arrays by name; ragged ones beside the number of rows of each frame."""
    arrays: dict[str, NDArray[Any]] = {}
    for name in ("detections", "flags", "innovations"):
        frames = getattr(shown, name)
        if frames is not None:
            arrays[f"{name}/rows"] = np.array([len(frame) for frame in frames], np.int64)
            arrays[name] = np.concatenate(frames)
    if shown.mask_px is not None and shown.object_px is not None:
        arrays["mask_px"] = shown.mask_px
        arrays["object_px/rows"] = np.array([len(frame) for frame in shown.object_px], np.int64)
        arrays["object_px"] = np.concatenate(shown.object_px)
    return arrays


def from_arrays(arrays: Mapping[str, NDArray[Any]]) -> ShownLog:
    """Return what `to_arrays` was given."""

    def frames(name: str) -> Any:
        if name not in arrays:
            return None
        return tuple(np.split(arrays[name], np.cumsum(arrays[f"{name}/rows"])[:-1]))

    return ShownLog(
        detections=frames("detections"),
        flags=frames("flags"),
        mask_px=arrays.get("mask_px"),
        object_px=frames("object_px"),
        innovations=frames("innovations"),
    )
