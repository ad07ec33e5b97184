"""How far ahead of its forecast, or behind it, a hidden vehicle may be, given where it has not been seen.

A vehicle that goes faster or slower than it was forecast to goes on doing so: it keeps its place on the
ellipse of the forecast while that grows. Every frame in which nothing is seen where a vehicle would be in
plain view speaks against that place. So a forecast that has run out from under a bridge is held back below
it, and of two vehicles of one lane the first that went in is the first to come out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

OFFSETS: Floats = np.linspace(-3.2, 3.2, 33)
"""Standard deviations along the way, forward positive."""
FREEDOM = 4.0
"""Degrees of Student's distribution of offsets: drivers brake hard, and change lanes, too."""
LANE = 8.0 / 3.0
"""One over the greatest density of that distribution with a scale of 1."""
PRIOR: Floats = (1.0 + OFFSETS**2 / FREEDOM) ** (-0.5 * (FREEDOM + 1.0))
PRIOR /= PRIOR.sum()
DETECTION = 0.5
"""Chance that a vehicle in plain view is found in a frame, as far as frames are independent."""
FLOOR = 1e-3
"""Share of an offset's first weight that is left to it: what is known of bridges and trees may be wrong."""
STEP = float(OFFSETS[1] - OFFSETS[0])
LASTING = 1.25
"""How much faster a vehicle ahead of its forecast goes in the end, in how much faster it was on the whole: 1
if it always was, 1.5 if its acceleration is white noise."""
LEFT = 0.75
"""Variance of that speed once the place is known, in variances of the place over the time squared, if the
acceleration is white noise."""
SPEED = 0.35
"""Standard deviation of a new track's measured speed, and of what drivers do just then, px a frame."""
STRANGE = 0.2
"""Strangers' speeds, a px a frame: they go as fast as traffic may."""


class Belief:
    """The weights of one hidden vehicle's offsets.

    Attributes:
        weights: (K,) of `OFFSETS`; what they lack to 1 is the chance that it would have been seen.
    """

    def __init__(self) -> None:
        self.weights: Floats = PRIOR.copy()

    @property
    def unseen(self) -> float:
        """The chance that such a vehicle would not have been seen until now."""
        return float(self.weights.sum())

    @property
    def mean(self) -> float:
        """The expected offset."""
        return float(self.weights @ OFFSETS) / self.unseen

    def miss(self, visible: Floats) -> None:
        """Take in a frame without it, given the chances (K,) that it would be in view at each offset."""
        self.weights = np.maximum(self.weights * (1.0 - DETECTION * visible), FLOOR * PRIOR)

    def log_density(self, points: Floats, centre: Floats, heading: Floats, covariance: Floats) -> Floats:
        """Return (M,) the log density a px^2 at points (M, 2), if it is still there.

        Args:
            points: Px.
            centre: (2,) of the forecast.
            heading: (2,) unit vector along which it may be ahead.
            covariance: (2, 2) of the forecast, px^2.
        """
        along, across = deviations(heading, covariance)
        apart = points - centre
        ahead, beside = apart @ heading, apart @ np.array([-heading[1], heading[0]])
        # Between two offsets it may be anywhere.
        width = STEP * along
        near = np.exp(-0.5 * ((ahead[:, None] - along * OFFSETS) / width) ** 2) @ (self.weights / self.unseen)
        lane = -0.5 * (FREEDOM + 1.0) * np.log1p((beside / across) ** 2 / FREEDOM)
        return np.asarray(np.log(near + 1e-12) + lane - np.log(LANE * across * np.sqrt(2.0 * np.pi) * width))


def speed_log_ratio(faster: Floats, ahead: Floats, along: float, lead: float) -> Floats:
    """Weigh the speeds of new tracks: who is ahead of its forecast went faster, and goes faster now.

    Args:
        faster: (M,) px a frame by which they are faster than forecast.
        ahead: (M,) px by which they are ahead of the forecast.
        along: Standard deviation of the forecast along the way, px.
        lead: Frames since the hidden vehicle was seen.

    Returns:
        (M,) the log density if it is the hidden vehicle, less that of a stranger.
    """
    variance = LEFT * (along / lead) ** 2 + SPEED**2
    squared = (faster - LASTING * ahead / lead) ** 2 / variance
    tail = -0.5 * (FREEDOM + 1.0) * np.log1p(squared / FREEDOM)
    return np.asarray(tail - np.log(LANE * np.sqrt(variance)) - np.log(STRANGE))


def deviations(heading: Floats, covariance: Floats) -> tuple[float, float]:
    """Return the standard deviations along a heading (2,) and across it of a covariance (2, 2)."""
    across = np.array([-heading[1], heading[0]])
    return float(np.sqrt(heading @ covariance @ heading)), float(np.sqrt(across @ covariance @ across))
