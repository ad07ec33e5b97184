"""The list of all models."""

from __future__ import annotations

from functools import cache

from sim.meshes.cars import car_models
from sim.meshes.heavy import heavy_models
from sim.meshes.plants import plant_models
from sim.meshes.roadside import roadside_models
from sim.meshes.structures import structure_models
from sim.models import Model


@cache
def catalogue() -> tuple[Model, ...]:
    """Return every model that bodies may index, in an order that never changes; names are unique."""
    return car_models() + heavy_models() + plant_models() + roadside_models() + structure_models()
