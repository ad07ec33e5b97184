"""Riders and their shadows: each routine against its plain twin, and a picture of known truth."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.motorcycle_lane import shade
from tracker.motorcycle_lane.front_end import look
from tracker.motorcycle_lane.measuring import DRAWN, reach_down

SEEDS = st.integers(0, 10_000)


def density(value, spread):
    """Of a normal distribution about 0."""
    return np.exp(-0.5 * (value / spread) ** 2) / (np.sqrt(2 * np.pi) * spread)


@given(seed=SEEDS)
@settings(max_examples=15, deadline=None)
def test_evidence_is_its_plain_twin(seed):
    rng = np.random.default_rng(seed)
    background = rng.integers(60, 200, (9, 11, 3)).astype(np.uint8)
    image = np.clip(background * rng.uniform(0.3, 1.1, (9, 11, 1)) + rng.normal(0, 9, (9, 11, 3)), 0, 255)
    image = image.astype(np.uint8)
    mask = rng.random((9, 11)) < 0.8
    found = shade.evidence(image, background, mask)
    # A uniform tint from 0 to the bluest with normal tails is as high throughout as the tails begin.
    height = 1 / (shade.BLUEST + np.sqrt(2 * np.pi) * shade.TINT_NOISE)
    for y, x in np.ndindex(9, 11):
        if not mask[y, x]:
            assert found[y, x] == 0
            continue
        near = np.s_[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        red, green, blue = (image[near].mean((0, 1)) + 1) / (background[near].mean((0, 1)) + 1)
        mean = (red + green + blue) / 3
        tint, middle = (blue - red) / mean, (green - (red + blue) / 2) / mean
        off = np.log(height) - 0.5 * (max(-tint, tint - shade.BLUEST, 0) / shade.TINT_NOISE) ** 2
        dark = -0.5 * ((mean - shade.DARKNESS) / shade.DARKNESS_SPREAD) ** 2
        shadow = off + dark + np.log(density(0, shade.GREEN_NOISE)) - 0.5 * (middle / shade.GREEN_NOISE) ** 2
        rider = np.log(density(0, shade.TINT_SPREAD) * density(0, shade.GREEN_SPREAD))
        rider -= 0.5 * (tint / shade.TINT_SPREAD) ** 2 + 0.5 * (middle / shade.GREEN_SPREAD) ** 2
        wanted = np.clip(shadow - rider + shade.COMMON, -shade.MOST, shade.MOST)
        assert np.isclose(found[y, x], wanted, atol=1e-4)


@given(seed=SEEDS)
@settings(max_examples=15, deadline=None)
def test_expectation_is_its_plain_twin(seed):
    rng = np.random.default_rng(seed)
    boxes = rng.uniform(-10, 40, (3, 4))
    boxes[:, 2:] = boxes[:, :2] + rng.uniform(4, 20, (3, 2))
    shape = rng.random((6, 4))
    found = shade.expectation(shape, boxes, 36, 40)
    for y, x in np.ndindex(36, 40):
        values = []
        for x0, y0, x1, y1 in boxes:
            reach = shade.AROUND[0] * (x1 - x0), shade.AROUND[1] * (y1 - y0)
            if x0 - reach[0] - 1 < x < x1 + reach[0] and y0 - reach[1] - 1 < y < y1 + reach[1]:
                values.append(shade.BESIDE)
            if x0 <= x + 0.5 < x1 and y0 <= y + 0.5 < y1:
                covered = shape[int((y + 0.5 - y0) / (y1 - y0) * 6), int((x + 0.5 - x0) / (x1 - x0) * 4)]
                share = max(2 * covered - 1, 0)
                values.append(shade.BESIDE * (1 - share) + shade.INSIDE * share)
        assert np.isclose(found[y, x], max(values, default=shade.ELSEWHERE), atol=1e-5)


@given(seed=SEEDS)
@settings(max_examples=15, deadline=None)
def test_what_is_upright_is_its_plain_twin(seed):
    rng = np.random.default_rng(seed)
    mask = rng.random((50, 12)) < 0.9
    before = rng.normal(0, 2, (50, 12)).astype(np.float32)
    found = before.copy()
    shade.raise_upright(found, mask, 5.0, 0.1)
    wanted = before.copy()
    for x in range(12):
        edges = np.flatnonzero(np.diff(np.pad(mask[:, x], 1).astype(int))).reshape(-1, 2)
        for top, end in edges:
            # Of a rider whose top is known: its height h is that of the row of its middle, top + h / 2.
            usual = (5.0 + 0.1 * top) / (1 - 0.05)
            if end - top >= shade.TALL * usual:
                rows = np.arange(top, min(int(top + shade.UPPER * usual), end))
                wanted[rows, x] = np.maximum(before[rows, x], shade.UPRIGHT)
    assert np.array_equal(found, wanted)


def scene():
    """A road, a red and a grey rider, and the shadow of each: image, background, foreground, riders."""
    rng = np.random.default_rng(1)
    background = np.clip(120 + rng.normal(0, 8, (90, 120, 1)) + [6, 0, -6], 0, 255).astype(np.uint8)
    riders = np.zeros((90, 120), bool)
    mask = riders.copy()
    picture = background.astype(float)
    for left, colour in ((20, (150, 40, 40)), (70, (75, 78, 82))):
        picture[56:70, left + 12 : left + 40] *= np.array([0.6, 0.65, 0.71])
        picture[20:70, left : left + 16] = colour
        riders[20:70, left : left + 16] = True
        mask[56:70, left : left + 40] = mask[20:70, left : left + 16] = True
    image = np.clip(picture + rng.normal(0, 2, picture.shape), 0, 255).astype(np.uint8)
    return image, background, mask, riders


def test_shadows_are_told_from_riders_and_grey_ones_where_they_are_expected():
    image, background, mask, riders = scene()
    nobody = shade.expectation(shade.STANDING, np.zeros((0, 4)), 90, 120)
    shadow = shade.shadow_of(image, background, mask, nobody)
    assert shadow[mask & ~riders].mean() > 0.9
    assert shadow[20:70, 20:36].mean() < 0.1
    assert shadow[20:70, 70:86].mean() > 0.9
    expected = shade.expectation(shade.STANDING, np.array([[70.0, 20.0, 86.0, 70.0]]), 90, 120)
    shadow = shade.shadow_of(image, background, mask, expected)
    assert shadow[mask & ~riders].mean() > 0.8
    assert shadow[24:66, 73:83].mean() < 0.1
    shade.raise_upright(nobody, mask, 50.0, 0.0)
    shade.raise_upright(nobody, mask, 50.0, 0.0)
    assert (nobody[20:50, 20:36] == shade.UPRIGHT).all()
    assert (nobody[20:50, 70:86] == shade.UPRIGHT).all()
    assert (nobody[:, 86:110] == shade.ELSEWHERE).all()


def test_what_was_taken_for_shadow_is_doubtful():
    image, background, mask, _ = scene()
    nobody = shade.expectation(shade.STANDING, np.zeros((0, 4)), 90, 120)
    shadow = shade.shadow_of(image, background, mask, nobody)
    sight = look(image, mask, shadow)
    assert not (sight.mask & sight.doubtful).any()
    assert len(sight.blobs) == 1
    assert not look(image, mask).doubtful.any()


@given(seed=SEEDS)
@settings(max_examples=30, deadline=None)
def test_boxes_reach_down_like_their_plain_twin(seed):
    rng = np.random.default_rng(seed)
    doubtful = rng.random((40, 30)) < rng.uniform(0.2, 0.7)
    boxes = rng.uniform(0, 20, (2, 4))
    boxes[:, 2:] = boxes[:, :2] + rng.uniform(3, 10, (2, 2))
    heights = rng.uniform(5, 40, 2)
    for (x0, y0, x1, y1), height, found in zip(
        boxes, heights, reach_down(doubtful, boxes, heights), strict=True
    ):
        y, bottom = int(y1), min(y0 + height, 40)
        columns = np.s_[int(x0) : int(np.ceil(x1))]
        while y < bottom and doubtful[y, columns].sum() >= DRAWN * (int(np.ceil(x1)) - int(x0)):
            y += 1
        assert np.allclose(found, (x0, y0, x1, max(y1, min(y, bottom))))
