"""`drive-gateway compare`: the values of a DCF beside those that a drive has."""

from pathlib import Path
from typing import Annotated

import typer

from cell.commands.bus_tools.bus_line import NodeSilent
from cell.commands.bus_tools.node_access import node_access
from cell.commands.bus_tools.place import BusPlace, NodeArgument, meant_node
from cell.commands.errors import CommandError
from drive_gateway.canopen.eds_file import is_dcf
from drive_gateway.config.gateway_objects import said_by


def compare(
    place: BusPlace,
    node: NodeArgument,
    dcf: Annotated[
        Path | None, typer.Option("--dcf", metavar="FILE", help="The DCF, instead of the `eds` of the axis.")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Show objects that are the same, too.")] = False,
) -> None:
    """Compare the ParameterValues of a DCF with what a node holds; nothing is written.

    One line for each object that differs: address, name, value of the file, value of the drive. Objects that the
    gateway writes itself are marked: there the drives file counts, not the DCF. The exit code is 1 when one differs.
    """
    meant = meant_node(place, node, dcf)
    file = str(dcf) if dcf is not None else "" if meant.settings is None else meant.settings.eds
    if not is_dcf(file):
        named = f"{file} is no DCF" if file else "no DCF is named"
        raise CommandError(named, "name one with --dcf, its name ends with .dcf", 2)
    if meant.eds.node_id not in (None, meant.id):
        raise CommandError(f"{file} is for Node-ID {meant.eds.node_id}, not {meant.id}", "name the DCF of this node")
    wanted = [(entry, data) for entry, data in meant.eds.parameters(lambda _index, _sub: True) if entry.readable]
    if not wanted:
        raise CommandError(f"{file} says no value of an object that can be read and written")
    same = different = unread = 0
    with node_access(place, "compare") as nodes:
        for entry, data in wanted:
            try:
                found = nodes.read(meant.id, entry.index, entry.sub)
            except NodeSilent:
                raise
            except CommandError as error:
                unread += 1
                print(f"{entry.address}  {entry.name}: file {entry.show(data)}, drive: {error.what}")
                continue
            alike = _alike(data, found)
            same, different = same + alike, different + (not alike)
            if every or not alike:
                key = said_by(entry.index, entry.sub)
                mark = f"  [the gateway writes it: {key}]" if key else ""
                sign = "=" if alike else "differs:"
                print(f"{entry.address}  {entry.name}: {sign} file {entry.show(data)}, drive {entry.show(found)}{mark}")
    print(f"{meant.label} and {Path(file).name}: {same} the same, {different} differ, {unread} cannot be read")
    if different or unread:
        raise typer.Exit(1)


def _alike(wanted: bytes, found: bytes) -> bool:
    """A node may show a value in another length than it was written in."""
    length = max(len(wanted), len(found))
    return bool(found or not wanted) and wanted.ljust(length, b"\0") == found.ljust(length, b"\0")
