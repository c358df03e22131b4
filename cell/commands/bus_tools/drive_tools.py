"""`drive-gateway scan`, `read`, `write`, `store`, `log`: an operator's tools for one CAN bus."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.bus_tools.node_access import (
    BusLine,
    drives_of,
    node_access,
    refuse_virtual,
    running_gateway,
)
from cell.commands.client.cell_view import names
from cell.commands.errors import CommandError
from cell.commands.options import CellFileArgument
from cell.commands.processes.stop import stop_event
from cell.config import ConfigError, load_cell_alone
from cell.messages import RecordBus, ScanBus
from drive_gateway.canopen.cob_id import MASTER_NODE_ID
from drive_gateway.canopen.eds import Eds, ObjectEntry
from drive_gateway.canopen.io_map import DIGITAL_INPUTS, DIGITAL_OUTPUTS, ERROR_MODE, ERROR_VALUE, IO_EDS
from drive_gateway.canopen.sdo import SAVE, STORE_PARAMETERS
from drive_gateway.config import AxisSettings, GatewaySettings, load_drives
from drive_gateway.gateway.bus.recorder import FORMATS, LONGEST_S, Recorder

GatewayArgument = Annotated[str, typer.Argument(metavar="GATEWAY", help="Name of the gateway in the cell file.")]
NodeArgument = Annotated[
    str, typer.Argument(metavar="NODE", help="Node-ID, ROBOT.AXIS such as left.J1, or an I/O node.")
]
_DEVICE_TYPE, _IDENTITY = 0x1000, 0x1018


def scan(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The cell file, or a drives file.", show_default=False)],
    gateway: Annotated[
        str | None, typer.Argument(metavar="[GATEWAY]", help="Gateway of the cell file; none for a drives file.")
    ] = None,
) -> None:
    """Show every node on a bus, also those that no file names.

    A running gateway is asked: it knows the state of its drives, and the device type of other nodes. Where none runs
    the bus is opened here, and every node tells its device type, vendor, product and serial number.
    """
    if gateway is None:
        if not file.is_file():
            raise CommandError(f"{file}: no such drives file", "name a drives file, or a cell file and a gateway")
        drives = _drives_alone(file)
        if drives.bus.interface == "virtual":
            raise CommandError(
                f"the bus {drives.bus.channel} is virtual: it lives in its gateway's process",
                "name the cell file and the gateway, so that the gateway is asked",
            )
        _scan_bus(drives)
        return
    with running_gateway(file, gateway) as line:
        if line is not None:
            print(line.ask(ScanBus()).text)
            return
    drives = drives_of(file, gateway)
    refuse_virtual(drives, file)
    _scan_bus(drives)


def _drives_alone(file: Path) -> GatewaySettings:
    """A drives file that no cell file names. Raises `CommandError` for a cell file, `ConfigError` for its problems."""
    try:
        return load_drives(file, file.stem)
    except ConfigError:
        try:
            gateways = load_cell_alone(file).gateways
        except ConfigError:
            pass
        else:
            raise CommandError(f"{file} is a cell file: name one of its gateways, too: {names(gateways)}") from None
        raise


def _scan_bus(drives: GatewaySettings) -> None:
    named: dict[int, str] = {}
    for name, axis in ((name, axis) for name, robot in drives.robots.items() for axis in robot.axes):
        before = named.get(axis.node_id)
        named[axis.node_id] = f"{name} {axis.name}" if before is None else f"{before}, {axis.name}"
    named |= {io.node_id: f"I/O {io.name}" for io in drives.io_nodes}
    everyone = list(range(1, MASTER_NODE_ID))
    with BusLine(drives, everyone) as bus:
        found = {node: outcome for node, outcome in bus.probe(everyone, _DEVICE_TYPE, 0).items() if not outcome.problem}
        for node in sorted(found):
            identity = [_number(bus, node, sub) for sub in (1, 2, 4)]
            texts = [f"{label} {value}" for label, value in zip(("vendor", "product", "serial"), identity, strict=True)]
            who = named.get(node, "not in the drives file")
            print(f"node {node} ({who}): device type {found[node].data[::-1].hex().upper()}h, {', '.join(texts)}")
        silent = [f"{node} ({who})" for node, who in named.items() if node not in found]
    if silent:
        raise CommandError(f"no answer from node {', '.join(silent)}", "check power, wiring, bit rate and Node-ID")


def _number(bus: BusLine, node: int, sub: int) -> str:
    try:
        return bus.read(node, _IDENTITY, sub)[::-1].hex().upper() + "h"
    except CommandError:
        return "unknown"


def read(
    file: CellFileArgument,
    gateway: GatewayArgument,
    node: NodeArgument,
    item: Annotated[
        str | None,
        typer.Argument(metavar="[INDEX:SUB]", help="In hex, such as 6041:00, or the object's name. [default: all]"),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write the bytes of that object to this file.")
    ] = None,
) -> None:
    """Read an object of a node, or all parameters that its EDS names but domains; always allowed."""
    named = named_node(drives_of(file, gateway), node)
    eds = named.eds
    if output is not None:
        if item is None:
            raise CommandError("--output takes the bytes of one object", "name it by INDEX:SUB, such as 1021:00")
        _read_to_file(file, gateway, named.node_id, eds.find(item, named.axis), output)
        return
    wanted = named.readable if item is None else [eds.find(item, named.axis)]
    with node_access(file, gateway) as nodes:
        for entry in wanted:
            try:
                value = entry.show(nodes.read(named.node_id, entry.index, entry.sub))
            except CommandError as error:
                if item is not None:
                    raise
                value = error.what
            print(f"{entry.address}  {entry.name}: {value}")


def _read_to_file(file: Path, gateway: str, node_id: int, entry: ObjectEntry, output: Path) -> None:
    with node_access(file, gateway) as nodes:
        data = nodes.read(node_id, entry.index, entry.sub)
    try:
        output.write_bytes(data)
    except OSError as error:
        raise CommandError(f"{output} cannot be written: {error}", "name a file in a folder that exists") from error
    print(f"{output} holds {len(data)} bytes of {entry.address}  {entry.name}")


def write(
    file: CellFileArgument,
    gateway: GatewayArgument,
    node: NodeArgument,
    item: Annotated[str, typer.Argument(metavar="INDEX:SUB", help="In hex, such as 6081:00, or the object's name.")],
    value: Annotated[
        str, typer.Argument(metavar="VALUE", help="Decimal, 0x... or ...h; a text for a text; @FILE for a domain.")
    ],
) -> None:
    """Write an object of a node; only while its robot is at rest and switched off.

    What the gateway itself writes at boot is refused: the drives file says it. A value below zero needs `--` before it.
    """
    named = named_node(drives_of(file, gateway), node)
    entry = named.eds.find(item, named.axis)
    if not entry.writable:
        raise CommandError(f"{entry.address} {entry.name} is read-only")
    data = _file_bytes(value[1:]) if entry.domain and value.startswith("@") else entry.pack(value)
    with node_access(file, gateway) as nodes:
        nodes.write(named.node_id, entry.index, entry.sub, data)
        shown = entry.show(nodes.read(named.node_id, entry.index, entry.sub)) if entry.readable else "is written"
        print(f"{entry.address}  {entry.name}: {shown}")


def _file_bytes(name: str) -> bytes:
    try:
        return Path(name).read_bytes()
    except OSError as error:
        raise CommandError(f"{name} cannot be read: {error}", "name the file with the object's bytes") from error


def store(file: CellFileArgument, gateway: GatewayArgument, node: NodeArgument) -> None:
    """Let a drive keep its parameters over the end of its supply (1010h); only while its robot is switched off.

    What the gateway writes at each boot needs no storing. What was set with `write` or the maker's own tool does.
    """
    node_id = named_node(drives_of(file, gateway), node).node_id
    with node_access(file, gateway) as nodes:
        nodes.write(node_id, STORE_PARAMETERS, 1, SAVE)
    print(f"node {node_id} has stored its parameters")


def log(
    file: CellFileArgument,
    gateway: GatewayArgument,
    target: Annotated[
        Path, typer.Argument(metavar="LOG", help=f"File to write: {', '.join(FORMATS)} (candump, ASC, BLF).")
    ],
    seconds: Annotated[float, typer.Option("--seconds", "-s", min=0.1, max=LONGEST_S, help="How long.")] = 10.0,
) -> None:
    """Write all frames of a bus to a file, for python-can, candump tools or CANalyzer.

    A virtual bus is recorded by its gateway's process; any other is opened here, for listening only.
    """
    drives = drives_of(file, gateway)
    if target.suffix not in FORMATS:
        raise CommandError(f"{target}: unknown format", f"use one of the suffixes {', '.join(FORMATS)}")
    if drives.bus.interface == "virtual":
        with running_gateway(file, gateway) as line:
            if line is None:
                refuse_virtual(drives, file)
            else:
                print(line.ask(RecordBus(str(target.absolute()), seconds)).text)
        return
    stop = stop_event()
    with Recorder(drives.bus, target) as recorder:
        print(f"recording {drives.bus.interface} {drives.bus.channel} for {seconds:g} s; Ctrl-C ends it", flush=True)
        frames = recorder.run(seconds, stop)
    print(f"{target} holds {frames} frames")


@dataclass(frozen=True, slots=True)
class NamedNode:
    """A node that was named, and which of its axes."""

    node_id: int
    axis: int
    """1 at an I/O node."""
    eds: Eds
    """Its objects, with those of all its axes."""
    longest: Mapping[int, int] = field(default_factory=dict)
    """Highest sub-index of objects that the EDS shows longer than the node has them."""

    @property
    def readable(self) -> list[ObjectEntry]:
        """All its parameters but domains."""
        entries = [entry for entry in self.eds if entry.readable and not entry.domain]
        return [entry for entry in entries if entry.sub <= self.longest.get(entry.index, entry.sub)]


def named_node(drives: GatewaySettings, node: str) -> NamedNode:
    """What `ROBOT.AXIS`, a Node-ID or the name of an I/O node means. Raises `CommandError` with all that there are."""
    io = next((io for io in drives.io_nodes if node in (io.name, str(io.node_id))), None)
    if io is not None:
        longest = {DIGITAL_INPUTS: io.input_bytes}
        longest |= dict.fromkeys((DIGITAL_OUTPUTS, ERROR_MODE, ERROR_VALUE), io.output_bytes)
        return NamedNode(io.node_id, 1, Eds(str(files("drive_gateway.sim").joinpath(IO_EDS))), longest)
    axis = _named_axis(drives, node)
    axes = sum(other.node_id == axis.node_id for robot in drives.robots.values() for other in robot.axes)
    return NamedNode(axis.node_id, axis.number, Eds(axis.eds, axes))


def _named_axis(drives: GatewaySettings, node: str) -> AxisSettings:
    """The axis that `ROBOT.AXIS` means, the first one of a Node-ID."""
    axes = [(f"{name}.{axis.name}", axis) for name, robot in drives.robots.items() for axis in robot.axes]
    for label, axis in axes:
        if node == label or (node == str(axis.node_id) and axis.number == 1):
            return axis
    known = ", ".join(f"{axis.node_id} ({label})" for label, axis in axes)
    known += "".join(f", {io.node_id} (I/O {io.name})" for io in drives.io_nodes)
    raise CommandError(f"no node {node!r} on the bus of gateway {drives.name}; its nodes are {known}")
