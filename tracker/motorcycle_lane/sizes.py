"""How large a rider is at which row of the picture, learnt from the regions of the foreground that move.

On a plane seen in perspective sizes grow linearly with the row. A region may hold several riders, or a part
of one, and shadows; but those that hold one are of one size, while the others are of any. So the line is
scaled to the mode of the regions' sizes, and then fitted to what lies about it by a redescending estimator
(Welsch's; Holland, Welsch, Robust regression using iteratively reweighted least-squares, 1977).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CAPACITY = 600
"""Samples that are kept: the newest."""
ENOUGH = 30
BEYOND = 0.15
"""How far beyond the rows that were sampled the line holds, as a share of the picture's height."""
TOLERANCE = 0.25
"""Relative deviation at which a sample loses its say."""
MODE_WIDTH = 0.15
"""Spread of the logarithms of the sizes of single riders."""
SMALLEST = 4.0
# A slope must be told by the samples: this much holds it back, as if that many said there was none.
_HELD = np.diag([0.0, 0.3])
_FACTORS = np.linspace(-1.0, 0.5, 16)


class SizeModel:
    """Width and height of a rider as lines over the row of its centre."""

    def __init__(self, width: int, height: int) -> None:
        self._rows, self._sizes = np.zeros(0), np.zeros((0, 2))
        self._scale = float(height)
        self._fresh = 0
        self._limits = np.array([np.inf, -np.inf])
        # Offset, and slope per picture height, of width and height.
        self._lines = np.array([[0.06 * width, 0.1 * width], [0.0, 0.0]])

    def known(self, rows: Floats) -> NDArray[np.bool_]:
        """Tell of which rows (N,) enough was seen to tell one rider from two."""
        return np.asarray((self._limits[0] <= rows) & (rows <= self._limits[1]))

    def sizes(self, rows: Floats) -> Floats:
        """Return (N, 2) width and height, px, of riders whose centres lie at ``rows`` (N,)."""
        if np.isfinite(self._limits).all():
            rows = np.clip(rows, *self._limits)
        return np.asarray(np.maximum(self._lines[0] + self._lines[1] * rows[:, None] / self._scale, SMALLEST))

    def learn(self, rows: Floats, sizes: Floats) -> None:
        """Take in the regions of a frame that moved.

        Args:
            rows: (K,) of their centres, px.
            sizes: (K, 2) their widths and heights, px.
        """
        self._rows = np.concatenate([self._rows, rows])[-CAPACITY:]
        self._sizes = np.concatenate([self._sizes, sizes])[-CAPACITY:]
        self._fresh += len(rows)
        if len(self._rows) >= ENOUGH and self._fresh >= len(self._rows) // 8:
            self._fresh = 0
            self._lines = robust_lines(self._rows / self._scale, self._sizes)
            beyond = BEYOND * self._scale * np.array([-1.0, 1.0])
            self._limits = np.quantile(self._rows, [0.02, 0.98]) + beyond


def robust_lines(places: Floats, sizes: Floats, rounds: int = 5) -> Floats:
    """Return (2, 2) offset and slope of the widths and heights that most samples agree on.

    Args:
        places: (K,) rows, as shares of the picture's height.
        sizes: (K, 2) width and height, px.
        rounds: Of reweighting.
    """
    design = np.stack([np.ones(len(places)), places - places.mean()], 1)
    lines = _fitted(design, sizes, np.ones(len(places)))
    ratios = np.log(sizes / np.maximum(design @ lines, SMALLEST))
    near = np.exp(-0.5 * ((ratios[:, None] - _FACTORS[None, :, None]) / MODE_WIDTH) ** 2)
    votes = near[:, :, 0].T @ near[:, :, 1]
    lines *= np.exp(_FACTORS[np.array(np.unravel_index(votes.argmax(), votes.shape))])
    for _ in range(rounds):
        deviation = ((sizes / np.maximum(design @ lines, SMALLEST) - 1.0) ** 2).sum(1)
        lines = _fitted(design, sizes, np.exp(-0.5 * deviation / TOLERANCE**2) + 1e-6)
    return np.stack([lines[0] - lines[1] * places.mean(), lines[1]])


def _fitted(design: Floats, sizes: Floats, weights: Floats) -> Floats:
    weighted = design * weights[:, None]
    return np.asarray(np.linalg.solve(design.T @ weighted + _HELD, weighted.T @ sizes), np.float64)
