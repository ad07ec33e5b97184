"""What a renderer draws: models made of meshes, each face of a named surface."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from sim.world import Kind


class Surface(IntEnum):
    """What a face is made of: it picks the layer of the texture array and how light falls on it."""

    PAINT = 0  # takes the body's colour; glossy, reflects the sky
    GLASS = 1  # dark, reflects the sky
    CHROME = 2
    RUBBER = 3
    PLASTIC = 4  # black trim, bumpers' lower part, underside
    PLATE = 5
    TAIL_LAMP = 6  # red, glows when Lamps.TAIL or BRAKE is on
    HEAD_LAMP = 7
    CARGO = 8  # a lorry's box or tarpaulin, takes the body's colour
    FOLIAGE = 9
    BARK = 10
    CONCRETE = 11
    STEEL = 12
    FACADE = 13
    ROOF = 14
    SIGN = 15  # takes the body's colour; carries markings
    STREET_LAMP = 16  # glows at night
    GRASS = 17
    ASPHALT = 18
    HILL = 19
    FABRIC = 20  # takes the body's colour; dull
    PALETTE = 21  # stripes of plain colours: a face lies on one of them


@dataclass(frozen=True, slots=True, kw_only=True)
class Mesh:
    """Triangles in the model's own frame: x ahead, y to the left, z up, origin on the ground in the middle.

    Attributes:
        vertices: (V, 3) float32, metres.
        normals: (V, 3) float32, unit.
        uvs: (V, 2) float32; one unit repeats the texture once.
        surfaces: (V,) uint8, a `Surface`, the same on all corners of a face.
        faces: (F, 3) int32, counter-clockwise from outside.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    uvs: NDArray[np.float32]
    surfaces: NDArray[np.uint8]
    faces: NDArray[np.int32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A thing that can stand in the world, at one or several levels of detail.

    Attributes:
        name: For people.
        kind: What it is.
        size: Length, width, height, metres. Bodies of another size are scaled from this one.
        lods: Meshes from fine to coarse.
        switch: Distances at which the next coarser mesh takes over, metres, for a focal length of
            `sim.render.instances.SWITCH_FOCAL`; one fewer than ``lods``.
    """

    name: str
    kind: Kind
    size: tuple[float, float, float]
    lods: tuple[Mesh, ...]
    switch: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Photo:
    """The ground as a picture of itself from straight above, for cameras that look down from afar.

    Attributes:
        low: (x, y) world metres of its south-western corner.
        texel: Metres along each side of a texel.
        image: (H, W, 3) uint8 albedo, coded by the square root as textures are; rows run north.
    """

    low: tuple[float, float]
    texel: float
    image: NDArray[np.uint8]

    @property
    def extent(self) -> tuple[float, float]:
        """Metres from west to east and from south to north."""
        return self.image.shape[1] * self.texel, self.image.shape[0] * self.texel


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """The flat ground: a road band along a reference line, and land on both sides out to the horizon.

    The shader paints asphalt, marks and verge from ``coordinates``, or from ``photo`` where there is one.

    Attributes:
        vertices: (V, 3) float32, world metres.
        coordinates: (V, 2) float32: arc length s along the reference line and offset d to its left, metres.
        faces: (F, 3) int32.
        lane_edges: (E,) offsets d of the painted lines, left to right (descending d).
        line_styles: (E,) uint8: 0 none, 1 solid white, 2 dashed white, 3 solid yellow, 4 double yellow.
        paved: (lowest d, highest d) of the asphalt.
        photo: What is painted on the faces within ``paved``, in place of a road.
    """

    vertices: NDArray[np.float32]
    coordinates: NDArray[np.float32]
    faces: NDArray[np.int32]
    lane_edges: NDArray[np.float64]
    line_styles: NDArray[np.uint8]
    paved: tuple[float, float]
    photo: Photo | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Light:
    """How the scene is lit. Colours are linear RGB; 1 is the white that a well exposed picture shows.

    Attributes:
        sun: (3,) unit vector toward the sun (or the moon).
        sun_colour: (3,) irradiance of a surface that faces it.
        zenith: (3,) sky radiance overhead.
        horizon: (3,) sky radiance at the horizon, also the colour of haze.
        cloud: Share of the sky under cloud, [0, 1].
        haze: Extinction per metre.
        night: Whether headlights shine and the beam of the own car lights the road.
        wet: How wet the road is, [0, 1].
        seed: Of the clouds and of the asphalt's patches.
        street_lamps: Whether street lamps shine at night.
    """

    sun: NDArray[np.float64]
    sun_colour: NDArray[np.float64]
    zenith: NDArray[np.float64]
    horizon: NDArray[np.float64]
    cloud: float
    haze: float
    night: bool
    wet: float
    seed: int
    street_lamps: bool = False
