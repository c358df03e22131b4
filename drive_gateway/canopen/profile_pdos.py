"""Process data for motions that drives make by themselves, mapped as the drives file says.

They take the PDOs 1 to 3 of a node; the cyclic image (`pdo_map`) then is its PDO 4. RPDOs act on arrival. TPDOs come by
the drive's timer (type FEh): the period is written as event timer and as inhibit time, so that a drive that sends on
change sends no more often, and one that takes its period from the inhibit time (FESTO CMMP) sends as often.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from struct import Struct

from drive_gateway.canopen.bus_load import frame_bits
from drive_gateway.canopen.cob_id import PDO_STEP, RPDO1, TPDO1
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.pdo_map import CONTROLWORD, DISABLED, TARGET_POSITION, SdoWrite, little

TARGET_VELOCITY = 0x60FF
END_VELOCITY = 0x6082
COMMANDS = {CONTROLWORD: (16, "H"), TARGET_POSITION: (32, "i"), END_VELOCITY: (32, "I"), TARGET_VELOCITY: (32, "i")}
"""What RPDOs may carry: bits and format of each object (sub-index 0)."""
NEEDED = (CONTROLWORD, TARGET_POSITION, TARGET_VELOCITY)
"""What the RPDOs must carry between them."""
ON_EVENT = 254
"""Transmission type: on arrival, or by the drive's own timer."""
MOST_BITS = 64

Entries = tuple[int, ...]
"""Mapping entries of one PDO: index << 16 | sub-index << 8 | bits."""


@dataclass(frozen=True, slots=True)
class ProfilePdos:
    """What RPDO1 and TPDO1 and those that follow carry, the same on every node."""

    period_s: float
    """Period of the TPDOs, and of RPDOs whose content does not change."""
    rpdos: tuple[Entries, ...]
    tpdos: tuple[Entries, ...]

    @property
    def bits_per_s(self) -> float:
        """Of one node on the wire, with worst-case stuffing."""
        return sum(frame_bits(bits_of(entries) // 8) for entries in (*self.rpdos, *self.tpdos)) / self.period_s


def bits_of(entries: Sequence[int]) -> int:
    """Bits of one PDO's content."""
    return sum(entry & 0xFF for entry in entries)


def object_of(entry: int) -> int:
    """Index of a mapping entry."""
    return entry >> 16


def profile_writes(node_id: int, pdos: ProfilePdos) -> list[SdoWrite]:
    """The writes, in their prescribed order, that give a pre-operational node these PDOs."""
    writes: list[SdoWrite] = []
    for number, entries in enumerate(pdos.rpdos):
        writes += _link(0x1400 + number, 0x1600 + number, RPDO1 + number * PDO_STEP + node_id, entries, [])
    timers = [(3, little(round(pdos.period_s * 10_000), 2)), (5, little(round(pdos.period_s * 1000), 2))]
    for number, entries in enumerate(pdos.tpdos):
        writes += _link(0x1800 + number, 0x1A00 + number, TPDO1 + number * PDO_STEP + node_id, entries, timers)
    return writes


def _link(
    communication: int, mapping: int, cob_id: int, entries: Entries, timers: list[tuple[int, bytes]]
) -> list[SdoWrite]:
    """Disable, type, times, no entries, entries, count, enable."""
    return [
        SdoWrite(communication, 1, little(cob_id | DISABLED, 4)),
        SdoWrite(communication, 2, little(ON_EVENT, 1)),
        *(SdoWrite(communication, sub, data) for sub, data in timers),
        SdoWrite(mapping, 0, little(0, 1)),
        *(SdoWrite(mapping, sub, little(entry, 4)) for sub, entry in enumerate(entries, start=1)),
        SdoWrite(mapping, 0, little(len(entries), 1)),
        SdoWrite(communication, 1, little(cob_id, 4)),
    ]


class ProfileSender:
    """The RPDOs to one node: each when its content changes, and every period; the controlword after what it starts."""

    def __init__(self, node_id: int, pdos: ProfilePdos) -> None:
        numbered = [
            (RPDO1 + number * PDO_STEP + node_id, [object_of(entry) for entry in entries])
            for number, entries in enumerate(pdos.rpdos)
        ]
        numbered.sort(key=lambda pdo: CONTROLWORD in pdo[1])
        self._period_s = pdos.period_s
        self._pdos = [
            (cob_id, indices, Struct("<" + "".join(COMMANDS[index][1] for index in indices)))
            for cob_id, indices in numbered
        ]
        self._sent: dict[int, tuple[bytes, float]] = {}

    def frames(self, values: Mapping[int, int], now: float) -> list[CanFrame]:
        """What is due; `values` are the objects' by index, and 0 for others."""
        due = []
        for cob_id, indices, layout in self._pdos:
            data = layout.pack(*[values.get(index, 0) for index in indices])
            before, at = self._sent.get(cob_id, (b"", 0.0))
            if data != before or now - at >= self._period_s:
                self._sent[cob_id] = (data, now)
                due.append(CanFrame(cob_id, data))
        return due
