"""`cell teach`, `points` and `go`: the points of a robot."""

import json
import uuid
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.connection import connect, report
from cell.commands.client.json_lines import json_line
from cell.commands.errors import CommandError
from cell.commands.operator.jog import hold
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, JsonOption, RobotArgument
from cell.commands.processes.stop import stop_event
from cell.messages import Go, ListPoints, PointKind, Teach

BASE = "base"
"""What `--frame` calls the robot's own."""

PointArgument = Annotated[str, typer.Argument(metavar="POINT", help="Name of the point.")]


def teach(
    robot: RobotArgument,
    point: PointArgument,
    joints: Annotated[bool, typer.Option("--joints", help="Keep the joints, not the pose of the tool.")] = False,
    frame: Annotated[
        str | None,
        typer.Option(
            metavar="FRAME",
            help="The frame in which the pose is kept, or base. [default: that of the point before, or base]",
            show_default=False,
        ),
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="The point may be there already.")] = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Keep where a robot stands as a point, in its points file and in its program from where that comes to it.

    It is the pose of the mounted tool's TCP, without a tool of the flange, as the drives measure it. The robot's agent
    writes the file, on its computer.
    """
    kind = PointKind.JOINTS if joints else PointKind.POSE
    with connect(file, endpoint) as operator:
        if frame not in (None, BASE, *operator.settings.frames):
            known = ", ".join([BASE, *operator.settings.frames])
            raise CommandError(f"--frame {frame!r} found, allowed are {known}")
        report(robot, operator.ask_robot(robot, Teach(point, kind, "" if frame == BASE else frame, replace)))


def points(
    robot: RobotArgument,
    as_json: JsonOption = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Print the points of a robot in mm and deg, and where those in frames are now."""
    with connect(file, endpoint) as operator:
        reply = operator.ask_robot(robot, ListPoints())
        if not reply.ok:
            raise CommandError(f"{robot} refuses: {reply.text}")
        if not as_json:
            typer.echo(reply.text)
            return
        for name, point in json.loads(reply.data).items():
            typer.echo(json_line("point", name, point, robot=robot))


def go(
    robot: RobotArgument, point: PointArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None
) -> None:
    """Move an enabled robot slowly to a point, all joints together, until Ctrl-C or until it is there.

    The command is the key that is held, as with `cell jog`: when it ends, in whatever way, or its messages do not
    arrive for 0.2 s, the robot comes to rest. No program may be running; a halted one is ended.
    """
    stop = stop_event()
    with connect(file, endpoint, stop) as operator:
        operator.check_robot(robot)
        operator.check_files(f"robot {robot}", operator.presence(robot).digest)
        command = Go(uuid.uuid4().hex, point)
        report(robot, operator.ask_robot(robot, command))
        hold(operator, robot, command.press, stop)
