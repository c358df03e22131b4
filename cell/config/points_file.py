"""Schema of a points file: the taught places of one robot, other names for its signals, how it reads CAM files."""

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from cell.config.document import Document, Naming
from cell.config.fields import Name
from cell.config.problem import ConfigError, KeyPath, Problem, near, refuses
from cell.config.reading import Reading, read
from cell.config.units import STRICT, Number, Seconds

COORDINATES = ("X", "Y", "Z", "A", "B", "C")
FARTHEST_MM, MOST_DEG = 100_000.0, 36_000.0
"""As in programs: what is farther away is a mistake in typing."""
_FRESH_S = 0.5
_RAPID_MM_S, _TOLERANCE_MM = 250.0, 0.05

PointName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,31}$", description="a name that programs may use")]


class PointEntry(BaseModel):
    """A place: the pose of the tool, X Y Z A B C; or a value for each joint by its name, deg, or mm where it slides."""

    model_config = ConfigDict(**{**STRICT, "extra": "allow"}, json_schema_extra={"additionalProperties": True})
    __pydantic_extra__: dict[str, Any]
    X: Number | None = Field(None, description="position along X, mm")
    Y: Number | None = Field(None, description="position along Y, mm")
    Z: Number | None = Field(None, description="position along Z, mm")
    A: Number | None = Field(None, description="angle about X, deg; R = Rz(C) Ry(B) Rx(A)")
    B: Number | None = Field(None, description="angle about Y, deg")
    C: Number | None = Field(None, description="angle about Z, deg")
    frame: Name | None = Field(
        None,
        description="the frame in which it is given; default the one active in the program, at first the base",
    )
    tool: Name | None = Field(None, description="the tool whose TCP is there; default the flange")
    branch: str | None = Field(None, description="the branch of the arm in which MJ goes there; default the nearest")


class SignalEntry(BaseModel):
    """Another name for a signal: exactly one of input, output and key."""

    model_config = STRICT
    input: Name | None = Field(None, description="a digital input of the robot in its drives file")
    output: Name | None = Field(None, description="a digital output of the robot in its drives file")
    key: Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^/*$#?\s]+(/[^/*$#?\s]+)*$")] | None = Field(
        None, description="a Zenoh key that holds `true` or `false`"
    )
    fresh: Seconds = Field(_FRESH_S, description="of a key: what is older counts as unknown, s")


CamCode = Annotated[str, Field(pattern=r"^(S|[MT](0|[1-9][0-9]{0,5}))$", description="a code of CAM files")]
_FIXED_CODES = ("M2", "M6", "M30")
"""They end a program, or mount the tool whose code T is."""
ENDED_BY = {"M3": "M5", "M4": "M5", "M7": "M9", "M8": "M9"}
"""By a code, the one that ends what it began; the end of a program does so too."""


class CamEntry(BaseModel):
    """How this robot reads CAM files, docs/gcode.md."""

    model_config = STRICT
    rapid: Annotated[float, Field(ge=0.1, le=10_000)] = Field(_RAPID_MM_S, description="speed of G0, mm/s")
    tolerance: Annotated[float, Field(ge=0, le=100)] = Field(_TOLERANCE_MM, description="of G64 without P, mm")
    skip: bool = Field(False, description="whether blocks that begin with / are left out")
    codes: Annotated[dict[CamCode, tuple[str, ...]], Field(max_length=200)] = Field(
        default={},
        description="what the robot does at M3, S, T1 (when M6 mounts it): statements; an empty list: nothing",
    )


class PointsFile(BaseModel):
    """What one robot was taught. Lengths are millimetres and angles degrees, as in programs."""

    model_config = STRICT
    points: Annotated[dict[PointName, PointEntry], Field(max_length=2000)] = Field(
        default={}, description="up to 2000 places by name; HOME is where the statement HOME goes"
    )
    signals: Annotated[dict[Name, SignalEntry], Field(max_length=200)] = Field(
        default={}, description="other names for inputs and outputs, for SET DO and RESET DO"
    )
    cam: CamEntry | None = Field(None, description="how CAM files are read")


@dataclass(frozen=True, slots=True)
class PosePoint:
    """The pose of a tool, or of the flange."""

    position_m: tuple[float, float, float]
    orientation_abc: tuple[float, float, float]
    """[rad] with R = Rz(C) Ry(B) Rx(A)."""
    frame: str | None = None
    """In which it is given; None: none of its own."""
    tool: str | None = None
    """Whose TCP is there; None: the flange."""
    branch: str | None = None


@dataclass(frozen=True, slots=True)
class JointPoint:
    """Joints of the robot."""

    joints: tuple[float, ...]
    """`(n,)` [rad or m]."""


Point = PosePoint | JointPoint


class SignalKind(Enum):
    """What another name stands for."""

    INPUT = "input"
    OUTPUT = "output"
    KEY = "key"


@dataclass(frozen=True, slots=True)
class Signal:
    """What a name of `signals` stands for."""

    kind: SignalKind
    name: str
    fresh_s: float
    """Of a key."""


@dataclass(frozen=True, slots=True)
class CamSettings:
    """How a robot reads CAM files; mm and mm/s, as in the statements that they come down to."""

    rapid_mm_s: float = _RAPID_MM_S
    tolerance_mm: float = _TOLERANCE_MM
    skips: bool = False
    """Blocks that begin with `/` are left out."""
    codes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Statements of the robot language by code."""


@dataclass(frozen=True, slots=True)
class PointsOwner:
    """What the points of one robot may name; None where nobody can say."""

    joints: tuple[str, ...]
    linear: Collection[str] = frozenset()
    """Joints that slide."""
    frames: Collection[str] | None = None
    tools: Collection[str] | None = None
    branches: Collection[str] | None = None


@dataclass(frozen=True, slots=True)
class PointsSettings:
    """A points file in SI units."""

    points: dict[str, Point] = field(default_factory=dict)
    signals: dict[str, Signal] = field(default_factory=dict)
    cam: CamSettings = field(default_factory=CamSettings)


def read_points(file: Path, owner: PointsOwner, named_by: Naming | None = None) -> Reading[PointsFile]:
    """The points file, read and checked against its robot."""
    reading = read(file, PointsFile, {}, named_by)
    if reading.document is not None and reading.content is not None:
        reading.problems += _problems(reading.document, reading.content, owner)
    return reading


def load_points(file: Path, owner: PointsOwner) -> PointsSettings:
    """What a robot was taught; nothing where the file is not there yet.

    Raises:
        cell.config.ConfigError: the file has problems.
    """
    if not file.exists():
        return PointsSettings()
    reading = read_points(file, owner)
    if reading.content is None or refuses(reading.problems):
        raise ConfigError(tuple(reading.problems))
    return settings_of(reading.content, owner)


def settings_of(content: PointsFile, owner: PointsOwner) -> PointsSettings:
    """A file without problems in SI units."""
    return PointsSettings(
        {name: _point(entry, owner) for name, entry in content.points.items()},
        {name: _signal(entry) for name, entry in content.signals.items()},
        cam_settings(content.cam),
    )


def cam_settings(entry: CamEntry | None) -> CamSettings:
    """How CAM files are read, of a file without problems."""
    if entry is None:
        return CamSettings()
    return CamSettings(entry.rapid, entry.tolerance, entry.skip, entry.codes)


def is_joints(keys: Collection[str], owner: PointsOwner) -> bool:
    """Whether an entry with these keys gives joints: it names one that is no coordinate, or all that there are."""
    named = set(keys) & set(owner.joints)
    return bool(named - set(COORDINATES)) or (named == set(owner.joints) and not set(keys) - named)


def _values(entry: PointEntry) -> dict[str, float]:
    given = entry.model_dump(exclude_none=True)
    return {key: value for key, value in given.items() if key not in ("frame", "tool", "branch")}


def _point(entry: PointEntry, owner: PointsOwner) -> Point:
    values = _values(entry)
    if is_joints(values, owner):
        return JointPoint(
            tuple(
                values[name] / 1000.0 if name in owner.linear else math.radians(values[name]) for name in owner.joints
            )
        )
    x, y, z = (values[axis] / 1000.0 for axis in "XYZ")
    a, b, c = (math.radians(values[axis]) for axis in "ABC")
    return PosePoint((x, y, z), (a, b, c), entry.frame, entry.tool, entry.branch)


def _signal(entry: SignalEntry) -> Signal:
    given = {SignalKind.INPUT: entry.input, SignalKind.OUTPUT: entry.output, SignalKind.KEY: entry.key}
    kind, name = next((kind, name) for kind, name in given.items() if name is not None)
    return Signal(kind, name, entry.fresh)


def _problems(document: Document, content: PointsFile, owner: PointsOwner) -> Iterator[Problem]:
    for name, point in content.points.items():
        yield from _point_problems(document, ("points", name), point, owner)
    for name, signal in content.signals.items():
        kinds = [kind.value for kind in SignalKind if getattr(signal, kind.value) is not None]
        if len(kinds) != 1:
            allowed = "exactly one of input, output and key"
            yield document.problem(("signals", name), " and ".join(kinds) or "none of them", allowed)
        if "fresh" in document.keys(("signals", name)) and signal.key is None:
            yield document.problem(("signals", name, "fresh"), "a freshness", "none: only a key has one", at_key=True)
    codes = {} if content.cam is None else content.cam.codes
    for code in codes:
        if code in _FIXED_CODES:
            allowed = "other codes: M2 and M30 end a program, M6 does what the code T of its tool says"
            yield document.problem(("cam", "codes", code), code, allowed, at_key=True)
        elif (off := ENDED_BY.get(code, code)) not in codes:
            allowed = f"both, or {off} alone"
            yield document.problem(("cam", "codes", code), f"{code} without {off}", allowed, at_key=True)


def _point_problems(document: Document, path: KeyPath, entry: PointEntry, owner: PointsOwner) -> Iterator[Problem]:
    values = _values(entry)
    known = (*COORDINATES, "frame", "tool", "branch", *owner.joints)
    for key, value in (entry.__pydantic_extra__ or {}).items():
        if key not in owner.joints:
            yield document.problem((*path, key), f"unknown key {key!r}", near(key, known, ""), at_key=True)
        elif isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            yield document.problem((*path, key), document.found((*path, key)), "a number")
        elif abs(value) > (most := FARTHEST_MM if key in owner.linear else MOST_DEG):
            yield document.problem((*path, key), f"{value:g}", f"-{most:g} to {most:g}")
    yield from _incomplete(document, path, values, owner)
    for key, most in [*((each, FARTHEST_MM) for each in "XYZ"), *((each, MOST_DEG) for each in "ABC")]:
        if key not in owner.joints and abs(values.get(key, 0.0)) > most:
            yield document.problem((*path, key), f"{values[key]:g}", f"-{most:g} to {most:g}")
    for key, names in (("frame", owner.frames), ("tool", owner.tools), ("branch", owner.branches)):
        said = getattr(entry, key)
        if said is None:
            continue
        if is_joints(values, owner):
            yield document.problem((*path, key), f"{key} beside joints", "none: joints say all", at_key=True)
        elif names is not None and not _names_one(key, said, names):
            none = f"no {key}: there is none"
            yield document.problem((*path, key), f"unknown {key} {said!r}", near(said, names, none))


def _names_one(key: str, said: str, names: Collection[str]) -> bool:
    """Branches may be named by some of their parts."""
    parts = set(said.split("/"))
    return said in names or (key == "branch" and any(parts <= set(name.split("/")) for name in names))


def _incomplete(document: Document, path: KeyPath, values: dict[str, float], owner: PointsOwner) -> Iterator[Problem]:
    joints, given = is_joints(values, owner), document.keys(path)
    wanted, other = (owner.joints, COORDINATES) if joints else (COORDINATES, owner.joints)
    allowed = f"all of {', '.join(wanted)}; or all of {', '.join(other)}"
    if joints and (beside := [name for name in COORDINATES if name in values and name not in owner.joints]):
        yield document.problem(path, f"{', '.join(beside)} beside joints", allowed)
    elif missing := [name for name in wanted if name not in given]:
        yield document.problem(path, f"nothing for {', '.join(missing)}", allowed)
