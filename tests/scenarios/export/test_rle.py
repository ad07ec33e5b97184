"""Run lengths against a decoder written from their description alone."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from scenarios.export import rle


def naive_decode(text: str, height: int, width: int) -> np.ndarray:
    numbers, bits = [], ""
    for character in text:
        code = format(ord(character) - 48, "06b")
        bits = code[1:] + bits
        if code[0] == "0":
            value = int(bits, 2) - (1 << len(bits) if bits[0] == "1" else 0)
            numbers.append(value + (numbers[-2] if len(numbers) > 2 else 0))
            bits = ""
    flat = []
    for k, run in enumerate(numbers):
        assert run >= 0
        flat += [bool(k % 2)] * run
    assert bits == ""
    assert len(flat) == height * width
    return np.array(flat, bool).reshape(width, height).T


masks = st.tuples(st.integers(0, 9), st.integers(0, 40)).flatmap(lambda size: arrays(bool, size))


@given(masks, *[st.integers(0, 70)] * 4)
def test_what_is_encoded_can_be_decoded(mask, top, left, below, right):
    whole = np.pad(mask, [(top, below), (left, right)])
    text = rle.encode(mask, at=(top, left), size=whole.shape)
    np.testing.assert_array_equal(naive_decode(text, *whole.shape), whole)


@given(arrays(bool, (7, 5)))
def test_neighbouring_runs_are_joined(mask):
    text = rle.encode(mask, at=(0, 0), size=mask.shape)
    changes = np.count_nonzero(np.diff(mask.T.ravel().astype(int))) + 1 + int(mask[0, 0])
    assert len(text) <= 2 * changes  # runs below 512 take two characters at most


def test_a_known_string():
    # 4 outside, 3 inside, 2 outside: pycocotools writes the same.
    mask = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0]], bool)
    assert rle.encode(mask, at=(0, 0), size=(3, 3)) == "432"
