"""What a node lets its master write into the PDO parameters, and in which order (CiA 301, 1400h to 1BFFh).

A PDO is changed outside Operational only, and while it is disabled (bit 31 of its COB-ID); its mapping is changed while
its count is zero, and the count is checked when it is written.
"""

from collections.abc import Callable
from functools import partial

from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import Objects
from drive_gateway.sim.services.pdo import (
    INVALID,
    LAST_CYCLIC,
    NO_REMOTE,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
    pdo_numbers,
)

_EVENT_TYPES = (254, 255)
_MOST_BITS = 64
_MOST_OBJECTS = 8
_RESERVED = (range(0x181), range(0x581, 0x680), range(0x6E0, 0x800))
"""Identifiers that no PDO may have: NMT, SYNC, EMCY, TIME, SDO, error control."""


class PdoParameters:
    """Guards all PDO parameters of a node; `operational` says whether it is in Operational."""

    def __init__(self, objects: Objects, operational: Callable[[], bool]) -> None:
        self._objects = objects
        self._operational = operational
        for number in pdo_numbers(objects):
            self._guard(RPDO_COMMUNICATION + number, RPDO_MAPPING + number, transmit=False)
            self._guard(TPDO_COMMUNICATION + number, TPDO_MAPPING + number, transmit=True)

    def _guard(self, communication: int, mapping: int, transmit: bool) -> None:
        guards = self._objects.guards
        guards[key_of(communication, 1)] = partial(self._cob_id, communication, transmit)
        guards[key_of(communication, 2)] = self._type
        if transmit:
            guards[key_of(communication, 3)] = lambda _value: self._disabled(communication)
            guards[key_of(communication, 5)] = lambda _value: self._not_operational()
        guards[key_of(mapping)] = partial(self._count, communication, mapping)
        for sub in range(1, _MOST_OBJECTS + 1):
            guards[key_of(mapping, sub)] = partial(self._mapped, communication, mapping, transmit)

    def _cob_id(self, communication: int, transmit: bool, value: int) -> None:
        self._not_operational()
        present = self._objects.numbers[key_of(communication, 1)]
        flags = INVALID | (NO_REMOTE if transmit else 0)
        if value & ~flags & ~0x7FF or any(value & 0x7FF in reserved for reserved in _RESERVED):
            raise AccessRefused(Abort.RANGE)
        if not present & INVALID and not value & INVALID and present != value:
            raise AccessRefused(Abort.DEVICE_STATE)

    def _type(self, value: int) -> None:
        self._not_operational()
        if value > LAST_CYCLIC and value not in _EVENT_TYPES:
            raise AccessRefused(Abort.RANGE)

    def _count(self, communication: int, mapping: int, value: int) -> None:
        self._disabled(communication)
        entries = [self._objects.numbers[key_of(mapping, sub)] for sub in range(1, value + 1)]
        if not all(entries):
            raise AccessRefused(Abort.NOT_MAPPABLE)
        if sum(entry & 0xFF for entry in entries) > _MOST_BITS:
            raise AccessRefused(Abort.PDO_TOO_LONG)

    def _mapped(self, communication: int, mapping: int, transmit: bool, value: int) -> None:
        self._disabled(communication)
        if self._objects.numbers[key_of(mapping)]:
            raise AccessRefused(Abort.UNSUPPORTED_ACCESS)
        if value == 0:
            return
        entry = self._objects.entry(value >> 8)
        allowed = entry.mappable and (entry.readable if transmit else entry.writable)
        if not allowed or entry.bits != value & 0xFF:
            raise AccessRefused(Abort.NOT_MAPPABLE)

    def _disabled(self, communication: int) -> None:
        self._not_operational()
        if not self._objects.numbers[key_of(communication, 1)] & INVALID:
            raise AccessRefused(Abort.DEVICE_STATE)

    def _not_operational(self) -> None:
        if self._operational():
            raise AccessRefused(Abort.DEVICE_STATE)
