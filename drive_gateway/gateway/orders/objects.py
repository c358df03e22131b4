"""An operator's access to the object dictionaries of the nodes: reading always, writing only when it is safe."""

from collections.abc import Callable, Mapping, Sequence

from cell.messages import ReadObject, WriteObject
from drive_gateway.canopen.axis_objects import first_axis_index
from drive_gateway.canopen.drive_objects import (
    CONTROLWORD,
    INTERPOLATION_DATA,
    TARGET_POSITION,
    TARGET_TORQUE,
    TARGET_VELOCITY,
    TORQUE_OFFSET,
    VELOCITY_OFFSET,
)
from drive_gateway.canopen.sdo import Dialogue, SdoRead, SdoWrite
from drive_gateway.gateway.nodes.node import Node
from drive_gateway.gateway.robots.group import DriveGroup

_COMMANDED = {
    CONTROLWORD,
    TARGET_POSITION,
    TARGET_TORQUE,
    TARGET_VELOCITY,
    INTERPOLATION_DATA,
    TORQUE_OFFSET,
    VELOCITY_OFFSET,
}
"""What drives are told in each cycle, or at a motion of their own."""
_IDENTIFIERS = {0x1005, 0x1014, *range(0x1200, 0x1300)}
"""COB-IDs of SYNC, EMCY and SDO, which are those of CiA 301: a node with others would not be found any more."""

Told = Callable[[bool, str, str], None]
"""Takes whether it was done, what was done or found, and the bytes read in hex."""

_LONGEST = 16_384
"""Bytes; such a domain takes about 3 s in blocks, far less than an operator's call waits."""


class ObjectAccess:
    """Carries out `ReadObject` and `WriteObject` beside the cycle, one request per node at a time.

    What the gateway writes and reads back at boot is not for writing here: the drives file would not be true any more.
    """

    def __init__(self, nodes: Mapping[int, tuple[Node, Sequence[DriveGroup]]]) -> None:
        """`nodes`: each with the drives of the robots that it belongs to, by Node-ID."""
        self._nodes = nodes

    def obey(self, command: ReadObject | WriteObject, then: Told) -> None:
        """Do it, or say why not."""
        found = self._nodes.get(command.node_id)
        if found is None:
            known = ", ".join(str(number) for number in sorted(self._nodes))
            then(False, f"no node {command.node_id} on this bus; its nodes are {known}", "")
            return
        node, groups = found
        problem = _write_problem(command, node, groups) if isinstance(command, WriteObject) else ""
        if problem:
            then(False, problem, "")
            return
        node.sdo.follow(_access(node, command, then), asked=True)


def _access(node: Node, command: ReadObject | WriteObject, then: Told) -> Dialogue:
    address = command.index, command.sub
    name = f"{command.index:04X}h:{command.sub:02X} of {node.label}"
    if isinstance(command, WriteObject):
        outcome, done = (yield SdoWrite(*address, bytes.fromhex(command.data))), "is written"
    else:
        outcome, done = (yield SdoRead(*address)), "was read"
    then(not outcome.problem, f"{name}: {outcome.problem}" if outcome.problem else f"{name} {done}", outcome.data.hex())


def _write_problem(command: WriteObject, node: Node, groups: Sequence[DriveGroup]) -> str:
    try:
        length = len(bytes.fromhex(command.data))
    except ValueError:
        return f"{command.data!r} are no bytes in hex"
    if not 1 <= length <= _LONGEST:
        return f"{length} bytes; allowed are 1 to {_LONGEST}"
    name = f"{command.index:04X}h:{command.sub:02X} of {node.label}"
    if command.index in _IDENTIFIERS or first_axis_index(command.index) in _COMMANDED:
        return f"{name} is the gateway's, nobody else writes it"
    if (command.index, command.sub) in node.kept:
        return f"{name} is the gateway's; change it in the drives file"
    for group in groups:
        if group.standstill.switched_off:
            continue
        return f"{group.robot} is not at rest and switched off: {group.permits.said()}; disable it first"
    return ""
