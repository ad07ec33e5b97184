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
        self._tail = [_centres(model, Surface.TAIL_LAMP) for model in models]
        self._head = [_centres(model, Surface.HEAD_LAMP) for model in models]
        self._street = [_centres(model, Surface.STREET_LAMP) for model in models]

    def burning(self, bodies: Bodies, camera: Camera, pose: Pose, *, streets: bool) -> Burning:
        """Collect the lamps that are on.

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
        position, direction, colour, power, strength = [], [], [], [], []
        for row in rows.tolist():
            model, lamps = int(bodies.models[row]), int(bodies.lamps[row])
            scale = bodies.sizes[row] / self._sizes[model]
            cos, sin = np.cos(bodies.yaws[row]), np.sin(bodies.yaws[row])
            forward = np.array([cos, sin, 0.0])
            shown = []
            if lamps & Lamps.BRAKE:
                shown.append((self._tail[model], -forward, _BRAKE, 1.0, 6.0))
            elif lamps & Lamps.TAIL:
                shown.append((self._tail[model], -forward, _TAIL, 1.0, 5.0))
            if lamps & Lamps.HEAD:
                shown.append((self._head[model], np.array([cos, sin, -0.05]), _HEAD, 28.0, 14.0))
            if streets:
                shown.append((self._street[model], np.array([0.0, 0.0, -1.0]), _STREET, 2.0, 90.0))
            for places, aim, tint, sharpness, reach in shown:
                for place in places * scale:
                    x, y = cos * place[0] - sin * place[1], sin * place[0] + cos * place[1]
                    position.append(offset[row] + [x, y, place[2]])
                    direction.append(aim)
                    colour.append(tint)
                    power.append(sharpness)
                    strength.append(reach)
        return Burning(
            position=np.array(position).reshape(-1, 3),
            direction=np.array(direction).reshape(-1, 3),
            colour=np.array(colour).reshape(-1, 3),
            power=np.array(power),
            strength=np.array(strength),
        )


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
        (9.0 + 330.0 / (distance[rows] + 3.0))
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
