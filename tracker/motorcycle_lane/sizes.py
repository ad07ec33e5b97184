"""How large a rider is at which row of the picture, learnt from what is seen of riders.

On a plane seen in perspective sizes grow linearly with the row. From the first frame on trees (widths.npz,
heights.npz; learnt as those of `tracker.motorcycle_lane.foreground`) guess from a pixel's surroundings how
large its vehicle is, be it alone or in a crowd. Later the regions of the foreground that travel tell it more
exactly. A region may hold several riders, or a part of one, and shadows; but those that hold one are of one
size, while the others are of any. So the line is voted for, with one horizon for widths and heights, and then
fitted to what lies about it by a redescending estimator (Welsch's; Holland, Welsch, Robust regression using
iteratively reweighted least-squares, 1977).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.boosting import Trees, log_odds
from tracker.motorcycle_lane.foreground import Weighed

Floats = NDArray[np.float64]
GUESSED_KEPT, TRAVELLED_KEPT = 2000, 600
"""Samples of either kind that are kept: the newest."""
ENOUGH = 200
"""Samples of a kind that make a line."""
SURE, GUESSES = 1.0, 60
"""Log odds from which on a pixel is asked how large its vehicle is; how many are asked in a frame."""
BEYOND = 0.4
"""How far beyond the rows that were sampled the line holds, as a share of the picture's height."""
TOLERANCE = 0.25
"""Relative deviation at which a sample loses its say."""
SMALLEST = 4.0
HORIZONS = (-1.0, -0.7, -0.5, -0.35, -0.25, -0.18, -0.12, -0.06, 0.0, 0.08, 0.16, 0.25, 0.35)
"""Rows at which sizes may vanish, as shares of the picture's height; 0 is its upper border."""
USUAL_HORIZON, HORIZON_SPREAD = -0.17, 0.2
"""Where the horizon of a camera that looks down on traffic lies, and its standard deviation."""
USUAL_SLOPE, SLOPE_SPREAD = 0.3, 1.0
"""Rows of a rider's height for each that it stands below the horizon: over a camera's of six metres; and the
standard deviation of its logarithm. Few samples of riders who hang together fit many lines."""
LEAST_BELOW = 0.05
"""How far below the horizon a sample must lie to tell of it."""
VOTE = 0.08
"""Width of the bins in which the logarithms of the scales are counted."""
SMOOTHING = 2.5
"""By so many bins the sizes of single riders differ."""
ASPECT, ASPECT_SPREAD = 0.45, 0.35
"""Width of a machine with its rider over their height, from front or back; and its logarithm's spread."""
OTHERS = 0.15
"""Share of lanes on which most vehicles are no motorcycles, but of any other aspect."""
# By so many samples about the voted lines each fitted one is held.
_HELD = np.diag([3.0, 3.0])


class Samples(NamedTuple):
    """Rows (K,) and sizes (K, 2), px."""

    rows: Floats
    sizes: Floats

    def joined(self, others: Samples, kept: int) -> Samples:
        """Return the newest of these and others, ``kept`` at most."""
        return Samples(*(np.concatenate(pair)[-kept:] for pair in zip(self, others, strict=True)))


def guessed(seen: Weighed, labels: NDArray[np.int32], heights: Floats, trees: Sequence[Trees]) -> Samples:
    """Guess from pixels of vehicles how large these are.

    Args:
        seen: The pixels near the foreground.
        labels: (H, W) of the regions of the foreground, 0 elsewhere: specks are asked nothing.
        heights: (H,) that were expected of a vehicle whose middle is in a row when they were weighed, px.
        trees: Two, for logarithms of a vehicle's width and height, over the height that was expected of it.
    """
    inside = labels[seen.squares.rows, seen.squares.columns] > 0
    sure = np.flatnonzero(inside & (seen.odds > SURE))
    asked = sure[:: max(-(-len(sure) // GUESSES), 1)]
    rows = seen.squares.rows[asked]
    logs = np.stack([log_odds(seen.cues[asked], weighed_by) for weighed_by in trees], 1)
    return Samples(rows.astype(np.float64), heights[rows, None] * np.exp(logs))


class SizeModel:
    """Width and height of a rider as lines over the row of its centre."""

    def __init__(self, height: int) -> None:
        self._scale = float(height)
        self._guessed = self._travelled = Samples(np.zeros(0), np.zeros((0, 2)))
        self._fresh = 0
        self._limits = np.array([np.inf, -np.inf])
        # Offset, and slope per picture height, of width and height: those of the usual camera at first.
        self._lines = USUAL_SLOPE * height * np.outer([-USUAL_HORIZON, 1.0], [ASPECT, 1.0])

    def known(self, rows: Floats) -> NDArray[np.bool_]:
        """Tell of which rows (N,) enough was seen to tell one rider from two."""
        return np.asarray((self._limits[0] <= rows) & (rows <= self._limits[1]))

    def sizes(self, rows: Floats) -> Floats:
        """Return (N, 2) width and height, px, of riders whose centres lie at ``rows`` (N,)."""
        low, high = self._limits
        if low <= high:
            rows = np.minimum(np.maximum(rows, low), high)
        return np.asarray(np.maximum(self._lines[0] + self._lines[1] * rows[:, None] / self._scale, SMALLEST))

    @property
    def settled(self) -> bool:
        """Whether regions that travelled tell the line.

        Guesses are many from the start, yet drawn to what is thought already; so from here on none are asked.
        """
        return len(self._travelled.rows) >= ENOUGH

    @property
    def line(self) -> tuple[Floats, Floats]:
        """(2,) width and height at row 0, px, and (2,) by how much they grow a row down the picture."""
        top, bottom = self.sizes(np.array([0.0, self._scale]))
        return top, (bottom - top) / self._scale

    def learn(self, samples: Samples, *, travelled: bool) -> None:
        """Take in what a frame shows.

        Args:
            samples: Rows of centres, and sizes.
            travelled: Whether they are regions that travelled (`tracker.motorcycle_lane.travellers`), else
                they are guesses.
        """
        if travelled:
            self._travelled = self._travelled.joined(samples, TRAVELLED_KEPT)
        else:
            self._guessed = self._guessed.joined(samples, GUESSED_KEPT)
        told = self._travelled if self.settled else self._guessed
        self._fresh += len(samples.rows)
        if len(told.rows) >= ENOUGH and self._fresh >= len(told.rows) // 8:
            self._fresh = 0
            self._lines = robust_lines(
                told.rows / self._scale, told.sizes, self._scale, one_horizon=self.settled
            )
            beyond = BEYOND * self._scale * np.array([-1.0, 1.0])
            self._limits = np.quantile(told.rows, [0.02, 0.98]) + beyond


def robust_lines(
    places: Floats, sizes: Floats, height: float, *, one_horizon: bool = False, rounds: int = 5
) -> Floats:
    """Return (2, 2) offset and slope of the widths and heights that most samples agree on.

    Args:
        places: (K,) rows, as shares of the picture's height.
        sizes: (K, 2) width and height, px.
        height: Of the picture, px.
        one_horizon: Whether widths vanish where heights do. Regions hold several abreast, more often so at
            the far end than nearby; seldom do they hold several one above another.
        rounds: Of reweighting.
    """
    voted = _voted(places, sizes, height)
    middle = places.mean()
    design = np.stack([np.ones(len(places)), places - middle], 1)
    start = np.stack([voted[0] + voted[1] * middle, voted[1]])
    lines = start
    for _ in range(rounds):
        deviation = ((sizes / np.maximum(design @ lines, SMALLEST) - 1.0) ** 2).sum(1)
        say = np.exp(-0.5 * deviation / TOLERANCE**2)
        weighted = design * say[:, None]
        lines = start + np.linalg.solve(design.T @ weighted + _HELD, weighted.T @ (sizes - design @ start))
        if one_horizon:
            tall = design @ lines[:, 1]
            lines[:, 0] = lines[:, 1] * (say * tall @ sizes[:, 0]) / (say * tall @ tall)
    return np.stack([lines[0] - lines[1] * middle, lines[1]])


def _voted(places: Floats, sizes: Floats, height: float) -> Floats:
    """Return (2, 2) lines that vanish at one row: the horizon and the two scales that most samples share.

    Votes count by how usual the aspect, the horizon and the scale of heights are.
    """
    most, best = -1.0, np.zeros((2, 2))
    for horizon in HORIZONS:
        below = places > horizon + LEAST_BELOW
        if not below.any():
            continue
        scales = np.log(sizes[below] / (places[below] - horizon)[:, None])
        low = scales.min(0) - VOTE
        at = ((scales - low) / VOTE).astype(np.int64)
        across, down = at.max(0) + 2
        votes = np.bincount(at[:, 1] * across + at[:, 0], minlength=int(across * down)).reshape(down, across)
        smooth = cv2.GaussianBlur(votes.astype(np.float64), (9, 9), SMOOTHING, borderType=cv2.BORDER_CONSTANT)
        centres = [low[k] + VOTE * (np.arange(n) + 0.5) for k, n in enumerate((across, down))]
        off = (centres[0][None] - centres[1][:, None] - np.log(ASPECT)) / ASPECT_SPREAD
        slope = (centres[1][:, None] - np.log(USUAL_SLOPE * height)) / SLOPE_SPREAD
        smooth *= OTHERS + (1.0 - OTHERS) * np.exp(-0.5 * off**2)
        smooth *= np.exp(-0.5 * (slope**2 + ((horizon - USUAL_HORIZON) / HORIZON_SPREAD) ** 2))
        if smooth.max() > most:
            most = float(smooth.max())
            row, column = np.unravel_index(smooth.argmax(), smooth.shape)
            slopes = np.exp(np.array([centres[0][column], centres[1][row]]))
            best = np.stack([-horizon * slopes, slopes])
    return best
