"""Joint probabilistic data association: gates, clusters, probabilities, moments (paper 3, section III).

Paper 3's eqs. (19)-(27) with the factors that its prose lacks (Bar-Shalom, Daum, Huang, IEEE Control Systems
29(6), 2009): of Poisson clutter with density lambda, an association event weighs the product of

    L[i, 0] = 1 - P_D P_G,    L[i, j] = P_D N(z_j; H x_i, S_i) / lambda inside the gate, else 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtri

from tracker.filtering import matchings

Floats = NDArray[np.float64]

BUDGET = 1 << 20
"""States of a cluster up to which its probabilities are exact: some 10 ms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Innovations:
    """What M measurements say to N predicted targets.

    Attributes:
        residuals: (N, M, m) measurement minus its prediction.
        spread: (N, m, m) S, covariance of a residual.
        gain: (N, n, m) K of the Kalman filter.
        distances: (N, M) squared Mahalanobis distance.
        densities: (N, M) Gaussian density of the residual, per unit of the measurement's space.
    """

    residuals: Floats
    spread: Floats
    gain: Floats
    distances: Floats
    densities: Floats


def innovations(
    mean: Floats, covariance: Floats, measurements: Floats, observation: Floats, noise: Floats
) -> Innovations:
    """Compare predictions with measurements.

    Args:
        mean: (N, n) predicted states.
        covariance: (N, n, n) theirs.
        measurements: (M, m).
        observation: (m, n) H.
        noise: (m, m) R of all measurements, or (N, m, m) by target.
    """
    crossed = covariance @ observation.T
    spread = observation @ crossed + noise
    inverse = np.linalg.inv(spread)
    residuals = measurements[None] - (mean @ observation.T)[:, None]
    distances = np.einsum("nma,nab,nmb->nm", residuals, inverse, residuals)
    height = 1.0 / np.sqrt(np.linalg.det(2.0 * np.pi * spread))
    return Innovations(
        residuals=residuals,
        spread=spread,
        gain=crossed @ inverse,
        distances=distances,
        densities=height[:, None] * np.exp(-0.5 * distances),
    )


def gate_distance(probability: float, dimensions: int = 2) -> float:
    """Return the squared Mahalanobis distance that holds a target's own measurement with ``probability``."""
    return float(chdtri(dimensions, 1.0 - probability))


def likelihoods(found: Innovations, *, detection: ArrayLike, gate: float, clutter: ArrayLike) -> Floats:
    """Weigh each target's choices: column 0 is a miss, column j measurement j - 1.

    What else tells whether a measurement is the target's, such as colour, enters as a likelihood ratio
    against clutter: multiply the columns from 1 by it.

    Args:
        found: Residuals of N targets and M measurements.
        detection: P_D in [0, 1), one or (N,); higher makes an empty gate more surprising.
        gate: P_G in (0, 1]: the share of a target's own measurements that the gate keeps; 1 is no gate.
        clutter: lambda, one or (M,): false measurements per unit of the measurement's space; higher makes
            every measurement less telling.

    Returns:
        (N, M + 1).
    """
    count, measured = found.distances.shape
    detection = np.broadcast_to(np.asarray(detection, float), count)
    weights = np.empty((count, measured + 1))
    weights[:, 0] = 1.0 - detection * gate
    inside = found.distances <= gate_distance(gate, found.residuals.shape[2])
    weights[:, 1:] = np.where(inside, detection[:, None] * found.densities / np.asarray(clutter), 0.0)
    return weights


@dataclass(frozen=True, slots=True, kw_only=True)
class Association:
    """How N targets and M measurements belong together.

    Attributes:
        beta: (N, M + 1) probability that a target was missed (column 0) or caused measurement j - 1, (26).
        clusters: (N,) int64 number of the cluster: targets that share measurements, also through others.
        approximate: (N,) bool, whether the target's cluster was beyond the budget and its probabilities come
            from belief propagation.
    """

    beta: Floats
    clusters: NDArray[np.int64]
    approximate: NDArray[np.bool_]


def associate(weights: Floats, budget: int = BUDGET) -> Association:
    """Return the association probabilities under the rule that no two targets cause one measurement.

    Exact for each cluster up to ``budget`` states (`tracker.filtering.matchings`), beyond it by loopy belief
    propagation.

    Args:
        weights: (N, M + 1) as from `likelihoods`; a miss must be possible.
        budget: States; each takes eight bytes and some ten nanoseconds. 0 is belief propagation for all.

    Raises:
        ValueError: If a weight is negative or not finite, or a miss impossible.
    """
    if not (np.isfinite(weights).all() and (weights >= 0.0).all() and (weights[:, 0] > 0.0).all()):
        raise ValueError("weights must be finite and not negative, those of a miss positive (P_D P_G < 1)")
    beta, clusters, approximate = _by_cluster(np.ascontiguousarray(weights[:, 1:] / weights[:, :1]), budget)
    return Association(beta=beta, clusters=clusters, approximate=approximate)


@njit(cache=True)
def _by_cluster(odds, budget):  # type: ignore[no-untyped-def]
    targets, measured = odds.shape
    of_target, of_measurement = matchings.components(odds > 0.0)
    beta, approximate = np.zeros((targets, measured + 1)), np.zeros(targets, np.bool_)
    beta[:, 0] = 1.0
    for cluster in range(of_target.max() + 1 if targets else 0):
        rows, columns = np.flatnonzero(of_target == cluster), np.flatnonzero(of_measurement == cluster)
        if columns.size == 0:
            continue
        own = np.empty((rows.size, columns.size))
        for a in range(rows.size):
            for b in range(columns.size):
                own[a, b] = odds[rows[a], columns[b]]
        turned = np.ascontiguousarray(own.T)
        upright, lying = matchings.plan(own > 0.0), matchings.plan(turned > 0.0)
        costs = matchings.states(upright[3]), matchings.states(lying[3])
        if min(costs) > budget:
            found = matchings.propagate(own, 1e-9, 10_000)
            approximate[rows] = True
        elif costs[0] <= costs[1]:
            found = matchings.marginals(own, *upright)
        else:
            found = matchings.marginals(turned, *lying).T
        for a in range(rows.size):
            missed = 1.0
            for b in range(columns.size):
                beta[rows[a], columns[b] + 1] = found[a, b]
                missed -= found[a, b]
            beta[rows[a], 0] = max(missed, 0.0)
    return beta, of_target, approximate


def without_misses(beta: Floats) -> Floats:
    """Renormalise so that a target always takes some measurement: eq. (28) as printed.

    Of a target with nothing in its gate (28) is 0 / 0; it stays missed for sure, so that (29) leaves it where
    it was predicted.

    Args:
        beta: (N, M + 1).

    Returns:
        (N, M + 1), column 0 is 0, or 1 for an empty gate.
    """
    shares = beta.copy()
    shares[:, 0] = 0.0
    total = shares.sum(1)
    empty = total == 0.0
    shares[~empty] /= total[~empty, None]
    shares[empty, 0] = 1.0
    return shares


def update(mean: Floats, covariance: Floats, found: Innovations, beta: Floats) -> tuple[Floats, Floats]:
    """Correct N targets by all measurements, each by its probability: eq. (27), (29) with `without_misses`.

    The covariance, which the paper does not give, is the mixture's: it grows where measurements disagree.

    Args:
        mean: (N, n) predicted.
        covariance: (N, n, n) predicted.
        found: Of the same targets.
        beta: (N, M + 1).

    Returns:
        Mean (N, n) and covariance (N, n, n).
    """
    shares = beta[:, 1:]
    mixed = np.einsum("nm,nma->na", shares, found.residuals)
    scatter = np.einsum("nm,nma,nmb->nab", shares, found.residuals, found.residuals)
    scatter -= mixed[:, :, None] * mixed[:, None, :]
    turned = np.swapaxes(found.gain, 1, 2)
    certain = (1.0 - beta[:, 0])[:, None, None] * found.spread
    return mean + (found.gain @ mixed[..., None])[..., 0], covariance - found.gain @ (
        certain - scatter
    ) @ turned
