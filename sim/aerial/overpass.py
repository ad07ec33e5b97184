"""Bridges over the road: decks on piers with the embankments that lead up to them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.aerial.networks import Strip
from sim.meshes.builder import MeshBuilder, scaled_to
from sim.models import Model, Surface
from sim.params import RoadParams
from sim.roads import InCarRoad, Piece
from sim.textures import PALETTE
from sim.world import Kind

Floats = NDArray[np.float64]

CLEARANCE = 5.4
"""Metres between the road and the underside of a deck."""
DEPTH = 1.5
"""Metres of the deck itself."""
PARAPET = 1.0
LANE = 3.5
RAMP = 75.0
"""Metres over which the road on the deck comes down to the ground, on either side."""
BATTER = 1.6
"""Metres that an embankment's sides run out for each metre that they rise."""
_STRIPE = 0.16
_TURF = 14.0
"""Metres of a slope that the grass covers before it repeats: tiles of a few pixels would show as a grid."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Overpass:
    """A bridge.

    Attributes:
        name: Of its model.
        x: Of its middle, metres.
        y: Likewise.
        heading: Of the road that it carries, radians.
        span: Metres of deck along that road, between the abutments.
        width: Metres across it.
        carries: What runs on it: a road, rails, or earth with plants.
        ramps: Whether embankments lead up to it; else the deck runs on, out of sight.
    """

    name: str
    x: float
    y: float
    heading: float
    span: float
    width: float
    carries: str
    ramps: bool = True

    @property
    def top(self) -> float:
        """Height of the deck's surface, metres."""
        return CLEARANCE + DEPTH

    @property
    def lanes(self) -> int:
        """Lanes each way of the road on it, 0 if it carries none."""
        return max(1, int((self.width - 3.0) / 2 / LANE)) if self.carries == "road" else 0

    @property
    def length(self) -> float:
        """Metres along, embankments too."""
        return self.span + (2 * RAMP if self.ramps else 0.0)

    def height(self, along: ArrayLike) -> Floats:
        """Return the height of the road ``along`` metres from the bridge's middle, any shape."""
        if not self.ramps:
            return np.full(np.shape(along), self.top)
        return np.interp(np.abs(along), [self.span / 2, self.span / 2 + RAMP], [self.top, 0.0])

    def road(self, beyond: float) -> InCarRoad:
        """Return the road on it, from ``beyond`` metres before its embankments to as many behind them."""
        half = self.length / 2 + beyond
        section = RoadParams(
            lanes=self.lanes, oncoming_lanes=self.lanes, lane_width=LANE, median=0.4, shoulder=0.6
        )
        x, y = self.x - half * np.cos(self.heading), self.y - half * np.sin(self.heading)
        return InCarRoad(section, (Piece(0.0, 2 * half, 0.0, x, y, self.heading),))

    def footprint(self) -> Strip:
        """Return the land that it covers, embankments too: nothing grows there."""
        along = np.linspace(-self.length / 2, self.length / 2, 2 + int(self.length / 4))
        reach = self.width / 2 + BATTER * self.top * self.ramps
        return self._strip(along, (-reach, reach))

    def approaches(self, beyond: float) -> tuple[Strip, ...]:
        """Return the asphalt on the ground, up to ``beyond`` metres from its embankments."""
        if not self.ramps:
            return ()
        half, (low, high) = self.length / 2, self.paved
        far = np.linspace(half - 1.0, half + beyond, 2 + int(beyond / 2))
        return tuple(self._strip(along, (low, high)) for along in (-far[::-1], far))

    @property
    def paved(self) -> tuple[float, float]:
        """Lowest and highest offset of the asphalt before and behind it, metres."""
        half = 0.2 + self.lanes * LANE + 0.6 if self.lanes else self.width / 2 - 1.0
        return -half, half

    def _strip(self, along: Floats, paved: tuple[float, float]) -> Strip:
        ahead = np.array([np.cos(self.heading), np.sin(self.heading)])
        outer = 0.2 + self.lanes * LANE
        marks = [(outer, 1), (0.0, 4), (-outer, 1)] if self.lanes else []
        marks += [(side * (0.2 + k * LANE), 2) for k in range(1, self.lanes) for side in (1, -1)]
        marks.sort(reverse=True)
        return Strip(
            line=np.array([self.x, self.y]) + along[:, None] * ahead,
            headings=np.full(len(along), self.heading),
            s=along - along[0],
            paved=paved,
            edges=np.array([d for d, _ in marks]),
            styles=np.array([style for _, style in marks], np.uint8),
        )

    def model(self) -> Model:
        """Make its mesh, x along the road on it."""
        size = (self.length, self.width + 2 * BATTER * self.top * self.ramps, self.top + PARAPET)
        builder = MeshBuilder()
        _deck(builder, self)
        if self.ramps:
            _embankments(builder, self)
        _surface(builder, self)
        return Model(name=self.name, kind=Kind.BRIDGE, size=size, lods=(scaled_to(builder, size),))


def _deck(builder: MeshBuilder, bridge: Overpass) -> None:
    half, side, top = bridge.span / 2, bridge.width / 2, bridge.top
    builder.box((-half, -side, top - DEPTH), (half, side, top - 0.02), Surface.CONCRETE)
    reach = bridge.length / 2 if not bridge.ramps else half + 6.0
    for sign in (1, -1):
        y = sorted((sign * side, sign * (side - 0.35)))
        builder.box((-reach, y[0], top - 0.4), (reach, y[1], top + PARAPET), Surface.CONCRETE, without="-z")
    for x in np.arange(-half + 9.0, half - 8.0, 18.0) if bridge.span > 60 else (-half + 2.0, half - 2.0):
        for y0 in np.linspace(-side + 1.5, side - 2.5, max(2, int(bridge.width / 7))):
            builder.box((x - 0.5, y0, 0), (x + 0.5, y0 + 1.0, top - DEPTH), Surface.CONCRETE, without="-z+z")


def _embankments(builder: MeshBuilder, bridge: Overpass) -> None:
    """Add earth from the abutments down to the ground, its sides under grass."""
    half, side, top = bridge.span / 2, bridge.width / 2, bridge.top
    for end in (1, -1):
        near, far = end * half, end * (half + RAMP)
        foot = BATTER * top
        for sign in (1, -1):
            slope = np.array(
                [(near, sign * side, top), (far, sign * side, 0.0), (near, sign * (side + foot), 0.0)]
            )
            builder.polygon(slope, Surface.GRASS, facing=(0, sign, 1), uv=slope[:, :2] / _TURF)
        wall = [(near, -side, 0), (near, side, 0), (near, side, top), (near, -side, top)]
        builder.polygon(wall, Surface.CONCRETE, facing=(-end, 0, 0))
        for sign in (1, -1):
            # Wing walls close the embankment's cut face.
            wing = [(near, sign * side, top), (near, sign * side, 0), (near, sign * (side + foot), 0)]
            builder.polygon(wing, Surface.CONCRETE, facing=(-end, 0, 0))


def _surface(builder: MeshBuilder, bridge: Overpass) -> None:
    """Add what one sees from above: the carriageway with its marks, rails on ballast, or earth."""
    side = bridge.width / 2 - 0.35
    stations = [-bridge.length / 2, -bridge.span / 2, bridge.span / 2, bridge.length / 2]
    if not bridge.ramps:
        stations = [stations[0], stations[-1]]
    surface = {"road": Surface.ASPHALT, "rail": Surface.BARK, "earth": Surface.GRASS}[bridge.carries]
    _band(builder, bridge, stations, -side, side, surface, 0.0)
    if bridge.carries == "road":
        outer = 0.2 + bridge.lanes * LANE
        for y in (outer, -outer):
            _paint(builder, bridge, stations, y, "white")
        for y in (0.13, -0.13):
            _paint(builder, bridge, stations, y, "yellow")
        for k in range(1, bridge.lanes):
            for sign in (1, -1):
                for x in np.arange(stations[0] + 1.5, stations[-1] - 4.5, 12.0):
                    _paint(builder, bridge, [x, x + 3.0], sign * (0.2 + k * LANE), "white")
    elif bridge.carries == "rail":
        tracks = np.arange(-side + 2.6, side - 2.0, 4.2)
        for middle in tracks:
            for y in (middle - 0.75, middle + 0.75):
                _band(builder, bridge, stations, y - 0.09, y + 0.09, Surface.STEEL, 0.12)


def _band(
    builder: MeshBuilder,
    bridge: Overpass,
    stations: list[float],
    low: float,
    high: float,
    surface: Surface,
    lift: float,
    uv: ArrayLike | None = None,
) -> None:
    """Add a strip from ``low`` to ``high`` across that follows the road's height at its stations."""
    for start, end in pairwise(stations):
        z0, z1 = (float(z) + lift for z in bridge.height([start, end]))
        corners = [(start, low, z0), (end, low, z1), (end, high, z1), (start, high, z0)]
        builder.polygon(corners, surface, facing=(0, 0, 1), uv=uv)


def _paint(builder: MeshBuilder, bridge: Overpass, stations: list[float], y: float, colour: str) -> None:
    u = (list(PALETTE).index(colour) + 0.5) / len(PALETTE)
    low, high = y - _STRIPE / 2, y + _STRIPE / 2
    _band(builder, bridge, stations, low, high, Surface.PALETTE, 0.03, [(u, 0.5)] * 4)
