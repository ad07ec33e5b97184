"""Scenarios as frozen models: read from TOML, overridden key by key, refused in one line when wrong."""

from __future__ import annotations

import difflib
import hashlib
import json
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from scenarios.errors import InputError
from sim.params import AerialParams, InCarParams, MotorcycleLaneParams, Params, TrafficParams

Seconds = Annotated[FiniteFloat, Field(gt=0, le=3600)]
Rate = Annotated[int, Field(ge=1, le=240)]
SceneName = Literal["in-car", "aerial", "motorcycle-lane"]

_BARE_WORD = re.compile(r"[A-Za-z][\w-]*")
_KEY = re.compile(r"[A-Za-z_][\w-]*(\.[A-Za-z_][\w-]*)*")


class SpecError(InputError):
    """A scenario that cannot be used; one line says what was wrong, what was wanted and where."""


class Scenario(Params):
    """One named scenario, resolved: what a drive depends on besides the seed.

    Attributes:
        name: Of the library, or the file's name without its ending.
        description: One line for people.
        scene: Which scene the parameters are of.
        seconds: Length of an episode.
        rate: Frames a second.
        params: The scene's parameters.
    """

    name: str
    description: str = ""
    scene: SceneName
    seconds: Seconds = 20.0
    rate: Rate = 30
    params: InCarParams | AerialParams | MotorcycleLaneParams

    @property
    def frames(self) -> int:
        """Frames in an episode, at least one."""
        return max(1, round(self.seconds * self.rate))


class InCarFile(InCarParams):
    """The layout of a scenario file of the in-car scene: these keys, then the scene's tables."""

    model_config = ConfigDict(title="testtrack scenario")

    scene: Literal["in-car"]
    description: str = ""
    seconds: Seconds = 20.0
    rate: Rate = 30


class AerialFile(AerialParams):
    """The layout of a scenario file of the aerial scene: these keys, then the scene's tables."""

    model_config = ConfigDict(title="testtrack scenario")

    scene: Literal["aerial"]
    description: str = ""
    seconds: Seconds = 20.0
    rate: Rate = 30


class MotorcycleLaneFile(MotorcycleLaneParams):
    """The layout of a scenario file of the motorcycle lane: these keys, then the scene's tables."""

    model_config = ConfigDict(title="testtrack scenario")

    scene: Literal["motorcycle-lane"]
    description: str = ""
    seconds: Seconds = 11.0
    rate: Rate = 30


@dataclass(frozen=True, slots=True)
class _Layout:
    """How the scenarios of one scene are written down: the whole file, and the scene's tables in it."""

    file: type[InCarFile] | type[AerialFile] | type[MotorcycleLaneFile]
    params: type[InCarParams] | type[AerialParams] | type[MotorcycleLaneParams]


_LAYOUTS: dict[str, _Layout] = {
    "in-car": _Layout(InCarFile, InCarParams),
    "aerial": _Layout(AerialFile, AerialParams),
    "motorcycle-lane": _Layout(MotorcycleLaneFile, MotorcycleLaneParams),
}


def library() -> dict[str, str]:
    """Return the named scenarios: name to the text of its TOML file, in alphabetical order."""
    files = resources.files("scenarios") / "library"
    return {
        entry.name.removesuffix(".toml"): entry.read_text("utf-8")
        for entry in sorted(files.iterdir(), key=lambda e: e.name)
        if entry.name.endswith(".toml")
    }


def load(name_or_path: str | Path, overrides: Sequence[str] = ()) -> Scenario:
    """Read a scenario.

    Args:
        name_or_path: A name of the library, or the path of a TOML file.
        overrides: ``table.key=value`` each, the value a TOML literal; plain words need no quotes.

    Raises:
        SpecError: If there is no such scenario, or a key or a value is wrong.
    """
    name, where, text = _find(str(name_or_path))
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SpecError(f"{where}: not TOML: {_one_line(str(error))}") from error
    set_by = {}
    for override in overrides:
        key, value = _parse_override(override)
        _put(data, key, value, override)
        set_by[key] = override
    return _resolve(name, data, where, set_by)


def from_document(document: object, where: str) -> Scenario:
    """Take a resolved scenario back from JSON, as ``Scenario.model_dump(mode="json")`` writes it.

    Args:
        document: What was read.
        where: The place, for messages.

    Raises:
        SpecError: If it is no scenario, or a key or a value is wrong.
    """
    if not isinstance(document, dict) or not isinstance(document.get("params"), dict):
        raise SpecError(f"{where}: holds no resolved scenario")
    data = {key: value for key, value in document.items() if key not in ("name", "params")}
    return _resolve(str(document.get("name")), data | document["params"], where, {})


def _resolve(name: str, data: dict[str, Any], where: str, set_by: Mapping[str, str]) -> Scenario:
    """Check the keys and values of a scenario file; ``set_by`` has the overrides by their keys."""
    layout = _layout(data, where)
    try:
        checked = layout.file.model_validate(data, strict=True)
    except ValidationError as error:
        raise SpecError(_explain(error.errors()[0], where, set_by, layout)) from error
    if isinstance(checked, InCarFile):
        _check_together(checked, where)
    if not isinstance(checked, MotorcycleLaneFile):
        _check_shares(checked.traffic, where)
    sections = {field: getattr(checked, field) for field in layout.params.model_fields}
    return Scenario(
        name=name,
        description=checked.description,
        scene=checked.scene,
        seconds=checked.seconds,
        rate=checked.rate,
        params=layout.params(**sections),
    )


def spec_id(scenario: Scenario) -> str:
    """Return a digest of all that a drive depends on besides the seed: not of name and description."""
    resolved = scenario.model_dump(mode="json", exclude={"name", "description", "params"})
    resolved[scenario.scene.replace("-", "_")] = scenario.params.model_dump(mode="json")
    text = json.dumps(resolved, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of a scenario file, for editors that complete and check TOML."""
    file = Annotated[InCarFile | AerialFile | MotorcycleLaneFile, Field(discriminator="scene")]
    return {"title": "testtrack scenario"} | TypeAdapter[Any](file).json_schema()


def nearest(word: str, known: Iterable[str]) -> str:
    """Return ``"did you mean 'x'?"`` for the nearest known word, or the list of all where none is near."""
    choices = list(known)
    close = difflib.get_close_matches(word, choices, n=1, cutoff=0.5)
    return f"did you mean {close[0]!r}?" if close else f"wanted one of {', '.join(choices)}"


def _find(name_or_path: str) -> tuple[str, str, str]:
    """Return name, place for messages, and text of a scenario."""
    named = library()
    if name_or_path in named:
        return name_or_path, f"{name_or_path}.toml", named[name_or_path]
    path = Path(name_or_path)
    if path.suffix != ".toml" and path.name == name_or_path and not path.is_file():
        raise SpecError(f"no scenario {name_or_path!r} in the library: {nearest(name_or_path, named)}")
    try:
        return path.stem, str(path), path.read_text("utf-8")
    except FileNotFoundError as error:
        known = ", ".join(named)
        raise SpecError(f"no scenario file {str(path)!r}; wanted a TOML file or one of {known}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise SpecError(f"{path}: cannot be read as a scenario: {_one_line(str(error))}") from error


def _parse_override(override: str) -> tuple[str, Any]:
    key, equals, literal = override.partition("=")
    key, literal = key.strip(), literal.strip()
    if not equals or not _KEY.fullmatch(key) or not literal or "\n" in literal:
        raise SpecError(f"--set {override!r}: wanted key=value, such as sensor.noise=3")
    try:
        return key, tomllib.loads(f"value = {literal}")["value"]
    except tomllib.TOMLDecodeError as error:
        if _BARE_WORD.fullmatch(literal):
            return key, literal
        raise SpecError(
            f"--set {override!r}: {literal!r} is no TOML value; wanted such as 3, 0.5, true or night"
        ) from error


def _layout(data: Mapping[str, Any], where: str) -> _Layout:
    """Return the layout of the scene that a file names."""
    if "scene" not in data:
        raise SpecError(f"{where}: the key 'scene' is missing: wanted {' or '.join(map(repr, _LAYOUTS))}")
    scene = data["scene"]
    if not isinstance(scene, str) or scene not in _LAYOUTS:
        raise SpecError(f"{where}: scene is {_short(scene)}: wanted {' or '.join(map(repr, _LAYOUTS))}")
    return _LAYOUTS[scene]


def _put(data: dict[str, Any], key: str, value: Any, override: str) -> None:
    *tables, last = key.split(".")
    for table in tables:
        inner = data.setdefault(table, {})
        if not isinstance(inner, dict):
            layout = _LAYOUTS.get(str(data.get("scene")), _LAYOUTS["in-car"])
            raise SpecError(
                f"--set {override!r}: {table!r} is no table; {nearest(table, layout.params.model_fields)}"
            )
        data = inner
    data[last] = value


def _explain(problem: ErrorDetails, where: str, set_by: Mapping[str, str], layout: _Layout) -> str:
    """Turn a validation error into one line: the place, what was wrong, what was wanted."""
    path = [str(part) for part in problem["loc"]]
    key = ".".join(path)
    for set_key, override in set_by.items():
        if key == set_key or set_key.startswith(f"{key}."):
            where = f"--set {override!r}"
    if problem["type"] == "extra_forbidden":
        return f"{where}: unknown key {key!r}: {_nearest_key(path, layout)}"
    if problem["type"] == "missing":
        return f"{where}: the key {key!r} is missing"
    wanted = (
        f"wanted a table of {', '.join(_fields(path, layout))}"
        if problem["type"] == "model_type"
        else _wanted(problem["msg"])
    )
    return f"{where}: {key} is {_short(problem['input'])}: {wanted}"


def _nearest_key(path: Sequence[str], layout: _Layout) -> str:
    """Say which key was probably meant: one of the same table, else the same word in another table."""
    here = _fields(path[:-1], layout)
    tables = layout.params.model_fields
    if not difflib.get_close_matches(path[-1], here, n=1, cutoff=0.5):
        elsewhere = [
            f"{table}.{key}"
            for table in tables
            for key in getattr(tables[table].annotation, "model_fields", ())
        ]
        same = [name for name in elsewhere if name.rpartition(".")[2] == path[-1]]
        if same:
            return f"did you mean {same[0]!r}?"
    return nearest(path[-1], here)


def _wanted(message: str) -> str:
    return (
        message.replace("Input should be", "wanted")
        .replace("wanted a valid integer", "wanted a whole number")
        .replace("wanted a valid", "wanted a")
    )


def _fields(path: Sequence[str], layout: _Layout) -> list[str]:
    """Return the keys of the table at ``path``; of the last table on the way where it leads to none."""
    model: type[BaseModel] = layout.file
    for part in path:
        annotation = model.model_fields[part].annotation if part in model.model_fields else None
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            model = annotation
    return list(model.model_fields)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _check_together(checked: InCarFile, where: str) -> None:
    """Refuse values that are right one by one and make no sense together."""
    road = checked.road
    if road.min_radius > road.max_radius:
        raise SpecError(
            f"{where}: road.min_radius is {road.min_radius:g}: "
            f"wanted at most road.max_radius, {road.max_radius:g}"
        )
    if checked.ego.lane >= road.lanes:
        raise SpecError(
            f"{where}: ego.lane is {checked.ego.lane}: "
            f"wanted less than road.lanes, {road.lanes}, or -1 for any"
        )


def _check_shares(traffic: TrafficParams, where: str) -> None:
    """Refuse shares of kinds of vehicles that add up to more than all of them."""
    if (others := traffic.vans + traffic.lorries + traffic.buses) > 1:
        raise SpecError(f"{where}: traffic.vans + lorries + buses is {others:g}: wanted at most 1")


def _one_line(text: str) -> str:
    return " ".join(text.split())
