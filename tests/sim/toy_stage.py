"""A small world of boxes for the renderers' tests."""

from collections.abc import Sequence

import numpy as np

from sim.camera import Camera, Pose
from sim.models import Ground, Light, Mesh, Model, Surface
from sim.render.types import Stage
from sim.world import FIRST_VEHICLE_ID, Bodies, Kind, Lamps, WorldState

CAMERA = Camera(width=160, height=120, focal=200.0, cx=80.0, cy=60.0)
POSE = Pose.looking((0.0, -1.8, 1.2), yaw=0.0)


def box(
    size: tuple[float, float, float], surface: Surface, at: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Mesh:
    """Stand a box on z = at[2]."""
    corners, normals, uvs = [], [], []
    for axis in range(3):
        for sign in (-1, 1):
            first, second = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            ring = [(-1, -1), (1, -1), (1, 1), (-1, 1)][::sign]
            corners.append([0.5 * (sign * np.eye(3)[axis] + a * first + b * second) for a, b in ring])
            normals.append(np.tile(sign * np.eye(3)[axis], (4, 1)))
            uvs.append([(0.5 * a + 0.5, 0.5 * b + 0.5) for a, b in ring])
    vertices = np.concatenate(corners) * size + at + [0, 0, size[2] / 2]
    faces = np.concatenate([[[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]] for k in range(6)])
    return Mesh(
        vertices=vertices.astype(np.float32),
        normals=np.concatenate(normals).astype(np.float32),
        uvs=np.concatenate(uvs).astype(np.float32),
        surfaces=np.full(24, surface, np.uint8),
        faces=faces.astype(np.int32),
    )


def joined(*meshes: Mesh) -> Mesh:
    """Make one mesh of several."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    return Mesh(
        vertices=np.concatenate([mesh.vertices for mesh in meshes]),
        normals=np.concatenate([mesh.normals for mesh in meshes]),
        uvs=np.concatenate([mesh.uvs for mesh in meshes]),
        surfaces=np.concatenate([mesh.surfaces for mesh in meshes]),
        faces=np.concatenate([m.faces + s for m, s in zip(meshes, starts, strict=True)]).astype(np.int32),
    )


CAR = joined(
    box((4.4, 1.8, 0.8), Surface.PAINT, (0, 0, 0.2)),
    box((2.2, 1.6, 0.5), Surface.GLASS, (-0.2, 0, 1.0)),
    *(box((0.06, 0.3, 0.15), Surface.TAIL_LAMP, (-2.22, y, 0.7)) for y in (-0.7, 0.7)),
    *(box((0.06, 0.3, 0.15), Surface.HEAD_LAMP, (2.22, y, 0.6)) for y in (-0.7, 0.7)),
)
MODELS = (
    Model(
        name="car",
        kind=Kind.CAR,
        size=(4.4, 1.8, 1.5),
        lods=(CAR, box((4.4, 1.8, 1.4), Surface.PAINT)),
        switch=(60.0,),
    ),
    Model(
        name="pillar",
        kind=Kind.BUILDING,
        size=(2.0, 2.0, 6.0),
        lods=(box((2.0, 2.0, 6.0), Surface.CONCRETE),),
    ),
    Model(
        name="bridge",
        kind=Kind.BRIDGE,
        size=(6.0, 40.0, 7.0),
        lods=(box((6, 40, 1.5), Surface.CONCRETE, (0, 0, 5.5)),),
    ),
)


def bodies(
    rows: Sequence[tuple[int, float, float, float]], first_id: int, lamps: Lamps = Lamps.OFF
) -> Bodies:
    """Place models: rows of model, x, y, yaw."""
    count = len(rows)
    models = np.array([row[0] for row in rows], np.int32)
    return Bodies(
        ids=np.arange(first_id, first_id + count, dtype=np.uint32),
        kinds=np.array([MODELS[model].kind for model in models], np.uint8),
        roles=np.zeros(count, np.uint8),
        models=models,
        positions=np.array([[x, y, 0.0] for _, x, y, _ in rows]).reshape(-1, 3),
        yaws=np.array([yaw for *_, yaw in rows]),
        velocities=np.zeros((count, 3)),
        sizes=np.array([MODELS[model].size for model in models]).reshape(-1, 3),
        colours=np.linspace(0.1, 0.9, 3 * count, dtype=np.float32).reshape(-1, 3),
        lamps=np.full(count, lamps, np.uint8),
        leans=np.zeros((count, 2)),
    )


def ground() -> Ground:
    """Make 2 km of straight road from x = -200."""
    d = np.array([400.0, 8.0, -8.0, -400.0])
    s = np.arange(-200.0, 1800.0, 50.0)
    along, across = np.meshgrid(s, d, indexing="ij")
    index = np.arange(len(s) * len(d)).reshape(len(s), len(d))
    a, b, c, e = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack([a, b, e], -1).reshape(-1, 3), np.stack([a, e, c], -1).reshape(-1, 3)])
    return Ground(
        vertices=np.stack([along, across, 0 * along], -1).reshape(-1, 3).astype(np.float32),
        coordinates=np.stack([along, across], -1).reshape(-1, 2).astype(np.float32),
        faces=faces.astype(np.int32),
        lane_edges=np.array([7.2, 3.6, 0.0, -3.6, -7.2]),
        line_styles=np.array([1, 2, 4, 2, 1], np.uint8),
        paved=(-8.0, 8.0),
    )


def light(*, night: bool = False, wet: float = 0.0) -> Light:
    """Shine from the left and behind, or hardly at all."""
    dim = 1e-3 if night else 1.0
    return Light(
        sun=np.array([-0.48, 0.60, 0.64]),
        sun_colour=dim * np.array([2.4, 2.2, 1.9]),
        zenith=dim * np.array([0.1, 0.2, 0.45]),
        horizon=dim * np.array([0.5, 0.6, 0.75]),
        cloud=0.3,
        haze=0.001,
        night=night,
        wet=wet,
        seed=3,
    )


def stage(*, night: bool = False, wet: float = 0.0) -> Stage:
    """Put pillars beside the road and a bridge over it."""
    rows = [(1, 25.0, 9.5, 0.2), (1, 40.0, -10.0, 0.7), (1, 14.0, -6.5, 0.0), (2, 60.0, 0.0, 0.0)]
    return Stage(models=MODELS, scenery=bodies(rows, 2), ground=ground(), light=light(night=night, wet=wet))


def state(tick: int = 0, *, lamps: Lamps = Lamps.OFF) -> WorldState:
    """Put five cars on the road: alone, behind others, across the frame's edge, beside the camera."""
    rows = [
        (0, 12.0 + 0.4 * tick, -1.8, 0.0),
        (0, 24.0 + 0.3 * tick, -1.2, 0.05),
        (0, 80.0, -5.4, 0.0),
        (0, 9.0, -5.2, 0.1),
        (0, 30.0 - 0.8 * tick, 5.4, np.pi),
        (0, 1.5, 1.8, 0.0),
    ]
    return WorldState(tick=tick, rate=30, vehicles=bodies(rows, FIRST_VEHICLE_ID, lamps), ego=None)
