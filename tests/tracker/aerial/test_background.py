"""The background in the mosaic: its compiled loop against one pixel at a time, and made-up grounds."""

from __future__ import annotations

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tracker.aerial.twin import Pixel
from tracker.aerial.background import LATE, NEIGHBOURS, Background, _compare

NONE = np.zeros((0, 4))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_every_pixel_is_learnt_as_by_itself(seed):
    rng = np.random.default_rng(seed)
    height, width, frames = 3, 4, 60
    mean, spread = np.zeros((height, width, 3), np.float32), np.full((height, width), 4.0, np.float32)
    support, rivals = np.zeros((2, height, width), np.uint8)
    rival, often = np.zeros((height, width, 3), np.uint8), np.zeros((height, width), np.float32)
    pixels = [[Pixel() for _ in range(width)] for _ in range(height)]
    colours = rng.integers(0, 256, (3, height, width, 3))
    # Each pixel stays with a colour for a while: rivals have their chance.
    which = np.repeat(rng.integers(0, 3, (frames // 10, height, width)), 10, axis=0)
    for k in range(frames):
        laid = np.take_along_axis(colours, which[k][None, ..., None], 0)[0]
        laid = np.clip(laid + rng.integers(-6, 7, laid.shape), 0, 255).astype(np.uint8)
        valid, protected = rng.random((height, width)) < 0.9, rng.random((height, width)) < 0.3
        ground = np.floor(mean + 0.5).astype(np.uint8)
        low, high = cv2.erode(ground, NEIGHBOURS), cv2.dilate(ground, NEIGHBOURS)
        found = _compare(laid, valid, protected, low, high, mean, spread, support, rival, rivals, often)
        for i, j in np.ndindex(height, width):
            if valid[i, j]:
                bounds = low[i, j].astype(int), high[i, j].astype(int)
                plain = pixels[i][j].see(laid[i, j], protected[i, j], *bounds)
                assert found[i, j] == plain
            else:
                assert not found[i, j]
    for i, j in np.ndindex(height, width):
        assert np.allclose(mean[i, j], pixels[i][j].mean, atol=1e-2)
        assert np.isclose(spread[i, j], pixels[i][j].spread, atol=1e-3)
        assert np.isclose(often[i, j], pixels[i][j].often, atol=1e-4)
        assert (support[i, j], rivals[i, j]) == (pixels[i][j].support, pixels[i][j].rivals)
    assert support.max() <= LATE


def picture(seed: int = 0) -> np.ndarray:
    ground = np.random.default_rng(seed).integers(60, 160, (60, 80, 3))
    return np.repeat(np.repeat(ground[::6, ::6], 6, 0), 6, 1)[:60, :80].astype(np.uint8)


def test_what_comes_onto_a_known_ground_is_new_and_nothing_else():
    background, ground = Background(), picture()
    for _ in range(10):
        assert not background.apply(ground, np.eye(3), NONE).any()
    seen = ground.copy()
    seen[20:30, 30:50] = 250
    found = background.apply(seen, np.eye(3), NONE)
    x, y = -np.array(background.view[:2]) - background.origin
    expected = np.zeros(found.shape, bool)
    expected[int(20 + y) : int(30 + y), int(30 + x) : int(50 + x)] = True
    assert (found == expected).all()


def test_the_window_moves_and_remembers():
    background, ground = Background(), np.tile(picture(), (6, 10, 1))

    def seen(at: int) -> np.ndarray:
        to_mosaic = np.array([[1.0, 0.0, at], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        return background.apply(ground[:120, at : at + 160], to_mosaic, NONE)

    for at in range(0, 400, 4):
        assert not seen(at).any()
    origin = background.origin.copy()
    assert origin[0] > 0
    inner = np.s_[2:-2, 2:-2]
    assert (np.abs(background.mean(inner) - background.laid[inner]) < 2).all()
    # What was seen a while ago is still in the window.
    assert not seen(300).any()
    assert (background.origin == origin).all()


def test_a_vehicle_that_stands_becomes_ground_unless_a_track_is_on_it():
    for kept, gone in ((NONE, True), (np.array([[30.0, 20.0, 50.0, 30.0]]), False)):
        background, ground = Background(), picture()
        for _ in range(15):
            background.apply(ground, np.eye(3), NONE)
        ground[20:30, 30:50] = 250
        found = [background.apply(ground, np.eye(3), kept).any() for _ in range(40)]
        assert found[0]
        assert found[-1] != gone


def test_edges_that_shift_by_a_pixel_are_nothing_new():
    background, ground = Background(), picture()
    for _ in range(10):
        background.apply(ground, np.eye(3), NONE)
    assert not background.apply(np.roll(ground, 1, axis=1), np.eye(3), NONE)[:, 3:-3].any()
    assert background.apply(np.roll(ground, 4, axis=1), np.eye(3), NONE).any()
