"""Higher order tracking accuracy (Luiten et al. 2021)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scenarios.score.sequence import Sequence, frequencies

ALPHAS: NDArray[np.float64] = np.arange(1, 20) / 20
"""The localisation thresholds .05, .10, ..., .95."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hota:
    """HOTA and its parts at each threshold: arrays (19,) over `ALPHAS`; the score is their mean."""

    hota: NDArray[np.float64]
    deta: NDArray[np.float64]
    assa: NDArray[np.float64]
    detection_recall: NDArray[np.float64]
    detection_precision: NDArray[np.float64]
    association_recall: NDArray[np.float64]
    association_precision: NDArray[np.float64]
    localisation: NDArray[np.float64]


def hota(sequence: Sequence) -> Hota:
    """Compute HOTA: the geometric mean of how well boxes are found and how well identities are kept.

    As in the paper, each frame's matching favours the pairs that agree over the whole sequence: it maximises
    alignment times similarity, where alignment is the Jaccard index of two identities' frames, each frame
    counted by the pair's share of the similarities around it. Without truth or tracks all parts are 0 but
    the localisation, which is 1.
    """
    truth_frames = frequencies(sequence.truths, sequence.truth_count)[:, None]
    track_frames = frequencies(sequence.tracks, sequence.track_count)[None, :]
    alignment = _alignment(sequence, truth_frames + track_frames)
    matches = np.zeros((len(ALPHAS), sequence.truth_count, sequence.track_count))
    similarity_sum = np.zeros(len(ALPHAS))
    for truths, tracks, similarity in zip(
        sequence.truths, sequence.tracks, sequence.similarities, strict=True
    ):
        if not len(truths) or not len(tracks):
            continue
        rows, columns = linear_sum_assignment(alignment[np.ix_(truths, tracks)] * similarity, maximize=True)
        found = similarity[rows, columns]
        good = found >= ALPHAS[:, None] - np.finfo(float).eps
        matches[:, truths[rows], tracks[columns]] += good
        similarity_sum += good @ found

    pairs = matches.sum(axis=(1, 2))
    recall = pairs / max(1, sequence.truth_boxes)
    precision = pairs / max(1, sequence.track_boxes)
    deta = pairs / np.maximum(1, sequence.truth_boxes + sequence.track_boxes - pairs)

    def weighted(whole: NDArray[np.float64] | NDArray[np.int64]) -> NDArray[np.float64]:
        """Mean over the matched boxes of the share that their pair's matches have in ``whole``."""
        shares = matches * matches / np.maximum(1, whole)
        return np.asarray(shares.sum(axis=(1, 2)) / np.maximum(1, pairs))

    assa = weighted(truth_frames + track_frames - matches)
    return Hota(
        hota=np.sqrt(deta * assa),
        deta=deta,
        assa=assa,
        detection_recall=recall,
        detection_precision=precision,
        association_recall=weighted(truth_frames),
        association_precision=weighted(track_frames),
        localisation=np.divide(similarity_sum, pairs, out=np.ones(len(ALPHAS)), where=pairs > 0),
    )


def _alignment(sequence: Sequence, frames: NDArray[np.int64]) -> NDArray[np.float64]:
    """Give the soft Jaccard index (G, P) of objects' and tracks' frames; ``frames`` is both counts added."""
    shared = np.zeros((sequence.truth_count, sequence.track_count))
    for truths, tracks, similarity in zip(
        sequence.truths, sequence.tracks, sequence.similarities, strict=True
    ):
        around = similarity.sum(0)[None, :] + similarity.sum(1)[:, None] - similarity
        shared[np.ix_(truths, tracks)] += np.divide(
            similarity, around, out=np.zeros_like(similarity), where=around > np.finfo(float).eps
        )
    return np.asarray(shared / (frames - shared))
