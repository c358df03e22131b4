"""`cell confine` and `cell stands`: an operator's word on where a robot stays that does not tell it itself."""

import math
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.connection import connect, report
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError
from cell.commands.operator.frame import parsed_pose
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.messages import Command, Confinement, ConfineRobot, EndAssurance, RobotStands

_LARGEST_MM = 1e9


class Off(Enum):
    """It counts no more."""

    OFF = "off"


OffArgument = Annotated[
    Off | None, typer.Argument(metavar="[off]", help="What was said counts no more.", show_default=False)
]


def confine(
    robot: RobotArgument,
    switch: OffArgument = None,
    box: Annotated[
        str | None, typer.Option("--box", metavar="X,Y,Z", help="Full edge lengths, in mm.", show_default=False)
    ] = None,
    pose: Annotated[
        str | None,
        typer.Option("--pose", metavar="X,Y,Z,A,B,C", help="Of its middle, in world; mm and deg.", show_default=False),
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Declare that a robot stays inside a box although it does not say where it is; the others may move around it.

    For one that is not referenced or whose agent does not run. You are answerable that all of it stays in there, with
    its tool and what it holds, also while it is homed: the software cannot know, and this replaces no hard-wired
    protection. It ends by itself when the robot says where it is.
    """
    if switch is not None:
        if box is not None or pose is not None:
            raise CommandError("off goes without --box and --pose")
        _say(robot, EndAssurance(robot, operator_name()), file, endpoint)
        return
    if box is None or pose is None:
        example = f"cell confine {robot} --box 2400,2000,2600 --pose 1800,0,1300,0,0,0, or cell confine {robot} off"
        raise CommandError("a box needs --box and --pose", f"write for example: {example}")
    placed = parsed_pose(pose)
    inside = Confinement(_lengths(box), placed.position_m, placed.quaternion_xyzw)
    _say(robot, ConfineRobot(robot, inside, operator_name()), file, endpoint)


def stands(
    robot: RobotArgument,
    switch: OffArgument = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Declare that a robot stands where it was last known; the others may move around it.

    For one that is not referenced or whose agent does not run, with its drives off. Look first: you are answerable that
    nothing has moved it, the software cannot know, and this replaces no hard-wired protection. It ends by itself when
    the robot says where it is, or can move.
    """
    by = operator_name()
    _say(robot, RobotStands(robot, by) if switch is None else EndAssurance(robot, by), file, endpoint)


def _say(robot: str, command: Command, file: Path, endpoint: list[str] | None) -> None:
    with connect(file, endpoint) as operator:
        operator.check_robot(robot)
        report("manager", operator.ask_manager(command))


def _lengths(text: str) -> tuple[float, float, float]:
    """`X,Y,Z` in mm as m. Raises `CommandError`."""
    try:
        x, y, z = (float(part) / 1000.0 for part in text.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(0.0 < each <= _LARGEST_MM / 1000.0 for each in (x, y, z)):
        raise CommandError(f"--box {text[:80]!r} found, allowed are three lengths in mm: --box 2400,2000,2600")
    return x, y, z
