"""What is kept of an episode: all that scores are computed from, so that scoring never renders again."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.files import moved_in
from scenarios.shown import ShownLog, from_arrays, to_arrays
from sim.truth.types import AerialTruth, FrameTruth
from tracker.types import Tracks


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceLog:
    """All traces of an episode, as flat rows.

    Attributes:
        ticks: (R,) int64, one row a trace and frame.
        ids: (R,) int64.
        x: (R,) float64, px.
        v: (R,) float64, px/s.
        labels: (R,) uint8, a `tracker.types.Label`.
        p_car: (R,) float64.
        owners: (R,) int64, the track that the trace belongs to, 0 for none.
        vote_ticks: (K,) int64, one row a trace, frame and object (scoring.md 7).
        vote_ids: (K,) int64, the trace.
        vote_objects: (K,) uint32, what its support points lie on.
        vote_counts: (K,) int64, how many of them.
        vote_depths: (K,) float64, their median depth, metres along the axis, infinite in the sky; None where
            it is not known.
    """

    ticks: NDArray[np.int64]
    ids: NDArray[np.int64]
    x: NDArray[np.float64]
    v: NDArray[np.float64]
    labels: NDArray[np.uint8]
    p_car: NDArray[np.float64]
    owners: NDArray[np.int64]
    vote_ticks: NDArray[np.int64]
    vote_ids: NDArray[np.int64]
    vote_objects: NDArray[np.uint32]
    vote_counts: NDArray[np.int64]
    vote_depths: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeLog:
    """One tracker on one episode of T frames.

    Attributes:
        scenario: Its name.
        scene: Which scene it is of; it decides what is scored.
        spec_id: Digest of the resolved scenario.
        seed: The episode's.
        tracker: Its name.
        rate: Frames a second.
        width: Pixels.
        height: Pixels.
        has_boxes: Whether the tracker gives boxes at all.
        truth: T frames of truth.
        tracks: T frames of tracks.
        traces: Of a tracker that shows them.
        shown: What else it showed.
        ego_speed: (T,) float64, m/s; not a number where the camera is on no car.
        light: (T,) float64, the light of sun and sky, 1 where it is the scene's own.
        hashes: Hex digests by name: truth, frames, tracks.
        timing_ms: (T,) float64 by stage: world, render, sensor, truth, track.
    """

    scenario: str
    scene: str
    spec_id: str
    seed: int
    tracker: str
    rate: int
    width: int
    height: int
    has_boxes: bool
    truth: tuple[FrameTruth, ...]
    tracks: tuple[Tracks, ...]
    traces: TraceLog | None
    shown: ShownLog
    ego_speed: NDArray[np.float64]
    light: NDArray[np.float64]
    hashes: dict[str, str]
    timing_ms: dict[str, NDArray[np.float64]]


_FORMAT = "testtrack episode 2"
_PLAIN = ("scenario", "scene", "spec_id", "seed", "tracker", "rate", "width", "height", "has_boxes", "hashes")
_TRUTH_ARRAYS = tuple(f.name for f in fields(FrameTruth) if f.name != "tick")
_ALOFT_ARRAYS = tuple(f.name for f in fields(AerialTruth) if f.name not in (*_TRUTH_ARRAYS, "tick"))
_A_FRAME = ("ground_to_image",)  # one of these a frame, of the others a row for each vehicle
_TRACK_ARRAYS = ("ids", "boxes", "status")
_OPTIONAL_TRACK_ARRAYS = {"score": (), "state": (4,), "covariance": (4, 4)}


def save(log: EpisodeLog, path: Path | str) -> None:
    """Write a log as one NumPy archive (.npz), without pickles; the same log gives the same bytes.

    Frames are joined into flat arrays, beside the number of rows that each frame has. The file is written
    beside its place and moved in when it is whole.

    Raises:
        OSError: If it cannot be written.
    """
    plain = {"format": _FORMAT} | {name: getattr(log, name) for name in _PLAIN}
    arrays: dict[str, Any] = {
        "plain": np.frombuffer(json.dumps(plain).encode(), np.uint8),
        "ego_speed": log.ego_speed,
        "light": log.light,
        "truth/ticks": np.array([frame.tick for frame in log.truth], np.int64),
        "truth/rows": np.array([len(frame) for frame in log.truth], np.int64),
        "tracks/rows": np.array([len(frame) for frame in log.tracks], np.int64),
    }
    if log.truth:
        aloft = isinstance(log.truth[0], AerialTruth)
        for name in (*_TRUTH_ARRAYS, *(_ALOFT_ARRAYS if aloft else ())):
            join = np.stack if name in _A_FRAME else np.concatenate
            arrays[f"truth/{name}"] = join([getattr(frame, name) for frame in log.truth])
    if log.tracks:
        for name in _TRACK_ARRAYS:
            arrays[f"tracks/{name}"] = np.concatenate([getattr(frame, name) for frame in log.tracks])
        for name, shape in _OPTIONAL_TRACK_ARRAYS.items():
            values = [getattr(frame, name) for frame in log.tracks]
            arrays[f"tracks/{name}/given"] = np.array([value is not None for value in values])
            arrays[f"tracks/{name}"] = np.concatenate(
                [np.zeros((0, *shape)), *(value for value in values if value is not None)]
            )
    if log.traces is not None:
        columns = {f"traces/{f.name}": getattr(log.traces, f.name) for f in fields(TraceLog)}
        arrays |= {name: column for name, column in columns.items() if column is not None}
    arrays |= {f"shown/{name}": values for name, values in to_arrays(log.shown).items()}
    arrays |= {f"timing_ms/{name}": values for name, values in log.timing_ms.items()}
    with moved_in(Path(path)) as part, part.open("wb") as file:
        np.savez_compressed(file, **arrays)


def load(path: Path | str) -> EpisodeLog:
    """Read what `save` wrote.

    Raises:
        ValueError: If there is no such file, or it is not a whole episode log.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("it is a bare array")
            return _read({name: archive[name] for name in archive.files})
    except FileNotFoundError as error:
        raise ValueError(f"there is no episode log {path}") from error
    except KeyError as error:
        raise ValueError(f"{path} is no episode log: it lacks {error}") from error
    except (OSError, EOFError, ValueError, TypeError, zipfile.BadZipFile, zlib.error) as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{path} is no whole episode log: {reason}") from error


def _read(arrays: Mapping[str, NDArray[Any]]) -> EpisodeLog:
    plain = json.loads(arrays["plain"].tobytes())
    if plain["format"] != _FORMAT:
        raise ValueError(f"its format is {plain['format']!r}, wanted {_FORMAT!r}")
    ticks, speed = arrays["truth/ticks"], arrays["ego_speed"]
    track_rows = arrays["tracks/rows"]
    if not len(ticks) == len(arrays["truth/rows"]) == len(track_rows) == len(speed):
        raise ValueError("its truth, tracks and speeds are not of equally many frames")
    truth: list[FrameTruth] = []
    tracks: list[Tracks] = []
    if len(ticks):
        aloft = f"truth/{_ALOFT_ARRAYS[0]}" in arrays
        columns: dict[str, Any] = {
            name: arrays[f"truth/{name}"]
            if name in _A_FRAME
            else _split(arrays[f"truth/{name}"], arrays["truth/rows"])
            for name in (*_TRUTH_ARRAYS, *(_ALOFT_ARRAYS if aloft else ()))
        }
        truth = [
            (AerialTruth if aloft else FrameTruth)(
                tick=int(tick), **{name: column[k] for name, column in columns.items()}
            )
            for k, tick in enumerate(ticks)
        ]
        required = {name: _split(arrays[f"tracks/{name}"], track_rows) for name in _TRACK_ARRAYS}
        optional = {
            name: _split_given(arrays[f"tracks/{name}"], track_rows, arrays[f"tracks/{name}/given"])
            for name in _OPTIONAL_TRACK_ARRAYS
        }
        make: Callable[..., Tracks] = Tracks
        tracks = [
            make(**{name: column[k] for name, column in (required | optional).items()})
            for k in range(len(track_rows))
        ]
    with_traces = "traces/ticks" in arrays
    return EpisodeLog(
        **{name: plain[name] for name in _PLAIN},
        truth=tuple(truth),
        tracks=tuple(tracks),
        traces=TraceLog(**_under("traces/", arrays)) if with_traces else None,
        shown=from_arrays(_under("shown/", arrays)),
        ego_speed=speed,
        light=arrays["light"],
        timing_ms=_under("timing_ms/", arrays),
    )


def _under(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Give the arrays whose names begin with ``prefix``, without it."""
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def _split(rows: NDArray[Any], counts: NDArray[np.int64]) -> list[NDArray[Any]]:
    """Cut joined rows into frames again."""
    if len(rows) != counts.sum():
        raise ValueError(f"it has {len(rows)} rows where its frames count {counts.sum()}")
    return np.split(rows, np.cumsum(counts)[:-1])


def _split_given(
    rows: NDArray[Any], counts: NDArray[np.int64], given: NDArray[np.bool_]
) -> list[NDArray[Any] | None]:
    """As `_split`, for values that some frames lack."""
    parts = _split(rows, np.where(given, counts, 0))
    return [part if has else None for part, has in zip(parts, given, strict=True)]
