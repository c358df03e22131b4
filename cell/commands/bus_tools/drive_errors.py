"""`drive-gateway errors`: what a node remembers of its errors (CiA 301)."""

from typing import Annotated

import typer

from cell.commands.bus_tools.bus_line import NodeRefuses
from cell.commands.bus_tools.drive_tools import MayMoveOption
from cell.commands.bus_tools.node_access import NodeAccess, node_access
from cell.commands.bus_tools.place import BusPlace, NodeArgument, meant_node
from cell.commands.errors import CommandError
from drive_gateway.canopen.emcy import emergency_of

_REGISTER, _HISTORY = 0x1001, 0x1003
_REGISTER_BITS = ("generic", "current", "voltage", "temperature", "communication", "profile", "reserved", "maker's own")
"""Of the error register (CiA 301), bit 0 first."""


def errors(
    place: BusPlace,
    node: NodeArgument,
    clear: Annotated[bool, typer.Option("--clear", help="Then delete the history; no fault is reset by it.")] = False,
    may_move: MayMoveOption = False,
) -> None:
    """Show the error register (1001h) and the error history (1003h) of a node, newest first, with what codes mean.

    Meanings are those of the drives file (`emergencies`), then of CiA 301 and CiA 402. The upper half of an entry is
    the maker's. `--clear` writes 0 to 1003h:00, while the node is without torque.
    """
    meant = meant_node(place, node)
    own = meant.emergencies
    with node_access(place, "errors", may_move) as nodes:
        register = _number(nodes.read(meant.id, _REGISTER, 0))
        bits = [name for bit, name in enumerate(_REGISTER_BITS) if register >> bit & 1]
        print(f"{meant.label}: error register {register:02X}h ({', '.join(bits) or 'no error'})")
        for sub in range(1, _length(nodes, meant.id) + 1):
            entry = _number(nodes.read(meant.id, _HISTORY, sub))
            found = emergency_of(entry & 0xFFFF, register, own)
            remedy = f"; {found.remedy}" if found.remedy else ""
            print(f"{sub:3}  {found.code:04X}h  maker's {entry >> 16:04X}h  {found.meaning}{remedy}")
        if clear:
            nodes.write(meant.id, _HISTORY, 0, b"\0")
            print("the history is deleted")


def _length(nodes: NodeAccess, node_id: int) -> int:
    try:
        count = _number(nodes.read(node_id, _HISTORY, 0))
    except NodeRefuses as error:
        raise CommandError(f"the node keeps no error history: {error.what}") from error
    if not count:
        print("its history is empty")
    return count


def _number(data: bytes) -> int:
    return int.from_bytes(data, "little")
