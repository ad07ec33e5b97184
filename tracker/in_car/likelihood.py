"""The likelihoods p(x, v | background) and p(x, v | car) of paper 1, eqs. (10)-(17).

They are not learnt: distributions of places and velocities in space are projected through the pinhole camera.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from tracker.in_car.projection import Population, Velocities, projected_density

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionPriors:
    """The parameters of paper 1's distributions in space.

    The paper's own values are lost; the defaults are ours.

    Attributes:
        corridor: D of eq. (12): scale of the empty corridor around the road, metres.
        lateral_limit: Background lies within this distance of the camera's path, metres: eq. (12) is improper
            without.
        depth_range: Background lies between these distances, metres, as likely at each: an unbounded flat
            p(Z) is improper.
        speed: S, mean speed of the camera, m/s.
        speed_sd: sigma_V, m/s.
        car_lateral_sd: sigma_X of the vehicles, metres.
        car_depth: Z_0, mean distance of the vehicles, metres.
        car_depth_sd: sigma_Z, metres.
        car_depth_range: Vehicles lie between these distances, metres.
        car_t_x_sd: sigma_Tx, sideways velocity of a vehicle against the camera, m/s.
        car_t_z_sd: sigma_Tz, forward velocity likewise, m/s.
        yaw_sd: sigma_R, rad/s, of the camera's yaw rate, or of what is left of it once a measured one is
            taken out.
        yaw_mean: Mean yaw rate, rad/s, positive to the right.
        v_sd: Standard deviation of the measurement of v, px/s.
        forward_only: Whether V is truncated to V > 0 (it then has the mean S only before the truncation).
    """

    corridor: float = 5.0
    lateral_limit: float = 50.0
    depth_range: tuple[float, float] = (5.0, 150.0)
    speed: float = 15.0
    speed_sd: float = 3.0
    car_lateral_sd: float = 4.0
    car_depth: float = 25.0
    car_depth_sd: float = 12.0
    car_depth_range: tuple[float, float] = (5.0, 100.0)
    car_t_x_sd: float = 0.6
    car_t_z_sd: float = 2.0
    yaw_sd: float = 0.0
    yaw_mean: float = 0.0
    v_sd: float = 0.0
    forward_only: bool = True


def corridor_density(lateral: ArrayLike, corridor: float) -> Floats:
    """Return eq. (12), not normalised: (1 - exp(-X^2 / 2 D^2)) / (1 + |X|), of X in metres."""
    distance = np.abs(np.asarray(lateral, float))
    return np.asarray(-np.expm1(-(distance**2) / (2 * corridor**2)) / (1 + distance))


def corridor_norm(corridor: float, limit: float) -> float:
    """Return the integral of eq. (12) over |X| <= ``limit``, metres."""
    # The numerator rises within a few D, the denominator within a metre: three panels.
    edges = np.unique(np.minimum([0.0, 2 * corridor, 8 * corridor, limit], limit))
    nodes, weights = np.polynomial.legendre.leggauss(64)
    total = 0.0
    for low, high in pairwise(edges):
        half = (high - low) / 2
        total += half * float(weights @ corridor_density(low + half * (nodes + 1), corridor))
    return 2 * total


def truncated_normal(values: Floats, mean: float, sd: float, low: float, high: float) -> Floats:
    """Return the density of a Gaussian cut to [``low``, ``high``] and normalised."""
    mass = ndtr((high - mean) / sd) - ndtr((low - mean) / sd)
    density = np.exp(-0.5 * ((values - mean) / sd) ** 2) / (sd * np.sqrt(2 * np.pi) * mass)
    return np.asarray(np.where((values >= low) & (values <= high), density, 0.0))


class MotionModel:
    """Paper 1's two classes of traces: densities of image place and image speed.

    Args:
        focal: Px.
        priors: Of places and velocities in space.
    """

    def __init__(self, focal: float, priors: MotionPriors | None = None) -> None:
        if not focal > 0:
            raise ValueError(f"focal must be positive, got {focal}")
        self.focal = focal
        self.priors = priors = priors or MotionPriors()
        near, far = priors.depth_range
        car_near, car_far = priors.car_depth_range
        norm = corridor_norm(priors.corridor, priors.lateral_limit) * (far - near)
        self._background = Population(
            place=lambda lateral, _: corridor_density(lateral, priors.corridor) / norm,
            depth_range=priors.depth_range,
            lateral_limit=priors.lateral_limit,
            velocities=Velocities.normal(
                t_z=-priors.speed, t_z_sd=priors.speed_sd, approaching=priors.forward_only
            ),
        )

        def car_place(lateral: Floats, depth: Floats) -> Floats:
            aside = np.exp(-0.5 * (lateral / priors.car_lateral_sd) ** 2)
            ahead = truncated_normal(depth, priors.car_depth, priors.car_depth_sd, car_near, car_far)
            return np.asarray(aside * ahead / (priors.car_lateral_sd * np.sqrt(2 * np.pi)))

        self._car = Population(
            place=car_place,
            depth_range=priors.car_depth_range,
            lateral_limit=np.inf,
            velocities=Velocities.normal(t_x_sd=priors.car_t_x_sd, t_z_sd=priors.car_t_z_sd),
        )

    def background(self, x: ArrayLike, v: ArrayLike, *, nodes: int = 96) -> Floats:
        """Return p(x, v | B), eq. (13) made proper, with yaw and noise, per px and px/s.

        Args:
            x: Px from the principal point.
            v: Px/s.
            nodes: Of the quadrature.
        """
        return self._density(self._background, x, v, nodes)

    def car(self, x: ArrayLike, v: ArrayLike, *, nodes: int = 96) -> Floats:
        """Return p(x, v | C), eqs. (16) and (17), with noise, per px and px/s.

        Args:
            x: Px from the principal point.
            v: Px/s.
            nodes: Of the quadrature.
        """
        return self._density(self._car, x, v, nodes)

    def _density(self, population: Population, x: ArrayLike, v: ArrayLike, nodes: int) -> Floats:
        priors = self.priors
        return projected_density(
            x,
            v,
            population,
            focal=self.focal,
            yaw_mean=priors.yaw_mean,
            yaw_sd=priors.yaw_sd,
            v_sd=priors.v_sd,
            nodes=nodes,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class LikelihoodTable:
    """ln p(x, v | C) - ln p(x, v | B) on a grid: even in x, and in asinh(v / ``bend``).

    Attributes:
        x_max: The grid covers |x| <= ``x_max``, px; beyond, its edge holds.
        v_max: Likewise of v, px/s.
        bend: Px/s: below it the grid is even in v, above it in log v.
        values: (N_x, N_v) log ratios.
    """

    x_max: float
    v_max: float
    bend: float
    values: Floats

    @classmethod
    def build(
        cls,
        model: MotionModel,
        *,
        x_max: float = 320.0,
        v_max: float = 1200.0,
        shape: tuple[int, int] = (121, 161),
        outliers: float = 1e-3,
    ) -> LikelihoodTable:
        """Tabulate a model, in about a tenth of a second.

        Args:
            model: The densities.
            x_max: Px.
            v_max: Px/s.
            shape: N_x, N_v.
            outliers: Share of either class that is spread evenly over x and asinh(v): the floor of the ratio.
                Raising it makes single observations say less.
        """
        bend = 8.0
        x = np.linspace(-x_max, x_max, shape[0])
        warped_max = np.arcsinh(v_max / bend)
        v = bend * np.sinh(np.linspace(-warped_max, warped_max, shape[1]))
        floor = outliers / (2 * x_max) / (2 * warped_max * np.hypot(v, bend))
        grid = x[:, None], v[None, :]
        car, background = (density(*grid, nodes=40) + floor for density in (model.car, model.background))
        return cls(x_max=x_max, v_max=v_max, bend=bend, values=np.log(car) - np.log(background))

    def log_ratio(self, x: ArrayLike, v: ArrayLike) -> Floats:
        """Interpolate.

        Args:
            x: (N,) px from the principal point.
            v: (N,) px/s.

        Returns:
            (N,) ln p(x, v | C) - ln p(x, v | B).
        """
        n_x, n_v = self.values.shape
        column = (np.asarray(x, float) / self.x_max + 1) * (0.5 * (n_x - 1))
        warped = np.arcsinh(np.asarray(v, float) / self.bend) / np.arcsinh(self.v_max / self.bend)
        row = (warped + 1) * (0.5 * (n_v - 1))
        column, row = np.clip(column, 0, n_x - 1), np.clip(row, 0, n_v - 1)
        i = np.minimum(column.astype(int), n_x - 2)
        j = np.minimum(row.astype(int), n_v - 2)
        a, b = column - i, row - j
        table = self.values
        low = (1 - b) * table[i, j] + b * table[i, j + 1]
        high = (1 - b) * table[i + 1, j] + b * table[i + 1, j + 1]
        return np.asarray((1 - a) * low + a * high)


@lru_cache(maxsize=16)
def likelihood_table(focal: float, priors: MotionPriors, x_max: float) -> LikelihoodTable:
    """Return the table of a model, built once in a process.

    Args:
        focal: Px.
        priors: Of the model.
        x_max: Px, half the image's width.
    """
    return LikelihoodTable.build(MotionModel(focal, priors), x_max=x_max)
