"""The robot language: text to statements, statements to steps. `docs/language.md` is its reference for people.

What a statement is called, how it is read and what it does stands in its class; each module with such classes is
imported here (`docs/architecture.md`, 2.1).
"""

from robot_agent.language.interpreter import Interpreter, Step
from robot_agent.language.moves import (
    ActiveFrame,
    ArcStep,
    Home,
    LineStep,
    MotionStep,
    Move,
    MoveArc,
    MoveJoints,
    MoveLine,
    MoveSpline,
    SplineStep,
    Tangent,
    TcpStep,
)
from robot_agent.language.names import Names, Points, points_owner
from robot_agent.language.parser import parse_program
from robot_agent.language.parts import Attach, ChangeTool, Detach, changes_tools, mounted_before, mounts
from robot_agent.language.program import Program, ProgramError, ProgramProblem
from robot_agent.language.sequence import End, Goto, Label, MeetOthers, SetOutput, Speed, Sub, SwitchSpace, Track, Wait
from robot_agent.language.statement import STATEMENTS, Statement
from robot_agent.language.steps import (
    BASE,
    Aim,
    Finished,
    Goal,
    JointStep,
    Meet,
    Mount,
    MoveCaps,
    Orientation,
    Pause,
    Position,
    ProgramFault,
    Switch,
    SwitchNow,
    TrackingOff,
    TrackingOn,
)
from robot_agent.language.targets import NoTarget, settled

__all__ = [
    "BASE",
    "STATEMENTS",
    "ActiveFrame",
    "Aim",
    "ArcStep",
    "Attach",
    "ChangeTool",
    "Detach",
    "End",
    "Finished",
    "Goal",
    "Goto",
    "Home",
    "Interpreter",
    "JointStep",
    "Label",
    "LineStep",
    "Meet",
    "MeetOthers",
    "MotionStep",
    "Mount",
    "Move",
    "MoveArc",
    "MoveCaps",
    "MoveJoints",
    "MoveLine",
    "MoveSpline",
    "Names",
    "NoTarget",
    "Orientation",
    "Pause",
    "Points",
    "Position",
    "Program",
    "ProgramError",
    "ProgramFault",
    "ProgramProblem",
    "SetOutput",
    "Speed",
    "SplineStep",
    "Statement",
    "Step",
    "Sub",
    "Switch",
    "SwitchNow",
    "SwitchSpace",
    "Tangent",
    "TcpStep",
    "Track",
    "TrackingOff",
    "TrackingOn",
    "Wait",
    "changes_tools",
    "mounted_before",
    "mounts",
    "parse_program",
    "points_owner",
    "settled",
]
