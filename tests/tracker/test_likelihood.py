"""The densities of paper 1 against methods.md's points, naive integrals and simulation."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, tplquad
from scipy.stats import norm, truncnorm

from tracker.in_car.likelihood import (
    LikelihoodTable,
    MotionModel,
    MotionPriors,
    corridor_density,
    corridor_norm,
    likelihood_table,
)
from tracker.in_car.projection import projected_density

FOCAL = 800.0
POINTS = np.array([(20, 5), (60, 8), (-150, -30), (150, 60), (250, -40)], float).T
X_EDGES, V_EDGES = np.linspace(-320, 320, 65), np.linspace(-120, 120, 61)


@pytest.mark.parametrize(
    ("density", "priors", "expected"),
    [
        ("background", MotionPriors(), [3.05185314e-05, 2.45703095e-04, 2.52147974e-05, 3.95103679e-06, 0]),
        (
            "background",
            MotionPriors(yaw_sd=0.02, forward_only=False),
            [1.92705840e-05, 3.97639020e-05, 2.17248051e-05, 6.41239634e-06, 6.74318860e-09],
        ),
        (
            "car",
            MotionPriors(),
            [7.58628067e-05, 5.59170025e-05, 8.28346033e-06, 1.51420342e-06, 2.38952234e-06],
        ),
        (
            "car",
            MotionPriors(yaw_sd=0.02),
            [5.30678803e-05, 4.22567837e-05, 9.69705139e-06, 2.32810539e-06, 2.53407989e-06],
        ),
    ],
)
@pytest.mark.parametrize(("nodes", "tolerance"), [(96, 1e-8), (40, 1e-5)])
def test_points(density, priors, expected, nodes, tolerance):
    found = getattr(MotionModel(FOCAL, priors), density)(*POINTS, nodes=nodes)
    np.testing.assert_allclose(found, expected, rtol=tolerance)


def test_corridor_norm():
    assert corridor_norm(5, 50) == pytest.approx(4.119885, abs=1e-6)
    for corridor, limit in ((0.5, 80), (20, 10), (5, 400)):
        naive = (
            2 * quad(corridor_density, 0, limit, (corridor,), points=[corridor], epsabs=1e-12, limit=200)[0]
        )
        assert corridor_norm(corridor, limit) == pytest.approx(naive, rel=1e-8)


def naive_background(x, v, p):
    """Eq. (10) without yaw as it stands: over X, with the squared Jacobian."""

    def integrand(distance):
        X = np.sign(x) * distance
        V, Z = v * FOCAL * X / x**2, FOCAL * X / x
        p_Z = (p.depth_range[0] <= Z <= p.depth_range[1]) / (p.depth_range[1] - p.depth_range[0])
        p_V = (V > 0) * norm.pdf(V, p.speed, p.speed_sd) / norm.sf(0, p.speed, p.speed_sd)
        return corridor_density(X, p.corridor) * p_Z * p_V * (FOCAL * X / x**2) ** 2

    low = abs(x) * p.depth_range[0] / FOCAL
    high = min(abs(x) * p.depth_range[1] / FOCAL, p.lateral_limit)
    peak = [X for X in (np.linspace(0, 3, 13) * p.speed * x * x / (FOCAL * abs(v))) if low < X < high]
    total = quad(integrand, low, high, points=peak or None, epsabs=0, epsrel=1e-10, limit=400)[0]
    return total / (2 * quad(corridor_density, 0, p.lateral_limit, (p.corridor,), epsrel=1e-11)[0])


@settings(max_examples=25, deadline=None)
@given(
    x=st.floats(5, 320),
    relative=st.floats(0.3, 3.0),
    depth=st.floats(6, 140),
    sign=st.sampled_from([-1, 1]),
    speed=st.floats(4, 35),
    speed_sd=st.floats(0.3, 4),
    corridor=st.floats(2, 12),
)
def test_background_is_the_naive_integral(x, relative, depth, sign, speed, speed_sd, corridor):
    priors = MotionPriors(speed=speed, speed_sd=speed_sd, corridor=corridor)
    v = relative * speed * x / depth
    found = MotionModel(FOCAL, priors).background(sign * x, sign * v)
    assert found == pytest.approx(naive_background(x, v, priors), rel=1e-6, abs=1e-14)


def naive_car(x, v, p):
    """Eq. (17) as it stands: over R_y, Z and T_Z, with the squared Jacobian."""
    low, high = p.car_depth_range
    p_Z = truncnorm(
        (low - p.car_depth) / p.car_depth_sd,
        (high - p.car_depth) / p.car_depth_sd,
        p.car_depth,
        p.car_depth_sd,
    )
    norm_Z = p_Z.pdf(p.car_depth) / norm.pdf(0)

    def gauss(value, sd):
        return np.exp(-0.5 * (value / sd) ** 2) / (sd * np.sqrt(2 * np.pi))

    def integrand(t_z, Z, yaw):
        t_x = (Z * v + x * t_z) / FOCAL + (x * x + FOCAL**2) / FOCAL**2 * Z * yaw
        return (
            gauss(yaw - p.yaw_mean, p.yaw_sd)
            * norm_Z
            * np.exp(-0.5 * ((Z - p.car_depth) / p.car_depth_sd) ** 2)
            / np.sqrt(2 * np.pi)
            * gauss(x * Z / FOCAL, p.car_lateral_sd)
            * gauss(t_z, p.car_t_z_sd)
            * gauss(t_x, p.car_t_x_sd)
            * (Z / FOCAL) ** 2
        )

    reach = 6 * p.car_t_z_sd
    bounds = (p.yaw_mean - 6 * p.yaw_sd, p.yaw_mean + 6 * p.yaw_sd)
    return tplquad(integrand, *bounds, low, high, -reach, reach, epsabs=0, epsrel=1e-4)[0]


@pytest.mark.parametrize(("x", "v", "yaw_mean"), [(60, 8, 0.0), (-150, -30, 0.03), (250, -40, -0.03)])
def test_car_is_the_naive_triple_integral(x, v, yaw_mean):
    priors = MotionPriors(yaw_sd=0.02, yaw_mean=yaw_mean, car_t_x_sd=2.0)
    found = MotionModel(FOCAL, priors).car(x, v)
    assert found == pytest.approx(naive_car(x, v, priors), rel=1e-4)


def test_truncated_speed_with_noise_is_the_naive_convolution():
    """Stop and go: V near 0 is cut there, and the noise blurs what is left."""
    priors = MotionPriors(speed=1.0, speed_sd=3.0, v_sd=4.0)
    sharp = MotionModel(FOCAL, MotionPriors(speed=1.0, speed_sd=3.0))
    for x, v in ((100.0, 12.0), (-60.0, 2.0), (200.0, -3.0)):
        values = np.linspace(1e-4, 400, 40001) * np.sign(x)
        blurred = np.trapezoid(
            sharp.background(x, values, nodes=48) * norm.pdf(v - values, scale=4.0), np.abs(values)
        )
        assert MotionModel(FOCAL, priors).background(x, v) == pytest.approx(blurred, rel=1e-3)


def test_forward_only_matters_little_at_speed():
    x, v = POINTS[:, :4]
    models = [MotionModel(FOCAL, MotionPriors(yaw_sd=0.02, forward_only=cut)) for cut in (True, False)]
    np.testing.assert_allclose(models[0].background(x, v), models[1].background(x, v), rtol=1e-6)


def simulate(which, priors, count, rng):
    """Draw (x, v) from the distributions in space and the velocity equation."""
    yaw = rng.normal(priors.yaw_mean, priors.yaw_sd, count)
    if which == "background":
        support = np.linspace(0, priors.lateral_limit, 20001)
        mass = np.cumsum(corridor_density(support, priors.corridor))
        X = np.interp(rng.random(count) * mass[-1], mass, support) * rng.choice([-1, 1], count)
        Z = rng.uniform(*priors.depth_range, count)
        speed = rng.normal(priors.speed, priors.speed_sd, count)
        t_x, t_z = np.zeros(count), -np.abs(speed)
    else:
        X = rng.normal(0, priors.car_lateral_sd, count)
        Z = rng.normal(priors.car_depth, priors.car_depth_sd, count)
        low, high = priors.car_depth_range
        while (outside := (low > Z) | (high < Z)).any():
            Z[outside] = rng.normal(priors.car_depth, priors.car_depth_sd, outside.sum())
        t_x, t_z = rng.normal(0, priors.car_t_x_sd, count), rng.normal(0, priors.car_t_z_sd, count)
    x = FOCAL * X / Z
    X_dot, Z_dot = t_x - yaw * Z, t_z + yaw * X
    return x, (FOCAL * X_dot - x * Z_dot) / Z


def total_variation(which, priors, model_priors, count, seed, cut=4):
    """Return TV between simulation and model on the window, and the TV that a perfect model would show.

    Cells hold the mean of ``cut`` by ``cut`` points: without yaw the density has edges.
    """
    rng = np.random.default_rng(seed)
    counts = np.zeros((64, 60))
    for _ in range(max(1, count // 1_000_000)):
        part = simulate(which, priors, min(count, 1_000_000), rng)
        counts += np.histogram2d(*part, bins=(X_EDGES, V_EDGES))[0]
    x, v = (
        (edges[:-1, None] + (np.arange(cut) + 0.5) / cut * (edges[1] - edges[0])).ravel()
        for edges in (X_EDGES, V_EDGES)
    )
    density = getattr(MotionModel(FOCAL, model_priors), which)(x[:, None], v[None, :], nodes=48)
    expected = density.reshape(64, cut, 60, cut).sum((1, 3))
    expected /= expected.sum()
    total = counts.sum()
    noise = 0.5 * np.sqrt(2 / np.pi) * np.sqrt(expected * (1 - expected) / total).sum()
    inside = density.mean() * 640 * 240
    return 0.5 * np.abs(counts / total - expected).sum(), noise, inside - total / count


YAWING = MotionPriors(yaw_sd=0.02)
TURNING = MotionPriors(yaw_sd=0.02, yaw_mean=0.03)
CASES = [
    ("background", MotionPriors()),
    ("background", YAWING),
    ("car", MotionPriors()),
    ("car", YAWING),
    ("car", TURNING),
]
CASES += [("background", TURNING), ("background", MotionPriors(speed=30, speed_sd=0.5, corridor=9))]


@pytest.mark.parametrize(("which", "priors"), CASES)
def test_simulation_follows_the_density(which, priors):
    tv, noise, mass_error = total_variation(which, priors, priors, 1_000_000, 3)
    assert tv < 1.3 * noise
    assert abs(mass_error) < 0.003


@pytest.mark.slow
@pytest.mark.parametrize(("which", "priors"), CASES)
def test_simulation_follows_the_density_closely(which, priors):
    tv, noise, mass_error = total_variation(
        which, priors, priors, 20_000_000, 4, cut=8 if priors.yaw_sd else 16
    )
    print(f"{which} {priors}: TV {tv:.5f}, noise {noise:.5f}")
    assert tv < 1.3 * noise
    assert abs(mass_error) < 0.001


def test_sign_of_yaw():
    """A camera that turns right moves the image left; the wrong sign is far off."""
    wrong = MotionPriors(yaw_sd=0.02, yaw_mean=-0.03)
    x, v = (edges[:-1] + (edges[1] - edges[0]) / 2 for edges in (X_EDGES, V_EDGES))
    right, flipped = (MotionModel(FOCAL, priors).car(x[:, None], v[None, :]) for priors in (TURNING, wrong))
    tv = 0.5 * np.abs(right - flipped).sum() * 10 * 4
    assert tv == pytest.approx(0.58, abs=0.005)
    v = np.linspace(-120, 120, 241)
    mean = np.average(v, weights=MotionModel(FOCAL, TURNING).car(0.0, v))
    assert mean == pytest.approx(-0.03 * FOCAL, abs=0.5)


@pytest.mark.parametrize(("which", "least"), [("background", 0.2), ("car", 0.08)])
def test_squared_jacobian(which, least):
    """With the Jacobian |Z / x| or Z / f to the first power the density is visibly another one."""
    model = MotionModel(FOCAL)
    x, v = (edges[:-1] + (edges[1] - edges[0]) / 2 for edges in (X_EDGES, V_EDGES))
    right = getattr(model, which)(x[:, None], v[None, :])
    population = getattr(model, f"_{which}")
    # In the form over Z the surplus power multiplies the place's density.
    single = replace(population, place=lambda X, Z: population.place(X, Z) / Z)
    wrong = projected_density(x[:, None], v[None, :], single, focal=FOCAL)
    if which == "background":
        wrong *= np.abs(x[:, None])
    tv = 0.5 * np.abs(right / right.sum() - wrong / wrong.sum()).sum()
    assert tv > least


def test_symmetry():
    rng = np.random.default_rng(1)
    x, v = rng.uniform(-300, 300, 40), rng.uniform(-100, 100, 40)
    model = MotionModel(FOCAL, MotionPriors(yaw_sd=0.01, v_sd=3))
    for density in (model.background, model.car):
        np.testing.assert_allclose(density(x, v), density(-x, -v), rtol=1e-10)


def test_no_spread_at_the_centre_is_no_error():
    model = MotionModel(FOCAL)
    assert np.all(model.background(0.0, [-5.0, 0.0, 5.0]) == 0)
    assert model.background(100.0, -5.0) == 0


def test_table_interpolates_the_model():
    rng = np.random.default_rng(2)
    model = MotionModel(FOCAL, MotionPriors(yaw_sd=0.002, v_sd=4, speed_sd=1.0))
    start = time.process_time()
    table = LikelihoodTable.build(model)
    assert time.process_time() - start < 1.0
    x, v = rng.uniform(-320, 320, 3000), rng.uniform(-300, 300, 3000)
    outlier = 1e-3 / 640 / (2 * np.arcsinh(1200 / 8)) / np.hypot(v, 8)
    exact = np.log(model.car(x, v) + outlier) - np.log(model.background(x, v) + outlier)
    error = np.abs(table.log_ratio(x, v) - exact)
    assert np.median(error) < 0.005
    assert np.quantile(error, 0.99) < 0.1


def test_table_is_bounded_outside_its_grid():
    table = likelihood_table(FOCAL, MotionPriors(v_sd=4), 320.0)
    assert likelihood_table(FOCAL, MotionPriors(v_sd=4), 320.0) is table
    found = table.log_ratio([-1e4, 1e4, 0.0], [1e6, -1e6, np.inf])
    assert np.isfinite(found).all()
    assert np.abs(table.values).max() < 15


def test_bad_focal():
    with pytest.raises(ValueError, match="focal"):
        MotionModel(0.0)
