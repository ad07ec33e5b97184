"""Projection of a population of moving points onto the image line: paper 1, eqs. (8)-(10), (15), (17).

A point at (X, Z) that moves at (T_X, T_Z) against the camera is seen at ``x = f X / Z`` and moves at
``v = (f T_X - x T_Z) / Z - k R_y`` with ``k = (x^2 + f^2) / f``. Static points have ``T_X = 0, T_Z = -V``:
background and cars are one integral over Z with different priors, in which velocities and yaw rate are
integrated out in closed form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_ndtr

Floats = NDArray[np.float64]
Place = Callable[[Floats, Floats], Floats]
"""A joint density of X and Z, per m^2, of arrays of metres that broadcast."""

_REACH = 9.0
"""Standard deviations that the quadrature covers: what lies beyond is below 1e-18."""
_CHUNK = 1 << 19
"""Integrand values that are held at a time."""
_LOG_ROOT_2PI = 0.5 * np.log(2 * np.pi)


@dataclass(frozen=True, slots=True, kw_only=True)
class Velocities:
    """A mixture of M Gaussians of (T_X, T_Z), against the camera, independent in each component; m/s.

    Attributes:
        weights: (M,), sum 1.
        t_x: (M,) means.
        t_x_sd: (M,).
        t_z: (M,) means.
        t_z_sd: (M,).
        approaching: Whether every component is truncated to T_Z < 0, as of static points before a camera that
            drives.
    """

    weights: Floats
    t_x: Floats
    t_x_sd: Floats
    t_z: Floats
    t_z_sd: Floats
    approaching: bool = False

    @classmethod
    def normal(
        cls,
        *,
        t_x: float = 0.0,
        t_x_sd: float = 0.0,
        t_z: float = 0.0,
        t_z_sd: float = 0.0,
        approaching: bool = False,
    ) -> Velocities:
        """Return a single Gaussian."""
        one = np.ones(1)
        return cls(
            weights=one,
            t_x=t_x * one,
            t_x_sd=t_x_sd * one,
            t_z=t_z * one,
            t_z_sd=t_z_sd * one,
            approaching=approaching,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Population:
    """The points of one class, in space.

    Attributes:
        place: Density of (X, Z); need not be normalised, and may hold a visibility.
        depth_range: Metres; outside it ``place`` counts as 0.
        lateral_limit: Metres; where |X| is larger ``place`` counts as 0.
        velocities: Against the camera, independent of the place.
    """

    place: Place
    depth_range: tuple[float, float]
    lateral_limit: float
    velocities: Velocities


def yaw_gain(x: ArrayLike, focal: float) -> Floats:
    """Return k = (x^2 + f^2) / f, px: a yaw rate R_y moves the image by -k R_y."""
    x = np.asarray(x, float)
    return np.asarray((x * x + focal * focal) / focal)


def projected_density(
    x: ArrayLike,
    v: ArrayLike,
    population: Population,
    *,
    focal: float,
    yaw_mean: float = 0.0,
    yaw_sd: float = 0.0,
    v_sd: float = 0.0,
    nodes: int = 96,
) -> Floats:
    """Project a population onto the image line: p(x, v), eqs. (10), (15) and (17).

    ``p(x, v) = ∫ place(x Z / f, Z) (Z / f) N(v; (f m_X - x m_Z) / Z - k μ_R, s^2) dZ`` with
    ``s^2 = (f^2 σ_Tx^2 + x^2 σ_Tz^2) / Z^2 + (k σ_R)^2 + σ_v^2``, by Gauss-Legendre quadrature in log Z over
    the part where the Gaussian is not negligible.

    Args:
        x: Px from the principal point.
        v: Px/s; broadcasts with ``x``.
        population: The points in space.
        focal: Px.
        yaw_mean: Rad/s.
        yaw_sd: Rad/s.
        v_sd: Of the measurement of v, px/s.
        nodes: Of the quadrature; 96 are exact to 1e-9 for the paper's priors, 40 to 1e-5.

    Returns:
        Density per px and px/s, of the shape that ``x`` and ``v`` broadcast to.
    """
    x, v = np.broadcast_arrays(np.asarray(x, float), np.asarray(v, float))
    flat_x, flat_v = x.ravel(), v.ravel()
    gain = yaw_gain(flat_x, focal)
    shifted = flat_v + gain * yaw_mean
    noise = np.hypot(gain * yaw_sd, v_sd)
    near, far = population.depth_range
    with np.errstate(divide="ignore"):
        far_of_x = np.minimum(far, focal * population.lateral_limit / np.abs(flat_x))
    result = np.zeros(flat_x.shape)
    step = max(1, _CHUNK // nodes)
    mixture = population.velocities
    for component in range(len(mixture.weights)):
        for start in range(0, len(flat_x), step):
            part = slice(start, start + step)
            result[part] += mixture.weights[component] * _component_density(
                flat_x[part],
                shifted[part],
                noise[part],
                near,
                far_of_x[part],
                population,
                component,
                focal,
                nodes,
            )
    return result.reshape(x.shape)


def _component_density(
    x: Floats,
    v: Floats,
    noise: Floats,
    near: float,
    far: Floats,
    population: Population,
    component: int,
    focal: float,
    nodes: int,
) -> Floats:
    """Integrate one Gaussian of the velocities; arguments of shape (N,), yaw's mean taken out of v."""
    mixture = population.velocities
    m_z, s_z = float(mixture.t_z[component]), float(mixture.t_z_sd[component])
    slope = focal * float(mixture.t_x[component]) - x * m_z
    spread = np.hypot(focal * float(mixture.t_x_sd[component]), x * s_z)
    low, high = _active_depths(v, slope, spread, noise, near, far)
    abscissae, weights = np.polynomial.legendre.leggauss(nodes)
    half = 0.5 * np.log(np.maximum(high, low) / low)
    depth = low[:, None] * np.exp(half[:, None] * (abscissae + 1))
    variance = np.maximum((spread[:, None] / depth) ** 2 + noise[:, None] ** 2, np.finfo(float).tiny)
    residual = v[:, None] - slope[:, None] / depth
    with np.errstate(over="ignore"):  # no spread at all: a density of 0 but where v is met exactly
        exponent = -0.5 * residual**2 / variance - 0.5 * np.log(variance) - _LOG_ROOT_2PI
    if mixture.approaching:
        exponent = exponent + _log_approaching(
            x[:, None], residual, variance, noise[:, None], depth, m_z, s_z
        )
    # One Z of place's (Z / f) dZ, one of dZ = Z d(log Z).
    values = population.place(x[:, None] * depth / focal, depth) * depth**2 / focal * np.exp(exponent)
    return np.asarray(half * (values @ weights))


def _active_depths(
    v: Floats, slope: Floats, spread: Floats, noise: Floats, near: float, far: Floats
) -> tuple[Floats, Floats]:
    """Bound the depths at which ``|v - slope / Z|`` is within reach of ``sqrt((spread / Z)^2 + noise^2)``.

    With u = 1 / Z that is a quadratic inequality. Where the relative spread is wide it excludes little, and
    the integrand is smooth in log Z over the whole range.
    """
    low, high = np.full(v.shape, near), np.maximum(far, near)
    a = slope**2 - (_REACH * spread) ** 2
    narrow = a > 0
    b, c = slope * v, v**2 - (_REACH * noise) ** 2
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        u_low = np.clip((b - root) / a, 1 / high, 1 / near)
        u_high = np.clip((b + root) / a, 1 / high, 1 / near)
    low = np.where(narrow, 1 / u_high, low)
    high = np.where(narrow, 1 / u_low, high)
    return low, high


def _log_approaching(
    x: Floats, residual: Floats, variance: Floats, noise: Floats, depth: Floats, m_z: float, s_z: float
) -> Floats:
    """Return ln [P(T_Z < 0 | v, Z) / P(T_Z < 0)], the exact correction for a Gaussian T_Z cut at 0."""
    if s_z == 0:
        return np.zeros(np.broadcast_shapes(residual.shape, depth.shape))
    # v = -x T_Z / Z + noise: T_Z given v is Gaussian again.
    gain = -x / depth
    mean = m_z + s_z**2 * gain * residual / variance
    sd = s_z * np.sqrt(np.maximum(1 - (s_z * gain) ** 2 / variance, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        score = np.where(noise > 0, -mean / sd, np.where(mean < 0, np.inf, -np.inf))
    return np.asarray(log_ndtr(score) - log_ndtr(-m_z / s_z))
