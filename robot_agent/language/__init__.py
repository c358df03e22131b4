"""The robot language: text to statements, statements to steps. `docs/language.md` is its reference for people.

What a statement is called, how it is read and what it does stands in its class; each module with such classes is
imported here (`docs/architecture.md`, 2.1).
"""

from robot_agent.language.interpreter import Interpreter, Step
from robot_agent.language.moves import (
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
from robot_agent.language.names import Names
from robot_agent.language.parser import parse_program
from robot_agent.language.parts import Attach, Detach, held_before, uses_parts
from robot_agent.language.program import Program, ProgramError, ProgramProblem
from robot_agent.language.sequence import End, Goto, Label, MeetOthers, SetOutput, SwitchSpace, Track, Wait
from robot_agent.language.statement import STATEMENTS, Statement
from robot_agent.language.steps import (
    Finished,
    HoldParts,
    JointStep,
    Meet,
    MoveCaps,
    Pause,
    ProgramFault,
    Switch,
    SwitchNow,
    TrackingOff,
    TrackingOn,
)

__all__ = [
    "STATEMENTS",
    "ArcStep",
    "Attach",
    "Detach",
    "End",
    "Finished",
    "Goto",
    "HoldParts",
    "Home",
    "Interpreter",
    "JointStep",
    "Label",
    "LineStep",
    "Meet",
    "MeetOthers",
    "MotionStep",
    "Move",
    "MoveArc",
    "MoveCaps",
    "MoveJoints",
    "MoveLine",
    "MoveSpline",
    "Names",
    "Pause",
    "Program",
    "ProgramError",
    "ProgramFault",
    "ProgramProblem",
    "SetOutput",
    "SplineStep",
    "Statement",
    "Step",
    "Switch",
    "SwitchNow",
    "SwitchSpace",
    "Tangent",
    "TcpStep",
    "Track",
    "TrackingOff",
    "TrackingOn",
    "Wait",
    "held_before",
    "parse_program",
    "uses_parts",
]
