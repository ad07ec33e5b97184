"""What a tracker showed of its inner state, as far as scores are computed from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.truth.boxes import visible_parts
from sim.truth.types import AerialTruth, FrameTruth
from tracker.types import Diagnostics, Predictions

NO_MASK = -1
"""Stands for the count of a frame in which no mask was shown."""
NOTHING_PREDICTED = Predictions(
    ids=np.zeros(0, np.int64), centres=np.zeros((0, 2)), covariances=np.zeros((0, 2, 2))
)
_PREDICTED = ("ids", "centres", "covariances")


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownLog:
    """What one tracker showed in T frames; None of what it never showed. Masks are kept as counts.

    Attributes:
        detections: T arrays (M_t, 4) of boxes, px.
        flags: T arrays (F_t,) int64, ids of tracks flagged as going the wrong way.
        mask_px: (T,) int64 pixels of the foreground mask, `NO_MASK` in a frame without one.
        object_px: T arrays (N_t,) int64, how many visible pixels of each vehicle of the truth the mask holds.
        innovations: T arrays (K_t,), squared, in units of the covariances (`tracker.types.Diagnostics`).
        predictions: T frames of where hidden vehicles were expected; kept of a camera in the air only.
        homographies: (T, 3, 3) from each frame to the mosaic.
    """

    detections: tuple[NDArray[np.float64], ...] | None
    flags: tuple[NDArray[np.int64], ...] | None
    mask_px: NDArray[np.int64] | None
    object_px: tuple[NDArray[np.int64], ...] | None
    innovations: tuple[NDArray[np.float64], ...] | None = None
    predictions: tuple[Predictions, ...] | None = None
    homographies: NDArray[np.float64] | None = None


class ShownRows:
    """Gathers a `ShownLog` frame by frame."""

    def __init__(self) -> None:
        self._detections: list[NDArray[np.float64] | None] = []
        self._flags: list[NDArray[np.int64] | None] = []
        self._innovations: list[NDArray[np.float64] | None] = []
        self._mask_px: list[int] = []
        self._object_px: list[NDArray[np.int64]] = []
        self._predictions: list[Predictions | None] = []
        self._homographies: list[NDArray[np.float64]] = []

    def add(self, diagnostics: Diagnostics, ids: NDArray[np.uint32], truth: FrameTruth) -> None:
        """Take in what was shown of a frame, given its id map (H, W) and truth."""
        boxes, flags, mask = diagnostics.detections, diagnostics.flags, diagnostics.mask
        self._detections.append(None if boxes is None else np.array(boxes, float).reshape(-1, 4))
        self._flags.append(None if flags is None else np.array(flags, np.int64).reshape(-1))
        innovations = diagnostics.innovations
        self._innovations.append(None if innovations is None else np.array(innovations, float).reshape(-1))
        if isinstance(truth, AerialTruth):
            self._predictions.append(diagnostics.predictions)
            if diagnostics.homography is not None:
                self._homographies.append(np.array(diagnostics.homography, float))
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
        everywhere = 0 < len(self._homographies) == len(self._mask_px)
        return ShownLog(
            detections=_filled(self._detections, np.zeros((0, 4))),
            flags=_filled(self._flags, np.zeros(0, np.int64)),
            mask_px=np.array(self._mask_px, np.int64) if masked else None,
            object_px=tuple(self._object_px) if masked else None,
            innovations=_filled(self._innovations, np.zeros(0)),
            predictions=_filled(self._predictions, NOTHING_PREDICTED),
            homographies=np.array(self._homographies) if everywhere else None,
        )


def _filled(frames: list[Any], empty: Any) -> Any:
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
    if shown.predictions is not None:
        arrays["predictions/rows"] = np.array([len(frame.ids) for frame in shown.predictions], np.int64)
        for name in _PREDICTED:
            arrays[f"predictions/{name}"] = np.concatenate(
                [getattr(frame, name) for frame in shown.predictions]
            )
    if shown.homographies is not None:
        arrays["homographies"] = shown.homographies
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
        predictions=_predictions(arrays),
        homographies=arrays.get("homographies"),
    )


def _predictions(arrays: Mapping[str, NDArray[Any]]) -> tuple[Predictions, ...] | None:
    if "predictions/rows" not in arrays:
        return None
    ends = np.cumsum(arrays["predictions/rows"])[:-1]
    columns = {name: np.split(arrays[f"predictions/{name}"], ends) for name in _PREDICTED}
    make: Callable[..., Predictions] = Predictions
    return tuple(make(**{name: column[k] for name, column in columns.items()}) for k in range(len(ends) + 1))
