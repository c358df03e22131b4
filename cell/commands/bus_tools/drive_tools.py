"""`drive-gateway scan`, `read`, `write`, `store`, `restore`, `log`: an operator's tools for one CAN bus."""

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.bus_tools.bus_line import BusLine, NodeRefuses, NodeSilent
from cell.commands.bus_tools.node_access import gateways_way, node_access, running_gateway
from cell.commands.bus_tools.place import (
    BusPlace,
    EdsOption,
    MeantNode,
    NodeArgument,
    meant_node,
    number_text,
    refuse_virtual,
)
from cell.commands.errors import CommandError
from cell.commands.processes.stop import stop_event
from cell.messages import RecordBus, ScanBus
from drive_gateway.canopen.eds import TYPES, ObjectEntry
from drive_gateway.canopen.sdo import LOAD, RESTORE_DEFAULTS, SAVE, STORE_PARAMETERS
from drive_gateway.gateway.bus.recorder import FORMATS, LONGEST_S, Recorder

MayMoveOption = Annotated[
    bool,
    typer.Option("--may-move", help="Do it although something may move. Without effect where the gateway runs."),
]
_DEVICE_TYPE, _IDENTITY = 0x1000, 0x1018
_IDENTITY_PARTS = ("vendor", "product", "revision", "serial")


class Parameters(Enum):
    """Which parameters a command is about: sub-indices of 1010h and 1011h (CiA 301)."""

    ALL = "all"
    COMMUNICATION = "communication"
    APPLICATION = "application"

    @property
    def sub(self) -> int:
        return [*Parameters].index(self) + 1


ParametersOption = Annotated[Parameters, typer.Option("--parameters", "-p", help="Which of them.")]


def scan(place: BusPlace) -> None:
    """Show every node on a bus, also those that no file names.

    A running gateway is asked: it knows the state of its drives, and the device type of other nodes. Where none runs
    the bus is opened here, and every node tells its device type and its identity (1018h).
    """
    with running_gateway(place) as line:
        if line is not None:
            print(line.ask(ScanBus()).text)
            return
    refuse_virtual(place)
    with BusLine(place, gateways_way(place, "scan")) as bus:
        found = bus.answering()
        for node in found:
            print(f"{_who(place, node)}: {_described(bus, node)}")
        for node in sorted(bus.living - {*found}):
            print(f"{_who(place, node)}: has a heartbeat and answers no SDO; it may be stopped (`nmt`)")
            found.append(node)
    if not found:
        raise CommandError("no node answers", "check power, wiring, bit rate and termination")
    silent = [place.label(node) for node in sorted({*place.node_ids} - {*found})]
    if silent:
        raise CommandError(f"no answer from {', '.join(silent)}", "check power, wiring, bit rate and Node-ID")


def _who(place: BusPlace, node: int) -> str:
    named = place.drives is None or node in place.node_ids
    return place.label(node) if named else f"node {node} (not in the drives file)"


def _described(bus: BusLine, node: int) -> str:
    identity = [_number(bus, node, _IDENTITY, sub) for sub in (1, 2, 3, 4)]
    texts = [f"{label} {value}" for label, value in zip(_IDENTITY_PARTS, identity, strict=True)]
    return f"device type {_number(bus, node, _DEVICE_TYPE, 0)}, {', '.join(texts)}"


def _number(bus: BusLine, node: int, index: int, sub: int) -> str:
    try:
        return bus.read(node, index, sub)[::-1].hex().upper() + "h"
    except NodeRefuses:
        return "unknown"


def read(
    place: BusPlace,
    node: NodeArgument,
    item: Annotated[
        str | None,
        typer.Argument(metavar="INDEX:SUB", help="In hex, such as 6041:00, or the object's name; all without it."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write the bytes of that object to this file.")
    ] = None,
    eds: EdsOption = None,
) -> None:
    """Read an object of a node, or all parameters that its EDS names but domains; always allowed."""
    meant = meant_node(place, node, eds)
    if output is not None:
        if item is None:
            raise CommandError("--output takes the bytes of one object", "name it by INDEX:SUB, such as 1021:00", 2)
        _read_to_file(place, meant, meant.eds.find(item, meant.axis), output)
        return
    wanted = meant.readable if item is None else [meant.eds.find(item, meant.axis)]
    with node_access(place, "read") as nodes:
        for entry in wanted:
            try:
                value = entry.show(nodes.read(meant.id, entry.index, entry.sub))
            except NodeSilent:
                raise
            except CommandError as error:
                if item is not None:
                    raise
                value = error.what
            print(f"{entry.address}  {entry.name}: {value}")


def _read_to_file(place: BusPlace, meant: MeantNode, entry: ObjectEntry, output: Path) -> None:
    with node_access(place, "read") as nodes:
        data = nodes.read(meant.id, entry.index, entry.sub)
    try:
        output.write_bytes(data)
    except OSError as error:
        raise CommandError(f"{output} cannot be written: {error}", "name a file in a folder that exists") from error
    print(f"{output} holds {len(data)} bytes of {entry.address}  {entry.name}")


def write(
    place: BusPlace,
    node: NodeArgument,
    item: Annotated[str, typer.Argument(metavar="INDEX:SUB", help="In hex, such as 6081:00, or the object's name.")],
    value: Annotated[
        str,
        typer.Argument(
            metavar="VALUE",
            help="-5, 1.5, 0x... or ...h; a text for a text; 01 0A for octets; @FILE for its bytes.",
        ),
    ],
    kind: Annotated[
        str | None,
        typer.Option("--type", metavar="TYPE", help=f"Of an object that no EDS describes: {', '.join(TYPES)}."),
    ] = None,
    may_move: MayMoveOption = False,
    eds: EdsOption = None,
) -> None:
    """Write an object of a node, while it is without torque.

    A running gateway writes it when its robot is at rest and switched off, but not what it writes itself at boot, which
    the drives file says. Where none runs it is written here: while a drive of the node has its power stage on every
    write is refused, and always a controlword (6040h) that switches torque on, digital outputs (60FEh: they may open a
    brake) and objects of the profile of a node without a statusword. `--may-move` lets these through. Targets (607Ah,
    60FFh, 6071h) of a drive without torque are only numbers.
    """
    meant = meant_node(place, node, eds)
    value, entry = number_text(value), meant.eds.find(item, meant.axis)
    if not entry.writable:
        raise CommandError(f"{entry.address} {entry.name} is read-only")
    if kind is not None:
        entry = _typed(entry, kind.upper())
    from_file = value.startswith("@") and (entry.domain or not entry.described)
    data = _file_bytes(value[1:]) if from_file else entry.pack(value)
    with node_access(place, "write", may_move) as nodes:
        nodes.write(meant.id, entry.index, entry.sub, data)
        shown = entry.show(nodes.read(meant.id, entry.index, entry.sub)) if entry.readable else "is written"
        print(f"{entry.address}  {entry.name}: {shown}")


def _typed(entry: ObjectEntry, kind: str) -> ObjectEntry:
    if kind not in TYPES:
        raise CommandError(f"no data type {kind}", f"use one of {', '.join(TYPES)}", 2)
    if entry.described:
        raise CommandError(f"--type {kind} for {entry.address} {entry.name}, whose type is known", "leave it out", 2)
    return entry.typed(*TYPES[kind])


def _file_bytes(name: str) -> bytes:
    try:
        return Path(name).read_bytes()
    except OSError as error:
        raise CommandError(f"{name} cannot be read: {error}", "name the file with the object's bytes") from error


def store(
    place: BusPlace,
    node: NodeArgument,
    parameters: ParametersOption = Parameters.ALL,
    may_move: MayMoveOption = False,
) -> None:
    """Let a drive keep its parameters over the end of its supply (1010h); only while it is without torque.

    What the gateway writes at each boot needs no storing. What was set with `write` or the maker's own tool does.
    """
    meant = meant_node(place, node)
    with node_access(place, "store", may_move) as nodes:
        nodes.write(meant.id, STORE_PARAMETERS, parameters.sub, SAVE)
    print(f"node {meant.id} has stored its parameters ({parameters.value})")


def restore(
    place: BusPlace,
    node: NodeArgument,
    parameters: ParametersOption = Parameters.ALL,
    may_move: MayMoveOption = False,
) -> None:
    """Give a drive the parameters of its factory again (1011h); only while it is without torque.

    They hold from the node's next start on (`nmt NODE reset-node`, or its supply). All of them are: what the maker's
    tool has set, servo loops for example, is lost, and with some drives the Node-ID too.
    """
    meant = meant_node(place, node)
    with node_access(place, "restore", may_move) as nodes:
        nodes.write(meant.id, RESTORE_DEFAULTS, parameters.sub, LOAD)
    print(f"node {meant.id} restores its parameters ({parameters.value}) at its next start")


def log(
    place: BusPlace,
    target: Annotated[
        Path, typer.Argument(metavar="LOG", help=f"File to write: {', '.join(FORMATS)} (candump, ASC, BLF).")
    ],
    seconds: Annotated[float, typer.Option("--seconds", "-s", min=0.1, max=LONGEST_S, help="How long.")] = 10.0,
) -> None:
    """Write all frames of a bus to a file, for python-can, candump tools or CANalyzer.

    A virtual bus is recorded by its gateway's process, to a file of this name in `recordings` of its state folder; any
    other is opened here, for listening only.
    """
    if target.suffix not in FORMATS:
        raise CommandError(f"{target}: unknown format", f"use one of the suffixes {', '.join(FORMATS)}")
    if place.in_one_process:
        with running_gateway(place) as line:
            if line is not None:
                print(line.ask(RecordBus(target.name, seconds)).text)
                return
        refuse_virtual(place)
    stop = stop_event()
    with Recorder(place.bus, target) as recorder:
        print(f"recording {place.bus.interface} {place.bus.channel} for {seconds:g} s; Ctrl-C ends it", flush=True)
        frames = recorder.run(seconds, stop)
    print(f"{target} holds {frames} frames")
