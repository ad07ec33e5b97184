"""What is kept of an episode: all that scores are computed from, so that scoring again never renders again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.truth.types import FrameTruth
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


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeLog:
    """One tracker on one episode of T frames.

    Attributes:
        scenario: Its name.
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
        ego_speed: (T,) float64, m/s; not a number where the camera is on no car.
        hashes: Hex digests by name: truth, frames, tracks.
        timing_ms: (T,) float64 by stage: world, render, sensor, truth, track.
    """

    scenario: str
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
    ego_speed: NDArray[np.float64]
    hashes: dict[str, str]
    timing_ms: dict[str, NDArray[np.float64]]
