"""`cell simulate conveyor`, `sensor` and `input`: measurements and signals without a machine, to try what follows."""

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.cell_view import names
from cell.commands.client.connection import Connection, connect
from cell.commands.errors import CommandError
from cell.commands.operator.robot_orders import OnOff
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.commands.processes.stop import stop_event
from cell.config.settings import SensorFrame
from cell.messages import CellTime, ConveyorCount, Correction, ManagerState, SimulateInput
from cell.net.clock import ManagerClock

PERIOD_S = 0.02
_SILENT_S = 2.0
_COUNTER = 2**32
_AXES = ("X", "Y", "Z", "A", "B", "C")


def conveyor(
    name: Annotated[str, typer.Argument(metavar="CONVEYOR", help="Name of the conveyor in the cell file.")],
    speed: Annotated[float, typer.Option(min=-1e5, max=1e5, help="Of the belt, in mm/s; below 0 backwards.")] = 50.0,
    every: Annotated[
        float | None,
        typer.Option(min=1.0, max=1e6, metavar="MM", help="A part on the belt every so many mm; else none."),
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Be the encoder of a belt that runs at a constant speed, until Ctrl-C.

    Robots that follow a real belt must not hear this: it is for simulated cells.
    """
    with connect(file, endpoint) as operator:
        belts = operator.settings.conveyors
        if name not in belts:
            raise CommandError(f"no conveyor {name!r} in {file}; its conveyors are: {names(belts) or 'none'}")
        per_metre = belts[name].counts_per_metre
        typer.echo(f"conveyor {name} runs at {speed:g} mm/s until Ctrl-C")
        _measure(
            operator,
            lambda at, passed_s: ConveyorCount(name, at, *belt_counts(speed / 1000.0 * passed_s, per_metre, every)),
        )


def sensor(
    robot: RobotArgument,
    name: Annotated[str, typer.Argument(metavar="CORRECTION", help="Name of the correction in the cell file.")],
    offset: Annotated[list[str], typer.Argument(metavar="AXIS=VALUE...", help="X, Y, Z in mm, A, B, C in deg.")],
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Be a sensor that measures a constant offset, until Ctrl-C; A, B, C are a rotation vector.

    Robots that follow a real sensor must not hear this: it is for simulated cells.
    """
    values = sensor_offset(offset)
    with connect(file, endpoint) as operator:
        operator.check_robot(robot)
        known = operator.settings.robots[robot].corrections
        if name not in known or not isinstance(known[name].sensor, SensorFrame):
            sensors = names(each for each, entry in known.items() if entry.sensor is not None)
            raise CommandError(f"no sensor {name!r} of robot {robot} in {file}; its sensors are: {sensors or 'none'}")
        typer.echo(f"sensor {name} measures {' '.join(offset)} for {robot} until Ctrl-C")
        x, y, z, a, b, c = values
        _measure(operator, lambda at, _: Correction(robot, name, at, (x, y, z), (a, b, c)))


def input_(
    robot: RobotArgument,
    name: Annotated[str, typer.Argument(metavar="INPUT", help="Of the drives file.")],
    switch: Annotated[OnOff, typer.Argument(metavar="on|off", help="on closes it, off opens it.")],
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Set a named digital input of a simulated drive or I/O node; it stays so until it is set again or started anew.

    The running gateway orders it over the bus; devices that are real are never written.
    """
    with connect(file, endpoint) as operator:
        operator.check_robot(robot)
        gateway = operator.settings.robots[robot].gateway
        reply = operator.order_gateway(gateway, SimulateInput(robot, name, switch is OnOff.ON))
        if not reply.ok:
            raise CommandError(f"gateway {gateway}: {reply.text}")
        typer.echo(reply.text)


def sensor_offset(words: list[str]) -> tuple[float, ...]:
    """X, Y, Z [m], A, B, C [rad] from an operator's words. Raises `CommandError`."""
    found = dict.fromkeys(_AXES, 0.0)
    for word in words:
        axis, _, text = word.partition("=")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if axis not in found or not math.isfinite(value):
            raise CommandError(f"{word!r} found, allowed is AXIS=VALUE with one of {', '.join(_AXES)}, as in Z=5")
        found[axis] = value / 1000.0 if axis in _AXES[:3] else math.radians(value)
    return tuple(found.values())


def belt_counts(way_m: float, counts_per_metre: float, every_mm: float | None) -> tuple[int, int | None]:
    """What the 32-bit counter of a belt shows that has run `way_m` [m], and what it did when the newest part passed."""
    part = None
    if every_mm is not None and abs(way_m) >= every_mm / 1000.0:
        passed_m = math.copysign(math.floor(1000.0 * abs(way_m) / every_mm) * every_mm / 1000.0, way_m)
        part = round(passed_m * counts_per_metre) % _COUNTER
    return round(way_m * counts_per_metre) % _COUNTER, part


def _measure(operator: Connection, message: Callable[[CellTime, float], object]) -> None:
    """Publish what `message` says of a moment and of the seconds since the start, until Ctrl-C."""
    stop, clock, states = stop_event(), ManagerClock(), operator.session.watch("manager/state")
    begun = heard_at = time.monotonic()
    while not stop.wait(PERIOD_S):
        for arrived in states.take_arrived():
            if isinstance(arrived.message, ManagerState):
                clock.heard(arrived.message, arrived.at)
                heard_at = arrived.at
        now = time.monotonic()
        if now - heard_at > _SILENT_S:
            raise CommandError("the manager is silent, and measurements are stamped with its clock")
        if (moment := clock.moment(now)) is not None:
            operator.session.publish(message(moment, now - begun))
