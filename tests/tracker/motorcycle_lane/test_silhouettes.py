"""Placing silhouettes, and looking for one more, against the same said plainly, pixel by pixel."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.motorcycle_lane import silhouettes
from tracker.motorcycle_lane.silhouettes import COLOUR, COLUMNS, ON_BACKGROUND, PULL, ROWS

HEIGHT, WIDTH, BINS = 30, 36, 5
MOST_ADDED = 3


def covers(shape, y, x, centre, size):
    u, v = (np.array([x, y]) + 0.5 - centre) / size + 0.5
    return shape[int(v * ROWS), int(u * COLUMNS)] if 0 <= u < 1 and 0 <= v < 1 else 0.0


def pixels(place, size, stride):
    (left, top), (right, bottom) = np.floor(place - 0.5 * size), np.ceil(place + 0.5 * size)
    return itertools.product(range(int(top), int(bottom), stride), range(int(left), int(right), stride))


def plain_worth(scene, centres, sizes, k, place, *, stride, nearer, shown_only=False):
    """The mean worth of silhouette k's pixels if it stands at ``place`` and the others at ``centres``."""
    shape, groups, bins, tables = scene
    total = value = 0.0
    for y, x in pixels(place, sizes[k], stride):
        covered = covers(shape, y, x, place, sizes[k])
        total += covered
        if not (0 <= y < HEIGHT and 0 <= x < WIDTH):
            continue
        if groups[y, x] != 1:
            value -= 0.0 if shown_only or groups[y, x] else ON_BACKGROUND * covered
            continue
        rest = {n: 1 - covers(shape, y, x, centres[n], sizes[n]) for n in range(len(centres)) if n != k}
        shown = np.prod([r for n, r in rest.items() if nearer[n]])
        half = int(y + 0.5 >= place[1])
        mine = np.prod(list(rest.values())) + COLOUR * shown * tables[k, half, bins[y, x]]
        value += covered * (shown if shown_only else mine)
    return value / total


def nearer_than(k, centres, sizes):
    feet = centres[:, 1] + 0.5 * sizes[:, 1]
    return feet > feet[k]


def plain_place(scene, expected, sizes, sweeps):
    centres = expected.copy()
    order = np.argsort(-(expected[:, 1] + 0.5 * sizes[:, 1]))
    for k in np.tile(order, sweeps):
        start, best, step = centres[k].copy(), -np.inf, 2.0
        nearer = nearer_than(k, centres, sizes)
        reach, stride = 2.0 + 0.3 * sizes[k, 1], 2 if sizes[k, 0] >= 12 else 1
        while step >= 1.0:
            origin, better = centres[k].copy(), False
            for down, across in itertools.product((-step, 0, step), repeat=2):
                trial = origin + np.array([across, down])
                if np.abs(trial - start).max() > reach:
                    continue
                pull = PULL * (((trial - expected[k]) / sizes[k]) ** 2).sum()
                value = plain_worth(scene, centres, sizes, k, trial, stride=stride, nearer=nearer) - pull
                if value > best + 1e-9:
                    centres[k], best, better = trial, value, True
            step = step if better else step - 1.0
    shares = [
        plain_worth(
            scene, centres, sizes, k, place, stride=1, nearer=nearer_than(k, centres, sizes), shown_only=True
        )
        for k, place in enumerate(centres)
    ]
    return centres, np.array(shares)


def plain_needed(scene, centres, sizes, least):
    left = list(range(len(centres)))
    while len(left) > 1:
        everyone = np.ones(len(left), bool)
        shares = [
            plain_worth(
                scene, centres[left], sizes[left], n, centres[k], stride=1, nearer=everyone, shown_only=True
            )
            for n, k in enumerate(left)
        ]
        if min(shares) >= least:
            break
        del left[int(np.argmin(shares))]
    return np.isin(np.arange(len(centres)), left)


def plain_unexplained(shape, groups, window, centres, sizes, offsets, slopes):
    x0, y0, x1, y1 = window
    step = max(2.0, 0.12 * (offsets[0] + slopes[0] * 0.5 * (y0 + y1)))
    found = []
    for y, x in itertools.product(np.arange(y0, y1 + 1e-9, step), np.arange(x0, x1 + 1e-9, step)):
        centre, size = np.array([x, y]), np.maximum(offsets + slopes * y, 4.0)
        stride = 3 if size[0] >= 18 else 2
        (left, top), (right, bottom) = (
            (centre - 0.5 * size).astype(int),
            (centre + 0.5 * size).astype(int) + 1,
        )
        total = value = 0.0
        for v, u in itertools.product(range(top, bottom, stride), range(left, right, stride)):
            covered = covers(shape, v, u, centre, size)
            total += covered
            if 0 <= v < HEIGHT and 0 <= u < WIDTH and groups[v, u] == 0:
                value -= ON_BACKGROUND * covered
            elif 0 <= v < HEIGHT and 0 <= u < WIDTH and groups[v, u] == 1:
                rest = [1 - covers(shape, v, u, c, s) for c, s in zip(centres, sizes, strict=True)]
                value += covered * np.prod(rest)
        found.append((value / total, x, y))
    return found


def random_scene(rng, count):
    """Blobs of group 1 and 2, colours, and silhouettes about them; some reach beyond the picture."""
    groups = np.zeros((HEIGHT, WIDTH), np.int32)
    for group in (2, 1, 1, 1):
        top, left = rng.integers(0, HEIGHT - 8), rng.integers(0, WIDTH - 6)
        groups[top : top + rng.integers(6, 18), left : left + rng.integers(4, 12)] = group
    groups[rng.random(groups.shape) < 0.05] = 0
    bins = rng.integers(0, BINS, groups.shape).astype(np.uint8)
    shape = np.clip(silhouettes.Silhouette().shape + rng.uniform(-0.2, 0.2, (ROWS, COLUMNS)), 0.0, 1.0)
    centres = rng.uniform((2, 4), (WIDTH - 2, HEIGHT - 4), (count, 2))
    sizes = rng.uniform((4, 8), (14, 20), (count, 2))
    return shape, groups, bins, centres, sizes, rng.uniform(-1.5, 1.5, (count, 2, BINS))


@given(seed=st.integers(0, 10_000), count=st.integers(1, 3), sweeps=st.integers(1, 2))
@settings(max_examples=12, deadline=None)
def test_place_is_its_plain_twin(seed, count, sweeps):
    shape, groups, bins, centres, sizes, tables = random_scene(np.random.default_rng(seed), count)
    wanted, shown = plain_place((shape, groups, bins, tables), centres, sizes, sweeps)
    shares = silhouettes.place(shape, groups, 1, bins, centres, sizes, tables, sweeps)
    assert np.allclose(centres, wanted)
    assert np.allclose(shares, shown, atol=1e-6)


@given(seed=st.integers(0, 10_000), count=st.integers(1, 4), least=st.sampled_from((0.1, 0.3, 0.6)))
@settings(max_examples=12, deadline=None)
def test_needed_is_its_plain_twin(seed, count, least):
    shape, groups, bins, centres, sizes, tables = random_scene(np.random.default_rng(seed), count)
    wanted = plain_needed((shape, groups, bins, tables), centres, sizes, least)
    assert (silhouettes.needed(shape, groups, 1, bins, centres, sizes, least) == wanted).all()


@given(seed=st.integers(0, 10_000), count=st.integers(0, 2), least=st.sampled_from((-1.0, 0.1, 0.45)))
@settings(max_examples=12, deadline=None)
def test_unexplained_is_its_plain_twin(seed, count, least):
    rng = np.random.default_rng(seed)
    shape, groups, _, centres, sizes, _ = random_scene(rng, count)
    corner = rng.uniform(0, (15, 12))
    window = np.array([*corner, *(corner + rng.uniform(2, 12, 2))])
    offsets, slopes = rng.uniform((4, 8), (8, 14)), rng.uniform(0, (0.4, 0.4))
    found = silhouettes.unexplained(
        shape, groups, 1, window, centres, sizes, offsets, slopes, least, MOST_ADDED
    )
    assert len(found) <= MOST_ADDED
    for worth, x, y in found:
        wanted = plain_unexplained(shape, groups, window, centres, sizes, offsets, slopes)
        assert np.isclose(worth, max(value for value, _, _ in wanted))
        assert any(np.allclose((worth, x, y), one) for one in wanted)
        centres = np.concatenate([centres, [[x, y]]])
        sizes = np.concatenate([sizes, [np.maximum(offsets + slopes * y, 4.0)]])
    if len(found) < MOST_ADDED:
        rest = plain_unexplained(shape, groups, window, centres, sizes, offsets, slopes)
        assert max(value for value, _, _ in rest) < least
