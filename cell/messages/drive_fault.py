"""The call that lets a simulated drive fail; real drives are never asked."""

from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

from cell.messages.call import Command, command
from cell.messages.common import Count, Number, Whole


class Fault(StrEnum):
    """What a simulated drive can be told to suffer from."""

    EMERGENCY = "emcy"
    """It finds an error; `value` is its code. The cause is gone when it is reset."""
    DROP_OUT = "drop-out"
    """Its cable is out."""
    ENCODER_JUMP = "encoder-jump"
    """Its encoder reads wrong by `value` counts."""
    BLOCKED = "blocked"
    """Something holds the axis with more than its motor can give."""
    HOT_MOTOR = "hot-motor"
    STUCK_BRAKE = "stuck-brake"
    """The holding brake does not open."""
    LATE_TPDOS = "late-tpdos"
    """What SYNC asks for is sent `value` ms late."""


NEEDS_VALUE = (Fault.EMERGENCY, Fault.ENCODER_JUMP, Fault.LATE_TPDOS)
"""The others have none."""
LONGEST_S = 3600.0


@command("gateway")
@dataclass(frozen=True, slots=True)
class FaultDrive(Command):
    """Let a simulated drive fail, for `seconds`, or, without them, until its process is started again.

    `axis` is the number of the axis in its node; a drop-out and late TPDOs concern all of a node.
    """

    verb: ClassVar[str] = "fault_drive"
    node_id: Count
    axis: Count
    fault: Fault
    value: Whole | None = None
    seconds: Number | None = None
