"""Process data for motions that drives make by themselves, mapped as the drives file says.

They take the PDOs 1 to 3 of a node. RPDOs act on arrival, TPDOs come by the drive's timer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from struct import Struct

from drive_gateway.canopen.axis_objects import first_axis_index
from drive_gateway.canopen.drive_objects import CONTROLWORD, END_VELOCITY, TARGET_POSITION, TARGET_VELOCITY
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.pdo_map import ON_EVENT, Pdo, entries_of

COMMANDS = {CONTROLWORD: (16, "H"), TARGET_POSITION: (32, "i"), END_VELOCITY: (32, "I"), TARGET_VELOCITY: (32, "i")}
"""What RPDOs may carry: bits and format of each object (sub-index 0)."""
NEEDED = (CONTROLWORD, TARGET_POSITION, TARGET_VELOCITY)
"""What the RPDOs must carry between them."""
MOST_BITS = 64

Entries = tuple[int, ...]
"""Mapping entries of one PDO: index << 16 | sub-index << 8 | bits."""


@dataclass(frozen=True, slots=True)
class ProfilePdos:
    """What RPDO1 and TPDO1 and those that follow carry, the same on every node; an empty one is not used."""

    period_s: float
    """Period of the TPDOs, and of RPDOs whose content does not change."""
    rpdos: tuple[Entries, ...]
    tpdos: tuple[Entries, ...]

    def of(self, node_id: int, axis: int = 1) -> tuple[Pdo, ...]:
        """The PDOs of one axis of a node; objects outside the profile are the same for all its axes."""
        return tuple(
            Pdo(number, receive, node_id, entries_of(entries, axis), ON_EVENT, self.period_s, axis)
            for receive, mapped in ((True, self.rpdos), (False, self.tpdos))
            for number, entries in enumerate(mapped, start=1)
            if entries
        )


def bits_of(entries: Sequence[int]) -> int:
    """Bits of one PDO's content."""
    return sum(entry & 0xFF for entry in entries)


def object_of(entry: int) -> int:
    """Index of a mapping entry."""
    return entry >> 16


class ProfileSender:
    """The RPDOs to one node: each when its content changes, and every period; the controlword after what it starts.

    Args:
        pdos: of the node, for its own motions.
    """

    def __init__(self, pdos: Sequence[Pdo]) -> None:
        received = [(pdo, [first_axis_index(object_of(entry)) for entry in pdo.entries]) for pdo in pdos if pdo.receive]
        received.sort(key=lambda item: CONTROLWORD in item[1])
        self._pdos = [
            (pdo, indices, Struct("<" + "".join(COMMANDS[index][1] for index in indices))) for pdo, indices in received
        ]
        self._sent: dict[int, tuple[bytes, float]] = {}

    def frames(self, values: Mapping[int, int], now: float) -> list[CanFrame]:
        """What is due; `values` are the objects' by index, and 0 for others."""
        due = []
        for pdo, indices, layout in self._pdos:
            data = layout.pack(*[values.get(index, 0) for index in indices])
            before, at = self._sent.get(pdo.number, (b"", 0.0))
            if data != before or now - at >= pdo.period_s:
                self._sent[pdo.number] = (data, now)
                due.append(CanFrame(pdo.cob_id, data))
        return due
