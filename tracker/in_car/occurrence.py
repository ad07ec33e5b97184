"""Where vehicles appear in the picture: p(x, y | C) of paper 1, eqs. (18), (19).

Rows y count downwards from the horizon. The density is low but in a band of rows, which is why profiling that
band vertically loses little: the expected vertical profile is the density with y integrated out.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from tracker.in_car.likelihood import MotionPriors, truncated_normal

Floats = NDArray[np.float64]

_NODES = 96


class Occurrence:
    """Density of the image points of vehicles' features.

    Features are spread evenly from the wheels' contact with the road up to the roof.

    Args:
        focal: Px.
        priors: Places of vehicles; the velocities do not matter.
        camera_height: H_cam, metres above the road.
        vehicle_height: Metres.
    """

    def __init__(
        self,
        focal: float,
        priors: MotionPriors | None = None,
        *,
        camera_height: float = 1.2,
        vehicle_height: float = 1.5,
    ) -> None:
        for name, value in (
            ("focal", focal),
            ("camera_height", camera_height),
            ("vehicle_height", vehicle_height),
        ):
            if not value > 0:
                raise ValueError(f"{name} must be positive, got {value}")
        self._focal = focal
        self._priors = priors or MotionPriors()
        self._roof = camera_height - vehicle_height
        self._road = camera_height
        self._nodes, self._weights = np.polynomial.legendre.leggauss(_NODES)

    def density(self, x: ArrayLike, y: ArrayLike) -> Floats:
        """Return p(x, y | C) = ∫ p(Z) p_X(x Z / f) p_Y(y Z / f) (Z / f)^2 dZ, per px^2.

        Args:
            x: Px from the principal point.
            y: Px below the horizon; broadcasts with ``x``.
        """
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        depth, weights = self._depths(*self._limits(y))
        heights = self._road - self._roof
        integrand = self._depth_density(depth) * self._lateral_density(x[..., None] * depth / self._focal)
        return np.asarray((integrand * (depth / self._focal) ** 2 * weights).sum(-1) / heights)

    def profile(self, x: ArrayLike) -> Floats:
        """Return p(x | C) = ∫ p(Z) p_X(x Z / f) (Z / f) dZ, per px: the expected vertical profile.

        Args:
            x: Px from the principal point.
        """
        x = np.asarray(x, float)
        near, far = self._priors.car_depth_range
        depth, weights = self._depths(np.full(x.shape, near), np.full(x.shape, far))
        integrand = self._depth_density(depth) * self._lateral_density(x[..., None] * depth / self._focal)
        return np.asarray((integrand * depth / self._focal * weights).sum(-1))

    def below(self, y: ArrayLike) -> Floats:
        """Return the share of vehicles' features whose row is at most ``y``, px below the horizon."""
        y = np.asarray(y, float)
        near, far = self._priors.car_depth_range
        # P(Y <= y Z / f) is bent at the depths at which the row meets the roof or the road.
        with np.errstate(divide="ignore"):
            bends = [
                np.where(y == 0, far, self._focal * edge / np.where(y == 0, 1, y))
                for edge in (self._roof, self._road)
            ]
        edges = np.sort(np.clip([np.full(y.shape, near), *bends, np.full(y.shape, far)], near, far), axis=0)
        total = np.zeros(y.shape)
        for low, high in pairwise(edges):
            depth, weights = self._depths(low, high)
            share = (y[..., None] * depth / self._focal - self._roof) / (self._road - self._roof)
            total += (self._depth_density(depth) * np.clip(share, 0, 1) * weights).sum(-1)
        return total

    def useful_band(self, share: float = 0.95) -> tuple[float, float]:
        """Return the rows between which ``share`` of the vehicles' features lie, as many above as below.

        Args:
            share: In (0, 1).

        Returns:
            Upper and lower row, px below the horizon (the upper one is negative where roofs stand above it).
        """
        if not 0 < share < 1:
            raise ValueError(f"share must lie between 0 and 1, got {share}")
        near = self._priors.car_depth_range[0]
        bounds = (
            min(self._roof, 0.0) * self._focal / near - 1,
            max(self._road, 0.0) * self._focal / near + 1,
        )
        tail = (1 - share) / 2
        low, high = (
            float(brentq(lambda y, goal=goal: float(self.below(y)) - goal, *bounds, xtol=1e-6))
            for goal in (tail, 1 - tail)
        )
        return low, high

    def _limits(self, y: Floats) -> tuple[Floats, Floats]:
        """Return the depths between which row y shows a vehicle."""
        near, far = self._priors.car_depth_range
        with np.errstate(divide="ignore", invalid="ignore"):
            roof, road = self._focal * self._roof / y, self._focal * self._road / y
        # A ray above the horizon leaves through the roof, one below through the road; a roof below the
        # camera also keeps near depths out.
        high = np.where(y > 0, road, np.where(y < 0, roof, far))
        low = np.where(y > 0, roof, near)
        if self._roof >= 0:
            high = np.where(y > 0, high, near)
        low = np.clip(low, near, far)
        return low, np.clip(high, low, far)

    def _depths(self, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        half = (high - low)[..., None] / 2
        return low[..., None] + half * (self._nodes + 1), half * self._weights

    def _depth_density(self, depth: Floats) -> Floats:
        priors = self._priors
        return truncated_normal(depth, priors.car_depth, priors.car_depth_sd, *priors.car_depth_range)

    def _lateral_density(self, lateral: Floats) -> Floats:
        sd = self._priors.car_lateral_sd
        return np.asarray(np.exp(-0.5 * (lateral / sd) ** 2) / (sd * np.sqrt(2 * np.pi)))
