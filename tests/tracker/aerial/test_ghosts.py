"""Ghosts told from vehicles by whose outline is where."""

from __future__ import annotations

import numpy as np

from tracker.aerial.background import Background
from tracker.aerial.ghosts import contrast
from tracker.blobs import find_blobs

NONE = np.zeros((0, 4))
STOOD, STANDS = np.s_[20:32, 20:44], np.s_[60:72, 60:84]


def left_and_come() -> tuple[Background, np.ndarray]:
    """A vehicle that stood where the background was learnt has left, and another one has come."""
    rng = np.random.default_rng(1)
    ground = rng.integers(96, 104, (100, 120, 3)).astype(np.uint8)
    background = Background()
    learnt, now = ground.copy(), ground.copy()
    learnt[STOOD], now[STANDS] = 220, 220
    for _ in range(20):
        background.apply(learnt, np.eye(3), NONE)
    return background, background.apply(now, np.eye(3), NONE)


def test_a_ghost_has_its_outline_in_the_background():
    background, found = left_and_come()
    blobs = find_blobs(found, 30)
    assert len(blobs) == 2
    ratios = contrast(blobs, background)
    upper = blobs.centres[:, 1].argmin()
    assert ratios[upper] < -1.0
    assert ratios[1 - upper] > 1.0


def test_what_is_adopted_is_ground_from_then_on():
    background, found = left_and_come()
    blobs = find_blobs(found, 30)
    now = background.laid.copy()
    background.adopt(np.append(False, contrast(blobs, background) < 0.0)[blobs.labels])
    part = np.s_[:, :]
    view = np.asarray(background.mean(part))
    ghost = blobs.labels == 1 + blobs.centres[:, 1].argmin()
    assert np.allclose(view[ghost], now[ghost])
    assert not np.allclose(view[(blobs.labels > 0) & ~ghost], now[(blobs.labels > 0) & ~ghost], atol=50)
