"""What must hold for the I/O nodes of a drives file, and for the places of its outputs and named inputs."""

from collections.abc import Iterator, Mapping, Sequence

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.node_checks import HIGHEST_NODE_ID, NamedAxis
from drive_gateway.config.output_entry import InputEntry, OutputEntry

MOST_INPUTS = 64
"""Named inputs of one robot."""
_AXIS_BITS = 32


def check_io_nodes(document: Document, drives: DrivesFile, axes: Sequence[NamedAxis]) -> Iterator[Problem]:
    """Each on a Node-ID of its own, and with something to exchange."""
    taken = {axis.node + axis.axis - 1: who for _, who, axis in reversed(axes)}
    for name, io in drives.io_nodes.items():
        path: KeyPath = ("io_nodes", name)
        if io.node == drives.gateway_node:
            found = f"{io.node}, under which the gateway itself sends its heartbeat"
            allowed = f"1 to {HIGHEST_NODE_ID} but for gateway_node, {drives.gateway_node}"
            yield document.problem((*path, "node"), found, allowed)
        other = taken.setdefault(io.node, f"I/O node {name}")
        if other != f"I/O node {name}":
            yield document.problem((*path, "node"), f"{io.node}, that of {other} too", "a Node-ID of its own")
        if not io.input_bytes + io.output_bytes:
            found = "an I/O node with neither input_bytes nor output_bytes"
            yield document.problem(path, found, "one of them, or both", at_key=True)


def check_places(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    """Every output and every named input has one place that is there; every output has it alone."""
    seen: dict[tuple[str, str, int], str] = {}
    for robot, entry in drives.robots.items():
        if len(entry.inputs) > MOST_INPUTS:
            found = f"{len(entry.inputs)} inputs"
            yield document.problem(("robots", robot, "inputs"), found, f"up to {MOST_INPUTS}", at_key=True)
        yield from _places(document, drives, robot, "inputs", entry.inputs)
        yield from _places(document, drives, robot, "outputs", entry.outputs)
        for name, output in entry.outputs.items():
            place = (output.io or "", "" if output.io else f"{robot}.{output.axis}", output.bit)
            who = f"{robot} {name}"
            other = seen.setdefault(place, who)
            if other != who:
                where = f"6200h of I/O node {output.io}" if output.io else f"60FEh of {output.axis}"
                other = other.removeprefix(f"{robot} ")
                path = ("robots", robot, "outputs", name, "bit")
                yield document.problem(path, f"{output.bit}, that of {other} too", f"each bit of {where} once")


def _places(
    document: Document, drives: DrivesFile, robot: str, kind: str, items: Mapping[str, OutputEntry | InputEntry]
) -> Iterator[Problem]:
    axes = drives.robots[robot].axes
    for name, item in items.items():
        path: KeyPath = ("robots", robot, kind, name)
        if (item.axis is None) == (item.io is None):
            found = "neither axis nor io" if item.axis is None else "axis and io"
            allowed = "one of them: `axis`, an axis of this robot, or `io`, an I/O node"
            yield document.problem(path, found, allowed, at_key=True)
        elif item.axis is not None and item.axis not in axes:
            allowed = f"an axis of {robot}: {', '.join(axes)}"
            yield document.problem((*path, "axis"), repr(item.axis), allowed)
        elif item.axis is not None and item.bit >= _AXIS_BITS:
            yield document.problem((*path, "bit"), str(item.bit), f"{_AXIS_BITS - 1} or less at an axis")
        elif item.io is not None and item.io not in drives.io_nodes:
            known = ", ".join(drives.io_nodes)
            allowed = f"an I/O node of this file: {known}" if known else "none: the file has no io_nodes"
            yield document.problem((*path, "io"), repr(item.io), allowed)
        elif item.io is not None:
            io = drives.io_nodes[item.io]
            count = io.output_bytes if kind == "outputs" else io.input_bytes
            if item.bit >= 8 * count:
                key = f"{kind.removesuffix('s')}_bytes"
                limit = f"{8 * count - 1} or less: " if count else "none: "
                allowed = f"{limit}{item.io} has {key}: {count}"
                yield document.problem((*path, "bit"), str(item.bit), allowed)
