"""`cell output`: the digital outputs of a robot's drives, listed, or one of them switched by hand or forced."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cell.commands.client.connection import Connection, connect
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError
from cell.commands.operator.robot_orders import Seen
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.messages import AxisStatus, ForceOutput, GatewayState, IoStatus, NodeStatus, SwitchOutput
from drive_gateway.config import RobotDrives, load_drives
from drive_gateway.config.settings import OutputSettings


def output(
    robot: RobotArgument,
    name: Annotated[
        str | None, typer.Argument(metavar="OUTPUT", help="Of the drives file.", show_default="list them all")
    ] = None,
    switch: Annotated[
        Seen | None,
        typer.Argument(metavar="on|off|follow", help="follow: ends a force.", show_default=False),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="For a test: stays so until follow, whatever the program says.")
    ] = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Switch a digital output of a robot's drives by hand; without its name list them all.

    Look first: a gripper that opens drops its part, one that closes pinches, also in a fault. Nothing else moves by
    this. Refused while the robot moves or its program runs, and where the output's node is not operational. The
    program's next SET DO or RESET DO switches it again. No safety function.

    With --force it is kept also while a program runs or the robot moves, until follow; a stop switches off what must be
    off then. `cell status` shows it.
    """
    if name is not None and switch is None:
        raise CommandError(f"on or off? Nothing was switched: {name!r}", f"cell output {robot} {name} on, or off")
    if force and switch in (None, Seen.FOLLOW):
        raise CommandError("--force needs on or off; nothing was switched", f"cell output {robot} OUTPUT on --force")
    with connect(file, endpoint) as operator:
        operator.check_robot(robot)
        gateway = operator.settings.robots[robot].gateway
        if name is None or switch is None:
            state = operator.gateway_state(gateway)
            operator.check_files(f"gateway {gateway}", state.digest)
            drives = load_drives(operator.settings.gateways[gateway].drives, gateway).robots[robot]
            _list(drives, state, str(operator.settings.gateways[gateway].drives))
        else:
            print(switched(operator, gateway, _order(robot, name, switch, force)))


def _order(robot: str, name: str, switch: Seen, force: bool) -> SwitchOutput | ForceOutput:
    if switch is Seen.FOLLOW:
        return ForceOutput(robot, name, None, operator_name())
    on = switch is Seen.ON
    return (ForceOutput if force else SwitchOutput)(robot, name, on, operator_name())


def switched(operator: Connection, gateway: str, order: SwitchOutput | ForceOutput) -> str:
    """What the gateway says when the drive shows it. Raises `CommandError` with what it says else."""
    reply = operator.order_gateway(gateway, order)
    if not reply.ok:
        raise CommandError(f"gateway {gateway}: {reply.text}")
    return reply.text


def _list(drives: RobotDrives, state: GatewayState, file: str) -> None:
    if drives.outputs:
        Console().print(outputs_table(drives, state))
    else:
        print(f"robot {drives.robot} has no digital outputs; its `outputs` in {file} would name them")


def outputs_table(drives: RobotDrives, state: GatewayState) -> Table:
    """One row per output: as it was told to its drive, what becomes of it at a stop, and where it is.

    What a silent drive does with its outputs nobody knows.
    """
    forced = state.forced.get(drives.robot, {})
    nodes = {node.axis: node for node in state.nodes if node.robot == drives.robot}
    io_nodes = {io.name: io for io in state.io_nodes}
    title = f"digital outputs of {drives.robot}"
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("output", "state", "at_stop", "axis", "node", "bit", "NMT", "drive"):
        table.add_column(heading, overflow="fold")
    for item in drives.outputs:
        found, where = _at_io(item, drives.robot, io_nodes) if item.io else _at_axis(item, nodes)
        number, nmt, drive = where
        at_stop = "keep" if item.keep else "off"
        carrier = f"I/O {item.io}" if item.io else item.axis
        found += f", forced by {forced[item.name]}" if item.name in forced else ""
        table.add_row(item.name, found, at_stop, carrier, number, str(item.bit), nmt, drive)
    return table


def _at_axis(item: OutputSettings, nodes: Mapping[str, NodeStatus]) -> tuple[str, tuple[str, str, str]]:
    """State of an output; Node-ID, NMT state and drive state of its node."""
    node = nodes.get(item.axis)
    if node is None or item.name not in node.outputs:
        return "unknown to its gateway", ("", "", "")
    told = "on" if node.outputs[item.name] else "off"
    found = "unknown" if node.drive is AxisStatus.SILENT else told
    return found, (str(node.node_id), node.nmt, node.drive.words)


def _at_io(item: OutputSettings, robot: str, io_nodes: Mapping[str, IoStatus]) -> tuple[str, tuple[str, str, str]]:
    """The same at an I/O node, which has no drive state."""
    io = io_nodes.get(item.io)
    if io is None or item.name not in io.outputs.get(robot, {}):
        return "unknown to its gateway", ("", "", "")
    told = "on" if io.outputs[robot][item.name] else "off"
    return told if io.operational else "unknown", (str(io.node_id), io.nmt, "")
