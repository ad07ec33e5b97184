"""Which hidden vehicle a new one is, or none: motion and appearance in one log likelihood ratio.

Every hidden vehicle may stay hidden, and every new one may never have been seen before: the assignment has a
place for 'none of them' in each row.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tracker.aerial import appearance
from tracker.filtering.assignment import Indices, assign

Floats = NDArray[np.float64]

STRAIGHT, BENT = 0.95, 0.5
"""Cosine of the angle between two sights' headings below which the sun has come to stand elsewhere, and by
how much less looks count there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """N hidden vehicles.

    Attributes:
        centres: (N, 2) where they are expected, px.
        covariances: (N, 2, 2) px^2.
        pictures: N arrays (L, D) of what they looked like.
        headings: (N, 2) unit vectors, of the last pictures.
        densities: (N, M) log of each one's density, a px^2, where the new vehicles are, and what their
            speeds speak for it.
    """

    centres: Floats
    covariances: Floats
    pictures: list[Floats]
    headings: Floats
    densities: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Appeared:
    """M new vehicles.

    Attributes:
        centres: (M, 2) px.
        pictures: (M, D).
        headings: (M, 2) unit vectors, of the last pictures.
        strangers: (M,) vehicles a px^2 that appear there and were never seen before.
    """

    centres: Floats
    pictures: Floats
    headings: Floats
    strangers: Floats


class Matcher(Protocol):
    """Tells which hidden vehicles the new ones are."""

    def __call__(self, hidden: Hidden, new: Appeared) -> tuple[Indices, Indices]:
        """Return rows of ``hidden`` and columns of ``new`` that are the same vehicles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fusion:
    """Motion and appearance in one.

    Attributes:
        motion: Whether the place counts beyond the gate.
        looks: Weight of the mean log likelihood ratio of appearance: as many independent dimensions as a
            picture is worth. 0 leaves appearance out.
        most: Greatest weight of looks, either way: light and partial views are not modelled.
        gate: Greatest squared Mahalanobis distance.
        least: Log likelihood ratio that a match needs. Raising it gives fewer wrong ones, and misses more.
    """

    motion: bool = True
    looks: float = 8.0
    most: float = 4.0
    gate: float = 36.0
    least: float = 0.0

    def __call__(self, hidden: Hidden, new: Appeared) -> tuple[Indices, Indices]:
        """Return rows of ``hidden`` and columns of ``new`` that are the same vehicles."""
        squared = distances(hidden, new)
        ratios = np.zeros_like(squared)
        if self.motion:
            ratios += hidden.densities - np.log(new.strangers)
        if self.looks:
            near = np.flatnonzero((squared <= self.gate).any(1))
            looks = appearance.log_ratios(new.pictures, [hidden.pictures[i] for i in near], self.looks)
            straight = hidden.headings[near] @ new.headings.T > STRAIGHT
            ratios[near] += np.where(straight, 1.0, BENT) * np.clip(self.looks * looks, -self.most, self.most)
        return best(np.where(squared <= self.gate, ratios, -np.inf), self.least)


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedStages:
    """As printed: whoever is near enough, then appearance in two stages; each new vehicle by itself.

    Attributes:
        reach: Px within which the forecast must lie.
    """

    reach: float = 60.0

    def __call__(self, hidden: Hidden, new: Appeared) -> tuple[Indices, Indices]:
        """Return rows of ``hidden`` and columns of ``new`` that are the same vehicles."""
        away = np.hypot(*(hidden.centres[:, None] - new.centres[None]).transpose(2, 0, 1))
        pairs: list[tuple[int, int]] = []
        for j in range(len(new.centres)):
            taken = {row for row, _ in pairs}
            near = [i for i in range(len(away)) if away[i, j] < self.reach and i not in taken]
            if near:
                groups = [hidden.pictures[i] for i in near]
                chosen = printed_choice(new.pictures[j], groups)
                if chosen is not None:
                    pairs.append((near[chosen], j))
        rows, columns = np.array(pairs, np.int64).reshape(-1, 2).T
        return rows, columns


@dataclass(frozen=True, slots=True, kw_only=True)
class Nearest:
    """Whoever is nearest, within a reach in px: what a user would try first."""

    reach: float = 60.0

    def __call__(self, hidden: Hidden, new: Appeared) -> tuple[Indices, Indices]:
        """Return rows of ``hidden`` and columns of ``new`` that are the same vehicles."""
        away = np.hypot(*(hidden.centres[:, None] - new.centres[None]).transpose(2, 0, 1))
        return assign(away, self.reach)


def distances(hidden: Hidden, new: Appeared) -> Floats:
    """Return (N, M) squared Mahalanobis distances of the new vehicles from the forecasts."""
    apart = new.centres[None] - hidden.centres[:, None]
    solved = np.linalg.solve(hidden.covariances[:, None], apart[..., None])[..., 0]
    return np.asarray((apart * solved).sum(-1))


def best(ratios: Floats, least: float) -> tuple[Indices, Indices]:
    """Assign one to one so that the sum of log likelihood ratios (N, M) is greatest.

    Below ``least`` 'none of them' is better; minus infinity means impossible.
    """
    count, others = ratios.shape
    if not count or not others:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    # A column of its own for each row stands for 'none of them'.
    none = np.where(np.eye(count, dtype=bool), 0.0, np.inf)
    gains = np.where(ratios > least, ratios - least, -np.inf)
    rows, columns = assign(np.concatenate([-gains, none], 1), np.finfo(float).max)
    real = columns < others
    return rows[real], columns[real]


def printed_choice(picture: Floats, groups: list[Floats]) -> int | None:
    """Choose as section 4.3 does: the least distance to a vehicle's own variation, then its verification.

    Distances are Mahalanobis', of the best of the pictures. Where one vehicle is hidden there is nothing to
    verify.
    """
    pooled = appearance.pool(groups)
    inside = [appearance.intra(group, pooled) for group in groups]
    nearest = [
        float((((picture - group) - own.mean) ** 2 / own.variance).sum(1).min())
        for group, own in zip(groups, inside, strict=True)
    ]
    chosen = int(np.argmin(nearest))
    for k, other in enumerate(groups):
        if k != chosen:
            between = appearance.inter(groups[chosen], other, pooled)
            apart = (picture - groups[chosen]) + between.mean
            if float((apart**2 / between.variance).sum(1).min()) <= nearest[chosen]:
                return None
    return chosen
