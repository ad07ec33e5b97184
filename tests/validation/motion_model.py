"""The simulator against paper 1's mathematics: does (x, v) follow p(x, v | B) and p(x, v | C)?

``python -m tests.validation.motion_model`` drives 50 seeds over a straight road and takes one sample per
object and sampled frame, at the object's centre. Two sides are compared that share no code:

- the picture: x is the centre's projection with the scene's own camera poses, v its difference quotient
  between the frames before and after, and the centre counts if the id map shows the object there;
- the paper: priors of X, Z and the velocities, measured in space over all objects, seen or not, are
  projected by `tracker.in_car.projection` (eqs. 10, 15, 17), times the visibility by cell of (x, Z).

The priors match the drives to different degrees. "family" keeps paper 1's own distributions and fits their
parameters, with eq. (12) cut to what lies beside the asphalt. "measured" takes each one-dimensional prior
as it is, still independent of the others. "lanes" does so for each lane and stretch of distance: distances
and relative speeds depend on the lane, which the paper neglects.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sim.camera import project
from sim.params import EgoParams, InCarParams, RoadParams, SceneryParams, TrafficParams
from sim.render.gl import GlRenderer
from sim.scenery.yard import MARGIN
from sim.scenes.in_car import InCarScene
from sim.world import Bodies, Kind, Role, WorldState
from tracker.in_car.likelihood import corridor_density
from tracker.in_car.projection import Place, Population, Velocities, projected_density

Floats = NDArray[np.float64]

DRIVES, SECONDS, RATE, EVERY = 50, 8.0, 15, 4
PARAMS = InCarParams(
    road=RoadParams(lanes=3, oncoming_lanes=2, median=3.0, shoulder=2.5),
    traffic=TrafficParams(density=20.0, oncoming_density=4.0, speed=22.0, speed_spread=4.0),
    ego=EgoParams(driver="traffic", speed=21.0),
    scenery=SceneryParams(setting="motorway", corridor=6.0, bridges=0.0),
)
STATIC_DEPTHS, VEHICLE_DEPTHS = (5.0, 150.0), (5.0, 100.0)
SIDE = 50.0
SCATTERED = (Kind.TREE, Kind.BUSH, Kind.SIGN, Kind.POLE, Kind.BUILDING)

X_EDGES = np.linspace(-320.0, 320.0, 18)
BEND = 10.0
V_EDGES = BEND * np.sinh(np.linspace(-np.arcsinh(60.0), np.arcsinh(60.0), 26))
"""Image speeds spread over three orders of magnitude: cells are even in asinh(v / 10 px/s)."""
CUT = 3
"""A cell is the mean of so many points a side."""
STRETCHES = (5.0, 15.0, 30.0, 50.0, 100.0)
DEPTH_EDGES = np.geomspace(5.0, 150.0, 13)


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """N objects in frames.

    Attributes:
        vehicle: (N,) whether it goes the ego's way; all others here are static.
        scattered: (N,) whether eq. (12) placed it.
        X: (N,) metres to the right of the camera.
        Z: (N,) metres ahead.
        t_x: (N,) m/s, velocity against the camera along its axes, its rotation left out.
        t_z: (N,) m/s.
        yaw: (N,) rad/s.
        aside: (N,) metres of the camera to the right of the reference line.
        x: (N,) px from the principal point.
        v: (N,) px/s.
        seen: (N,) whether the id map shows the object at its centre.
    """

    vehicle: NDArray[np.bool_]
    scattered: NDArray[np.bool_]
    X: Floats
    Z: Floats
    t_x: Floats
    t_z: Floats
    yaw: Floats
    aside: Floats
    x: Floats
    v: Floats
    seen: NDArray[np.bool_]

    def take(self, index: NDArray[np.bool_]) -> Samples:
        """Return the samples that ``index`` selects."""
        return Samples(**{f.name: getattr(self, f.name)[index] for f in fields(self)})


def centres(bodies: Bodies) -> Floats:
    """Return the middles of bodies, (N, 3) world metres."""
    return bodies.positions + 0.5 * bodies.sizes[:, 2:] * np.array([0, 0, 1])


def drive(params: InCarParams, seed: int) -> Samples:
    """Drive once and sample every object ahead in each ``EVERY``-th frame."""
    scene = InCarScene(params, seed=seed, rate=RATE, seconds=SECONDS)
    parts: list[dict[str, NDArray[np.generic]]] = []
    with GlRenderer(scene.stage, scene.camera) as renderer:
        states: list[WorldState] = []
        for tick in range(round(SECONDS * RATE)):
            states = [*states[-2:], scene.step()]
            if tick >= 2 and tick % EVERY == 0:
                parts.append(_sample(scene, renderer, states))
    return Samples(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})


def _sample(
    scene: InCarScene, renderer: GlRenderer, states: list[WorldState]
) -> dict[str, NDArray[np.generic]]:
    """Sample the middle one of three successive states."""
    camera, scenery, now = scene.camera, scene.stage.scenery, states[1]
    common = np.intersect1d(states[0].vehicles.ids, states[2].vehicles.ids)
    common = np.intersect1d(common, now.vehicles.ids[now.vehicles.roles == Role.SAME_WAY])
    poses = [scene.pose(state) for state in states]
    points, bodies = [], []
    for state in states:
        order = np.argsort(state.vehicles.ids)
        vehicles = state.vehicles.take(order[np.searchsorted(state.vehicles.ids, common, sorter=order)])
        bodies.append(vehicles)
        points.append(np.concatenate([centres(scenery), centres(vehicles)]))
    (before, _), (pixels, _), (after, _) = (
        project(camera, pose, point) for pose, point in zip(poses, points, strict=True)
    )
    local = poses[1].to_camera(points[1])
    moved = (points[2] - points[0] - (poses[2].position - poses[0].position)) * RATE / 2
    t = moved @ poses[1].rotation.T
    ids = renderer.render(now, camera, poses[1]).ids
    column, row = (np.nan_to_num(pixels, nan=-1.0)[:, k].astype(np.int64) for k in (0, 1))
    inside = (pixels[:, 0] >= 0) & (column < camera.width) & (pixels[:, 1] >= 0) & (row < camera.height)
    own = np.concatenate([scenery.ids, common])
    seen = np.zeros(len(own), bool)
    seen[inside] = ids[row[inside], column[inside]] == own[inside]
    vehicle = np.arange(len(own)) >= len(scenery)
    offset = scene.road.locate(*points[1][:, :2].T)[1]
    assert now.ego is not None
    aside = -float(scene.road.locate(*poses[1].position[:2])[1])
    away = np.maximum(scene.road.paved[0] - offset, offset - scene.road.paved[1])
    kinds = np.concatenate([scenery.kinds, bodies[1].kinds])
    values = {
        "vehicle": vehicle,
        # Delineators stand in line, 0.45 m beside the asphalt.
        "scattered": ~vehicle & np.isin(kinds, SCATTERED) & (np.abs(away - 0.45) > 0.02),
        "X": local[:, 0],
        "Z": local[:, 2],
        "t_x": t[:, 0],
        "t_z": t[:, 2],
        "yaw": np.full(len(own), now.ego.yaw_rate),
        "aside": np.full(len(own), aside),
        "x": pixels[:, 0] - camera.cx,
        "v": (after - before)[:, 0] * RATE / 2,
        "seen": seen,
    }
    low, high = np.where(vehicle[:, None], VEHICLE_DEPTHS, STATIC_DEPTHS).T
    wanted = (local[:, 2] >= low) & (local[:, 2] <= high) & (np.abs(local[:, 0]) <= SIDE)
    return {name: value[wanted] for name, value in values.items()}


# --- priors


def histogram(values: Floats, edges: Floats) -> Callable[[Floats, Floats], Floats]:
    """Return the piecewise constant density of a sample, as its mean between two points."""
    cumulative = np.concatenate([[0.0], np.cumsum(np.histogram(values, edges)[0]) / len(values)])

    def mean(low: Floats, high: Floats) -> Floats:
        return (np.interp(high, edges, cumulative) - np.interp(low, edges, cumulative)) / (high - low)

    return mean


def warped_cells(values: Floats, width: float) -> Floats:
    """Number cells that are ``width`` wide about 0 and widen in proportion to the value."""
    return np.round(np.arcsinh(values / (2 * width)) * 2)


def mixture(t_x: Floats, t_z: Floats) -> Velocities:
    """Return the Gaussian mixture that stands for a sample of velocities: one component per filled cell."""
    cells = np.stack([warped_cells(t_x, 0.05), np.round(t_z)], axis=1)
    _, index, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    index = index.ravel()

    def moments(values: Floats) -> tuple[Floats, Floats]:
        mean = np.bincount(index, values) / counts
        variance = np.bincount(index, (values - mean[index]) ** 2) / counts
        return mean, np.sqrt(variance + 0.01**2)

    (m_x, s_x), (m_z, s_z) = moments(t_x), moments(t_z)
    return Velocities(weights=counts / counts.sum(), t_x=m_x, t_x_sd=s_x, t_z=m_z, t_z_sd=s_z)


def visibility(samples: Samples) -> Place:
    """Return the measured share of centres that are seen, by cell of (x, Z), as a function of X and Z."""
    grid = (samples.x, samples.Z)
    edges = (X_EDGES, DEPTH_EDGES)
    all_of_them = np.histogram2d(*grid, bins=edges)[0]
    share = np.histogram2d(*grid, bins=edges, weights=samples.seen.astype(float))[0] / np.maximum(
        all_of_them, 1
    )

    def at(lateral: Floats, depth: Floats) -> Floats:
        x = PARAMS.camera.focal * lateral / depth
        i = np.clip(np.searchsorted(X_EDGES, x, side="right") - 1, 0, len(X_EDGES) - 2)
        j = np.clip(np.searchsorted(DEPTH_EDGES, depth, side="right") - 1, 0, len(DEPTH_EDGES) - 2)
        return np.asarray(share[i, j])

    return at


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Velocities against the camera, and its yaw rate, that occur together.

    Attributes:
        weight: Share of the samples.
        yaw: Rad/s, mean.
        yaw_sd: Rad/s.
        velocities: Of the objects.
    """

    weight: float
    yaw: float
    yaw_sd: float
    velocities: Velocities


def motions(samples: Samples, velocities: Callable[[Samples], Velocities]) -> list[Motion]:
    """Return velocities by yaw rate: yaw comes in bursts, when the car changes lane, and turns its course."""
    cells = warped_cells(samples.yaw, 0.001)
    parts = [samples.take(cells == cell) for cell in np.unique(cells)]
    return [
        Motion(
            weight=len(part.X) / len(samples.X),
            yaw=float(part.yaw.mean()),
            yaw_sd=float(part.yaw.std()),
            velocities=velocities(part),
        )
        for part in parts
    ]


def measured_place(samples: Samples, depths: tuple[float, float], lateral_step: float) -> Place:
    """Return independent densities of X and Z as measured, all objects counted, seen or not."""
    in_x = histogram(samples.X, np.arange(-SIDE, SIDE + lateral_step, lateral_step))
    in_z = histogram(samples.Z, np.linspace(*depths, 25))
    # Vehicles keep so well to their lanes that X has to be averaged over the width of a part of a cell.
    half = 0.5 * (X_EDGES[1] - X_EDGES[0]) / CUT / PARAMS.camera.focal
    return lambda X, Z: in_x(X - half * Z, X + half * Z) * in_z(Z - 0.01, Z + 0.01)


def scattered_place(samples: Samples) -> Place:
    """Return eq. (12) about the middle of the ego's way, outside the asphalt, from where the camera was."""
    road = PARAMS.road
    half = road.median / 2
    left = half + road.oncoming_lanes * road.lane_width + road.shoulder + MARGIN
    right = half + road.lanes * road.lane_width + road.shoulder + MARGIN
    middle = half + road.lanes * road.lane_width / 2
    asides = samples.aside
    grid = np.arange(-SIDE, SIDE + 0.1, 0.1)
    total = np.zeros(len(grid))
    for aside, count in zip(*np.unique(np.round(asides * 4) / 4, return_counts=True), strict=True):
        offset = grid + aside
        free = ((offset < -left) | (offset > right)) & (np.abs(offset - middle) < SIDE)
        total += count * corridor_density(offset - middle, PARAMS.scenery.corridor) * free
    return lambda X, _: np.interp(X, grid, total)


def gaussian_place(samples: Samples) -> Place:
    """Return eq. (16)'s Gaussians of X and Z with the samples' moments."""
    m_x, s_x, m_z, s_z = samples.X.mean(), samples.X.std(), samples.Z.mean(), samples.Z.std()
    return lambda X, Z: np.exp(-0.5 * ((X - m_x) / s_x) ** 2 - 0.5 * ((Z - m_z) / s_z) ** 2)


def gaussian_velocities(samples: Samples) -> Velocities:
    """Return one Gaussian with the samples' moments."""
    t_x, t_z = samples.t_x, samples.t_z
    return Velocities.normal(
        t_x=float(t_x.mean()), t_x_sd=float(t_x.std()), t_z=float(t_z.mean()), t_z_sd=float(t_z.std())
    )


def measured_velocities(samples: Samples) -> Velocities:
    """Return the samples' joint distribution of T_X and T_Z, one narrow Gaussian per filled cell."""
    return mixture(samples.t_x, samples.t_z)


# --- comparison


def expected(
    place: Place, depths: tuple[float, float], moves: list[Motion], seen: Place, nodes: int = 64
) -> Floats:
    """Return p(x, v) times the visibility over the cells, not normalised."""
    x, warped = (
        (edges[:-1, None] + (np.arange(CUT) + 0.5) / CUT * np.diff(edges)[:, None]).ravel()
        for edges in (X_EDGES, np.arcsinh(V_EDGES / BEND))
    )
    v = BEND * np.sinh(warped)
    density = np.zeros((len(x), len(v)))
    for move in moves:
        visible = Population(
            place=lambda X, Z: place(X, Z) * seen(X, Z),
            depth_range=depths,
            lateral_limit=SIDE,
            velocities=move.velocities,
        )
        density += move.weight * projected_density(
            x[:, None],
            v[None, :],
            visible,
            focal=PARAMS.camera.focal,
            yaw_mean=move.yaw,
            yaw_sd=move.yaw_sd,
            v_sd=0.5,
            nodes=nodes,
        )
    density *= np.hypot(v, BEND)
    return density.reshape(len(X_EDGES) - 1, CUT, len(V_EDGES) - 1, CUT).mean((1, 3))


def total_variation(samples: Samples, cells: Floats) -> float:
    """Return the distance between the seen samples and an expectation, both normalised over the cells."""
    shown = samples.take(samples.seen)
    counts = np.histogram2d(shown.x, shown.v, bins=(X_EDGES, V_EDGES))[0]
    return float(0.5 * np.abs(counts / counts.sum() - cells / cells.sum()).sum())


def by_lane(samples: Samples) -> Floats:
    """Return the expectation where each lane, and each stretch of it, has priors of its own."""
    seen = visibility(samples)
    total = np.zeros((len(X_EDGES) - 1, len(V_EDGES) - 1))
    lateral = np.round(samples.X / PARAMS.road.lane_width)
    for lane in np.unique(lateral):
        for low, high in pairwise(STRETCHES):
            part = samples.take((lateral == lane) & (low <= samples.Z) & (high > samples.Z))
            if len(part.X):
                place = measured_place(part, (low, high), 0.2)
                moves = motions(part, measured_velocities)
                total += len(part.X) * expected(place, (low, high), moves, seen, nodes=24)
    return total


def run(drives: int = DRIVES) -> dict[str, float]:
    """Drive and return the total variations by name (see `compare`)."""
    parts = []
    for seed in range(drives):
        parts.append(drive(PARAMS, seed))
        print(f"\rdrive {seed + 1} of {drives}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return compare(
        Samples(**{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Samples)})
    )


def compare(samples: Samples) -> dict[str, float]:
    """Return the total variation of the seen samples from each degree of priors."""
    static, scattered, vehicles = (
        samples.take(chosen) for chosen in (~samples.vehicle, samples.scattered, samples.vehicle)
    )

    def distance(
        part: Samples, place: Place, depths: tuple[float, float], velocities: Callable[[Samples], Velocities]
    ) -> float:
        return total_variation(part, expected(place, depths, motions(part, velocities), visibility(part)))

    return {
        "background, family": distance(
            scattered, scattered_place(scattered), STATIC_DEPTHS, gaussian_velocities
        ),
        "background, measured": distance(
            static, measured_place(static, STATIC_DEPTHS, 0.5), STATIC_DEPTHS, measured_velocities
        ),
        "vehicles, family": distance(vehicles, gaussian_place(vehicles), VEHICLE_DEPTHS, gaussian_velocities),
        "vehicles, measured": distance(
            vehicles, measured_place(vehicles, VEHICLE_DEPTHS, 0.2), VEHICLE_DEPTHS, measured_velocities
        ),
        "vehicles, lanes": total_variation(vehicles, by_lane(vehicles)),
    }


if __name__ == "__main__":
    for name, distance in run().items():
        print(f"{name:25s} total variation {distance:.3f}")
