"""The scenes: each populates a world and places its camera."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sim.params import AerialParams, InCarParams, MotorcycleLaneParams

if TYPE_CHECKING:
    from sim.simulation import Scene


def make_scene(
    params: InCarParams | AerialParams | MotorcycleLaneParams, *, seed: int, rate: int, seconds: float
) -> Scene:
    """Populate the world that parameters describe.

    Args:
        params: Of one of the scenes.
        seed: Picks one world among all that they allow.
        rate: Ticks a second.
        seconds: How long it is to last.

    Raises:
        RecordingError: If the traffic's recording is missing or too short.
    """
    # With the traffic and the meshes: heavy.
    from sim.scenes.aerial import AerialScene
    from sim.scenes.in_car import InCarScene
    from sim.scenes.motorcycle_lane import MotorcycleLaneScene

    if isinstance(params, InCarParams):
        return InCarScene(params, seed=seed, rate=rate, seconds=seconds)
    if isinstance(params, AerialParams):
        return AerialScene(params, seed=seed, rate=rate, seconds=seconds)
    return MotorcycleLaneScene(params, seed=seed, rate=rate)
