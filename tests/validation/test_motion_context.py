"""The protocol on made-up ways, in which it is plain what is easy and what is not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.motion_context import FORECASTERS, hide, mean_errors, report

STEP = 3.0


def platoon(*, bend: int | None) -> dict[int, tuple[int, np.ndarray]]:
    """Vehicles one behind another, 30 frames apart; all turn left at one place, or none does."""
    heading = np.zeros(400)
    if bend is not None:
        heading[bend:] = np.minimum(np.arange(400 - bend) * 0.02, np.pi / 2)
    way = np.cumsum(STEP * np.stack([np.cos(heading), np.sin(heading)], 1), 0)
    return {k: (30 * k, way) for k in range(8)}


@pytest.fixture(scope="module")
def bent():
    return [event for event in hide(platoon(bend=200), seed=3) if event.curved]


def test_where_the_road_bends_the_context_knows_it_and_the_others_do_not(bent):
    context, linear, kalman = (mean_errors(bent, name, 60)[0] for name in ("context", "linear", "Kalman"))
    assert len(bent) > 5
    assert context < 0.5 * min(linear, kalman)


def test_on_a_straight_road_all_go_straight_on():
    events = hide(platoon(bend=None), seed=3)
    assert not any(event.curved for event in events)
    for name in ("context", "linear", "Kalman"):
        assert mean_errors(events, name, 10)[0] < 2.0


def test_the_table_names_all_forecasts(bent):
    lines = report("bent", bent).splitlines()
    assert f"{len(bent)} events" in lines[0]
    assert [line.split("  ")[1].strip() for line in lines[2:]] == list(FORECASTERS)
