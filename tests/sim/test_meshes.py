"""Meshes: turned outward, of the stated size, cheap, and with what the detector looks for."""

from __future__ import annotations

import numpy as np
import pytest

from sim.meshes import catalogue
from sim.meshes.builder import MeshBuilder
from sim.meshes.motorcycles import OUTFITS, rider_models
from sim.models import Mesh, Model, Surface
from sim.world import VEHICLE_KINDS, Kind

MODELS = catalogue() + rider_models()
VEHICLES = [model for model in catalogue() if model.kind in VEHICLE_KINDS]
MIRRORS = 0.55
"""Metres that mirrors and lamps may stand out of a vehicle's width."""


def names(models):
    return [model.name for model in models]


def face_normals(mesh: Mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, i]].astype(float) for i in range(3))
    area = np.cross(b - a, c - a)
    return area / np.linalg.norm(area, axis=1, keepdims=True), np.linalg.norm(area, axis=1) / 2


def test_names_are_unique_and_the_list_is_cached():
    assert len(set(names(MODELS))) == len(MODELS)
    assert catalogue() is catalogue()
    assert rider_models() is rider_models()


@pytest.mark.parametrize("model", MODELS, ids=names(MODELS))
def test_arrays_are_well_formed(model: Model):
    assert len(model.switch) == len(model.lods) - 1
    assert list(model.switch) == sorted(model.switch)
    for mesh in model.lods:
        assert mesh.vertices.dtype == mesh.normals.dtype == mesh.uvs.dtype == np.float32
        assert mesh.faces.dtype == np.int32
        assert mesh.surfaces.dtype == np.uint8
        assert len(mesh.vertices) == len(mesh.normals) == len(mesh.uvs) == len(mesh.surfaces)
        assert mesh.faces.min() >= 0
        assert mesh.faces.max() < len(mesh.vertices)
        assert np.isfinite(mesh.vertices).all()
        assert np.isfinite(mesh.uvs).all()
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-5)
        kinds = mesh.surfaces[mesh.faces]
        assert (kinds == kinds[:, :1]).all(), "a face is made of one thing"
        assert (face_normals(mesh)[1] > 1e-8).all(), "no face without area"


@pytest.mark.parametrize("model", MODELS, ids=names(MODELS))
def test_every_level_fills_the_stated_size(model: Model):
    slack = np.array([0.10, MIRRORS, 0.06]) if model.kind in VEHICLE_KINDS else np.full(3, 1e-3)
    for mesh in model.lods:
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        assert (high - low <= np.array(model.size) + slack).all()
        assert (high - low >= np.array(model.size) - np.array([0.15, 0.12, 0.06])).all()
        assert abs(low[2]) < 0.01
        np.testing.assert_allclose((low + high)[:2] / 2, 0, atol=0.06)


@pytest.mark.parametrize("model", VEHICLES, ids=names(VEHICLES))
def test_faces_look_outward(model: Model):
    """What points away from the middle axis must be most of the skin; and rear faces look back."""
    for mesh in model.lods:
        normal, area = face_normals(mesh)
        middle = mesh.vertices[mesh.faces].mean(axis=1).astype(float)
        centre = np.array([0, 0, 0.5 * model.size[2]])
        outward = ((middle - centre) * normal).sum(axis=1) > 0
        assert area[outward].sum() > 0.85 * area.sum()
        shading = mesh.normals[mesh.faces].mean(axis=1)
        assert (np.sum(shading * normal, axis=1) > 0).all(), "normals lie on the faces' outer side"
        for surface, sign in ((Surface.TAIL_LAMP, -1), (Surface.HEAD_LAMP, 1)):
            lamp = mesh.surfaces[mesh.faces[:, 0]] == surface
            assert lamp.any()
            assert (sign * normal[lamp, 0] * area[lamp]).sum() > 0
            assert (sign * middle[lamp, 0] > 0).all()


@pytest.mark.parametrize("model", VEHICLES, ids=names(VEHICLES))
def test_vehicles_carry_what_the_detector_sees(model: Model):
    wanted = {Surface.PAINT, Surface.GLASS, Surface.TAIL_LAMP, Surface.HEAD_LAMP, Surface.PLASTIC}
    for level, mesh in enumerate(model.lods):
        present = set(mesh.surfaces.tolist())
        assert wanted <= present
        if level < 2:
            assert {Surface.PLATE, Surface.RUBBER} <= present
    fine = model.lods[0]
    lamps = fine.vertices[fine.surfaces == Surface.TAIL_LAMP]
    assert lamps[:, 1].min() < -0.3 * model.size[1]
    assert lamps[:, 1].max() > 0.3 * model.size[1]
    if model.kind is Kind.CAR:
        # The high lamp is told by u >= 2 (sim.textures).
        assert (fine.uvs[fine.surfaces == Surface.TAIL_LAMP][:, 0] >= 2).any()


@pytest.mark.parametrize("model", VEHICLES, ids=names(VEHICLES))
def test_vehicles_have_horizontal_edges_behind(model: Model):
    """The rear faces have level edges of half a metre or more at eight heights at least."""
    mesh = model.lods[0]
    rear = face_normals(mesh)[0][:, 0] < -0.3
    edges = np.concatenate([mesh.faces[rear][:, [i, (i + 1) % 3]] for i in range(3)])
    span = mesh.vertices[edges[:, 1]] - mesh.vertices[edges[:, 0]]
    level = (np.abs(span[:, 1]) > 0.5) & (np.abs(span[:, 2]) < 0.01)
    heights = np.unique(np.round(mesh.vertices[edges[level, 0], 2], 2))
    assert len(heights) >= 8


@pytest.mark.parametrize("model", MODELS, ids=names(MODELS))
def test_triangle_budgets(model: Model):
    counts = [len(mesh.faces) for mesh in model.lods]
    assert counts == sorted(counts, reverse=True)
    if model.kind is Kind.MOTORCYCLE:
        assert counts[0] <= 900
        assert counts[1] <= 560
        assert counts[2] <= 420
    elif model.kind in VEHICLE_KINDS:
        assert counts[0] <= 520
        assert counts[1] <= 190
        assert counts[2] <= 110
        assert counts[2] <= 45 or model.kind is not Kind.CAR
    elif model.kind in (Kind.TREE, Kind.BUSH) and not model.name.startswith("woods"):
        assert counts[0] <= 800
        assert counts[1] <= 400
        assert counts[2] <= 110
    elif model.kind is Kind.HILL:
        assert counts[0] <= 100
    else:
        assert counts[0] <= 460


def silhouette(mesh: Mesh, axis: int, size: float, cells: int = 48):
    """Occupancy of a mesh seen along an axis, by sampled points of its faces."""
    rng = np.random.default_rng(0)
    corners = mesh.vertices[mesh.faces].astype(float)
    area = face_normals(mesh)[1]
    pick = rng.choice(len(area), 60000, p=area / area.sum())
    a, b = np.sort(rng.random((2, 60000)), axis=0)
    points = (
        corners[pick, 0] * a[:, None]
        + corners[pick, 1] * (b - a)[:, None]
        + corners[pick, 2] * (1 - b)[:, None]
    )
    across = points[:, 1 if axis == 0 else 0]
    grid = np.zeros((cells, cells), bool)
    column = ((across / size + 0.5) * cells).astype(int).clip(0, cells - 1)
    row = (points[:, 2] / size * cells).astype(int).clip(0, cells - 1)
    grid[row, column] = True
    return grid


@pytest.mark.parametrize("model", VEHICLES, ids=names(VEHICLES))
@pytest.mark.parametrize("axis", [0, 1])
def test_levels_agree_in_silhouette(model: Model, axis: int):
    size = max(model.size) if axis else max(model.size[1:]) + 0.6
    fine = silhouette(model.lods[0], axis, size)
    for mesh in model.lods[1:]:
        coarse = silhouette(mesh, axis, size)
        assert (fine & coarse).sum() / (fine | coarse).sum() > 0.80


def test_builder_turns_faces_outward_and_scales_uv():
    builder = MeshBuilder()
    builder.box((0, 0, 0), (1, 2, 3), Surface.PAINT)
    mesh = builder.build()
    normal, area = face_normals(mesh)
    assert len(mesh.faces) == 12
    np.testing.assert_allclose(area.sum(), 22.0)
    middle = mesh.vertices[mesh.faces].mean(axis=1) - [0.5, 1, 1.5]
    assert ((middle * normal).sum(axis=1) > 0).all()
    np.testing.assert_allclose(mesh.normals[mesh.faces[:, 0]], normal, atol=1e-6)
    assert mesh.uvs[:, 1].max() == pytest.approx(3.0), "v is metres up"


def test_riders_wear_many_colours_and_are_cheap():
    machines = rider_models()
    worn = {
        tuple(np.unique(m.lods[0].uvs[m.lods[0].surfaces == Surface.PALETTE, 0]).tolist()) for m in machines
    }
    assert len(machines) >= 20
    assert len(worn) >= 15
    assert len({colour for outfit in OUTFITS for colour in outfit}) >= 12
    for model in machines:
        fine, middle, coarse = (len(mesh.faces) for mesh in model.lods)
        assert coarse < 0.8 * middle < 0.6 * fine
        assert 1.7 < model.size[0] < 2.3
        assert 0.6 < model.size[1] < 1.1
        assert 1.5 < model.size[2] < 1.8
        assert {Surface.FABRIC, Surface.PALETTE, Surface.TAIL_LAMP, Surface.PLATE} <= set(
            model.lods[2].surfaces.tolist()
        )
