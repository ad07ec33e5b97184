"""The scenes: each populates a world and places its camera."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sim.params import InCarParams, MotorcycleLaneParams

if TYPE_CHECKING:
    from sim.simulation import Scene


def make_scene(params: InCarParams | MotorcycleLaneParams, *, seed: int, rate: int, seconds: float) -> Scene:
    """Populate the world that parameters describe.

    Args:
        params: Of one of the scenes.
        seed: Picks one world among all that they allow.
        rate: Ticks a second.
        seconds: How long it is to last.
    """
    # With the traffic and the meshes: heavy.
    from sim.scenes.in_car import InCarScene
    from sim.scenes.motorcycle_lane import MotorcycleLaneScene

    if isinstance(params, InCarParams):
        return InCarScene(params, seed=seed, rate=rate, seconds=seconds)
    return MotorcycleLaneScene(params, seed=seed, rate=rate)
