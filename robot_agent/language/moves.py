"""The statements that move the robot: words to moves in SI units, moves to steps."""

import math
from dataclasses import dataclass, replace
from typing import Self, TypeVar

from robot_agent.language.statement import Reading, Statement, Walk, statement
from robot_agent.language.steps import (
    BASE,
    FREELY,
    HERE,
    Aim,
    Goal,
    JointStep,
    Mark,
    MoveCaps,
    Orientation,
    Position,
    ProgramFault,
)
from robot_agent.language.targets import NoTarget, aims, frame_in, settled
from robot_agent.language.words import (
    FARTHEST_MM,
    MOST_DEG,
    SLOWEST,
    Mistake,
    Named,
    Word,
    check_size,
    named_numbers,
    number,
    percent,
)
from robot_agent.model.description import NOTHING, Mounted
from robot_agent.paths.caps import Tolerance

_COORDINATES = ("X", "Y", "Z", "A", "B", "C")
_HOME = "HOME"
"""The point that takes the place of the robot model's home position."""
_VIA = ("QX", "QY", "QZ", "QA", "QB", "QC")
_PACE = ("F", "FC", "FA", "FJ", "R")
_SPEEDS = {"F": (0.1, "mm/s"), "FC": (0.1, "mm/s"), "FA": (SLOWEST, "deg/s"), "FJ": (SLOWEST, "deg/s")}
"""The least that may be asked for, and the unit."""
_LEAST_TOLERANCE = 0.001
"""[mm, degrees]"""
_MOST_TOLERANCE_MM, _MOST_TOLERANCE_DEG = 10.0, 30.0
_TOLERANCE_DEG = 0.5
"""Where ANGLE names none."""


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
    speed: float | None = None
    """Fraction of the joints' speed limits, above 0 to 1; None: that of the joint move before."""
    pace: MoveCaps = FREELY
    synchronised: bool = True
    """`SYNC=0`: each joint at its own speed, they start together and arrive when they do."""
    goal: Goal | None = None
    """The pose that it leads to; the joints are then reference values for the branch."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        joints, linear = reading.names.joints, reading.names.linear
        aimed = aims(words, reading.names, branch=True)
        coordinates = tuple(axis for axis in _COORDINATES if axis not in {name.upper() for name in joints})
        named = named_numbers(aimed.words, (*joints, *coordinates, *_PACE, "SYNC"))
        speed = _joint_speed(named, words[0])
        synchronised = _switch(named, "SYNC", True, "1: the joints arrive together, or 0: each as fast as it can")
        edge = named.get("R")
        if edge is not None and edge[0] > 0.0 and not synchronised:
            raise Mistake(edge[1].column, f"R={edge[0]:g} with SYNC=0", "R only where the joints arrive together")
        pace = pace_of(named)
        pose = {axis: named.pop(axis) for axis in coordinates if axis in named}
        aimed.refuse(pose, words[0])
        goal = None
        if pose or aimed.target.point:
            goal = Goal(*_coordinates(pose, words[0], aimed.target), aimed.target)
        elif aimed.target.frame is not None:
            raise Mistake(words[0].column, "a frame without a pose", "Z=name beside P or X Y Z A B C")
        elif not named:
            allowed = f"at least one of {', '.join(joints)}; or a pose: P=name, or X Y Z A B C"
            raise Mistake(words[0].column, "MJ without a joint", allowed)
        check_size(named, [name.upper() for name in joints if name in linear], FARTHEST_MM, "mm")
        check_size(named, [name.upper() for name in joints if name not in linear], MOST_DEG, "degrees")
        target = tuple(
            _joint(named[name.upper()][0], name in linear) if name.upper() in named else None for name in joints
        )
        return cls(line, target, speed, pace, synchronised, goal)

    def run(self, walk: Walk) -> JointStep | ProgramFault:
        step = JointStep(self.line, self.joints, _joint_share(walk, self.speed), self.pace, self.synchronised)
        return step if self.goal is None else _to_goal(step, self.goal, walk, walk.frame)

    @property
    def from_anywhere(self) -> bool:
        return None not in self.joints or (self.goal is not None and self.goal.aim.point != "")

    @property
    def frames(self) -> tuple[str, ...]:
        return () if self.goal is None else _frames(self.goal.aim)


@statement("ML")
@dataclass(frozen=True, slots=True)
class MoveLine(Move):
    """`ML X=… F=…`: the TCP moves on a straight line in the robot's base frame."""

    position_m: Position
    orientation_abc: Orientation | None
    """`None` keeps the orientation."""
    pace: MoveCaps = FREELY
    wrist_may_flip: bool = False
    tangential_rad: float | None = None
    """`TANG`, on every move of the TCP: the tool follows the direction of the path, at this angle to it."""
    switches: tuple[Mark, ...] = ()
    """On every move: what is switched at its end."""
    spaces_off: frozenset[str] = frozenset()
    """On every move: the spaces that are switched off during it."""
    mounted: Mounted = NOTHING
    """On every move: what the robot carries during it."""
    aim: Aim = HERE
    """On every move: what is said of the target beside its coordinates."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        aimed = aims(words, reading.names)
        named = named_numbers(aimed.words, (*_COORDINATES, *_PACE, "FLIP"))
        flip = _switch(named, "FLIP", False, "1: the wrist may pass its singular pose, or 0")
        pace = _path_pace_of(named, words[0], reading)
        aimed.refuse(named, words[0])
        return cls(line, *_coordinates(named, words[0], aimed.target), pace, wrist_may_flip=flip, aim=aimed.target)

    def run(self, walk: Walk) -> "MoveLine | ProgramFault":
        return _on_its_way(self, walk, self.orientation_abc)

    @property
    def frames(self) -> tuple[str, ...]:
        return _frames(self.aim)


@statement("MC")
@dataclass(frozen=True, slots=True)
class MoveArc(Move):
    """`MC QX=… X=… F=…`: the TCP moves on the circle through where it is, the via point Q and the target."""

    via_position_m: Position
    via_orientation_abc: Orientation | None
    """`None`: turned evenly on the way to the target."""
    position_m: Position
    orientation_abc: Orientation | None
    angle_rad: float | None
    """`H`: how far to go on the circle; the target is then only a point of it."""
    pace: MoveCaps = FREELY
    lift_m: float = 0.0
    """`LIFT`: a helix, which ends so far from the plane of the circle."""
    tangential_rad: float | None = None
    switches: tuple[Mark, ...] = ()
    spaces_off: frozenset[str] = frozenset()
    mounted: Mounted = NOTHING
    aim: Aim = HERE
    via_aim: Aim = HERE

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        aimed = aims(words, reading.names, via=True)
        named = named_numbers(aimed.words, (*_COORDINATES, *_VIA, "H", "LIFT", *_PACE))
        pace = _path_pace_of(named, words[0], reading)
        angle = named.pop("H", None)
        if angle is not None and not 0.0 < abs(angle[0]) <= MOST_DEG:
            allowed = f"degrees of the circle to go, any but 0 up to {MOST_DEG:g}; negative is backwards"
            raise Mistake(angle[1].column, f"H={angle[0]:g}", allowed)
        check_size(named, ("LIFT",), FARTHEST_MM, "mm")
        lift_m = named.pop("LIFT", (0.0, words[0]))[0] / 1000.0
        via = {name[1:]: named.pop(name) for name in _VIA if name in named}
        if aimed.via.point and via:
            beside = f"{' '.join(f'Q{axis}' for axis in via)} beside the via point {aimed.via.point}"
            raise Mistake(words[0].column, beside, "Q=point, or its coordinates")
        if not aimed.via.point and not any(axis in via for axis in "XYZ"):
            allowed = f"Q=point, or at least one of {', '.join(_VIA[:3])}"
            raise Mistake(words[0].column, "MC without a via point", allowed)
        via_position, via_orientation = _coordinates(via, words[0], aimed.via)
        aimed.refuse(named, words[0])
        position, orientation = _coordinates(named, words[0], aimed.target)
        radians = None if angle is None else math.radians(angle[0])
        return cls(
            line, via_position, via_orientation, position, orientation, radians, pace, lift_m,
            aim=aimed.target, via_aim=aimed.via,
        )  # fmt: skip

    def run(self, walk: Walk) -> "MoveArc | ProgramFault":
        try:
            via = settled(self.via_aim, self.via_position_m, self.via_orientation_abc, walk.points.named, walk.frame)
        except NoTarget as error:
            return ProgramFault(self.line, str(error))
        position, orientation, aim = via
        named = self.orientation_abc or self.via_orientation_abc
        arc = replace(self, via_position_m=position, via_orientation_abc=orientation, via_aim=aim)
        return _on_its_way(arc, walk, named)

    @property
    def frames(self) -> tuple[str, ...]:
        return _frames(self.aim)


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
    mounted: Mounted = NOTHING
    aim: Aim = HERE

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        aimed = aims(words, reading.names)
        named = named_numbers(aimed.words, (*_COORDINATES, *_PACE))
        pace = _path_pace_of(named, words[0], reading)
        aimed.refuse(named, words[0])
        return cls(line, *_coordinates(named, words[0], aimed.target), pace, aim=aimed.target)

    def run(self, walk: Walk) -> "MoveSpline | ProgramFault":
        return _on_its_way(self, walk, self.orientation_abc)

    @property
    def frames(self) -> tuple[str, ...]:
        return _frames(self.aim)


@statement("HOME")
@dataclass(frozen=True, slots=True)
class Home(Move):
    """`HOME F=…`: a joint move to the point HOME where there is one, else to the robot model's home position."""

    speed: float | None = None
    """As of `MJ`."""
    pace: MoveCaps = FREELY

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        named = named_numbers(words, ("F", "FC", "FA", "FJ", "R"))
        speed = _joint_speed(named, words[0])
        return cls(line, speed, pace_of(named))

    def run(self, walk: Walk) -> JointStep | ProgramFault:
        step = JointStep(self.line, None, _joint_share(walk, self.speed), self.pace)
        if _HOME not in walk.points.named:
            return step
        return _to_goal(step, Goal((None, None, None), None, Aim(_HOME)), walk, BASE)

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

    @property
    def idle(self) -> bool:
        return True


@statement("TOL")
@dataclass(frozen=True, slots=True)
class WithinTolerance(Statement):
    """`TOL n`, `TOL n ANGLE m`, `TOL 0`: from here on lines and arcs are passed within it, or (`None`) exactly."""

    tolerance: Tolerance | None

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        allowed = "TOL n in mm, if wanted with ANGLE m in degrees, or TOL 0"
        with_angle = len(words) == 4 and words[2].text.upper() == "ANGLE"
        if not (len(words) == 2 or with_angle):
            raise Mistake(words[0].column, f"`{' '.join(word.text for word in words)}`", allowed)
        distance_mm = number(words[1].text, words[1])
        if distance_mm == 0.0 and not with_angle:
            return cls(line, None)
        if not _LEAST_TOLERANCE <= distance_mm <= _MOST_TOLERANCE_MM:
            found, between = f"TOL {words[1].text}", f"{_LEAST_TOLERANCE:g} to {_MOST_TOLERANCE_MM:g} mm, or 0 alone"
            raise Mistake(words[1].column, found, between)
        angle_deg = number(words[3].text, words[3]) if with_angle else _TOLERANCE_DEG
        if not _LEAST_TOLERANCE <= angle_deg <= _MOST_TOLERANCE_DEG:
            between = f"{_LEAST_TOLERANCE:g} to {_MOST_TOLERANCE_DEG:g} degrees"
            raise Mistake(words[3].column, f"ANGLE {words[3].text}", between)
        return cls(line, Tolerance(distance_mm / 1000.0, math.radians(angle_deg)))

    def run(self, walk: Walk) -> None:
        walk.tolerance = self.tolerance

    @property
    def idle(self) -> bool:
        return True


@statement("Z=")
@dataclass(frozen=True, slots=True)
class ActiveFrame(Statement):
    """`Z=name`, `Z1`, `Z0`: from here on coordinates, and points without a frame of their own, are meant in it."""

    frame: str

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        frame = frame_in(words[0], reading.names)
        if frame is None or len(words) > 1:
            wrong = words[min(1, len(words) - 1)]
            raise Mistake(wrong.column, f"`{wrong.text}`", "a frame alone in its line: Z=name, Z1, or Z0 for the base")
        return cls(line, frame)

    def run(self, walk: Walk) -> None:
        walk.frame = self.frame

    @property
    def frames(self) -> tuple[str, ...]:
        return (self.frame,)


LineStep = MoveLine
ArcStep = MoveArc
SplineStep = MoveSpline
TcpStep = LineStep | ArcStep | SplineStep
MotionStep = JointStep | TcpStep
"""Moves of the TCP are their own steps; what is left to resolve is whether the tool follows the path."""

M = TypeVar("M", MoveLine, MoveArc, MoveSpline)


def _on_its_way(move: M, walk: Walk, named: Orientation | None) -> M | ProgramFault:
    """The move to where its target is now, with its speed and what `TANG` asks for, which leaves no orientation."""
    if walk.tangential_rad is not None and named is not None:
        text = "A, B and C are named while TANG is on, where the tool follows the path: leave them out, or TANG 0"
        return ProgramFault(move.line, text)
    try:
        target = settled(move.aim, move.position_m, move.orientation_abc, walk.points.named, walk.frame)
    except NoTarget as error:
        return ProgramFault(move.line, str(error))
    pace = _path_pace(move.pace, walk)
    if pace is None:
        return ProgramFault(move.line, "no path move before this one has named its speed: F=mm/s")
    position, orientation, aim = target
    return replace(
        move, position_m=position, orientation_abc=orientation, aim=aim, tangential_rad=walk.tangential_rad, pace=pace
    )


def _to_goal(step: JointStep, goal: Goal, walk: Walk, active: str) -> JointStep | ProgramFault:
    """The joint move to where its goal is now, with a frame active; a point that is given by joints is all of it."""
    try:
        target = settled(goal.aim, goal.position_m, goal.orientation_abc, walk.points.named, active)
    except NoTarget as error:
        return ProgramFault(step.line, str(error))
    position, orientation, aim = target
    if not aim.joints:
        return replace(step, goal=Goal(position, orientation, aim))
    if any(value is not None for value in step.joints or ()):
        text = f"point {aim.point} is given by joints, so there is no branch to choose: leave the joints out"
        return ProgramFault(step.line, text)
    return replace(step, joints=aim.joints)


def _frames(aim: Aim) -> tuple[str, ...]:
    return () if aim.frame is None else (aim.frame,)


def _joint_speed(named: Named, head: Word) -> float | None:
    """Takes F of a joint move out of the named values: percent as a fraction."""
    feed = named.pop("F", None)
    return None if feed is None else percent(feed, head)


def _joint_share(walk: Walk, speed: float | None) -> float:
    """The fraction of the limits at which a joint move runs; its own F holds from here on."""
    walk.joint_speed = walk.joint_speed if speed is None else speed
    return walk.joint_speed * walk.speed_share


def _path_pace(pace: MoveCaps, walk: Walk) -> MoveCaps | None:
    """What a path move runs with; its own F holds from here on. None: no move has named one yet."""
    walk.path_speed_m_s = pace.speed_m_s or walk.path_speed_m_s
    if walk.path_speed_m_s is None:
        return None
    return replace(pace, speed_m_s=walk.path_speed_m_s * walk.speed_share, tolerance=walk.tolerance)


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


def _path_pace_of(named: Named, head: Word, reading: Reading) -> MoveCaps:
    """The same of a path move; the first one of a file names its speed."""
    pace = pace_of(named)
    if pace.speed_m_s is None and not reading.has_feed:
        reading.has_feed = True  # told once
        allowed = "F=mm/s on the first path move of a file; it holds until another one names F"
        raise Mistake(head.column, f"{head.text.upper()} without a speed", allowed)
    reading.has_feed = True
    return pace


def _coordinates(named: Named, head: Word, aim: Aim) -> tuple[Position, Orientation | None]:
    """Position [m] and orientation [rad] out of X, Y, Z, A, B, C, which are left to a point where one is named."""
    if aim.point:
        return (None, None, None), None
    if not named:
        allowed = f"at least one of {', '.join(_COORDINATES)}, or a point: P=name"
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
