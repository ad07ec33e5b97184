"""The ground's mesh: a band along the road's reference line, and a plain below it out to the horizon."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sim.models import Ground
from sim.roads import HORIZON, LAND, PLAIN_DROP, SAGITTA, InCarRoad, Piece

Floats = NDArray[np.float64]

STRAIGHT_STEP = 100.0
"""Metres between the band's rows on a straight, where any step is exact."""
VERGE = 8.0
"""Metres from the asphalt to the first column of land."""
OFF_ROAD = 2.0 * LAND
"""Offset d that the plain's vertices carry at least: far from anything painted."""


def make_ground(road: InCarRoad) -> Ground:
    """Mesh the ground of a road.

    Coordinates (s, d) are linear on every straight. On an arc the rows are so close that the facets miss it
    by `sim.roads.SAGITTA` at most. The land's columns end where the land would be nearer to another stretch
    of the road, so that the band never folds over itself.
    """
    rows = np.unique(np.concatenate([_rows(piece) for piece in road.pieces]))
    reach_right, reach_left = (_reach(road, rows, side) for side in (-1.0, 1.0))
    low, high = road.paved
    columns = [
        np.minimum(reach_left, LAND),
        np.minimum(reach_left, 60.0 + high),
        np.full(len(rows), high + VERGE),
        np.full(len(rows), high),
        np.zeros(len(rows)),
        np.full(len(rows), low),
        np.full(len(rows), low - VERGE),
        -np.minimum(reach_right, 60.0 - low),
        -np.minimum(reach_right, LAND),
    ]
    d = np.stack(columns, axis=1)
    s = np.broadcast_to(rows[:, None], d.shape)
    x, y = road.to_world(s, d)
    band = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    plain, plain_coordinates = _plain(x, y)
    lane_edges, line_styles = road.painted_lines()
    return Ground(
        vertices=np.concatenate([band, plain]).astype(np.float32),
        coordinates=np.concatenate([np.stack([s, d], axis=-1).reshape(-1, 2), plain_coordinates]).astype(
            np.float32
        ),
        faces=np.concatenate(
            [_grid_faces(*d.shape), np.array([[0, 1, 2], [0, 2, 3]], np.int32) + len(band)]
        ).astype(np.int32),
        lane_edges=lane_edges,
        line_styles=line_styles,
        paved=road.paved,
    )


def _rows(piece: Piece) -> Floats:
    """S of the band's rows on a piece, both ends with it."""
    step = STRAIGHT_STEP if piece.curvature == 0.0 else np.sqrt(8 * SAGITTA / abs(piece.curvature))
    return np.linspace(piece.start, piece.end, 1 + int(np.ceil(piece.length / step)))


def _reach(road: InCarRoad, rows: Floats, side: float) -> Floats:
    """How far the land goes from each row before another stretch of the road is nearer: (len(rows),)."""
    line = np.arange(road.pieces[0].start, road.length, 2.0)
    tree = cKDTree(np.stack(road.to_world(line, 0.0), axis=1))
    shortest = max(-road.paved[0], road.paved[1]) + VERGE
    reach, open_ = np.full(len(rows), shortest), np.ones(len(rows), bool)
    for away in np.linspace(shortest, LAND, 32):
        nearest, _ = tree.query(np.stack(road.to_world(rows, side * away), axis=1))
        open_ &= nearest > away - 0.05
        reach[open_] = away
    return np.where(open_, reach, np.maximum(0.9 * reach, shortest))


def _grid_faces(rows: int, columns: int) -> NDArray[np.int32]:
    """Two triangles a cell, counter-clockwise from above: rows run forward, columns from left to right."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    back_left, back_right = corner, corner + 1
    front_left, front_right = corner + columns, corner + columns + 1
    return np.concatenate(
        [
            np.stack([back_left, back_right, front_right], axis=1),
            np.stack([back_left, front_right, front_left], axis=1),
        ]
    ).astype(np.int32)


def _plain(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """One quad around everything, and coordinates that no paint comes near."""
    west, east = x.min() - HORIZON, x.max() + HORIZON
    south, north = y.min() - HORIZON, y.max() + HORIZON
    corners = np.array([[west, south], [east, south], [east, north], [west, north]])
    vertices = np.column_stack([corners, np.full(4, -PLAIN_DROP)])
    return vertices, corners - np.array([0.0, south - OFF_ROAD])
