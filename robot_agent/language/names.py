"""What a program of one robot may name."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Self

from cell.config.points_file import CamSettings, Point, PointsOwner, PointsSettings, Signal, SignalKind
from cell.config.settings import CellSettings
from robot_agent.model.description import RobotDescription

Known = Collection[str] | None
"""Names that there are; None where nobody can say, so that every name passes."""


class Points:
    """The points of a robot as they are now: who teaches one exchanges them, and programs come to the new ones."""

    def __init__(self, named: Mapping[str, Point] | None = None) -> None:
        self.named: Mapping[str, Point] = named or {}


@dataclass(frozen=True, slots=True, kw_only=True)
class Names:
    """The names that a program is read against."""

    joints: tuple[str, ...] = field(kw_only=False)
    """That `MJ` may name; their values are degrees, or millimetres for those in `linear`."""
    linear: Collection[str] = frozenset()
    corrections: Known = None
    """Of `TRACK`."""
    outputs: Known = None
    """Of `SET DO`, `RESET DO` and `IF DO`."""
    inputs: Known = None
    """Of `WAIT DI` and `IF DI`."""
    spaces: Known = None
    """Of `SPACE`."""
    tools: Known = None
    """Of `T`."""
    parts: Known = None
    """Of `ATTACH`."""
    meetings: Known = None
    """Of `MEET`."""
    frames: Known = None
    """Of `Z`."""
    points: Points | None = None
    """Of `P` and `Q`."""
    signals: Mapping[str, Signal] = field(default_factory=dict)
    """Other names for inputs and outputs."""
    robot: str = ""
    variables: Mapping[str, str] = field(default_factory=dict)
    """Of the cell: by name, the robot whose programs set it."""
    cam: CamSettings | None = None
    """How CAM files are read."""

    @classmethod
    def of(
        cls, cell: CellSettings, robot: str, described: RobotDescription, taught: PointsSettings | None = None
    ) -> Self:
        """Those of a robot of the cell that was `taught` this; inputs and outputs are known to its gateway alone."""
        linear = (name for name, slides in zip(described.joint_names, described.linear, strict=False) if slides)
        return cls(
            described.joint_names,
            linear=frozenset(linear),
            corrections=cell.robots[robot].corrections,
            spaces=cell.robots[robot].program_spaces,
            tools=described.tools,
            parts=described.parts,
            meetings=cell.meetings_of(robot),
            frames=cell.frames,
            points=Points() if taught is None else Points(taught.points),
            signals={} if taught is None else taught.signals,
            robot=robot,
            variables=cell.variables,
            cam=CamSettings() if taught is None else taught.cam,
        )

    def sets(self, variable: str) -> bool | None:
        """Whether programs of this robot set a variable of the cell, or another one's; None: it is none of the cell."""
        owner = self.variables.get(variable)
        return None if owner is None else owner == self.robot

    def input(self, name: str) -> str:
        """The input that a name stands for."""
        signal = self.signals.get(name)
        return signal.name if signal is not None and signal.kind is SignalKind.INPUT else name

    def key(self, name: str) -> Signal | None:
        """The Zenoh key that a name stands for; None for all other names."""
        signal = self.signals.get(name)
        return signal if signal is not None and signal.kind is SignalKind.KEY else None

    def output(self, name: str) -> str:
        """The output that a name stands for."""
        signal = self.signals.get(name)
        return signal.name if signal is not None and signal.kind is SignalKind.OUTPUT else name


def points_owner(cell: CellSettings, described: RobotDescription, branches: Collection[str] | None) -> PointsOwner:
    """What the points file of a robot of the cell may name."""
    linear = (name for name, slides in zip(described.joint_names, described.linear, strict=False) if slides)
    return PointsOwner(described.joint_names, frozenset(linear), tuple(cell.frames), tuple(described.tools), branches)
