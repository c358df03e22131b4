"""The statements that move the robot: words to moves in SI units, moves to steps."""

import math
from dataclasses import dataclass, replace
from typing import Self, TypeVar

from robot_agent.language.statement import Reading, Statement, Walk, statement
from robot_agent.language.steps import FREELY, JointStep, Mark, MoveCaps, Orientation, Position, ProgramFault
from robot_agent.language.words import (
    FARTHEST_MM,
    MOST_DEG,
    SLOWEST,
    Mistake,
    Named,
    Word,
    check_size,
    named_numbers,
    percent,
)

_COORDINATES = ("X", "Y", "Z", "A", "B", "C")
_VIA = ("QX", "QY", "QZ", "QA", "QB", "QC")
_PACE = ("F", "FC", "FA", "FJ", "R")
_SPEEDS = {"F": (0.1, "mm/s"), "FC": (0.1, "mm/s"), "FA": (SLOWEST, "deg/s"), "FJ": (SLOWEST, "deg/s")}
"""The least that may be asked for, and the unit."""


@dataclass(frozen=True, slots=True)
class Move(Statement):
    """A statement with a motion."""

    @property
    def from_anywhere(self) -> bool:
        """Whether it ends at the same place wherever it begins."""
        return False


@statement("MJ")
@dataclass(frozen=True, slots=True)
class MoveJoints(Move):
    """`MJ J1=… F=…`: all joints start and end together. Joints that are not named (`None`) keep their value."""

    joints: tuple[float | None, ...]
    """Target per joint [rad or m]."""
    speed: float
    """Fraction of the joints' speed limits, above 0 to 1."""
    pace: MoveCaps = FREELY
    synchronised: bool = True
    """`SYNC=0`: each joint at its own speed, they start together and arrive when they do."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        joints, linear = reading.names.joints, reading.names.linear
        named = named_numbers(words, (*joints, *_PACE, "SYNC"))
        speed = percent(named.pop("F", None), words[0])
        synchronised = _switch(named, "SYNC", True, "1: the joints arrive together, or 0: each as fast as it can")
        edge = named.get("R")
        if edge is not None and edge[0] > 0.0 and not synchronised:
            raise Mistake(edge[1].column, f"R={edge[0]:g} with SYNC=0", "R only where the joints arrive together")
        pace = pace_of(named)
        if not named:
            raise Mistake(words[0].column, "MJ without a joint", f"at least one of {', '.join(joints)}")
        check_size(named, [name.upper() for name in joints if name in linear], FARTHEST_MM, "mm")
        check_size(named, [name.upper() for name in joints if name not in linear], MOST_DEG, "degrees")
        target = tuple(
            _joint(named[name.upper()][0], name in linear) if name.upper() in named else None for name in joints
        )
        return cls(line, target, speed, pace, synchronised)

    def run(self, _walk: Walk) -> JointStep:
        return JointStep(self.line, self.joints, self.speed, self.pace, self.synchronised)

    @property
    def from_anywhere(self) -> bool:
        return None not in self.joints


@statement("ML")
@dataclass(frozen=True, slots=True)
class MoveLine(Move):
    """`ML X=… F=…`: the flange moves on a straight line in the robot's base frame."""

    position_m: Position
    orientation_abc: Orientation | None
    """`None` keeps the orientation."""
    pace: MoveCaps = FREELY
    wrist_may_flip: bool = False
    tangential_rad: float | None = None
    """`TANG`, on every move of the flange: the tool follows the direction of the path, at this angle to it."""
    switches: tuple[Mark, ...] = ()
    """On every move: what is switched at its end."""
    spaces_off: frozenset[str] = frozenset()
    """On every move: the spaces that are switched off during it."""
    held: tuple[str, ...] = ()
    """On every move: the part that is held during it."""

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        named = named_numbers(words, (*_COORDINATES, *_PACE, "FLIP"))
        flip = _switch(named, "FLIP", False, "1: the wrist may pass its singular pose, or 0")
        pace = pace_of(named)
        return cls(line, *_target(named, words[0]), pace, wrist_may_flip=flip)

    def run(self, walk: Walk) -> "MoveLine | ProgramFault":
        return _tangential(self, walk, self.orientation_abc)


@statement("MC")
@dataclass(frozen=True, slots=True)
class MoveArc(Move):
    """`MC QX=… X=… F=…`: the flange moves on the circle through where it is, the via point Q and the target."""

    via_position_m: Position
    via_orientation_abc: Orientation | None
    """`None`: turned evenly on the way to the target."""
    position_m: Position
    orientation_abc: Orientation | None
    angle_rad: float | None
    """`H`: how far to go on the circle; the target is then only a point of it."""
    pace: MoveCaps = FREELY
    tangential_rad: float | None = None
    switches: tuple[Mark, ...] = ()
    spaces_off: frozenset[str] = frozenset()
    held: tuple[str, ...] = ()

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        named = named_numbers(words, (*_COORDINATES, *_VIA, "H", *_PACE))
        pace = pace_of(named)
        angle = named.pop("H", None)
        if angle is not None and not 0.0 < abs(angle[0]) <= MOST_DEG:
            allowed = f"degrees of the circle to go, any but 0 up to {MOST_DEG:g}; negative is backwards"
            raise Mistake(angle[1].column, f"H={angle[0]:g}", allowed)
        via = {name[1:]: named.pop(name) for name in _VIA if name in named}
        if not any(axis in via for axis in "XYZ"):
            raise Mistake(words[0].column, "MC without a via point", f"at least one of {', '.join(_VIA[:3])}")
        via_position, via_orientation = _target(via, words[0])
        position, orientation = _target(named, words[0])
        radians = None if angle is None else math.radians(angle[0])
        return cls(line, via_position, via_orientation, position, orientation, radians, pace)

    def run(self, walk: Walk) -> "MoveArc | ProgramFault":
        return _tangential(self, walk, self.orientation_abc or self.via_orientation_abc)


@statement("MS")
@dataclass(frozen=True, slots=True)
class MoveSpline(Move):
    """`MS X=… F=…`: the next point of a spline; consecutive ones are one curve."""

    position_m: Position
    orientation_abc: Orientation | None
    pace: MoveCaps = FREELY
    tangential_rad: float | None = None
    switches: tuple[Mark, ...] = ()
    spaces_off: frozenset[str] = frozenset()
    held: tuple[str, ...] = ()

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        named = named_numbers(words, (*_COORDINATES, *_PACE))
        pace = pace_of(named)
        return cls(line, *_target(named, words[0]), pace)

    def run(self, walk: Walk) -> "MoveSpline | ProgramFault":
        return _tangential(self, walk, self.orientation_abc)


@statement("HOME")
@dataclass(frozen=True, slots=True)
class Home(Move):
    """`HOME F=…`: a joint move to the robot's home position."""

    speed: float
    pace: MoveCaps = FREELY

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        named = named_numbers(words, ("F", "FC", "FA", "FJ", "R"))
        speed = percent(named.pop("F", None), words[0])
        return cls(line, speed, pace_of(named))

    def run(self, _walk: Walk) -> JointStep:
        return JointStep(self.line, None, self.speed, self.pace)

    @property
    def from_anywhere(self) -> bool:
        return True


@statement("TANG")
@dataclass(frozen=True, slots=True)
class Tangent(Statement):
    """`TANG 1 H=…`, `TANG 0`: from here on the tool follows the path at this angle [rad], or (`None`) no longer."""

    angle_rad: float | None

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        allowed = "TANG 1, with H=degrees if wanted, or TANG 0"
        switch = words[1].text if len(words) > 1 else ""
        if switch not in ("0", "1"):
            raise Mistake(words[min(1, len(words) - 1)].column, f"`{' '.join(w.text for w in words)}`", allowed)
        named = named_numbers(words[1:], ("H",))
        if named and switch == "0":
            raise Mistake(named["H"][1].column, f"`{named['H'][1].text}` after TANG 0", allowed)
        check_size(named, "H", MOST_DEG, "degrees")
        angle = math.radians(named["H"][0]) if named else 0.0
        return cls(line, angle if switch == "1" else None)

    def run(self, walk: Walk) -> None:
        walk.tangential_rad = self.angle_rad


LineStep = MoveLine
ArcStep = MoveArc
SplineStep = MoveSpline
FlangeStep = LineStep | ArcStep | SplineStep
MotionStep = JointStep | FlangeStep
"""Moves of the flange are their own steps; what is left to resolve is whether the tool follows the path."""

M = TypeVar("M", MoveLine, MoveArc, MoveSpline)


def _tangential(move: M, walk: Walk, named: Orientation | None) -> M | ProgramFault:
    """The move with what `TANG` asks for, which leaves no orientation to choose."""
    if walk.tangential_rad is not None and named is not None:
        text = "A, B and C are named while TANG is on, where the tool follows the path: leave them out, or TANG 0"
        return ProgramFault(move.line, text)
    return replace(move, tangential_rad=walk.tangential_rad)


def _joint(value: float, linear: bool) -> float:
    return value / 1000.0 if linear else math.radians(value)


def _switch(named: Named, name: str, default: bool, allowed: str) -> bool:
    """Takes a value that is 0 or 1 out of the named ones."""
    value = named.pop(name, None)
    if value is None:
        return default
    if value[0] not in (0.0, 1.0):
        raise Mistake(value[1].column, f"{name}={value[0]:g}", allowed)
    return value[0] == 1.0


def pace_of(named: Named) -> MoveCaps:
    """Takes the caps and the round edge out of the named values; F and FC are both mm/s here. Raises Mistake."""
    speeds = []
    for name, (least, unit) in _SPEEDS.items():
        value = named.pop(name, None)
        if value is not None and value[0] < least:
            raise Mistake(value[1].column, f"{name}={value[0]:g}", f"a speed of at least {least:g} {unit}")
        speeds.append(None if value is None else value[0])
    edge = named.pop("R", None)
    if edge is not None and not 0 <= edge[0] <= FARTHEST_MM:
        raise Mistake(edge[1].column, f"R={edge[0]:g}", f"a round edge of 0 to {FARTHEST_MM:g} mm; 0 stops")
    feed, linear, angular, joints = speeds
    path = min((speed for speed in (feed, linear) if speed is not None), default=None)
    return MoveCaps(
        None if path is None else path / 1000.0,
        None if angular is None else math.radians(angular),
        None if joints is None else math.radians(joints),
        None if edge is None else edge[0] / 1000.0,
    )


def _target(named: Named, head: Word) -> tuple[Position, Orientation | None]:
    """Position [m] and orientation [rad] out of X, Y, Z, A, B, C."""
    if not named:
        allowed = f"at least one of {', '.join(_COORDINATES)}"
        raise Mistake(head.column, f"{head.text.upper()} without a coordinate", allowed)
    check_size(named, "XYZ", FARTHEST_MM, "mm")
    check_size(named, "ABC", MOST_DEG, "degrees")
    angles = [axis for axis in "ABC" if axis in named]
    if angles and len(angles) < 3:
        word = named[angles[0]][1]
        raise Mistake(word.column, f"only {' '.join(angles)}", "all of A, B, C, or none to keep the orientation")
    x, y, z = (named[axis][0] / 1000.0 if axis in named else None for axis in "XYZ")
    a, b, c = (math.radians(named[axis][0]) if angles else 0.0 for axis in "ABC")
    return (x, y, z), (a, b, c) if angles else None
