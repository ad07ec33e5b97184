from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from scipy import stats

from sim.meshes import catalogue
from sim.params import RoadParams, SceneryParams
from sim.rng import stream
from sim.roads import build_road
from sim.scenery import place_scenery
from sim.scenery.lines import SEGMENT
from sim.scenery.scatter import X_MAX, offset_density, species_density
from sim.scenery.settings import MODELS, SETTINGS, SPECIES
from sim.scenery.yard import MARGIN
from sim.world import FIRST_SCENERY_ID, FIRST_VEHICLE_ID, Kind

SETTING_NAMES = ("motorway", "rural", "urban")
CATALOGUE = catalogue()
NAME = np.array([model.name for model in CATALOGUE])


def road_of(*, curved=False, length=1500.0, **more):
    return build_road(RoadParams(curved=curved, **more), length, stream(1, "road"))


def corners(bodies):
    """Footprints (N, 4, 2) in world metres."""
    half = bodies.sizes[:, None, :2] / 2 * np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)])
    cos, sin = np.cos(bodies.yaws)[:, None], np.sin(bodies.yaws)[:, None]
    x = bodies.positions[:, None, 0] + cos * half[..., 0] - sin * half[..., 1]
    y = bodies.positions[:, None, 1] + sin * half[..., 0] + cos * half[..., 1]
    return np.stack([x, y], axis=-1)


def scattered(bodies, setting):
    """The rows that eq. (12) governs: lines at fixed offsets, bridges, gantries and the horizon left out."""
    kinds = (Kind.TREE, Kind.BUSH, Kind.SIGN, Kind.POLE, Kind.BUILDING)
    wanted = {name for species in SPECIES for name in MODELS[setting][species]} - {"delineator", "pole-b"}
    return np.isin(bodies.kinds, kinds) & np.isin(NAME[bodies.models], sorted(wanted))


@pytest.mark.parametrize("setting", SETTING_NAMES)
def test_species_together_follow_eq_12(setting):
    """All species' rates add up to the printed density outside the asphalt, to rounding."""
    road, params = road_of(), SceneryParams(setting=setting, corridor=6.0)
    d = np.linspace(-70, 70, 4001)
    total = sum(species_density(road, params, species, d) for species in SPECIES)
    low, high = road.paved
    x = d - road.lane_offsets(True).mean()
    printed = np.where(np.abs(x) <= X_MAX, (1 - np.exp(-(x**2) / 72)) / (1 + np.abs(x)), 0)
    free = (d <= low - MARGIN) | (d >= high + MARGIN)
    np.testing.assert_allclose(total, printed * free, atol=1e-12)


def test_eq_12_has_its_mode_and_normaliser():
    x = np.linspace(-50, 50, 200001)
    density = offset_density(x, 5.0)
    assert np.trapezoid(density, x) == pytest.approx(4.119885, rel=1e-4)
    assert abs(x[density.argmax()]) == pytest.approx(8.483, abs=0.01)


@pytest.mark.parametrize("setting", SETTING_NAMES)
def test_placed_offsets_follow_eq_12(setting):
    """Chi-square of what is placed on 60 km of road against eq. (12) cut at the asphalt.

    Poles stand in lines too, so that the models' names tell the scattered ones. Buildings that would overlap
    are left out, hence the thin town (density 0.25).
    """
    road = road_of(length=20000.0)
    params = SceneryParams(setting=setting, bridges=0.0, density=0.25 if setting == "urban" else 1.0)
    low, high = road.paved
    middle = road.lane_offsets(True).mean()
    offsets = []
    for seed in range(3):
        bodies = place_scenery(road, params, False, CATALOGUE, seed)
        bodies = bodies.take(scattered(bodies, setting))
        offsets.append(road.locate(*bodies.positions[:, :2].T)[1])
    found = np.concatenate(offsets)
    edges = np.concatenate(
        [np.linspace(middle - X_MAX, low - MARGIN, 9), np.linspace(high + MARGIN, middle + X_MAX, 8)]
    )
    grid = np.arange(middle - X_MAX, middle + X_MAX, 0.01)
    kept = [s for s in SPECIES if s != "pole"]
    weight = sum(species_density(road, params, species, grid) for species in kept)
    if setting == "motorway":
        # pole-a is scattered only; it takes the poles' offsets at which it fits.
        weight = weight + species_density(road, params, "pole", grid) * (
            np.maximum(low - grid, grid - high) >= 1.4
        )
    expected = np.histogram(grid, edges, weights=weight)[0]
    observed = np.histogram(found, edges)[0]
    inside = expected > 0
    expected = expected[inside] / expected.sum() * observed[inside].sum()
    observed = observed[inside]
    assert observed.sum() > 500
    assert 0.5 * np.abs(observed - expected).sum() / observed.sum() < 0.05, "total variation"
    # Clumps and even spacing along the road leave the offsets independent.
    assert stats.chisquare(observed, expected).pvalue > 1e-4


@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize("setting", SETTING_NAMES)
def test_nothing_stands_on_the_asphalt(setting, curved):
    road = road_of(curved=curved, median=3.0)
    for seed in range(3):
        bodies = place_scenery(road, SceneryParams(setting=setting, bridges=0.0), True, CATALOGUE, seed)
        # Hills close the view beyond the road's end.
        bodies = bodies.take(road.locate(*bodies.positions[:, :2].T)[0] < road.length)
        spanning = NAME[bodies.models] == "gantry"
        low, high = road.paved
        _, d = road.locate(*np.moveaxis(corners(bodies), -1, 0))
        middle = road.locate(*bodies.positions[:, :2].T)[1]
        median = np.abs(middle) < road.params.median / 2
        beside = ~spanning & ~median
        # Chords of rails cut a little off the inner side of a bend.
        plants = np.isin(bodies.kinds, (Kind.TREE, Kind.BUSH)) & (bodies.sizes[:, 0] < 30)
        # Crowns are round: their boxes' corners are empty.
        reach = np.hypot(*(bodies.sizes[plants, :2].T)) / 2 - bodies.sizes[plants, :2].max(axis=1) / 2
        d[plants] += np.where(middle[plants] < 0, -reach, reach)[:, None]
        slack = SEGMENT**2 / 8 / road.params.min_radius if curved else 1e-3
        assert ((d[beside] < low + slack) | (d[beside] > high - slack)).all()
        # The barrier stays between the innermost lanes.
        assert (np.abs(d[median & ~spanning]) < road.params.median / 2).all()
        # Gantries stand with their posts outside.
        assert (bodies.sizes[spanning][:, 1] - 0.8 > high - low).all()


def test_bridges_span_the_road_and_clear_their_place():
    road, params = road_of(length=6000.0), SceneryParams(bridges=2.0)
    bodies = place_scenery(road, params, False, CATALOGUE, 0)
    bridges = bodies.take(bodies.kinds == Kind.BRIDGE)
    assert len(bridges) >= 4
    assert (0.7 * bridges.sizes[:, 1] > np.ptp(road.paved)).all(), "the piers stand outside"
    rest = bodies.take(scattered(bodies, "motorway"))
    away = np.abs(rest.positions[:, None, 0] - bridges.positions[:, 0]).min(axis=1)
    assert away.min() > 5


def test_ids_count_up_and_leave_room_for_vehicles():
    bodies = place_scenery(road_of(), SceneryParams(), False, CATALOGUE, 0)
    np.testing.assert_array_equal(bodies.ids, FIRST_SCENERY_ID + np.arange(len(bodies)))
    assert bodies.ids.max() < FIRST_VEHICLE_ID
    assert (bodies.sizes > 0).all()
    assert (bodies.velocities == 0).all()


def test_same_seed_same_scenery():
    road = road_of(curved=True)
    first, again, other = (place_scenery(road, SceneryParams(), False, CATALOGUE, seed) for seed in (2, 2, 3))
    for field in fields(first):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(again, field.name))
    assert len(first) != len(other) or not np.array_equal(first.positions, other.positions)


def test_more_of_one_species_moves_no_other(monkeypatch):
    """Twice as many bushes: each other piece stands where it stood."""
    road, params = road_of(), SceneryParams(setting="rural", bridges=0.0)
    before = place_scenery(road, params, False, CATALOGUE, 5)
    from sim.scenery import scatter as module

    plain = module.scatter

    def denser(yard, species, bridges):
        if species == "bush":
            yard.params = params.model_copy(update={"density": 2.0})
        plain(yard, species, bridges)
        yard.params = params

    monkeypatch.setattr("sim.scenery.place.scatter", denser)
    after = place_scenery(road, params, False, CATALOGUE, 5)
    assert (after.kinds == Kind.BUSH).sum() > (before.kinds == Kind.BUSH).sum()
    for field in fields(before):
        if field.name == "ids":
            continue
        old, new = (getattr(b, field.name)[b.kinds != Kind.BUSH] for b in (before, after))
        np.testing.assert_array_equal(old, new)


@pytest.mark.parametrize("setting", SETTING_NAMES)
def test_density_scales_the_counts_and_zero_leaves_the_roadside_empty(setting):
    road = road_of()
    counts = []
    for density in (0.0, 0.5, 1.0, 2.0):
        params = SceneryParams(setting=setting, density=density, bridges=0.0)
        bodies = place_scenery(road, params, True, CATALOGUE, 0)
        counts.append(int(scattered(bodies, setting).sum()))
        s, d = road.locate(*bodies.positions[:, :2].T)
        near = (np.abs(d) < X_MAX) & (s < road.length)
        if density == 0:
            assert not near.any()
    assert counts == sorted(counts)
    assert SETTINGS[setting].per_km > 0
