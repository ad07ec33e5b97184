"""Lamps of vehicles and streets: where they are, what they light, and the glare around them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.models import Model, Surface
from sim.world import Bodies, Lamps

LIGHTS = 12
"""Lamps that light the scene in one frame: the nearest ones that matter."""

HALO = np.dtype([("position", "<f4", 3), ("radius", "<f4"), ("colour", "<f4", 3)])
"""One glare, as the shader reads it: where, relative to the camera; its radius, px; its colour."""

_REACH = 110.0
_TAIL, _BRAKE = np.array([0.55, 0.008, 0.006]), np.array([1.5, 0.025, 0.018])
_HEAD = np.array([1.5, 1.4, 1.2])
_STREET = np.array([1.0, 0.70, 0.36])
_HIGH_LAMP_U = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Lights:
    """What lights the scene. Empty places have no colour.

    Attributes:
        position: (LIGHTS, 3) relative to the camera, metres.
        colour: (LIGHTS, 3) irradiance at one metre.
        aim: (LIGHTS, 4) direction of the beam, and the power of its cosine.
        count: How many there are, the strongest first.
    """

    position: NDArray[np.float32]
    colour: NDArray[np.float32]
    aim: NDArray[np.float32]
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Burning:
    """K lamps that are on, near enough to be seen.

    Attributes:
        position: (K, 3) relative to the camera, metres.
        direction: (K, 3) where the lamp shines, unit.
        colour: (K, 3) how bright it is.
        power: (K,) of the cosine of its beam.
        strength: (K,) irradiance at one metre, per unit of colour.
    """

    position: NDArray[np.float64]
    direction: NDArray[np.float64]
    colour: NDArray[np.float64]
    power: NDArray[np.float64]
    strength: NDArray[np.float64]


class LampPlan:
    """Where each model has its lamps, found from its finest mesh.

    Args:
        models: All models of the stage.
    """

    def __init__(self, models: Sequence[Model]) -> None:
        self._sizes = np.array([model.size for model in models], float)
        self._tail, self._head, self._street = (
            _Places.of([_centres(model, surface) for model in models])
            for surface in (Surface.TAIL_LAMP, Surface.HEAD_LAMP, Surface.STREET_LAMP)
        )

    def burning(self, bodies: Bodies, camera: Camera, pose: Pose, *, streets: bool) -> Burning:
        """Collect the lamps that are on, body by body.

        Args:
            bodies: All that may carry lamps.
            camera: Its far plane ends the search.
            pose: The camera's pose.
            streets: Whether street lamps are on.
        """
        offset = bodies.positions - pose.position
        ahead = offset @ pose.rotation[2]
        near = (ahead > -20.0) & (ahead < 0.5 * camera.far)
        rows = np.flatnonzero(near & ((bodies.lamps != 0) | streets))
        if not len(rows):
            level, nothing = np.zeros(0), np.zeros((0, 3))
            return Burning(position=nothing, direction=nothing, colour=nothing, power=level, strength=level)
        lamps, models = bodies.lamps[rows], bodies.models[rows]
        scale = bodies.sizes[rows] / self._sizes[models]
        cos, sin = np.cos(bodies.yaws[rows]), np.sin(bodies.yaws[rows])
        level, one = np.zeros(len(rows)), np.ones(len(rows))
        brake = (lamps & Lamps.BRAKE) != 0
        carried, parts = [], []
        for places, on, aim, tint, power, strength in (
            (self._tail, brake, (-cos, -sin, level), _BRAKE, 1.0, 2.0),
            (self._tail, ((lamps & Lamps.TAIL) != 0) & ~brake, (-cos, -sin, level), _TAIL, 1.0, 1.0),
            (self._head, (lamps & Lamps.HEAD) != 0, (cos, sin, level - 0.05), _HEAD, 28.0, 14.0),
            (self._street, np.full(len(rows), streets), (level, level, -one), _STREET, 2.0, 90.0),
        ):
            bearers, local = places.on(models, on)
            local = local * scale[bearers]
            c, s = cos[bearers], sin[bearers]
            turned = np.stack(
                [c * local[:, 0] - s * local[:, 1], s * local[:, 0] + c * local[:, 1], local[:, 2]], axis=1
            )
            count = len(bearers)
            carried.append(bearers)
            parts.append(
                (
                    offset[rows[bearers]] + turned,
                    np.stack(aim, axis=1)[bearers],
                    np.tile(tint, (count, 1)),
                    np.full(count, power),
                    np.full(count, strength),
                )
            )
        order = np.argsort(np.concatenate(carried), kind="stable")
        position, direction, colour, powers, strengths = (
            np.concatenate(kind)[order] for kind in zip(*parts, strict=True)
        )
        return Burning(
            position=position, direction=direction, colour=colour, power=powers, strength=strengths
        )


@dataclass(frozen=True, slots=True)
class _Places:
    """Where M models have lamps of one kind.

    Attributes:
        local: (P, 3) metres, in the model, model by model.
        first: (M,) where each model's begin.
        count: (M,) how many it has.
    """

    local: NDArray[np.float64]
    first: NDArray[np.intp]
    count: NDArray[np.intp]

    @classmethod
    def of(cls, places: Sequence[NDArray[np.float64]]) -> _Places:
        """Gather (n, 3) places of each model."""
        count = np.array([len(part) for part in places], np.intp)
        return cls(np.concatenate([np.zeros((0, 3)), *places]), np.cumsum(count) - count, count)

    def on(
        self, models: NDArray[np.int32], lit: NDArray[np.bool_]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return (K,) which of N bodies bears each lamp that is lit, and (K, 3) where in its model."""
        count = np.where(lit, self.count[models], 0)
        bearers = np.repeat(np.arange(len(models)), count)
        within = np.arange(len(bearers)) - np.repeat(np.cumsum(count) - count, count)
        return bearers, self.local[self.first[models[bearers]] + within]


def lights(burning: Burning) -> Lights:
    """Pick the lamps that light most of what is near."""
    distance = np.sqrt((burning.position**2).sum(axis=1))
    worth = burning.strength / (distance + 5.0) ** 2
    rows = np.argsort(-worth, kind="stable")[:LIGHTS]
    rows = rows[distance[rows] < _REACH]
    count = len(rows)
    out = Lights(
        count=count,
        position=np.zeros((LIGHTS, 3), np.float32),
        colour=np.zeros((LIGHTS, 3), np.float32),
        aim=np.zeros((LIGHTS, 4), np.float32),
    )
    out.position[:count] = burning.position[rows]
    out.colour[:count] = burning.colour[rows] * burning.strength[rows, None]
    out.aim[:count, :3] = burning.direction[rows]
    out.aim[:count, 3] = burning.power[rows]
    return out


def halos(burning: Burning, camera: Camera, *, night: bool) -> NDArray[np.void]:
    """Return (K,) `HALO` records of the lamps that shine toward the camera.

    Args:
        burning: The lamps.
        camera: Its focal length scales the glare.
        night: By day the glare is small.
    """
    distance = np.maximum(np.sqrt((burning.position**2).sum(axis=1)), 1.0)
    facing = -(burning.position * burning.direction).sum(axis=1) / distance
    facing = np.clip(facing, 0.0, 1.0) ** np.where(burning.power > 10, 4.0, 0.7)
    bright = burning.colour.max(axis=1) * facing
    rows = np.flatnonzero(bright > 0.02)
    out = np.zeros(len(rows), HALO)
    scale = camera.focal / 800.0
    out["position"] = burning.position[rows]
    glare = (
        (5.0 + 330.0 / (distance[rows] + 3.0))
        * np.sqrt(bright[rows])
        * np.minimum(1.0, (220.0 / distance[rows]) ** 0.7)
    )
    out["radius"] = np.maximum(scale * glare * (1.0 if night else 0.3), 1.0)
    fade = np.minimum(1.0, 90.0 / distance[rows]) ** 0.6
    out["colour"] = burning.colour[rows] * (facing[rows] * fade * (2.2 if night else 0.25))[:, None]
    return out


def _centres(model: Model, surface: Surface) -> NDArray[np.float64]:
    """Return (n, 3) the middles of a model's lamps of one kind: one each side, and the high one apart."""
    mesh = model.lods[0]
    own = mesh.surfaces == surface
    if surface is Surface.TAIL_LAMP:
        own &= mesh.uvs[:, 0] < _HIGH_LAMP_U
    points = np.asarray(mesh.vertices[own], np.float64)
    if surface is Surface.STREET_LAMP:
        return points if not len(points) else np.asarray(points.mean(axis=0, keepdims=True))
    sides = [points[points[:, 1] > 0.02], points[points[:, 1] < -0.02]]
    middles = [side.mean(axis=0) for side in sides if len(side)]
    return np.asarray(middles, np.float64).reshape(-1, 3)
