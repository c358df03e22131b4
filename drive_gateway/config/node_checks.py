"""What must hold for the Node-IDs of a drives file, and for axes that share a node."""

from collections.abc import Iterator, Sequence

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from drive_gateway.config.axis_entry import AxisEntry

NamedAxis = tuple[KeyPath, str, AxisEntry]
"""An axis with its place in the file and its name for people, which begins with its robot's."""
HIGHEST_NODE_ID = 127


def check_nodes(document: Document, axes: Sequence[NamedAxis], own: int) -> Iterator[Problem]:
    """Each axis of a node once, none with the gateway's `own` Node-ID; what belongs to the node said alike by all its
    axes; no identifier twice."""
    seen: dict[tuple[int, int], str] = {}
    firsts: dict[int, NamedAxis] = {}
    for path, who, axis in axes:
        if axis.node == own:
            found = f"{axis.node}, under which the gateway itself sends its heartbeat"
            yield document.problem((*path, "node"), found, f"1 to {HIGHEST_NODE_ID} but for gateway_node, {own}")
        other = seen.setdefault((axis.node, axis.axis), who)
        first = firsts.setdefault(axis.node, (path, who, axis))
        if other != who:
            found = f"{axis.node}, axis {axis.axis}, those of {other} too"
            yield document.problem((*path, "node"), found, "each axis of a node once")
        elif first[1] != who:
            yield from _one_node(document, (path, who, axis), first)
    yield from _numbers(document, axes, seen)


def _one_node(document: Document, named: NamedAxis, first: NamedAxis) -> Iterator[Problem]:
    """A node stops, restarts and is looked for as one."""
    path, who, axis = named
    _, other, entry = first
    if who.partition(".")[0] != other.partition(".")[0]:
        yield document.problem((*path, "node"), f"{axis.node}, the node of {other} too", "axes of one robot on a node")
    for name in ("identity", "error_control", "eds", "like", "emergencies"):
        if getattr(axis, name) != getattr(entry, name):
            found = f"another {name} than that of {other}, on the same node"
            yield document.problem((*path, "node"), found, f"the same {name} at all axes of a node")
    if ("1016" in axis.waive) != ("1016" in entry.waive):
        found = f"1016h waived by one of {other} and {who}, on the same node"
        yield document.problem((*path, "node"), found, "an object of the node waived by all its axes or by none")


def _numbers(document: Document, axes: Sequence[NamedAxis], seen: dict[tuple[int, int], str]) -> Iterator[Problem]:
    """Axis 2 has the PDO identifiers of the next Node-ID, axis 3 those of the one after it."""
    for path, _, axis in axes:
        if axis.axis == 1:
            continue
        if (axis.node, axis.axis - 1) not in seen:
            found = f"axis {axis.axis} of node {axis.node} without its axis {axis.axis - 1}"
            yield document.problem((*path, "axis"), found, "the axes of a node from 1 on, none left out")
        taken = axis.node + axis.axis - 1
        other = next((name for (node, _), name in seen.items() if node == taken), None)
        if other is not None or taken > HIGHEST_NODE_ID:
            owner = f"of {other}" if other is not None else "beyond the highest"
            found = f"axis {axis.axis} of node {axis.node}, whose PDOs have the identifiers of Node-ID {taken}, {owner}"
            yield document.problem((*path, "axis"), found, "Node-IDs that leave room for all axes of each node")
