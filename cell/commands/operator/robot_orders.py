"""`cell run` and the other orders to one robot that are a word and at most one value."""

import math
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.connection import ask_each, connect, report
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError
from cell.commands.operator.common_start import AHEAD_S, run_together
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.messages import (
    AnswerFlag,
    Command,
    Continue,
    Disable,
    Enable,
    ForceInput,
    Halt,
    ListParameters,
    Load,
    Return,
    Run,
    SetManual,
    SetOverride,
    SetParameter,
    SetPart,
    SetTool,
    Step,
    Stop,
)

PercentArgument = Annotated[float, typer.Argument(min=-100.0, max=100.0, metavar="PERCENT", help="-100 to 100.")]
RobotsArgument = Annotated[list[str], typer.Argument(metavar="ROBOT...", help="Names of robots in the cell file.")]
FirstLineOption = Annotated[
    int | None,
    typer.Option("--from", min=1, metavar="LINE", help="Begin there, with all that holds there.", show_default=False),
]
LastLineOption = Annotated[
    int | None, typer.Option("--to", min=1, metavar="LINE", help="End with this line.", show_default=False)
]


class OnOff(Enum):
    """A word of the command line."""

    ON = "on"
    OFF = "off"


class Seen(Enum):
    """How programs see an input, or what an output is to be."""

    ON = "on"
    OFF = "off"
    FOLLOW = "follow"


SwitchArgument = Annotated[OnOff, typer.Argument(help="on: at most 250 mm/s; off: automatic operation.")]


def _order(robot: str, command: Command, file: Path, endpoints: list[str] | None) -> None:
    with connect(file, endpoints) as operator:
        report(robot, operator.ask_robot(robot, command))


def _order_each(robots: list[str], command: Command, file: Path, endpoints: list[str] | None) -> None:
    with connect(file, endpoints) as operator:
        for robot in robots:
            operator.check_robot(robot)
        ask_each(operator, robots, command)


def run(
    robots: RobotsArgument,
    ahead: Annotated[
        float | None,
        typer.Option(
            min=0.5,
            max=600,
            metavar="SECONDS",
            help=f"Plan for so long, then start. [default: {AHEAD_S:g} for several robots; one starts at once]",
            show_default=False,
        ),
    ] = None,
    last: Annotated[
        float | None,
        typer.Option(
            min=0.1, max=3600, metavar="SECONDS", help="End the first motions together, so long after the start."
        ),
    ] = None,
    first_line: FirstLineOption = None,
    last_line: LastLineOption = None,
    dry: Annotated[bool, typer.Option("--dry", help="Move, but switch no output.")] = False,
    virtual: Annotated[
        bool, typer.Option("--virtual", help="Neither move nor switch: only a picture, which `cell status` shows.")
    ] = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Start a robot's program; several robots begin their first motions at the same moment.

    A robot that cannot begin then does not begin at all; one that cannot end in time ends as soon as it can. When one
    refuses, the others are halted before the start. With --from the robot moves from where it stands to the target of
    that line: look at the way first. With --virtual it stays where it is, with its drives off or in a fault too, asks
    for no zone and no room, and takes no other order to move until the run has ended; halt, continue, step, stop,
    override and flag are about that run.
    """
    if len(robots) == 1 and ahead is None and last is None:
        part = Run(first_line=first_line, last_line=last_line, dry=dry, virtual=virtual)
        _order(robots[0], part, file, endpoint)
        return
    if dry or virtual or first_line is not None or last_line is not None:
        found = "--from, --to, --dry and --virtual for a common start"
        raise CommandError(found, "leave them out, or run one robot at once")
    with connect(file, endpoint) as operator:
        run_together(operator, robots, AHEAD_S if ahead is None else ahead, last)


def load(
    robot: RobotArgument,
    program: Annotated[
        str | None,
        typer.Argument(
            metavar="[FILE]", help="Below the folder of the cell file on the agent's computer.", show_default=False
        ),
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Give a robot another program, or without FILE its present one anew after somebody has edited it.

    Read are the program, all that it calls, and the robot's points. With a mistake in one of them all are told and the
    old program stays. The robot is at rest; a program that is halted or interrupted ends by it. When the agent is
    started again, the program of the cell file counts.
    """
    _order(robot, Load(program), file, endpoint)


def halt(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Brake a robot on its path; `cell continue` goes on from there."""
    _order(robot, Halt(), file, endpoint)


def stop(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Brake a robot on its path and end its program, also one that is halted or interrupted; a jog ends as well.

    It replaces no emergency stop: the drives stay switched on, and the robot takes the next order.
    """
    _order(robot, Stop(), file, endpoint)


def continue_(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Let a halted robot go on along its path; one that is off its path must `cell return` first."""
    _order(robot, Continue(), file, endpoint)


def return_(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Let a robot that is off its path move slowly back to where it left it, and halt there.

    It moves all joints straight there, at a tenth of their speed limits and at most 250 mm/s: look at the way first.
    """
    _order(robot, Return(), file, endpoint)


def step(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Let a robot go on, or start, to the end of the present move of its program, and halt there."""
    _order(robot, Step(), file, endpoint)


def override(
    robot: RobotArgument,
    percent: PercentArgument,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Follow the path at a percentage of the planned speed; below 0 back along it: `override left -30`."""
    _order(robot, SetOverride(percent), file, endpoint)


def manual(
    robot: RobotArgument,
    switch: SwitchArgument,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Bound a robot's TCP to 250 mm/s (manual operation), or not. It replaces no safety-rated speed monitoring."""
    _order(robot, SetManual(switch is OnOff.ON), file, endpoint)


def set_(
    robot: RobotArgument,
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="Of the list.", show_default=False)] = None,
    value: Annotated[
        str | None,
        typer.Argument(metavar="VALUE|file", help="In its unit; file: as the files say, again.", show_default=False),
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Change a parameter of a robot while it works; without NAME list all that may be changed, with their ranges.

    What shapes a motion counts with the next one that begins at rest, so nothing jumps. It lasts until `file` or the
    end of the agent, and is written into no file. `cell status` shows what is set.
    """
    _order(robot, _parameter_order(robot, name, value), file, endpoint)


def _parameter_order(robot: str, name: str | None, value: str | None) -> Command:
    """Raises `CommandError` for a value that is missing, or is no number."""
    if name is None:
        return ListParameters()
    lists = f"`cell set {robot}` lists names, units and ranges"
    if value is None:
        raise CommandError(f"{name} without a value; allowed is a number in its unit, or file", lists)
    if value.lower() == "file":
        return SetParameter(name, None, operator_name())
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise CommandError(f"{name}: {value!r} found, allowed is a number in its unit, or file", lists)
    return SetParameter(name, number, operator_name())


def tool(
    robot: RobotArgument,
    name: Annotated[str, typer.Argument(metavar="TOOL|none", help="Of the robot file, or none.", show_default=False)],
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Say which tool is mounted on a robot: look first, its body and its TCP are those of what you say.

    Wanted after each start of its agent, before a program with T runs, and when somebody has changed the tool by hand.
    The robot is at rest; a program that is halted or interrupted ends by it.
    """
    _order(robot, SetTool(None if name.lower() == "none" else name), file, endpoint)


def part(
    robot: RobotArgument,
    name: Annotated[str, typer.Argument(metavar="PART|none", help="Of the robot file, or none.", show_default=False)],
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Say what is in a robot's gripper: look first, its body is the one of what you say.

    Wanted after each start of its agent, before a program with ATTACH or DETACH runs, and when somebody has put a part
    in or taken one out by hand. The robot is at rest; a program that is halted or interrupted ends by it.
    """
    _order(robot, SetPart(None if name.lower() == "none" else name), file, endpoint)


def flag(
    robot: RobotArgument,
    number: Annotated[int, typer.Argument(metavar="N", min=0, max=999, help="Of the M at which it waits.")],
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Answer the flag at which a robot's program waits (`M n`): it goes on, and may move at once.

    Refused where the program does not wait at this flag. One that is halted there goes on when it continues.
    """
    _order(robot, AnswerFlag(number), file, endpoint)


def input_(
    robot: RobotArgument,
    name: Annotated[str, typer.Argument(metavar="INPUT", help="Of the drives file.", show_default=False)],
    seen: Annotated[
        Seen, typer.Argument(metavar="on|off|follow", help="follow: as it is measured, again.", show_default=False)
    ],
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Force what the programs of a robot see of an input; one that waits for it goes on, and may move at once.

    WAIT DI and IF DI alone see that, until follow or the end of the agent. Safety inputs have no such name and count as
    they are measured, always; an input that switches a space is refused. `cell status` shows what is forced.
    """
    _order(robot, ForceInput(name, None if seen is Seen.FOLLOW else seen is Seen.ON), file, endpoint)


def enable(robots: RobotsArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Switch the drives of robots on; they hold their positions."""
    _order_each(robots, Enable(), file, endpoint)


def disable(robots: RobotsArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Switch the drives of robots off; refused while a robot moves."""
    _order_each(robots, Disable(), file, endpoint)
