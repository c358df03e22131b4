"""What a program of one robot may name."""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Self

from cell.config.settings import CellSettings
from robot_agent.model.description import RobotDescription

Known = Collection[str] | None
"""Names that there are; None where nobody can say, so that every name passes."""


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
    parts: Known = None
    """Of `ATTACH`."""
    meetings: Known = None
    """Of `MEET`."""

    @classmethod
    def of(cls, cell: CellSettings, robot: str, described: RobotDescription) -> Self:
        """Those of a robot of the cell; inputs and outputs are known to its gateway alone."""
        linear = (name for name, slides in zip(described.joint_names, described.linear, strict=False) if slides)
        return cls(
            described.joint_names,
            linear=frozenset(linear),
            corrections=cell.robots[robot].corrections,
            spaces=cell.robots[robot].program_spaces,
            parts=described.parts,
            meetings=cell.meetings_of(robot),
        )
