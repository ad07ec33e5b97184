"""How long vehicles have stood."""

import numpy as np

from sim.truth.standing import Standing
from tests.scenarios.score.episodes import CAR, Car, frame_truth


def test_seconds_count_from_the_standstill_and_end_with_it():
    clock, speeds = Standing(10), [5.0, 0.0, 0.05, 0.0, 0.2, 0.0]
    seconds = [clock.seconds(frame_truth(k, [Car(id=CAR, speed=v)]))[0] for k, v in enumerate(speeds)]
    assert np.allclose(seconds, [0, 0, 0.1, 0.2, 0, 0])


def test_each_vehicle_has_its_own_time_and_who_was_gone_begins_again():
    clock = Standing(10)
    a, b = Car(id=CAR, speed=0.0), Car(id=CAR + 1, speed=0.0)
    frames = [[a], [a, b], [b, a], [a], [a, b]]
    seconds = [clock.seconds(frame_truth(k, cars)).tolist() for k, cars in enumerate(frames)]
    assert np.allclose(np.concatenate(seconds), [0, 0.1, 0, 0.1, 0.2, 0.3, 0.4, 0])
