"""The CLEAR MOT measures (Bernardin and Stiefelhagen 2008), in the form that TrackEval gives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from scenarios.score.sequence import Sequence, frequencies

_CONTINUITY = 1000.0
"""What keeping last frame's partner is worth: more than any sum of similarities."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Clear:
    """CLEAR's counts.

    Attributes:
        true_positives: Matched pairs of boxes.
        false_negatives: Boxes of truth without a match.
        false_positives: Boxes of tracks without a match.
        id_switches: Matches of an object whose last match was with another track.
        fragmentations: How often the following of an object was taken up again.
        mostly_tracked: Objects matched in more than 0.8 of their frames.
        partly_tracked: In 0.2 to 0.8.
        mostly_lost: In less than 0.2.
        similarity: Sum over the matched pairs.
    """

    true_positives: int
    false_negatives: int
    false_positives: int
    id_switches: int
    fragmentations: int
    mostly_tracked: int
    partly_tracked: int
    mostly_lost: int
    similarity: float

    @property
    def mota(self) -> float:
        """1 - (misses + false boxes + switches) / boxes of truth; 0 without truth."""
        truth = self.true_positives + self.false_negatives
        return (self.true_positives - self.false_positives - self.id_switches) / truth if truth else 0.0

    @property
    def motp(self) -> float:
        """Mean similarity of the matched pairs; 0 without any."""
        return self.similarity / max(1, self.true_positives)

    @property
    def recall(self) -> float:
        """Share of the boxes of truth that are matched; 0 without truth."""
        return self.true_positives / max(1, self.true_positives + self.false_negatives)

    @property
    def precision(self) -> float:
        """Share of the boxes of tracks that are matched; 0 without any."""
        return self.true_positives / max(1, self.true_positives + self.false_positives)


def clear(sequence: Sequence, *, threshold: float = 0.5) -> Clear:
    """Compute the CLEAR measures.

    In each frame the assignment first keeps as many of the last frame's pairs as it can, and among those
    assignments takes the one of the greatest similarity. A frame without truth or without tracks leaves the
    pairs of the frame before it in force, as in TrackEval. A switch is counted against an object's last
    match, however long ago that was.

    Args:
        sequence: Frames of ids and similarities.
        threshold: Least similarity of a match. Raising it turns loose boxes into a miss and a false box each.
    """
    matched_frames = np.zeros(sequence.truth_count, np.int64)
    fragments = np.zeros(sequence.truth_count, np.int64)
    last = np.full(sequence.truth_count, -1)
    partner = np.full(sequence.truth_count, -1)  # in the last frame that had both
    true_positives = switches = 0
    similarity_sum = 0.0
    for truths, tracks, similarity in zip(
        sequence.truths, sequence.tracks, sequence.similarities, strict=True
    ):
        if not len(truths) or not len(tracks):
            continue
        worth = similarity + _CONTINUITY * (tracks == partner[truths][:, None])
        worth[similarity < threshold - np.finfo(float).eps] = 0.0
        rows, columns = linear_sum_assignment(worth, maximize=True)
        good = worth[rows, columns] > np.finfo(float).eps
        rows, columns = rows[good], columns[good]
        objects, partners = truths[rows], tracks[columns]
        switches += int(np.sum((last[objects] >= 0) & (last[objects] != partners)))
        fragments[objects] += partner[objects] < 0
        matched_frames[objects] += 1
        last[objects] = partners
        partner[:] = -1
        partner[objects] = partners
        true_positives += len(rows)
        similarity_sum += float(similarity[rows, columns].sum())
    share = matched_frames / np.maximum(1, frequencies(sequence.truths, sequence.truth_count))
    mostly = int(np.sum(share > 0.8))
    lost = int(np.sum(share < 0.2))
    return Clear(
        true_positives=true_positives,
        false_negatives=sequence.truth_boxes - true_positives,
        false_positives=sequence.track_boxes - true_positives,
        id_switches=switches,
        fragmentations=int(np.maximum(fragments - 1, 0).sum()),
        mostly_tracked=mostly,
        partly_tracked=sequence.truth_count - mostly - lost,
        mostly_lost=lost,
        similarity=similarity_sum,
    )
