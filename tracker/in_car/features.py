"""What is seen in one frame: the working picture, its horizontal segments, corners and lamps."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.in_car import segments

Floats = NDArray[np.float64]

WORKING_WIDTH = 640
# Lamps are searched where the mean brightness lies below this, in full below the half of it.
DUSK = 80.0
# Brings the corner response of whole numbers to cv2's units, grey levels over 255: squares of Sobel's 4 and
# of a window of 3.
RESPONSE_UNIT = 1.0 / (4.0 * 3.0 * 255.0) ** 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A frame made small and single-channelled.

    Attributes:
        grey: (h, w) uint8, brightness that leans to red, so that tail lamps and red cars stay visible.
        red: (h, w) uint8, how much redder than green: tail lamps.
        scale: Original px per working px.
        brightness: Mean of ``grey``.
    """

    grey: NDArray[np.uint8]
    red: NDArray[np.uint8]
    scale: float
    brightness: float

    @property
    def night(self) -> float:
        """How dark it is, 0 (day) to 1 (night), a continuous measure."""
        return float(np.clip(2.0 - 2.0 * self.brightness / DUSK, 0.0, 1.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Features:
    """The features of one frame, in working px from the picture's upper left corner.

    Attributes:
        segments: (M, 6), see `tracker.in_car.segments.find_segments`.
        lamps: (L, 3) x, y, contrast of intensity peaks; none by day.
    """

    segments: Floats
    lamps: Floats


@njit(cache=True)
def _lean(luminance, red):  # type: ignore[no-untyped-def]
    """Mix a fifth of red into the luminance (N,), in place."""
    for k in range(luminance.size):
        luminance[k] = (
            np.uint16(4) * np.uint16(luminance[k]) + np.uint16(red[k]) + np.uint16(2)
        ) // np.uint16(5)


def working_picture(image: NDArray[np.uint8]) -> Picture:
    """Make a frame (H, W, 3) RGB small (about 640 px wide) and single-channelled."""
    height, width = image.shape[:2]
    scale = max(1.0, width / WORKING_WIDTH)
    if scale > 1.0:
        size = (round(width / scale), round(height / scale))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    # 0.44, 0.47, 0.09 of red, green and blue.
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
    red = cv2.extractChannel(image, 0)
    _lean(grey.reshape(-1), red.reshape(-1))
    redder = np.asarray(cv2.subtract(red, cv2.extractChannel(image, 1)), np.uint8)
    return Picture(grey=grey, red=redder, scale=width / grey.shape[1], brightness=float(cv2.mean(grey)[0]))


def find_features(picture: Picture, top: int, bottom: int) -> Features:
    """Find the features in rows [top, bottom) of a picture."""
    band = picture.grey[top:bottom]
    derivative = segments.vertical_derivative(band)
    found = segments.find_segments(derivative, segments.edge_threshold(derivative))
    found[:, segments.Y] += top
    lamps = find_lamps(band, picture.night)
    lamps[:, 1] += top
    return Features(segments=found, lamps=lamps)


@njit(cache=True)
def _peaks(smooth, surround, least, radius, limit):  # type: ignore[no-untyped-def]
    height, width = smooth.shape
    table = np.empty((limit, 3), np.float64)
    used = 0
    for row in range(radius, height - radius):
        for column in range(radius, width - radius):
            value = smooth[row, column]
            contrast = value - surround[row, column]
            if contrast < least:
                continue
            highest = True
            for i in range(row - radius, row + radius + 1):
                for j in range(column - radius, column + radius + 1):
                    # Of equal neighbours the first in reading order wins.
                    earlier = i < row or (i == row and j < column)
                    if smooth[i, j] > value or (earlier and smooth[i, j] == value):
                        highest = False
                        break
                if not highest:
                    break
            if highest and used < limit:
                table[used, 0] = column + 0.5
                table[used, 1] = row + 0.5
                table[used, 2] = contrast
                used += 1
    return table[:used]


def find_lamps(grey: NDArray[np.uint8], night: float, *, contrast: float = 30.0, limit: int = 400) -> Floats:
    """Find intensity peaks: lamps against the dark (paper 1, Fig. 6c).

    Args:
        grey: (H, W).
        night: How dark it is, [0, 1]; at 0 there are no lamps, and the less night, the more contrast is
            asked for.
        contrast: Grey levels above the mean of the surroundings, at full night.
        limit: Peaks returned at most.

    Returns:
        (L, 3): x, y, contrast.
    """
    if night <= 0.0:
        return np.zeros((0, 3))
    smooth = np.asarray(cv2.blur(grey, (3, 3)), np.int16)
    surround = np.asarray(cv2.blur(grey, (17, 17)), np.int16)
    found: Floats = _peaks(smooth, surround, contrast / night, 3, limit)
    return found


@njit(cache=True)
def _select(response, least, cell, taken, limit):  # type: ignore[no-untyped-def]
    height, width = response.shape
    places = np.empty((limit, 2), np.float32)
    used = 0
    for down in range(taken.shape[0]):
        for right in range(taken.shape[1]):
            if taken[down, right]:
                continue
            best, best_i, best_j = least, -1, -1
            for i in range(down * cell, min(down * cell + cell, height)):
                for j in range(right * cell, min(right * cell + cell, width)):
                    if response[i, j] > best:
                        best = response[i, j]
                        best_i, best_j = i, j
            if best_i >= 0 and used < limit:
                places[used, 0] = best_j
                places[used, 1] = best_i
                used += 1
    return places[:used]


def find_corners(
    response: NDArray[np.float32], held: NDArray[np.int64], cell: int, least: float, limit: int
) -> NDArray[np.float32]:
    """Find corners: the best one of each free cell of a grid.

    Args:
        response: (H, W) smaller eigenvalue of the structure tensor (`corner_response`).
        held: (K, 2) column, row of the points that are followed already; their cells get no new point.
        cell: Side of a cell, px.
        least: Least response.
        limit: Corners returned at most.

    Returns:
        (N, 2) float32 column, row, in reading order of the cells.
    """
    height, width = response.shape
    taken = np.zeros((-(-height // cell), -(-width // cell)), np.bool_)
    taken[held[:, 1] // cell, held[:, 0] // cell] = True
    found: NDArray[np.float32] = _select(response, least, cell, taken, limit)
    return found


@njit(cache=True)
def _weaker(grey, first, last):  # type: ignore[no-untyped-def]
    height, width = grey.shape
    response = np.zeros((last - first, width), np.float32)
    # Of one row: sums and differences over three rows, and products of the gradients.
    smooth, step = np.zeros(width, np.int32), np.zeros(width, np.int32)
    products = np.zeros((3, width), np.int32)
    # Of the last three rows: the products summed over three columns.
    sums = np.zeros((3, 3, width), np.int32)
    unit, half = np.float32(RESPONSE_UNIT), np.float32(0.5)
    begin = max(first - 1, 1)
    for i in range(begin, min(last + 1, height - 1)):
        above, here, below = grey[i - 1], grey[i], grey[i + 1]
        for j in range(width):
            smooth[j] = np.int32(above[j]) + 2 * np.int32(here[j]) + np.int32(below[j])
            step[j] = np.int32(below[j]) - np.int32(above[j])
        left, right = smooth[: width - 2], smooth[2:]
        before, middle, after = step[: width - 2], step[1 : width - 1], step[2:]
        pxx, pxy, pyy = products[0, 1 : width - 1], products[1, 1 : width - 1], products[2, 1 : width - 1]
        for j in range(width - 2):
            x, y = right[j] - left[j], before[j] + 2 * middle[j] + after[j]
            pxx[j], pxy[j], pyy[j] = x * x, x * y, y * y
        for k in range(3):
            product, total = products[k], sums[k, i % 3, 1 : width - 1]
            for j in range(width - 2):
                total[j] = product[j] + product[j + 1] + product[j + 2]
        if i < begin + 2:
            continue
        result = response[i - 1 - first, 2 : width - 2]
        xx0, xx1, xx2 = sums[0, 0, 2 : width - 2], sums[0, 1, 2 : width - 2], sums[0, 2, 2 : width - 2]
        xy0, xy1, xy2 = sums[1, 0, 2 : width - 2], sums[1, 1, 2 : width - 2], sums[1, 2, 2 : width - 2]
        yy0, yy1, yy2 = sums[2, 0, 2 : width - 2], sums[2, 1, 2 : width - 2], sums[2, 2, 2 : width - 2]
        for j in range(width - 4):
            xx = half * np.float32(xx0[j] + xx1[j] + xx2[j])
            yy = half * np.float32(yy0[j] + yy1[j] + yy2[j])
            xy = np.float32(xy0[j] + xy1[j] + xy2[j])
            result[j] = unit * (xx + yy - np.sqrt((xx - yy) * (xx - yy) + xy * xy))
    return response


def corner_response(grey: NDArray[np.uint8], first: int, last: int) -> NDArray[np.float32]:
    """Return the smaller eigenvalue of the structure tensor in rows [first, last).

    Args:
        grey: (H, W).
        first: Row, >= 0.
        last: Row, <= H.

    Returns:
        (last - first, W): of 3 x 3 Sobel gradients summed over 3 x 3 px, in cv2's units; 0 within two pixels
        of the picture's edge.
    """
    found: NDArray[np.float32] = _weaker(grey, first, last)
    return found


@njit(cache=True)
def _stiffness(grey, x, y, ux, uy, radius):  # type: ignore[no-untyped-def]
    height, width = grey.shape
    trust = np.zeros(x.size)
    for k in range(x.size):
        column, row = int(x[k]), int(y[k])
        xx = yy = xy = 0.0
        for i in range(max(row - radius, 1), min(row + radius + 1, height - 1)):
            for j in range(max(column - radius, 1), min(column + radius + 1, width - 1)):
                gx = 0.5 * (float(grey[i, j + 1]) - float(grey[i, j - 1]))
                gy = 0.5 * (float(grey[i + 1, j]) - float(grey[i - 1, j]))
                xx += gx * gx
                yy += gy * gy
                xy += gx * gy
        determinant = xx * yy - xy * xy
        top = 0.5 * (xx + yy) + np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
        weak = ux[k] * ux[k] * yy + uy[k] * uy[k] * xx - 2.0 * ux[k] * uy[k] * xy
        if weak > 1e-9 and top > 1e-9:
            trust[k] = determinant / weak / top
    return trust


def stiffness(grey: NDArray[np.uint8], position: Floats, direction: Floats, radius: int = 5) -> Floats:
    """Tell how well the picture around a point fixes its motion along a direction.

    Along an edge that points at the focus of expansion a point seems to stand still like a car, whatever it
    does.

    Args:
        grey: (H, W).
        position: (N, 2) px.
        direction: (N, 2) unit vectors u.
        radius: Half of the window.

    Returns:
        (N,) in [0, 1]: 1 / (u A^-1 u) over the larger eigenvalue of A, A the structure tensor of the window.
    """
    x, y = np.ascontiguousarray(position.T)
    ux, uy = np.ascontiguousarray(direction.T)
    found: Floats = _stiffness(grey, x, y, ux, uy, radius)
    return found
