"""`cell home`, `cell move`: an operator's set-up of one robot, by motion that its drives make themselves."""

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.connection import Operator, connect
from cell.commands.errors import CommandError
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.commands.stop import stop_event
from cell.commands.view import names
from cell.messages import AxisStatus, Command, HoldSetup, Home, MoveAxes
from drive_gateway.config import AxisSettings, RobotDrives, load_drives

HOLD_PERIOD_S = 0.1
_TORQUE = (AxisStatus.SWITCHED_ON, AxisStatus.OPERATION_ENABLED, AxisStatus.QUICK_STOP_ACTIVE)


def home(
    robot: RobotArgument,
    axes: Annotated[
        list[str] | None, typer.Argument(metavar="[AXIS]...", help="These axes only.", show_default="all that can")
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Let the axes of a robot find their home points; Ctrl-C stops them.

    The robot must be disabled, and so must every other robot of the cell: the drives move by themselves, and nobody
    knows where the robot is until it is done. Stand at the hard-wired emergency stop; Ctrl-C supports and never
    replaces it.
    """

    def order(drives: RobotDrives) -> Command:
        return Home(robot, tuple(_axis(drives, name).name for name in axes or ()))

    _run(robot, order, file, endpoint)


def move(
    robot: RobotArgument,
    targets: Annotated[
        list[str], typer.Argument(metavar="AXIS=VALUE...", help="Position of an axis in degrees or mm; J1=10 J2=-5.")
    ],
    by: Annotated[bool, typer.Option("--by", help="The values are distances from where the axes are.")] = False,
    speed: Annotated[float, typer.Option("--speed", min=1, max=100, help="Percent of what set-up may use.")] = 20.0,
    velocity: Annotated[
        bool, typer.Option("--velocity", help="Mode profile velocity, which stops by time, not by position.")
    ] = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Move axes of a disabled robot by their drives' own profiles, all in the same time; Ctrl-C stops them.

    This motion has no path and no zones: every other robot must be disabled. Angles are behind the gear, in
    degrees; positions of axes that slide are in mm.
    """

    def order(drives: RobotDrives) -> Command:
        wanted = dict(target_of(drives, text) for text in targets)
        return MoveAxes(robot, wanted, by, speed / 100.0, velocity)

    _run(robot, order, file, endpoint)


def _axis(drives: RobotDrives, name: str) -> AxisSettings:
    for axis in drives.axes:
        if axis.name == name:
            return axis
    known = names([axis.name for axis in drives.axes])
    raise CommandError(f"robot {drives.robot} has no axis {name}; its axes are {known}")


def target_of(drives: RobotDrives, text: str) -> tuple[str, float]:
    """A word of the command line as an axis and its target [rad or m]."""
    name, _, value = text.partition("=")
    try:
        number = float(value)
    except ValueError:
        raise CommandError(f"{text!r} is no target of an axis", "write for example J1=10, in degrees or mm") from None
    return name, number / 1000.0 if _axis(drives, name).linear else math.radians(number)


def _run(robot: str, order: Callable[[RobotDrives], Command], file: Path, endpoint: list[str] | None) -> None:
    stop = stop_event()
    with connect(file, endpoint) as operator:
        operator.check_robot(robot)
        gateway = operator.settings.robots[robot].gateway
        drives: RobotDrives = load_drives(operator.settings.gateways[gateway].drives, gateway).robots[robot]
        command = order(drives)
        _check_others(operator, robot)
        print(f"{robot}: {operator.ask_gateway(gateway, command).text}", flush=True)
        said, state = "", "moving"
        while state == "moving":
            if stop.wait(HOLD_PERIOD_S):
                raise CommandError(f"{robot}: let go of; its drives stop and switch off")
            reply = operator.ask_gateway(gateway, HoldSetup(robot))
            state = reply.data
            if reply.text != said:
                said = reply.text
                print(f"{robot}: {time.strftime('%H:%M:%S')} {said}", flush=True)
        if state != "done":
            raise CommandError(f"{robot}: {said}", "remove the cause, then: cell reset; and begin again")


def _check_others(operator: Operator, robot: str) -> None:
    """One robot at a time: every other one of the cell must be heard, and be without torque."""
    seen = operator.snapshot()
    silent = [name for name in operator.settings.gateways if name not in seen.gateways]
    if silent:
        raise CommandError(f"gateway {names(silent)} is silent: nobody knows whether its robots move")
    moving = {
        node.robot
        for gateway in seen.gateways.values()
        for node in gateway.nodes
        if node.robot != robot and node.drive in _TORQUE
    }
    if moving:
        raise CommandError(
            f"robot {names(sorted(moving))} is switched on; set-up needs every other robot disabled",
            "; ".join(f"cell disable {name} -f {operator.file}" for name in sorted(moving)),
        )
