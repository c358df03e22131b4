"""Variables of the cell: what the programs of one robot have set, for all others."""

from dataclasses import dataclass, field
from typing import Annotated

from cell.messages.common import CellTime, Count, Few, Name, Number, Text
from cell.messages.state import state


@dataclass(frozen=True, slots=True)
class VariableValue:
    """What a variable was set to, by which line of which program, and when."""

    value: Number
    program: Text
    line: Count
    at: CellTime | None = None
    """None: no manager was heard then."""


@state("robot/{robot}/variables")
@dataclass(frozen=True, slots=True)
class RobotVariables:
    """The variables of the cell that are this robot's; the agent answers queries on its key with the newest one."""

    robot: Name
    boot: Name
    era: Count
    """Grows from one run of the agent to the next: the number of its claim."""
    sequence: Count
    at: CellTime | None
    """When they were as told; None while no manager is heard."""
    values: Annotated[dict[Name, VariableValue], Few] = field(default_factory=dict)
    """Those that were set since the agent was started."""


@state("manager/variables")
@dataclass(frozen=True, slots=True)
class CellVariables:
    """The newest of all robots, as the manager passes it on: agents do not hear each other. It answers queries too."""

    robots: Annotated[dict[Name, RobotVariables], Few] = field(default_factory=dict)
