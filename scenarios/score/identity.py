"""The identity measures (Ristani et al. 2016)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from scenarios.score.sequence import Sequence


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Counts of boxes under the best one-to-one assignment of whole tracks to whole objects."""

    true_positives: int
    false_negatives: int
    false_positives: int

    @property
    def idf1(self) -> float:
        """2 TP / (boxes of truth + boxes of tracks); 0 without boxes."""
        return self.true_positives / max(
            1.0, self.true_positives + 0.5 * (self.false_positives + self.false_negatives)
        )

    @property
    def recall(self) -> float:
        """TP / boxes of truth; 0 without truth."""
        return self.true_positives / max(1, self.true_positives + self.false_negatives)

    @property
    def precision(self) -> float:
        """TP / boxes of tracks; 0 without any."""
        return self.true_positives / max(1, self.true_positives + self.false_positives)


def identity(sequence: Sequence, *, threshold: float = 0.5) -> Identity:
    """Compute the identity measures.

    Misses and false boxes are fewest together where the frames in which objects agree with their tracks are
    most, so the assignment simply maximises those.

    Args:
        sequence: Frames of ids and similarities.
        threshold: Least similarity of two boxes that agree.
    """
    agreeing = np.zeros((sequence.truth_count, sequence.track_count), np.int64)
    for truths, tracks, similarity in zip(
        sequence.truths, sequence.tracks, sequence.similarities, strict=True
    ):
        agreeing[np.ix_(truths, tracks)] += similarity >= threshold
    rows, columns = linear_sum_assignment(agreeing, maximize=True)
    true_positives = int(agreeing[rows, columns].sum())
    return Identity(
        true_positives=true_positives,
        false_negatives=sequence.truth_boxes - true_positives,
        false_positives=sequence.track_boxes - true_positives,
    )
