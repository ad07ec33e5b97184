"""Box areas and overlaps."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tracker.boxes import box_area, intersection, iou

corner = st.integers(0, 6)
boxes = st.lists(
    st.tuples(corner, corner, corner, corner).map(
        lambda b: [min(b[0], b[2]), min(b[1], b[3]), max(b[0], b[2]), max(b[1], b[3])]
    ),
    max_size=4,
)


def cells(box: list[int]) -> set[tuple[int, int]]:
    return {(x, y) for x in range(box[0], box[2]) for y in range(box[1], box[3])}


@given(boxes, boxes)
def test_whole_boxes_are_sets_of_pixels(first: list[list[int]], second: list[list[int]]) -> None:
    areas, shared = box_area(np.array(first).reshape(-1, 4)), intersection(first, second)
    overlap = iou(first, second)
    assert shared.shape == overlap.shape == (len(first), len(second))
    for i, a in enumerate(first):
        assert areas[i] == len(cells(a))
        for j, b in enumerate(second):
            assert shared[i, j] == len(cells(a) & cells(b))
            union = len(cells(a) | cells(b))
            assert overlap[i, j] == (len(cells(a) & cells(b)) / union if union else 0)


def test_inverted_boxes_have_no_area() -> None:
    assert box_area([5.0, 5.0, 1.0, 1.0]) == 0
    assert iou([[5, 5, 1, 1]], [[0, 0, 9, 9]])[0, 0] == 0
