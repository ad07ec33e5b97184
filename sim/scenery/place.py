"""Place everything that stands beside a road."""

from __future__ import annotations

from collections.abc import Sequence

from sim.models import Model
from sim.params import SceneryParams
from sim.roads import InCarRoad
from sim.scenery.horizon import place_horizon
from sim.scenery.lines import place_lines
from sim.scenery.scatter import place_bridges, scatter
from sim.scenery.settings import SPECIES
from sim.scenery.yard import Yard
from sim.world import Bodies


def place_scenery(
    road: InCarRoad, params: SceneryParams, lit: bool, catalogue: Sequence[Model], seed: int
) -> Bodies:
    """Place everything that stands beside a road.

    Trees, bushes, signs, poles and buildings are scattered: along the road as Poisson processes (trees in
    clumps, buildings evenly), across it by eq. (12). Rails, walls, lamp posts and delineators stand in lines
    at fixed offsets, woods and hills farther away than eq. (12) reaches: they are no part of it. Each species
    has random streams of its own, so that more of one moves none of another; a bridge clears its own place.

    Args:
        road: Where.
        params: What and how much.
        lit: Whether motorways too are lined with lamp posts in stretches; towns always are.
        catalogue: Models to choose from, by name.
        seed: Of the episode.

    Returns:
        The pieces, ids from `FIRST_SCENERY_ID` on.
    """
    yard = Yard(road, params, catalogue, seed)
    bridges = place_bridges(yard)
    for species in SPECIES:
        scatter(yard, species, bridges)
    place_lines(yard, lit)
    place_horizon(yard)
    return yard.bodies()
