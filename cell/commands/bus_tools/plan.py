"""`drive-gateway plan` and `check`: what a drives file means for its nodes, without a bus."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.bus_tools.place import BusPlace, io_eds, meant_node
from cell.commands.errors import CommandError
from cell.config.problem import refuses
from drive_gateway.canopen.eds import Eds
from drive_gateway.canopen.io_map import IoImage
from drive_gateway.canopen.pdo_map import ProcessImage
from drive_gateway.cia402.preparation import interpolation_period
from drive_gateway.config import AxisSettings, GatewaySettings
from drive_gateway.config.bus_load import bus_load
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.image import image_of, io_image_of
from drive_gateway.config.known_drive import eds_of, known_drive
from drive_gateway.config.load import read_drives
from drive_gateway.gateway.nodes.program import Step, boot_plan, io_boot_plan
from drive_gateway.sim.config.load import read_simulation

CIA_301 = {
    0x1005: "COB-ID SYNC message",
    0x1006: "Communication cycle period",
    0x1019: "Synchronous counter overflow value",
}
"""Names of objects that the gateway asks every node for, whether its EDS has them or not."""


def plan(
    place: BusPlace,
    node: Annotated[
        str | None, typer.Argument(metavar="NODE", help="Node-ID, or ROBOT.AXIS; every node without it.")
    ] = None,
) -> None:
    """Show what the gateway would write to its nodes when it starts, object by object; no bus is opened.

    `write` is written; `check` is read and must show this value, or the node is not brought up; `write, check` is both.
    """
    if place.drives is None:
        raise CommandError("no drives file is named", "name one, or a cell file and a gateway", 2)
    wanted = None if node is None else meant_node(place, node).id
    nodes = place.node_ids
    if wanted is not None and wanted not in nodes:
        raise CommandError(f"node {wanted} is not in the drives file", f"its nodes are {', '.join(map(str, nodes))}")
    for number in nodes:
        if wanted in (None, number):
            print(f"{place.label(number)}: NMT reset communication, and after its boot-up:")
            for line in _lines(*_steps(place, place.drives, number)):
                print(f"  {line}")
            print("  NMT start")


def _steps(place: BusPlace, settings: GatewaySettings, node_id: int) -> tuple[list[Step], Eds]:
    """All requests to a node, and the names of its objects."""
    io = next((io for io in place.io_nodes if io.node_id == node_id), None)
    if io is not None:
        return io_boot_plan(io, settings), io_eds()
    mine: list[AxisSettings] = [axis for _, axis in place.axes if axis.node_id == node_id]
    axes = sorted(mine, key=lambda axis: axis.number)
    try:
        return boot_plan(axes, settings), eds_of(axes[0].eds, len(axes), axes[0].like)
    except ValueError as error:
        raise CommandError(str(error), "correct cycle_s in the drives file") from error


def _lines(steps: list[Step], eds: Eds) -> list[str]:
    lines, at = [], 0
    while at < len(steps):
        step, after = steps[at], steps[at + 1] if at + 1 < len(steps) else None
        both = step.data is not None and after is not None and _shows(after, step)
        lines.append(_line("write, check" if both else "write" if step.data is not None else "", step, eds))
        at += 2 if both else 1
    return lines


def _shows(check: Step, write: Step) -> bool:
    """It reads back what was written just before."""
    return check.data is None and (check.index, check.sub, check.shown) == (write.index, write.sub, write.data)


def _line(verb: str, step: Step, eds: Eds) -> str:
    entry = eds.find(f"{step.index:04X}:{step.sub:02X}")
    value = step.shown if step.data is None else step.data
    if not entry.described:
        # An EDS need not have what CiA 301 gives a node, and what the gateway sends says its own length.
        typed = entry.typed(0 if value is None else len(value), signed=False)
        entry = replace(typed, name=CIA_301.get(step.index, entry.name))
    shown = "" if value is None else f" = {entry.show(value)}"
    verb = verb or ("read" if value is None else "check")
    unless = "" if step.present is None or step.data is None else step.present.unless
    unless = unless or ("the node has no such object" if step.optional or step.waived else "")
    note = f"{step.what}, unless {unless}" if unless else step.what
    return f"{verb:12}  {entry.address}  {entry.name}{shown}  [{note}]"


def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The drives file.", show_default=False)],
) -> None:
    """Check a drives file alone, with the EDS and DCF files that it names and its simulation; no bus is opened.

    Prints all problems, one a line, as file:line:column: path: found ..., allowed ... and exits with 1; a good file is
    summed up. Whether it fits its robots says `cell check` of the cell.
    """
    if not file.is_file():
        raise CommandError(f"{file}: no such drives file")
    reading = read_drives(file.absolute())
    problems = list(reading.problems)
    if reading.content is not None and reading.document is not None:
        problems += read_simulation(reading.document.file, reading.content).problems
        try:
            interpolation_period(reading.content.cycle_s)
        except ValueError as error:
            found, _, allowed = str(error).partition(": allowed are ")
            problems.append(reading.document.problem(("cycle_s",), found, allowed))
    for problem in problems:
        print(problem)
    if reading.content is None or refuses(problems):
        raise typer.Exit(1)
    _sum_up(reading.content.settings(file.stem, file.absolute().parent))
    _tell_known_drives(reading.content)


def _sum_up(drives: GatewaySettings) -> None:
    axes = [axis for robot in drives.robots.values() for axis in robot.axes]
    images: list[ProcessImage | IoImage] = [*map(image_of, axes), *map(io_image_of, drives.io_nodes)]
    load = bus_load(images, drives.bus.bitrate, drives.cycle_s, drives.heartbeat_producer_s)
    bus = f"{drives.bus.interface} {drives.bus.channel}, {drives.bus.bitrate / 1000:g} kbit/s"
    nodes = len({axis.node_id for axis in axes})
    also = f", {len(drives.io_nodes)} I/O nodes" if drives.io_nodes else ""
    print(f"{drives.name} is good: {bus}, {nodes} nodes, {len(axes)} axes{also}, cycle {1000 * drives.cycle_s:g} ms")
    print(f"bus load {100 * load.total:.0f} %: worst case of the cyclic frames, and 10 % for SDO and EMCY")
    for name, robot in drives.robots.items():
        listed = ", ".join(f"{axis.name} {axis.node_id}" for axis in robot.axes)
        print(f"robot {name}, axes and their nodes: {listed}")


def _tell_known_drives(drives: DrivesFile) -> None:
    """Each kind that axes are like, with its facts and where they come from."""
    axes = [(f"{robot}.{name}", axis) for robot, entry in drives.robots.items() for name, axis in entry.axes.items()]
    for like in dict.fromkeys(axis.like for _, axis in axes if axis.like is not None):
        named = ", ".join(name for name, axis in axes if axis.like == like)
        print(f"like {like}: {named}; keys of the file go before")
        for fact in known_drive(like).facts():
            print(f"  {fact}")
