"""Recorded traffic: the ways of real vehicles, read from files and resampled to the camera's rate.

Two formats are read: CommonRoad XML (both its older and newer obstacles; Althoff et al., IV 2017) and the
table of vehicles that Geo-trax writes of a drone's film.
"""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from sim.world import Kind

Floats = NDArray[np.float64]

_GEO_TRAX_RATE = 30.0
_GEO_TRAX_KINDS = (Kind.CAR, Kind.BUS, Kind.LORRY, Kind.MOTORCYCLE)
_COMMON_ROAD_KINDS = {
    "car": Kind.CAR,
    "taxi": Kind.CAR,
    "parkedVehicle": Kind.CAR,
    "truck": Kind.LORRY,
    "bus": Kind.BUS,
    "motorcycle": Kind.MOTORCYCLE,
}
_SIZES = {Kind.CAR: (4.6, 1.85), Kind.BUS: (11.5, 2.6), Kind.LORRY: (8.0, 2.5), Kind.MOTORCYCLE: (2.1, 0.8)}
"""Length and width of what was recorded without them, metres."""
_STRIDE = 0.4
"""Metres that tell the way a vehicle heads where the recording does not."""


class RecordingError(ValueError):
    """A recording that cannot be used."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """One vehicle as recorded.

    Attributes:
        name: Its number in the file.
        kind: A `Kind`.
        size: Length and width, metres.
        times: (T,) seconds from the recording's beginning, ascending.
        positions: (T, 2) metres, its middle.
        yaws: (T,) radians counter-clockwise from east, unwrapped.
    """

    name: str
    kind: Kind
    size: tuple[float, float]
    times: Floats
    positions: Floats
    yaws: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """Vehicles, and the lanes that they drove on where these are known.

    Attributes:
        ways: Of the vehicles, in the file's order. World axes, with the middle of all at the origin.
        lanes: (left, right) borders of lanes, (P, 2) metres each.
        seconds: How long it lasts.
        origin: (2,) what was taken from the file's coordinates, metres.
    """

    ways: tuple[Way, ...]
    lanes: tuple[tuple[Floats, Floats], ...]
    seconds: float
    origin: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampled:
    """Where V vehicles are at T ticks.

    Attributes:
        present: (T, V) bool.
        positions: (T, V, 2) metres; not a number where they are not there, as are all below.
        velocities: (T, V, 2) m/s.
        yaws: (T, V) radians.
    """

    present: NDArray[np.bool_]
    positions: Floats
    velocities: Floats
    yaws: Floats


def read(path: Path | str) -> Recording:
    """Read a recording.

    Raises:
        RecordingError: If there is no such file, or it is in no format that is known.
    """
    path = Path(path)
    try:
        if path.suffix == ".xml":
            ways, lanes = _common_road(path)
        elif path.suffix == ".csv":
            ways, lanes = _geo_trax(path), []
        else:
            raise RecordingError(f"{path}: wanted CommonRoad's .xml or Geo-trax's .csv")
    except FileNotFoundError as error:
        raise RecordingError(f"there is no recording {path}") from error
    except (OSError, ElementTree.ParseError, KeyError, TypeError, AttributeError) as error:
        raise RecordingError(f"{path} is no recording of traffic: {' '.join(str(error).split())}") from error
    if not ways:
        raise RecordingError(f"{path} holds no vehicle")
    everything = np.concatenate([way.positions for way in ways])
    origin = np.round((everything.min(axis=0) + everything.max(axis=0)) / 2)
    return Recording(
        ways=tuple(replace(way, positions=way.positions - origin) for way in ways),
        lanes=tuple((left - origin, right - origin) for left, right in lanes),
        seconds=max(float(way.times[-1]) for way in ways),
        origin=origin,
    )


def resample(recording: Recording, rate: int, *, start: float, ticks: int) -> Sampled:
    """Return where all vehicles are at ``ticks`` ticks from ``start`` seconds on.

    Between two samples a vehicle follows the cubic spline through all of them; on a sample it is where it
    was recorded. It is there from its first sample to its last.
    """
    times = start + np.arange(ticks) / rate
    shape = (ticks, len(recording.ways))
    present = np.zeros(shape, bool)
    positions, velocities = np.full((*shape, 2), np.nan), np.full((*shape, 2), np.nan)
    yaws = np.full(shape, np.nan)
    for k, way in enumerate(recording.ways):
        here = (times >= way.times[0] - 1e-9) & (times <= way.times[-1] + 1e-9)
        present[:, k] = here
        if len(way.times) < 2:
            positions[here, k], velocities[here, k], yaws[here, k] = way.positions[0], 0.0, way.yaws[0]
            continue
        curve = CubicSpline(way.times, way.positions)
        at = np.clip(times[here], way.times[0], way.times[-1])
        positions[here, k], velocities[here, k] = curve(at), curve(at, 1)
        yaws[here, k] = np.interp(at, way.times, way.yaws)
    return Sampled(present=present, positions=positions, velocities=velocities, yaws=yaws)


def headings(positions: ArrayLike) -> Floats:
    """Tell which way a vehicle heads: (T,) unwrapped radians, not a number if it never moved.

    Each is the direction between the nearest samples before and after that lie `_STRIDE` metres away or
    more; where it stood, the nearest such direction.
    """
    points = np.asarray(positions, float)
    away = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    before = np.maximum(np.searchsorted(away, away - _STRIDE, side="right") - 1, 0)
    after = np.minimum(np.searchsorted(away, away + _STRIDE), len(points) - 1)
    step = points[after] - points[before]
    moved = np.hypot(*step.T) >= _STRIDE
    if not moved.any():
        return np.full(len(points), np.nan)
    known = np.flatnonzero(moved)
    directions = np.unwrap(np.arctan2(step[known, 1], step[known, 0]))
    return np.asarray(np.interp(np.arange(len(points)), known, directions))


def _common_road(path: Path) -> tuple[list[Way], list[tuple[Floats, Floats]]]:
    root = ElementTree.parse(path).getroot()
    step = float(root.attrib["timeStepSize"])
    ways = []
    for node in root:
        dynamic = node.tag == "dynamicObstacle" or (
            node.tag == "obstacle" and node.findtext("role") == "dynamic"
        )
        if not dynamic:
            continue
        states = [node.find("initialState"), *(node.find("trajectory") or ())]
        rows = np.array([[_number(state, name) for name in _STATE] for state in states if state is not None])
        kind = _COMMON_ROAD_KINDS.get(node.findtext("type", "").strip(), Kind.CAR)
        box = node.find("shape/rectangle")
        size = _SIZES[kind] if box is None else (_number(box, "length"), _number(box, "width"))
        ways.append(
            Way(
                name=node.attrib["id"],
                kind=kind,
                size=size,
                times=rows[:, 0] * step,
                positions=rows[:, 1:3],
                yaws=np.unwrap(rows[:, 3]),
            )
        )
    lanes = [
        (_border(lane.find("leftBound")), _border(lane.find("rightBound")))
        for lane in root.iter("lanelet")
        if lane.find("leftBound") is not None
    ]
    return ways, lanes


_STATE = ("time/exact", "position/point/x", "position/point/y", "orientation/exact")


def _number(node: ElementTree.Element, name: str) -> float:
    text = node.findtext(name)
    if text is None:
        raise KeyError(f"{node.tag} without {name}")
    return float(text)


def _border(node: ElementTree.Element | None) -> Floats:
    if node is None:
        raise KeyError("lanelet without a border")
    return np.array([[_number(point, "x"), _number(point, "y")] for point in node.iter("point")])


def _geo_trax(path: Path) -> list[Way]:
    rows: dict[str, list[dict[str, str]]] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            rows.setdefault(row["Vehicle_ID"], []).append(row)
    ways = []
    for name, own in rows.items():
        frames = np.array([float(row["Frame_Number"]) for row in own])
        positions = np.array([[float(row["Local_X"]), float(row["Local_Y"])] for row in own])
        kind = _GEO_TRAX_KINDS[int(own[0]["Vehicle_Class"])]
        length, width = (
            float(own[0][key] or plain)
            for key, plain in zip(("Vehicle_Length", "Vehicle_Width"), _SIZES[kind], strict=True)
        )
        ways.append(
            Way(
                name=name,
                kind=kind,
                size=(length, width),
                times=frames / _GEO_TRAX_RATE,
                positions=positions,
                yaws=headings(positions),
            )
        )
    return _with_headings(ways)


def _with_headings(ways: list[Way]) -> list[Way]:
    """Give those that never moved the heading of whoever passed nearest to them."""
    moved = [way for way in ways if not np.isnan(way.yaws).any()]
    if not moved:
        return ways
    places = np.concatenate([way.positions for way in moved])
    directions = np.concatenate([way.yaws for way in moved])
    out = []
    for way in ways:
        yaws = way.yaws
        if np.isnan(yaws).any():
            nearest = int(np.hypot(*(places - way.positions[0]).T).argmin())
            yaws = np.full(len(way.times), directions[nearest])
        out.append(replace(way, yaws=yaws))
    return out
