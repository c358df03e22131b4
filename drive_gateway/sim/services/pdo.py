"""The process data of a node in Operational, packed and unpacked by structs that are built once when it is started."""

from collections.abc import Iterator
from struct import Struct

from drive_gateway.canopen.axis_objects import AXES, PDO_SPAN
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.sim.services.abort import AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import Objects

PDOS = range(4)
"""Each axis has four PDOs in each direction, 64 numbers from those of the axis before."""
RPDO_COMMUNICATION, RPDO_MAPPING = 0x1400, 0x1600
TPDO_COMMUNICATION, TPDO_MAPPING = 0x1800, 0x1A00

INVALID = 1 << 31
"""Bit 31 of a COB-ID: the PDO does not exist."""
NO_REMOTE = 1 << 30
"""Bit 30 of a TPDO's COB-ID: it is not sent on a remote frame."""
_CLOCK_S = 1e-9
"""Sums of cycles are not exact."""
LAST_CYCLIC = 240
"""Transmission types up to here belong to SYNC."""


class ReceivePdo:
    """Process data to the drive. A synchronous one is kept until the next SYNC, the newest wins."""

    def __init__(self, objects: Objects, cob_id: int, synchronous: bool, layout: Struct, keys: tuple[int, ...]) -> None:
        self._objects = objects
        self._layout = layout
        self._keys = keys
        self._latched: bytes | None = None
        self.cob_id = cob_id
        self.synchronous = synchronous

    def fits(self, data: bytes) -> bool:
        """A frame may be longer than its mapping, never shorter."""
        return len(data) >= self._layout.size

    def latch(self, data: bytes) -> None:
        self._latched = data

    def take_over(self) -> None:
        """Write what was latched into the mapped objects, in their order. A value that an object refuses is dropped."""
        data, self._latched = self._latched, None
        if data is None:
            return
        for key, value in zip(self._keys, self._layout.unpack_from(data), strict=True):
            try:
                self._objects.put(key, value)
            except AccessRefused:
                continue


class TransmitPdo:
    """Process data from the drive: on SYNC (types 0 to 240), or on change and by its event timer (254, 255)."""

    def __init__(self, objects: Objects, communication: int, layout: Struct, keys: tuple[int, ...]) -> None:
        numbers = objects.numbers
        cob_id = numbers[key_of(communication, 1)]
        self._numbers = numbers
        self._layout = layout
        self._keys = keys
        self._type = numbers[key_of(communication, 2)]
        self._inhibit_s = numbers[key_of(communication, 3)] * 1e-4
        self._event_s = numbers[key_of(communication, 5)] * 1e-3
        self._syncs = 0
        self._sent: bytes | None = None
        self._sent_at = 0.0
        self.cob_id = cob_id & 0x7FF
        self.remote = not cob_id & NO_REMOTE

    def frame(self) -> CanFrame:
        return CanFrame(self.cob_id, self._content())

    def on_sync(self) -> CanFrame | None:
        if self._type > LAST_CYCLIC:
            return None
        if self._type == 0:
            content = self._content()
            if content == self._sent:
                return None
            self._sent = content
            return CanFrame(self.cob_id, content)
        self._syncs += 1
        if self._syncs < self._type:
            return None
        self._syncs = 0
        return self.frame()

    def on_time(self, now: float) -> CanFrame | None:
        if self._type <= LAST_CYCLIC:
            return None
        age_s = now - self._sent_at + _CLOCK_S
        content = self._content()
        changed = content != self._sent and (self._sent is None or age_s >= self._inhibit_s)
        if not changed and (self._event_s == 0.0 or age_s < self._event_s):
            return None
        self._sent, self._sent_at = content, now
        return CanFrame(self.cob_id, content)

    def _content(self) -> bytes:
        numbers = self._numbers
        return self._layout.pack(*[numbers[key] for key in self._keys])


def receive_pdos(objects: Objects) -> list[ReceivePdo]:
    """The RPDOs that exist now."""
    found = []
    for number in _valid(objects, RPDO_COMMUNICATION):
        cob_id = objects.numbers[key_of(RPDO_COMMUNICATION + number, 1)] & 0x7FF
        synchronous = objects.numbers[key_of(RPDO_COMMUNICATION + number, 2)] <= LAST_CYCLIC
        layout, keys = _mapping(objects, RPDO_MAPPING + number)
        if keys:
            found.append(ReceivePdo(objects, cob_id, synchronous, layout, keys))
    return found


def transmit_pdos(objects: Objects) -> list[TransmitPdo]:
    """The TPDOs that exist now."""
    found = []
    for number in _valid(objects, TPDO_COMMUNICATION):
        layout, keys = _mapping(objects, TPDO_MAPPING + number)
        if keys:
            found.append(TransmitPdo(objects, TPDO_COMMUNICATION + number, layout, keys))
    return found


def _valid(objects: Objects, communication: int) -> Iterator[int]:
    numbers = objects.numbers
    return (number for number in pdo_numbers(objects) if not numbers[key_of(communication + number, 1)] & INVALID)


def pdo_numbers(objects: Objects) -> list[int]:
    """The PDOs of all axes of the node, counted from 0."""
    firsts = range(0, AXES * PDO_SPAN, PDO_SPAN)
    return [first + number for first in firsts for number in PDOS if key_of(RPDO_MAPPING + first) in objects.numbers]


def _mapping(objects: Objects, index: int) -> tuple[Struct, tuple[int, ...]]:
    count = objects.numbers[key_of(index)]
    keys = tuple(objects.numbers[key_of(index, sub)] >> 8 for sub in range(1, count + 1))
    return Struct("<" + "".join(objects.entry(key).code for key in keys)), keys
