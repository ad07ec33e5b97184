"""Where a cluster of tracks carries a point: paper 2, section 4.1, with a ridge that leads to the identity.

Piterbarg, Ozgokmen, A simple prediction algorithm for the Lagrangian motion in two-dimensional turbulent
flows, SIAM Journal on Applied Mathematics 63, 2002. Predictors on one road lie almost on a line, so the
scatter S(0) is nearly singular: the map is taken to be near the identity unless the predictors say otherwise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def affine(reference: ArrayLike, current: ArrayLike, ridge: float) -> Floats:
    """Return A (2, 2) = (S(t) + lambda I) (S(0) + lambda I)^-1 of M >= 3 predictors.

    Args:
        reference: (M, 2) where the predictors were, px.
        current: (M, 2) where they are.
        ridge: lambda, px^2: the variance of a coordinate over that of the entries of A. 0 is least squares;
            where it is large the cluster is only shifted.
    """
    reference, current = np.asarray(reference, float), np.asarray(current, float)
    before, now = reference - reference.mean(0), current - current.mean(0)
    scatter = before.T @ before
    change = now.T @ before - scatter
    return np.asarray(np.eye(2) + change @ np.linalg.pinv(scatter + ridge * np.eye(2), hermitian=True))


def similarity(reference: ArrayLike, current: ArrayLike, ridge: float) -> Floats:
    """Return the turn and stretch (2, 2) of two predictors, as `affine` led to the identity."""
    reference, current = np.asarray(reference, float), np.asarray(current, float)
    before = (reference - reference.mean(0)) @ np.array([1.0, 1.0j])
    now = (current - current.mean(0)) @ np.array([1.0, 1.0j])
    size = float((np.abs(before) ** 2).sum()) + ridge
    if size == 0.0:
        return np.eye(2)
    factor = (complex((np.conj(before) * now).sum()) + ridge) / size
    return np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])


def carry(
    reference: ArrayLike, current: ArrayLike, point: ArrayLike, *, ridge: float = 25.0
) -> tuple[Floats, Floats]:
    """Carry a point along with its predictors: translation by one, similarity by two, an affine map by more.

    Args:
        reference: (M, 2) where M >= 1 predictors were when the point was, px.
        current: (M, 2) where they are.
        point: (2,) px.
        ridge: lambda, px^2, as in `affine`.

    Returns:
        Where the point is, (2,), and what the map leaves of each predictor's way, (M, 2), px.

    Raises:
        ValueError: If there is no predictor.
    """
    reference, current = np.asarray(reference, float), np.asarray(current, float)
    count = len(reference)
    if count == 0:
        raise ValueError("no predictor, wanted one or more")
    turn = np.eye(2)
    if count > 2:
        turn = affine(reference, current, ridge)
    elif count == 2:
        turn = similarity(reference, current, ridge)
    before, now = reference.mean(0), current.mean(0)
    left = current - now - (reference - before) @ turn.T
    return np.asarray(now + turn @ (np.asarray(point, float) - before)), left
