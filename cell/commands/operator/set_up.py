"""`cell home`, `cell move`: an operator's set-up of one robot, by motion that its drives make themselves."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.cell_files import check_robot, running_cell
from cell.commands.client.cell_view import names
from cell.commands.client.connection import Connection, connect, report
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.commands.processes.stop import stop_event
from cell.messages import AcceptPosition, ClearSetup, Command, HoldSetup, Home, MoveAxes, PressAxis, Reply
from drive_gateway.config import AxisSettings, RobotDrives, load_drives

HOLD_PERIOD_S = 0.1
AloneOption = Annotated[
    bool,
    typer.Option(
        "--without-manager",
        help="There is no manager, so nobody keeps the other robots still: you do. Refused while one is heard.",
    ),
]


def home(
    robot: RobotArgument,
    axes: Annotated[
        list[str] | None, typer.Argument(metavar="[AXIS]...", help="These axes only.", show_default="all that can")
    ] = None,
    without_manager: AloneOption = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Let the axes of a robot find their home points; Ctrl-C stops them.

    The robot must be disabled, and so must every other robot of the cell, which the manager keeps so meanwhile: the
    drives move by themselves, and nobody knows where the robot is until it is done. While another robot is in set-up it
    waits for its turn. Stand at the hard-wired emergency stop; Ctrl-C supports and never replaces it.
    """

    def order(drives: RobotDrives, alone: bool) -> Command:
        return Home(robot, tuple(_axis(drives, name).name for name in axes or ()), alone)

    _run(robot, order, file, endpoint, without_manager)


def move(
    robot: RobotArgument,
    targets: Annotated[
        list[str],
        typer.Argument(
            metavar="AXIS=VALUE...",
            help="Position of an axis in degrees or mm; J1=10 J2=-5. With --torque one axis: J2.",
        ),
    ],
    by: Annotated[bool, typer.Option("--by", help="The values are distances from where the axes are.")] = False,
    speed: Annotated[float, typer.Option("--speed", min=1, max=100, help="Percent of what set-up may use.")] = 20.0,
    velocity: Annotated[
        bool, typer.Option("--velocity", help="Mode profile velocity, which stops by time, not by position.")
    ] = False,
    torque: Annotated[
        float | None,
        typer.Option(
            "--torque",
            metavar="NM",
            help="Give a torque behind the gear instead; Nm, or N.",
            show_default=False,
            min=-1e6,
            max=1e6,
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option("--for", metavar="S", help="How long the torque stays.", show_default=False, max=3600),
    ] = None,
    within: Annotated[
        float, typer.Option("--within", metavar="WAY", help="How far the axis may give way, degrees or mm.", max=1000)
    ] = 1.0,
    without_manager: AloneOption = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Move axes of a disabled robot by their drives' own profiles, all in the same time; Ctrl-C stops them.

    This motion has no path and no zones: every other robot must be disabled, and the manager keeps it so meanwhile.
    Angles are behind the gear, in degrees; positions of axes that slide are in mm. With --torque one axis presses
    (cyclic torque): the torque rises, stays --for so long, falls and the axis is switched off; quick stop when it moves
    farther than --within. Stand at the hard-wired emergency stop; Ctrl-C supports and never replaces it.
    """
    if (torque is None) != (seconds is None):
        raise CommandError(
            "--torque and --for go together", f"write for example: cell move {robot} J2 --torque 50 --for 2"
        )

    def order(drives: RobotDrives, alone: bool) -> Command:
        if torque is not None and seconds is not None:
            return replace(press_of(drives, targets, torque, seconds, within), alone=alone)
        wanted = dict(target_of(drives, text) for text in targets)
        return MoveAxes(robot, wanted, by, speed / 100.0, velocity, alone)

    _run(robot, order, file, endpoint, without_manager)


def accept(
    robot: RobotArgument,
    axes: Annotated[
        list[str] | None, typer.Argument(metavar="[AXIS]...", help="These axes only.", show_default="all in doubt")
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Confirm that axes are where their drives show them, although they are not where they were switched off.

    Look at the robot first: `cell drives` says what was found. From then on the cell takes its body to be there.
    """
    with connect(file, endpoint) as operator:
        operator.check_robot(robot)
        gateway = operator.settings.robots[robot].gateway
        print(operator.ask_gateway(gateway, AcceptPosition(robot, tuple(axes or ()))).text)


def _axis(drives: RobotDrives, name: str) -> AxisSettings:
    for axis in drives.axes:
        if axis.name == name:
            return axis
    known = names([axis.name for axis in drives.axes])
    raise CommandError(f"robot {drives.robot} has no axis {name}; its axes are {known}")


def target_of(drives: RobotDrives, text: str) -> tuple[str, float]:
    """A word of the command line as an axis and its target [rad or m]. Raises `CommandError`."""
    name, _, value = text.partition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise CommandError(f"{text!r} is no target of an axis", "write for example J1=10, in degrees or mm")
    return name, number / 1000.0 if _axis(drives, name).linear else math.radians(number)


def press_of(drives: RobotDrives, targets: list[str], torque: float, seconds: float, within: float) -> PressAxis:
    """A torque [Nm or N] of the one axis that the command line names; `within` in degrees or mm."""
    if len(targets) != 1 or "=" in targets[0]:
        example = f"write for example: cell move {drives.robot} J2 --torque 50 --for 2"
        raise CommandError(f"--torque with {' '.join(targets)!r}; it takes one axis, without a value", example)
    axis = _axis(drives, targets[0])
    way = within / 1000.0 if axis.linear else math.radians(within)
    return PressAxis(drives.robot, axis.name, torque, seconds, way)


def clear(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Declare that a robot in set-up stands, because its gateway is silent: you have looked, and it stays so.

    From then on the other robots may move again. While the gateway is alive this is refused: it knows better.
    """
    with connect(file, endpoint) as operator:
        operator.check_robot(robot)
        report("manager", operator.ask_manager(ClearSetup(robot=robot, by=operator_name())))


def _begun(operator: Connection, gateway: str, robot: str, command: Command) -> Reply:
    """The gateway's answer that the motion begins; homing waits for its turn. Raises `CommandError`."""
    said = ""
    while True:
        before = _in_setup(operator)
        reply = operator.order_gateway(gateway, command)
        other = _in_setup(operator) or before
        if reply.ok or not isinstance(command, Home) or command.alone or other in ("", robot):
            break
        if other != said:
            said = other
            print(f"{robot}: waits: {other} is in set-up", flush=True)
        time.sleep(HOLD_PERIOD_S)
    if not reply.ok:
        raise CommandError(f"gateway {gateway} refuses: {reply.text}")
    return reply


def _in_setup(operator: Connection) -> str:
    """Which robot is in set-up, by the manager; empty: none."""
    manager = operator.view.look().manager
    return "" if manager is None or manager.setup is None else manager.setup.robot


def _run(
    robot: str,
    order: Callable[[RobotDrives, bool], Command],
    file: Path,
    endpoint: list[str] | None,
    alone: bool,
) -> None:
    stop = stop_event()
    settings = running_cell(file)
    check_robot(settings, file, robot)
    gateway = settings.robots[robot].gateway
    if alone and not endpoint:
        endpoint = [settings.gateways[gateway].endpoint]
    with connect(file, endpoint, stop) as operator:
        drives: RobotDrives = load_drives(settings.gateways[gateway].drives, gateway).robots[robot]
        command = order(drives, alone)
        operator.check_files(f"gateway {gateway}", operator.gateway_state(gateway).digest)
        begun = _begun(operator, gateway, robot, command)
        print(f"{robot}: {begun.text}", flush=True)
        said, state = "", "moving"
        while state == "moving":
            if stop.wait(HOLD_PERIOD_S):
                raise CommandError(f"{robot}: let go of; its drives stop and switch off")
            reply = operator.ask_gateway(gateway, HoldSetup(robot, begun.id))
            state = reply.data
            if reply.text != said:
                said = reply.text
                print(f"{robot}: {time.strftime('%H:%M:%S')} {said}", flush=True)
        if state != "done":
            raise CommandError(f"{robot}: {said}", "remove the cause, then: cell reset; and begin again")
