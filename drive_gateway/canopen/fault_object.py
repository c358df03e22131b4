"""The object by which a simulated drive is told to fail: 2020h of axis 1, 2820h and 3020h of further axes.

It is the maker's own, so a real drive has none or another one there. Whoever orders a fault reads the mark first.
"""

from cell.messages.drive_fault import Fault
from drive_gateway.canopen.axis_objects import AXIS_SPAN

FIRST_INDEX = 0x2020
MARK_SUB = 1
MARK = 0x6D69737A.to_bytes(4, "little")
"""What a simulated drive of this project shows at its sub-index 1."""
DURATION_SUB = 2
"""UNSIGNED32 [ms]: how long the next fault lasts; 0: it stays. It is 0 again afterwards."""
DURATION_BYTES = 4
FAULT_SUBS: dict[Fault, tuple[int, int]] = {
    Fault.EMERGENCY: (3, 2),
    Fault.DROP_OUT: (4, 1),
    Fault.ENCODER_JUMP: (5, 4),
    Fault.BLOCKED: (6, 1),
    Fault.HOT_MOTOR: (7, 1),
    Fault.STUCK_BRAKE: (8, 1),
    Fault.LATE_TPDOS: (9, 2),
}
"""Sub-index and bytes. What is written there begins: `FaultDrive.value`, 1 where a fault has none; 0 ends a fault."""


def fault_index(axis: int) -> int:
    """Where axis 1 to 3 of a node has the object."""
    return FIRST_INDEX + AXIS_SPAN * (axis - 1)
