"""World state as arrays, on an integer clock."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from enum import IntEnum, IntFlag
from typing import Self

import numpy as np
from numpy.typing import NDArray

SKY_ID = 0
GROUND_ID = 1
FIRST_SCENERY_ID = 2
FIRST_VEHICLE_ID = 1 << 20


class Kind(IntEnum):
    """What an object is."""

    GROUND = 1
    CAR = 2
    VAN = 3
    LORRY = 4
    BUS = 5
    MOTORCYCLE = 6
    TREE = 10
    BUSH = 11
    POLE = 12
    LAMP_POST = 13
    SIGN = 14
    RAIL = 15
    BUILDING = 16
    BRIDGE = 17
    WALL = 18
    HILL = 19


VEHICLE_KINDS = (Kind.CAR, Kind.VAN, Kind.LORRY, Kind.BUS, Kind.MOTORCYCLE)
"""The movable kinds: those that have amodal truth."""


class Role(IntEnum):
    """How a vehicle takes part in the traffic, as seen from the camera car; or that it is in a convoy."""

    NONE = 0
    SAME_WAY = 1
    ONCOMING = 2
    CROSSING = 3
    PARKED = 4
    WRONG_WAY = 5
    CONVOY = 6


class Lamps(IntFlag):
    """The lamps that a vehicle has switched on."""

    OFF = 0
    TAIL = 1
    BRAKE = 2
    HEAD = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Bodies:
    """N objects as parallel arrays.

    Attributes:
        ids: (N,) uint32, unique in an episode, >= 2.
        kinds: (N,) uint8, a `Kind`.
        roles: (N,) uint8, a `Role`.
        models: (N,) int32, index into the scene's list of `sim.meshes.Model`.
        positions: (N, 3) float64, metres: the middle of the footprint, on the ground.
        yaws: (N,) float64, radians, counter-clockwise from east.
        velocities: (N, 3) float64, m/s.
        sizes: (N, 3) float64, metres: length (along the heading), width, height.
        colours: (N, 3) float32 in [0, 1]: sRGB paint; models decide where it shows.
        lamps: (N,) uint8, `Lamps` that are on.
        leans: (N, 2) float64, metres east and north by which a metre of height stands aside: a rider in a
            bend, a tree in the wind.
    """

    ids: NDArray[np.uint32]
    kinds: NDArray[np.uint8]
    roles: NDArray[np.uint8]
    models: NDArray[np.int32]
    positions: NDArray[np.float64]
    yaws: NDArray[np.float64]
    velocities: NDArray[np.float64]
    sizes: NDArray[np.float64]
    colours: NDArray[np.float32]
    lamps: NDArray[np.uint8]
    leans: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.ids)

    def take(self, index: NDArray[np.bool_] | NDArray[np.intp]) -> Self:
        """Return the objects that ``index`` selects: (N,) bool or (M,) int."""
        return replace(self, **{f.name: getattr(self, f.name)[index] for f in fields(self)})

    @classmethod
    def concatenate(cls, *parts: Bodies) -> Bodies:
        """Return all objects of ``parts``, in order."""
        return cls(**{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)})

    @classmethod
    def empty(cls) -> Bodies:
        """Return no objects."""
        return cls(
            ids=np.zeros(0, np.uint32),
            kinds=np.zeros(0, np.uint8),
            roles=np.zeros(0, np.uint8),
            models=np.zeros(0, np.int32),
            positions=np.zeros((0, 3)),
            yaws=np.zeros(0),
            velocities=np.zeros((0, 3)),
            sizes=np.zeros((0, 3)),
            colours=np.zeros((0, 3), np.float32),
            lamps=np.zeros(0, np.uint8),
            leans=np.zeros((0, 2)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Ego:
    """The camera car at one tick.

    Attributes:
        position: (3,) float64, metres, on the ground below the middle of the car.
        yaw: Heading, radians, counter-clockwise from east.
        speed: m/s along the heading, >= 0.
        yaw_rate: Paper 1's R_y, rad/s: positive turns the nose to the right.
        pitch: Radians: positive raises the nose.
        heave: Metres: how far the body stands above its rest height.
    """

    position: NDArray[np.float64]
    yaw: float
    speed: float
    yaw_rate: float
    pitch: float
    heave: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Aloft:
    """A camera in the air at one tick.

    Attributes:
        position: (3,) float64, world metres.
        rotation: (3, 3) float64, world to camera, as `sim.camera.Pose` has it.
        velocity: (3,) float64, m/s.
    """

    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    velocity: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lighting:
    """The light at one tick, as factors on the scene's `sim.models.Light`, red, green and blue.

    Attributes:
        sun: Of what comes straight from the sun, and casts shadows.
        sky: Of what comes from everywhere else.
    """

    sun: tuple[float, float, float] = (1.0, 1.0, 1.0)
    sky: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Handling:
    """What is done to a camera on a mast at one tick.

    Attributes:
        pan: Radians by which it is turned to the right of where it was mounted to look.
        stops: Stops of light by which its exposure is set above what it would choose.
    """

    pan: float = 0.0
    stops: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldState:
    """All that changes, at one tick; the scenery stands in the scene.

    Attributes:
        tick: Integer time, from 0.
        rate: Ticks a second.
        vehicles: Every vehicle but the ego, parked ones too.
        ego: The camera car, or None where the camera is on none.
        lighting: How the light differs from the scene's.
        sway: (S, 2) how the scene's S pieces of scenery lean, as `Bodies.leans`, or None where the air is
            still.
        aloft: The camera, where it flies.
        handling: What is done to the camera.
    """

    tick: int
    rate: int
    vehicles: Bodies
    ego: Ego | None
    lighting: Lighting = Lighting()
    sway: NDArray[np.float64] | None = None
    aloft: Aloft | None = None
    handling: Handling = Handling()

    @property
    def time(self) -> float:
        """Seconds since the start: tick / rate, never accumulated."""
        return self.tick / self.rate
