import numpy as np
import pytest

from sim.ego import Body, Profile, Resonator, odometer
from sim.params import EgoParams
from sim.rng import stream
from sim.world import Ego

EGO = Ego(position=np.zeros(3), yaw=0.3, speed=20.0, yaw_rate=0.05, pitch=0.0, heave=0.0)


def test_resonator_has_unit_deviation_and_stays_in_its_band():
    rate = 30
    resonator = Resonator(2.2, 0.25, rate, stream(0, "test"))
    x = np.array([resonator.step() for _ in range(60_000)])
    assert np.std(x) == pytest.approx(1.0, rel=0.05)
    power = np.abs(np.fft.rfft(x)) ** 2
    hertz = np.fft.rfftfreq(len(x), 1 / rate)
    band = (hertz > 1.0) & (hertz < 4.0)
    assert power[band].sum() > 0.7 * power.sum()
    assert 1.5 < hertz[np.argmax(np.convolve(power, np.ones(400), "same"))] < 3.0


def test_resonator_is_stationary_from_the_start():
    first = [
        [r.step() for _ in range(3)] for r in (Resonator(2.2, 0.25, 30, stream(i, "t")) for i in range(1500))
    ]
    assert np.std(np.array(first), axis=0) == pytest.approx(1.0, rel=0.1)


def test_the_body_shakes_at_speed_and_rests_at_standstill():
    params = EgoParams(pitch_vibration=0.002)
    driving = np.array([Body(params, 30, stream(i, "b")).step(20.0, 0.0) for i in range(1500)])
    assert np.std(driving[:, 0]) == pytest.approx(0.002, rel=0.1)
    assert np.std(driving[:, 1]) == pytest.approx(0.008, rel=0.1)
    assert Body(params, 30, stream(0, "b")).step(0.0, 0.0) == (0.0, 0.0)


def test_the_nose_dives_under_the_brakes():
    body = Body(EgoParams(pitch_vibration=0.0), 30, stream(0, "b"))
    pitch = [body.step(20.0, -4.0)[0] for _ in range(60)]
    assert np.all(np.diff(pitch) < 0)
    assert np.degrees(pitch[-1]) == pytest.approx(-0.62, abs=0.03)


def test_odometer_errors_have_the_stated_deviations():
    params = EgoParams(speed_noise=0.3, yaw_noise=0.01)
    read = np.array([odometer(EGO, params, stream(0, "odometer", i)) for i in range(3000)])
    assert np.mean(read, axis=0) == pytest.approx([20.0, 0.05], abs=0.02)
    assert np.std(read, axis=0) == pytest.approx([0.3, 0.01], rel=0.06)
    exact = EgoParams(speed_noise=0.0, yaw_noise=0.0)
    assert odometer(EGO, exact, stream(0, "odometer")) == (20.0, 0.05)


def test_a_profile_swings_about_its_speed_and_its_rates_match():
    profile = Profile(EgoParams(speed=20.0), stream(0, "profile"))
    t = np.arange(0, 60, 0.01)
    speed, offset, rate = np.array([profile.at(one) for one in t]).T
    assert speed.min() > 17
    assert speed.max() < 23
    assert np.allclose(np.gradient(offset, t)[1:-1], rate[1:-1], atol=1e-3)
