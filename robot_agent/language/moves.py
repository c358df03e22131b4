"""The statements that move the robot: words to moves in SI units."""

import math
from collections.abc import Collection

from robot_agent.language.program import MoveArc, MoveJoints, MoveLine, MoveSpline, Orientation, Pace, Position
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

Move = MoveJoints | MoveLine | MoveArc | MoveSpline

_COORDINATES = ("X", "Y", "Z", "A", "B", "C")
_VIA = ("QX", "QY", "QZ", "QA", "QB", "QC")
_PACE = ("F", "FC", "FA", "FJ", "R")
_SPEEDS = {"F": (0.1, "mm/s"), "FC": (0.1, "mm/s"), "FA": (SLOWEST, "deg/s"), "FJ": (SLOWEST, "deg/s")}
"""The least that may be asked for, and the unit."""


def parse_move(line: int, words: list[Word], joint_names: tuple[str, ...], linear: Collection[str]) -> Move:
    """The move of a statement whose first word is `MJ`, `ML`, `MC` or `MS`. Raises Mistake."""
    kind = words[0].text.upper()
    if kind == "MJ":
        return _joints(line, words, joint_names, linear)
    if kind == "ML":
        return _line(line, words)
    return _arc(line, words) if kind == "MC" else _spline(line, words)


def _joints(line: int, words: list[Word], joint_names: tuple[str, ...], linear: Collection[str]) -> MoveJoints:
    named = named_numbers(words, (*joint_names, *_PACE, "SYNC"))
    speed = percent(named.pop("F", None), words[0])
    synchronised = _switch(named, "SYNC", True, "1: the joints arrive together, or 0: each as fast as it can")
    edge = named.get("R")
    if edge is not None and edge[0] > 0.0 and not synchronised:
        raise Mistake(edge[1].column, f"R={edge[0]:g} with SYNC=0", "R only where the joints arrive together")
    pace = pace_of(named)
    if not named:
        raise Mistake(words[0].column, "MJ without a joint", f"at least one of {', '.join(joint_names)}")
    check_size(named, [name.upper() for name in joint_names if name in linear], FARTHEST_MM, "mm")
    check_size(named, [name.upper() for name in joint_names if name not in linear], MOST_DEG, "degrees")
    joints = tuple(
        _joint(named[name.upper()][0], name in linear) if name.upper() in named else None for name in joint_names
    )
    return MoveJoints(line, joints, speed, pace, synchronised)


def _joint(value: float, linear: bool) -> float:
    return value / 1000.0 if linear else math.radians(value)


def _line(line: int, words: list[Word]) -> MoveLine:
    named = named_numbers(words, (*_COORDINATES, *_PACE, "FLIP"))
    flip = _switch(named, "FLIP", False, "1: the wrist may pass its singular pose, or 0")
    pace = pace_of(named)
    return MoveLine(line, *_target(named, words[0]), pace, wrist_may_flip=flip)


def _arc(line: int, words: list[Word]) -> MoveArc:
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
    return MoveArc(line, via_position, via_orientation, position, orientation, radians, pace)


def _spline(line: int, words: list[Word]) -> MoveSpline:
    named = named_numbers(words, (*_COORDINATES, *_PACE))
    pace = pace_of(named)
    return MoveSpline(line, *_target(named, words[0]), pace)


def _switch(named: Named, name: str, default: bool, allowed: str) -> bool:
    """Takes a value that is 0 or 1 out of the named ones."""
    value = named.pop(name, None)
    if value is None:
        return default
    if value[0] not in (0.0, 1.0):
        raise Mistake(value[1].column, f"{name}={value[0]:g}", allowed)
    return value[0] == 1.0


def pace_of(named: Named) -> Pace:
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
    return Pace(
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
