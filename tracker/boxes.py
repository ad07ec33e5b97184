"""Boxes as arrays (..., 4) of x0, y0, x1, y1 in pixels, half-open."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def box_area(boxes: ArrayLike) -> NDArray[np.float64]:
    """Give the areas (...) of boxes (..., 4), px^2; 0 for one turned inside out.

    >>> box_area([[0, 0, 4, 2], [3, 0, 1, 5]]).tolist()
    [8.0, 0.0]
    """
    boxes = np.asarray(boxes, float)
    sides = np.maximum(boxes[..., 2:] - boxes[..., :2], 0.0)
    return np.asarray(sides[..., 0] * sides[..., 1])


def intersection(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Give the areas (N, M), px^2, that each of ``a`` (N, 4) shares with each of ``b`` (M, 4).

    >>> intersection([[0, 0, 4, 2]], [[2, 1, 9, 9]]).tolist()
    [[2.0]]
    """
    first, second = np.asarray(a, float).reshape(-1, 1, 4), np.asarray(b, float).reshape(1, -1, 4)
    low = np.maximum(first[..., :2], second[..., :2])
    high = np.minimum(first[..., 2:], second[..., 2:])
    return box_area(np.concatenate([low, high], axis=-1))


def iou(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Give the intersection over union (N, M) of ``a`` (N, 4) with ``b`` (M, 4); empty boxes have 0.

    >>> iou([[0, 0, 2, 2]], [[0, 0, 2, 2], [0, 1, 2, 3], [5, 5, 6, 6]]).round(3).tolist()
    [[1.0, 0.333, 0.0]]
    """
    first, second = np.asarray(a, float).reshape(-1, 4), np.asarray(b, float).reshape(-1, 4)
    shared = intersection(first, second)
    union = box_area(first)[:, None] + box_area(second)[None, :] - shared
    return np.divide(shared, union, out=np.zeros_like(shared), where=union > 0)
