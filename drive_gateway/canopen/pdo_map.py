"""The process image on the bus, in one place: what the gateway and a drive exchange in each cycle.

RPDO1 carries controlword and target position, TPDO1 statusword and actual position; both act on every SYNC. Where the
drives file gives the first PDOs of its nodes to motions of their own (`profile_pdos`), the image is PDO 4. It is
written to a node by SDO; a node obeys what it is given and need not know this file.
"""

from dataclasses import dataclass
from struct import Struct

from drive_gateway.canopen.cob_id import PDO_STEP, RPDO1, TPDO1

CONTROLWORD = 0x6040
STATUSWORD = 0x6041
TARGET_POSITION = 0x607A
POSITION_ACTUAL = 0x6064

EVERY_SYNC = 1
"""Transmission type: cyclic synchronous, each SYNC."""
DISABLED = 1 << 31
"""Bit 31 of a PDO's COB-ID: the PDO does not exist."""

RPDO1_LAYOUT = Struct("<Hi")
"""Controlword, target position [counts]."""
TPDO1_LAYOUT = Struct("<Hi")
"""Statusword, position actual [counts]."""

RPDO1_ENTRIES = (0x60400010, 0x607A0020)
TPDO1_ENTRIES = (0x60410010, 0x60640020)
"""Mapping entries: index << 16 | sub-index << 8 | bits."""


@dataclass(frozen=True, slots=True)
class SdoWrite:
    """One confirmed write to a node's object dictionary; `data` is little-endian, as long as the object."""

    index: int
    sub: int
    data: bytes


def pdo_writes(node_id: int, number: int = 1) -> list[SdoWrite]:
    """The writes, in their prescribed order, that give a pre-operational node the process image as its PDO `number`."""
    place = number - 1
    step = place * PDO_STEP + node_id
    rpdo = _writes(0x1400 + place, 0x1600 + place, RPDO1 + step, RPDO1_ENTRIES)
    return rpdo + _writes(0x1800 + place, 0x1A00 + place, TPDO1 + step, TPDO1_ENTRIES)


def _writes(communication: int, mapping: int, cob_id: int, entries: tuple[int, ...]) -> list[SdoWrite]:
    """Disable, type, no entries, entries, count, enable: a node refuses any other order."""
    return [
        SdoWrite(communication, 1, little(cob_id | DISABLED, 4)),
        SdoWrite(communication, 2, little(EVERY_SYNC, 1)),
        SdoWrite(mapping, 0, little(0, 1)),
        *(SdoWrite(mapping, sub, little(entry, 4)) for sub, entry in enumerate(entries, start=1)),
        SdoWrite(mapping, 0, little(len(entries), 1)),
        SdoWrite(communication, 1, little(cob_id, 4)),
    ]


def little(value: int, size: int) -> bytes:
    """A value as an object holds it."""
    return value.to_bytes(size, "little")
