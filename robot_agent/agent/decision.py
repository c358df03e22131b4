"""What an operator's call is judged by, and what can come out of it."""

from dataclasses import dataclass

from cell.messages import Command, DriveFeedback, Estop, Mode
from robot_agent.agent.cell_clock import CellClock
from robot_agent.agent.executive import Executive
from robot_agent.agent.planning import Planner


@dataclass(frozen=True, slots=True)
class Situation:
    """What decides whether a call is allowed."""

    executive: Executive | None
    planner: Planner
    estop: Estop | None
    feedback: DriveFeedback
    refused_by_manager: str
    clock: CellClock
    kept_still: str = ""
    """Why nothing may move the robot now; empty when it may."""


@dataclass(frozen=True, slots=True)
class Done:
    """A call was carried out; the robot is now in `mode`."""

    text: str
    mode: Mode


@dataclass(frozen=True, slots=True)
class Refused:
    text: str


@dataclass(frozen=True, slots=True)
class Passed:
    """The gateway decides; the answer comes later."""

    command: Command
    mode: Mode


Decision = Done | Refused | Passed
