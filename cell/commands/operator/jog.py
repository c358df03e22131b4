"""`cell jog`: move a robot along one axis for as long as the command lives."""

import math
import threading
import time
import uuid
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.cell_view import echo
from cell.commands.client.connection import Connection, connect, report
from cell.commands.errors import CommandError, quoted
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.commands.processes.stop import stop_event
from cell.config.settings import CellSettings
from cell.messages import Jog, JogFrame, JogHeld, Mode

PERIOD_S = 0.03
"""The key's signs of life are this far apart; the robot stops when it hears none for 0.2 s."""
SILENT_S = 1.0
_RELEASES = 5
_MOVES_ON_S = 0.5
"""In front of what is in its way a robot comes to rest by smaller and smaller steps: it moves on when it does for so
long."""
_LOAD = "take load off the hosts and the network when it happens again"
_SPEED_MM_S = 50.0
_SPEED_DEG_S = 10.0
_ALONG = ("X", "Y", "Z")
_ABOUT = ("A", "B", "C")


class Direction(Enum):
    """Which way."""

    FORWARD = "+"
    BACKWARD = "-"


def jog(
    robot: RobotArgument,
    axis: Annotated[str, typer.Argument(metavar="AXIS", help="A joint's name, or X, Y, Z, A, B, C for the tool.")],
    direction: Annotated[Direction, typer.Argument(metavar="+|-", help="Which way.")],
    speed: Annotated[
        float | None,
        typer.Option(
            help="mm/s or deg/s; TCP and flange never exceed 250 mm/s. [default: 50 mm/s, 10 deg/s]",
            show_default=False,
        ),
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Stop after so many mm or deg. [default: at Ctrl-C]", show_default=False)
    ] = None,
    frame: Annotated[JogFrame, typer.Option(help="Whose axes X to C are.")] = JogFrame.WORLD,
    in_frame: Annotated[
        str | None,
        typer.Option("--in", metavar="FRAME", help="Or those of this frame.", show_default=False),
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Move an enabled robot along one axis until Ctrl-C, or by a step; no program may be running.

    The command is the key that is held: when it ends, in whatever way, or its messages do not arrive for 0.2 s, the
    robot comes to rest. It supports and never replaces an enabling switch and a hard-wired emergency stop.
    """
    stop = stop_event()
    with connect(file, endpoint, stop) as operator:
        operator.check_robot(robot)
        operator.check_files(f"robot {robot}", operator.presence(robot).digest)
        sliding = axis not in _ALONG + _ABOUT and _slides(operator.settings, robot, axis)
        command = replace(jog_command(axis, direction, speed, step, frame, sliding), in_frame=in_frame)
        report(robot, operator.ask_robot(robot, command))
        hold(operator, robot, command.press, stop)


def jog_command(
    axis: str, direction: Direction, speed: float | None, step: float | None, frame: JogFrame, sliding: bool
) -> Jog:
    """The call for an operator's words in mm and deg; `sliding`: the axis is a joint that slides.

    Raises `CommandError` for a speed or a step that is not above 0.
    """
    for name, value in (("--speed", speed), ("--step", step)):
        if value is not None and not 0.0 < value < math.inf:
            raise CommandError(f"{name} {value:g} found, allowed is any above 0; the direction is given by + or -")
    linear = sliding or axis in _ALONG
    unit = 1e-3 if linear else math.pi / 180.0
    if speed is None:
        speed = _SPEED_MM_S if linear else _SPEED_DEG_S
    sign = 1.0 if direction is Direction.FORWARD else -1.0
    return Jog(uuid.uuid4().hex, axis, sign * speed * unit, frame, None if step is None else step * unit)


def _slides(settings: CellSettings, robot: str, joint: str) -> bool:
    """Whether a joint slides, by the robot's file."""
    from robot_agent.kinematics import KinematicsError
    from robot_agent.workspace import PlacedRobot

    try:
        return joint in PlacedRobot.of(settings.robots[robot]).model.linear_names
    except KinematicsError as error:
        raise CommandError(str(error), f"correct it, then: cell check {quoted(settings.file)}") from error


def hold(operator: Connection, robot: str, press: str, stop: threading.Event) -> None:
    """Say that the key is held until `stop`, or until the robot has ended the jog; then wait until it rests.

    Raises `CommandError` when the robot falls silent, is not seen to jog, or ends the jog before its time.
    """
    said = newest = ""
    begun, heard_at, released = False, time.monotonic(), 0
    held_up_at = heard_at
    begins_by = heard_at + SILENT_S
    while True:
        state = operator.view.look().robots.get(robot)
        if state is None:
            if time.monotonic() - heard_at > SILENT_S:
                raise CommandError(f"robot {robot} is silent", "look at the robot; it comes to rest by itself")
        else:
            heard_at, jogging = time.monotonic(), state.mode is Mode.JOGGING
            begun = begun or jogging
            reason = "; ".join(state.alarms) or state.waiting_for
            if begun and not jogging:
                if (why := reason or newest) and not stop.is_set():
                    raise CommandError(
                        f"{robot}: the jog was broken off: {why}",
                        f"see where the robot stands (cell status), then press again, by the rest of the way; {_LOAD}",
                    )
                typer.echo(f"{robot}: is at rest; the jog has ended")
                return
            if not begun and (heard_at > begins_by or released == _RELEASES):
                early = reason or "no sign of the key arrived in time"
                raise CommandError(f"{robot}: the jog was over before it was seen: {early}", f"press again; {_LOAD}")
            if released < _RELEASES:
                operator.session.publish(JogHeld(robot, press, not stop.is_set(), echo(state)))
                released += stop.is_set()
            newest = reason
            if reason:
                held_up_at = time.monotonic()
                if reason != said:
                    typer.echo(f"{robot}: {reason}")
                said = reason
            elif said and time.monotonic() - held_up_at > _MOVES_ON_S:
                said = ""
                typer.echo(f"{robot}: moves on")
        time.sleep(PERIOD_S)
