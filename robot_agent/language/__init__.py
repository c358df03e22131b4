"""The robot language: text to statements, statements to steps. `docs/language.md` is its reference for people."""

from robot_agent.language.interpreter import Finished, Interpreter, JointStep, LineStep, Pause, ProgramFault, Step
from robot_agent.language.parser import parse_program
from robot_agent.language.program import (
    End,
    Goto,
    Home,
    Label,
    MoveJoints,
    MoveLine,
    Program,
    ProgramError,
    ProgramProblem,
    Statement,
    Wait,
)

__all__ = [
    "End",
    "Finished",
    "Goto",
    "Home",
    "Interpreter",
    "JointStep",
    "Label",
    "LineStep",
    "MoveJoints",
    "MoveLine",
    "Pause",
    "Program",
    "ProgramError",
    "ProgramFault",
    "ProgramProblem",
    "Statement",
    "Step",
    "Wait",
    "parse_program",
]
