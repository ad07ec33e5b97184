import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.render.antialias import smooth_edges


def edge(shape: tuple[int, int], slope: float, step: float, samples: int) -> np.ndarray:
    """Sample a slanted edge: dark below, bright above."""
    fine = (np.arange(samples) + 0.5) / samples
    y = (np.arange(shape[0])[:, None] + fine).ravel()
    x = (np.arange(shape[1])[:, None] + fine).ravel()
    inside = (y[:, None] < step + slope * x[None]).reshape(shape[0], samples, shape[1], samples)
    return 40 + 170 * inside.mean(axis=(1, 3))


@pytest.mark.parametrize(("slope", "left"), [(0.05, 0.1), (0.11, 0.1), (0.3, 0.3), (-0.2, 0.1)])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("bright_above", [False, True])
def test_smoothed_stairs_are_nearer_to_the_true_edge(slope, left, turned, bright_above):
    shape = (48, 64)
    stairs, truth = edge(shape, slope, 20.3, 1), edge(shape, slope, 20.3, 16)
    if not bright_above:
        stairs, truth = 250 - stairs, 250 - truth
    rgba = np.repeat(np.round(stairs).astype(np.uint8)[..., None], 4, axis=-1)
    smooth = smooth_edges(np.ascontiguousarray(rgba.swapaxes(0, 1)) if turned else rgba)[..., 0].astype(float)
    smooth = smooth.T if turned else smooth
    before = np.abs(stairs - truth)[4:-4, 16:-16].sum()
    after = np.abs(smooth - truth)[4:-4, 16:-16].sum()
    assert after < left * before


def test_flat_parts_and_levels_are_left_alone():
    rgba = np.full((20, 30, 4), 90, np.uint8)
    rgba[10:] = 180
    np.testing.assert_array_equal(smooth_edges(rgba), rgba[..., :3])


def smoothed_pixel(image: np.ndarray, luma: np.ndarray, i: int, j: int) -> np.ndarray:
    """What the method makes of one pixel, said on plain integers."""
    rows, columns = luma.shape
    if i in (0, rows - 1) or j in (0, columns - 1):
        return image[i, j]
    at = {(a, b): int(luma[i + a, j + b]) for a in (-1, 0, 1) for b in (-1, 0, 1)}
    m = at[0, 0]
    cross = [at[p] for p in ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))]
    contrast = max(cross) - min(cross)
    if contrast <= max(14, int(0.12 * max(cross))):
        return image[i, j]

    def bent(down: int, right: int) -> int:
        """How far the brightness bends across, over three lines side by side."""
        lines = ((2, 0), (1, -1), (1, 1))
        return sum(
            weight * abs(at[-down + right * k, -right + down * k] + at[down + right * k, right + down * k]
                         - 2 * at[right * k, down * k])
            for weight, k in lines
        )  # fmt: skip

    level = bent(1, 0) >= bent(0, 1)
    across = np.array([1, 0] if level else [0, 1])
    along = across[::-1]
    if abs(at[tuple(-across)] - m) >= abs(at[tuple(across)] - m):
        across = -across
    other = at[tuple(across)]
    step = abs(other - m)

    def followed(way: np.ndarray) -> tuple[int, float | None]:
        """Pixels to the end of the edge, and how its level changes there; None without an end."""
        for length in range(1, 15):
            p = np.array([i, j]) + length * way
            if not ((p >= 0).all() and (p < luma.shape).all()):
                return length, None
            q = p + across
            change = (int(luma[tuple(p)]) + int(luma[tuple(q)]) - m - other) / 2
            if abs(change) >= step / 4:
                return length, change
        return 15, None

    back, on = followed(-along), followed(along)
    near = on if on[0] <= back[0] else back
    shift = 0.0
    if near[1] is not None and (near[1] < 0) != (m < other):
        shift = 0.5 - (near[0] - 0.5) / max(back[0] + on[0] - 1, 1)
    around = (2 * (sum(cross) - m) + at[-1, -1] + at[-1, 1] + at[1, -1] + at[1, 1]) / 12
    lone = min(max(abs(around - m) / contrast - 0.35, 0) / 0.65, 1)
    shift = min(max(shift, 0.6 * lone), 0.5)
    own, mixed = image[i, j].astype(float), image[i + across[0], j + across[1]].astype(float)
    return (own + shift * (mixed - own) + 0.5).astype(np.uint8)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), coarse=st.integers(1, 6), levels=st.integers(2, 12))
def test_each_pixel_is_smoothed_as_said(seed, coarse, levels):
    rng = np.random.default_rng(seed)
    small = rng.integers(0, levels, (24, 40, 3)) * (255 // levels)
    rgba = np.dstack([small, np.full((24, 40), 255)]).astype(np.uint8)
    rgba = rgba[:, : 40 // coarse].repeat(coarse, axis=1)  # runs, as edges have
    rgba = np.ascontiguousarray(rgba)
    luma = cv2.cvtColor(rgba, cv2.COLOR_RGBA2GRAY)
    wanted = [
        [smoothed_pixel(rgba[..., :3], luma, i, j) for j in range(luma.shape[1])]
        for i in range(luma.shape[0])
    ]
    np.testing.assert_array_equal(smooth_edges(rgba), np.array(wanted))
