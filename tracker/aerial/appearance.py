"""Appearance context: how a hidden vehicle's pictures vary, and how they differ from the others' (paper 2).

A picture is the region along the vehicle's heading, as RGB values of a fixed patch. Differences of two
pictures of one vehicle (intra-class) and of pictures of two vehicles (inter-class) are Gaussian, each number
by itself. Over all pairs their mean and variance follow from those of the pictures: no pair has to be formed.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

PATCH = (12, 6)
"""Length and width of a patch, cells."""
MEMORY = 16
"""Pictures of a vehicle that are kept."""
FLOOR = 4.0
"""Least standard deviation of a difference, grey levels."""
USUAL = 14.0
"""Standard deviation of a difference within a vehicle where nothing better is known, grey levels."""
STRANGE = 40.0
"""Standard deviation of what vehicles look like, grey levels, at least."""
SIGHT = 15.0
"""Standard deviation of a difference between two sights of a vehicle, beyond that within one, grey levels:
light and shadow have changed."""
SHIFT = 1.0
"""Cells by which the patches of two sights are usually out of line."""
BELIEF = 6.0
"""Pictures that the pooled variance counts for."""


def cut(image: NDArray[np.uint8], centre: ArrayLike, along: ArrayLike, across: ArrayLike) -> Floats:
    """Return the picture of a vehicle: ``PATCH`` cells of RGB, front to rear, as (D,) values.

    Args:
        image: (H, W, 3).
        centre: (2,) px.
        along: (2,) from the centre to the middle of the front, px.
        across: (2,) from the centre to the middle of the right side, px.
    """
    centre, along, across = (np.asarray(v, float) for v in (centre, along, across))
    cells, beside = PATCH
    # Of a cell (i along from the front, j across from the left) to its place; cell centres at +0.5.
    step_i, step_j = -2.0 * along / cells, 2.0 * across / beside
    first = centre + along - across + 0.5 * (step_i + step_j) - 0.5
    place = np.column_stack([step_i, step_j, first])
    warped = cv2.warpAffine(
        image,
        place,
        (cells, beside),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(warped, np.float64).reshape(-1)


@dataclass(frozen=True, slots=True)
class Gaussian:
    """Independent Gaussians: (D,) means and variances."""

    mean: Floats
    variance: Floats

    def log_density(self, differences: Floats) -> Floats:
        """Return (...) the mean log density a dimension of differences (..., D)."""
        apart = (differences - self.mean) ** 2 / self.variance
        return np.asarray(-0.5 * (apart + np.log(2.0 * np.pi * self.variance)).mean(-1))


def intra(pictures: Floats, pooled: Floats) -> Gaussian:
    """Return the variation within a vehicle, of pictures (L, D) and the pooled variance (D,).

    Ordered pairs have mean 0, and the variance of their differences is twice the pictures' own; it is shrunk
    to the pooled one, which alone stands where there is one picture.
    """
    count = len(pictures)
    own = 2.0 * pictures.var(0, ddof=1) if count > 1 else pooled
    shrunk = ((count - 1) * own + BELIEF * pooled) / (count - 1 + BELIEF)
    return Gaussian(np.zeros(pictures.shape[1]), np.maximum(shrunk, FLOOR**2))


def inter(pictures: Floats, others: Floats, pooled: Floats) -> Gaussian:
    """Return the variation between two vehicles, over all pairs of pictures (L, D) and (K, D).

    The mean is that of the differences; their variance is the sum of both vehicles' own, shrunk as `intra`.
    """
    variance = 0.5 * (intra(pictures, pooled).variance + intra(others, pooled).variance)
    return Gaussian(pictures.mean(0) - others.mean(0), variance)


def pool(groups: list[Floats]) -> Floats:
    """Return the variance (D,) of differences within vehicles, over those (L, D) with several pictures."""
    several = [group for group in groups if len(group) > 1]
    usual = np.full(PATCH[0] * PATCH[1] * 3, USUAL**2)
    squares = sum((((g - g.mean(0)) ** 2).sum(0) for g in several), np.zeros_like(usual))
    count = sum(len(g) - 1 for g in several)
    return np.asarray((2.0 * squares + BELIEF * usual) / (count + BELIEF))


def log_ratios(pictures: Floats, hidden: list[Floats], worth: float) -> Floats:
    """Weigh new vehicles against hidden ones by their looks.

    Args:
        pictures: (M, D), of each new vehicle one.
        hidden: N arrays (L, D) of what the hidden vehicles looked like.
        worth: Independent dimensions that a picture is worth.

    Returns:
        (N, M) the log density of the differences to hidden vehicle i if the new one is i, less that if it is
        anybody else: like one of the other hidden, all as likely, or like no one in particular; a dimension
        each. Among vehicles that all look alike looks say nothing.
    """
    if not hidden or not len(pictures):
        return np.zeros((len(hidden), len(pictures)))
    pooled = pool(hidden)
    within = [intra(group, pooled) for group in hidden]
    middles = np.array([group.mean(0) for group in hidden])
    variances = np.array([gaussian.variance for gaussian in within]) + between_sights(middles)
    strange = Gaussian(middles.mean(0), pooled + (STRANGE**2 + middles.var(0)))
    ratios = np.empty((len(hidden), len(pictures)))
    for j, picture in enumerate(pictures):
        unlike = float(strange.log_density(picture))
        squares = (picture - middles) ** 2
        for i, group in enumerate(hidden):
            own = Gaussian(within[i].mean, variances[i])
            # If the new vehicle were k, its differences to i would be those of k to i, as `inter` has them.
            between = 0.5 * (variances + variances[i])
            others = -0.5 * (squares / between + np.log(2.0 * np.pi * between)).mean(1)
            others[i] = unlike
            most = others.max()
            anybody = most + np.log(np.exp(worth * (others - most)).mean()) / worth
            ratios[i, j] = np.median(own.log_density(picture - group)) - anybody
    return ratios


def between_sights(middles: Floats) -> Floats:
    """Return the variance (N, D) that is added between two sights of vehicles with mean pictures (N, D).

    A patch that is out of line changes where the picture does.
    """
    cells = middles.reshape(-1, PATCH[1], PATCH[0], 3)
    beside, along = np.gradient(cells, axis=(1, 2))
    return np.asarray(SIGHT**2 + SHIFT**2 * (along**2 + beside**2)).reshape(middles.shape)
