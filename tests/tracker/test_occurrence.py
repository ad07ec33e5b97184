"""Where vehicles appear, against simulation and naive integrals."""

import numpy as np
import pytest
from scipy.integrate import quad

from tracker.in_car.likelihood import MotionPriors
from tracker.in_car.occurrence import Occurrence
from tracker.in_car.profile import band_rows

FOCAL = 800.0
X_EDGES, Y_EDGES = np.linspace(-320, 320, 65), np.linspace(-60, 180, 49)


def simulate(count, rng, priors, camera_height, vehicle_height):
    low, high = priors.car_depth_range
    Z = rng.normal(priors.car_depth, priors.car_depth_sd, 2 * count)
    Z = Z[(low < Z) & (high > Z)][:count]
    X = rng.normal(0, priors.car_lateral_sd, len(Z))
    Y = rng.uniform(camera_height - vehicle_height, camera_height, len(Z))
    return FOCAL * X / Z, FOCAL * Y / Z


@pytest.mark.parametrize(
    ("count", "cut"), [(1_000_000, 4), pytest.param(10_000_000, 8, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("heights", [(1.2, 1.5), (1.4, 0.9), (2.2, 3.5)])
def test_simulation_follows_the_density(heights, count, cut):
    camera_height, vehicle_height = heights
    rng, priors = np.random.default_rng(2), MotionPriors()
    sample = simulate(count, rng, priors, *heights)
    counts = np.histogram2d(*sample, bins=(X_EDGES, Y_EDGES))[0] / len(sample[0])
    model = Occurrence(FOCAL, priors, camera_height=camera_height, vehicle_height=vehicle_height)
    x, y = (
        (edges[:-1, None] + (np.arange(cut) + 0.5) / cut * (edges[1] - edges[0])).ravel()
        for edges in (X_EDGES, Y_EDGES)
    )
    expected = model.density(x[:, None], y[None, :]).reshape(64, cut, 48, cut).mean((1, 3)) * 10 * 5
    noise = 0.5 * np.sqrt(2 / np.pi) * np.sqrt(expected * (1 - expected) / count).sum()
    tv = 0.5 * np.abs(counts - expected).sum()
    print(f"{heights}: TV {tv:.5f}, noise {noise:.5f}")
    assert tv < 1.3 * noise


def test_density_is_the_naive_integral():
    """Eq. (19) as it stands, with p_Y cut where it ends."""
    priors = MotionPriors()
    model = Occurrence(FOCAL, priors)
    mass = quad(lambda Z: np.exp(-0.5 * ((Z - 25) / 12) ** 2), 5, 100)[0]

    def naive(x, y):
        def integrand(Z):
            inside = -0.3 <= y * Z / FOCAL <= 1.2
            p_X = np.exp(-0.5 * (x * Z / FOCAL / 4) ** 2) / (4 * np.sqrt(2 * np.pi))
            return np.exp(-0.5 * ((Z - 25) / 12) ** 2) / mass * p_X * inside / 1.5 * (Z / FOCAL) ** 2

        edge = FOCAL * (1.2 if y > 0 else -0.3) / y if y else 100.0
        return quad(integrand, 5, max(5, min(100, edge)), epsabs=0, epsrel=1e-10)[0]

    for x, y in ((0, 10), (100, 40), (-300, 120), (50, -8), (20, 0), (0, 185)):
        assert model.density(x, y) == pytest.approx(naive(x, y), rel=1e-7)
    assert model.density(0, 200) == 0
    assert model.density(0, -50) == 0


def test_profile_is_the_density_without_rows():
    model = Occurrence(FOCAL)
    x = np.array([-200.0, 0.0, 35.0])
    rows = np.linspace(-60, 200, 52001)
    summed = np.trapezoid(model.density(x[:, None], rows), rows)
    np.testing.assert_allclose(model.profile(x), summed, rtol=1e-3)
    wide = np.linspace(-8000, 8000, 160001)
    assert np.trapezoid(model.profile(wide), wide) == pytest.approx(1, abs=1e-4)


@pytest.mark.parametrize("heights", [(1.2, 1.5), (1.4, 0.9), (2.2, 3.5)])
def test_band_holds_its_share(heights):
    model = Occurrence(FOCAL, camera_height=heights[0], vehicle_height=heights[1])
    _, y = simulate(400_000, np.random.default_rng(3), MotionPriors(), *heights)
    for share in (0.5, 0.9, 0.99):
        low, high = model.useful_band(share)
        assert np.mean((y > low) & (y < high)) == pytest.approx(share, abs=0.004)
        assert np.mean(y < low) == pytest.approx((1 - share) / 2, abs=0.003)


def test_band_is_a_small_part_of_the_picture():
    """The paper's reason to profile vertically: nine tenths of a car's features within 70 of 480 rows."""
    low, high = Occurrence(FOCAL).useful_band(0.9)
    assert -20 < low < 0 < high < 80


@pytest.mark.parametrize("focal", [560.0, 640.0, 800.0])
@pytest.mark.parametrize("vehicle_height", [1.5, 2.6])
def test_the_front_end_looks_where_vehicles_show(focal, vehicle_height):
    """Its band holds the one that nine tenths of the features of cars and of vans lie in."""
    top, bottom = band_rows(240.0, 480, 640)
    low, high = Occurrence(focal, vehicle_height=vehicle_height).useful_band(0.9)
    assert top <= 240 + low
    assert 240 + high <= bottom


def test_bad_arguments():
    with pytest.raises(ValueError, match="camera_height"):
        Occurrence(FOCAL, camera_height=0)
    with pytest.raises(ValueError, match="share"):
        Occurrence(FOCAL).useful_band(1.0)
