"""What the lane's shipped scenarios promise."""

import numpy as np
import pytest

from scenarios import spec
from scenarios.loop import make_scene
from scenarios.score.params import ScoringParams


@pytest.mark.parametrize("seed", [500, 507, 509])
def test_the_parked_rider_stops_after_the_training_and_is_gone_before_the_end(seed):
    scenario = spec.load("lane-parked")
    scene = make_scene(scenario, seed)
    frames: dict[int, list[int]] = {}
    for tick in range(scenario.frames):
        bodies = scene.step().vehicles
        for rider in bodies.ids[~bodies.velocities.any(axis=1)].tolist():
            frames.setdefault(rider, []).append(tick)
    at = np.array(max(frames.values(), key=len))
    assert at[0] > ScoringParams().training_frames + scenario.rate
    assert len(at) == at[-1] - at[0] + 1 >= scenario.params.riders.stand * scenario.rate
    assert at[-1] < scenario.frames - 2 * scenario.rate
