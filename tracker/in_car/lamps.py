"""Points that may lie on a tail lamp: redder than what is around them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tracker.in_car.relief import RED, Relief

Floats = NDArray[np.float64]

# Difference in redness, grey levels, between so many px around a point and so much wider surroundings, from
# which on it may be on a tail lamp. Its vehicle may stand while the ego moves, and so move like the scenery.
LAMP_RED, LAMP_REACH, AROUND = 25.0, 2, 10


def on_lamp(relief: Relief, position: Floats) -> NDArray[np.bool_]:
    """Tell which points (N, 2) may be on a tail lamp (N,): redder than what is around."""
    column, row = position.astype(np.int64).T
    near, wide = (_redness(relief, column, row, reach) for reach in (LAMP_REACH, AROUND))
    return np.asarray(near - wide > LAMP_RED)


def _redness(relief: Relief, column: NDArray[np.int64], row: NDArray[np.int64], reach: int) -> Floats:
    """Return the mean redness (N,) within so many px of pixels (N,)."""
    red = relief.sums[RED]
    height, width = red.shape
    x0, x1 = (column - reach).clip(0), (column + reach + 1).clip(0, width - 1)
    y0, y1 = (row - reach).clip(0), (row + reach + 1).clip(0, height - 1)
    total = 0.5 * (red[y1, x1] - red[y0, x1] - red[y1, x0] + red[y0, x0])
    return np.asarray(total / ((x1 - x0) * (y1 - y0)))
