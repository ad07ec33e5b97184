"""What of the changes is a vehicle: cues as naive code reads them, a vehicle and its shadow, a tree."""

from __future__ import annotations

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.tracker.surroundings import average, differences, floored, reaches, smoothed
from tracker.aerial import foreground as fg
from tracker.aerial.background import Background
from tracker.surroundings import DIM, UNIT

SHAPE = 14, 17
NONE = np.zeros((0, 4))


def naive_cues(view, raw, y, x):
    now, then = smoothed(view.laid), smoothed(view.ground)
    maps, shares = differences(now, then), (raw.astype(float), floored(view.often))
    red, green, blue = (now[y, x] + 1) / (then[y, x] + 1)
    mean = (red + green + blue) / 3
    found = [mean, (blue - red) / mean, (green - (red + blue) / 2) / mean]
    found += [np.ptp(now[y, x]) / (now[y, x].max() + DIM), now[y, x].sum(), then[y, x].sum()]
    s, h, c = then[y, x]
    found += [np.ptp(then[y, x]) / (then[y, x].max() + DIM), (2 * h - s - c) / (then[y, x].max() + DIM)]
    found += [np.abs(now[y, x] - then[y, x]).max(), view.spread[y, x], view.often[y, x]]
    found += reaches(raw, y, x)
    found += [average(part, y, x, half) for half in fg.AREAS for part in shares]
    return found + [
        average(part, y + down, x + across, half) for across, down, half in fg.OFFSETS for part in maps
    ]


Images = arrays(np.uint8, (*SHAPE, 3))
Floats = arrays(np.float32, SHAPE, elements=st.floats(0, 1, width=32))


@settings(max_examples=40, deadline=None)
@given(Images, Images, arrays(np.bool_, SHAPE), Floats, Floats, st.data())
def test_cues_are_those_of_naive_code(laid, ground, raw, spread, often, data):
    y, x = data.draw(st.integers(0, SHAPE[0] - 1)), data.draw(st.integers(0, SHAPE[1] - 1))
    view = SimpleNamespace(laid=laid, ground=ground, spread=spread, often=often)
    found = fg.cues(view, raw, np.array([y]), np.array([x]))
    assert found.shape == (1, fg.COUNT)
    np.testing.assert_allclose(found[0], naive_cues(view, raw, y, x), rtol=1e-3, atol=1.1 / UNIT)


def drive(side):
    """A background with a vehicle on it that casts its shadow to a side, and which pixels are which."""
    rng = np.random.default_rng(2)
    road = 78 + 12 * cv2.GaussianBlur(rng.standard_normal((120, 160)), (0, 0), 2.0)[..., None] + np.zeros(3)

    def seen(picture):
        picture = cv2.GaussianBlur(picture, (0, 0), 0.7)
        return np.clip(picture + rng.normal(0, 1.5, picture.shape), 0, 255).astype(np.uint8)

    background = Background()
    for _ in range(60):
        background.apply(seen(road), np.eye(3), NONE)
    body, both = np.zeros((120, 160), np.uint8), np.zeros((120, 160), np.uint8)
    cv2.rectangle(body, (70, 50), (89, 58), 1, -1)
    for step in range(6):
        both |= np.roll(body, (side * step, step // 2), (0, 1))
    shadow = (both > body).view(np.bool_)
    image = road.copy()
    image[shadow] *= np.array([0.55, 0.58, 0.64])
    image[body > 0] = (190, 192, 195)
    image[51:58, 83:86] = image[51:58, 73:75] = (30, 32, 36)
    raw = background.apply(seen(image), np.eye(3), NONE)
    x, y = (-np.array(background.view[:2]) - background.origin).astype(int)
    return background, raw, (y, x), body.view(np.bool_), shadow


@pytest.mark.parametrize("side", [-1, 1])
def test_a_vehicle_stays_and_its_shadow_goes(side):
    background, raw, (y, x), body, shadow = drive(side)
    found = fg.vehicles(background, raw)[y : y + 120, x : x + 160]
    assert found[body].mean() > 0.8
    assert found[shadow].mean() < 0.3
    assert found[~body & ~shadow].mean() < 0.01


def test_nothing_is_found_where_nothing_changes():
    background, raw, *_ = drive(1)
    assert not fg.vehicles(background, np.zeros_like(raw)).any()
