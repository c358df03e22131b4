"""Emergency messages (CiA 301, codes of CiA 301 and CiA 402): what a node says when something is wrong."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

MOTOR_HOT = 0x4310
WARNINGS = frozenset({0x8120})
"""Codes of CiA 301 that a drive goes on with: error passive, its frames still come and go."""


class Meaning(NamedTuple):
    """What a code says."""

    text: str
    remedy: str
    stops: bool = True
    """The robot is stopped. Else the code is a warning: a drive that stops by it says so in its statusword."""


@dataclass(frozen=True, slots=True)
class Emergency:
    """One EMCY frame: error code, error register (1001h) and meaning."""

    code: int
    register: int
    meaning: str
    remedy: str
    stops: bool

    @property
    def reset(self) -> bool:
        """00xxh: an error is gone (CiA 301, 7.2.7.1); others may be there, see `gone`."""
        return _no_error(self.code)

    @property
    def gone(self) -> bool:
        """No error is there any more: the error register says so too."""
        return self.reset and not self.register


_TABLE: dict[int, tuple[str, str]] = {
    0x2310: ("continuous over-current", "check load, brake and motor cable"),
    0x2320: ("short circuit or earth leakage", "switch off and check the motor cable"),
    0x3210: ("DC link over-voltage", "check the braking resistor and the deceleration"),
    0x3220: ("DC link under-voltage", "check the power supply of the drives"),
    0x4210: ("drive over-temperature", "let the drive cool down and check its ventilation"),
    0x4280: ("over-temperature of the device", "let the drive cool down and check its ventilation"),
    MOTOR_HOT: ("motor over-temperature", "let the motor cool down and check its load"),
    0x5114: ("supply of the electronics too low", "check the 24 V supply"),
    0x5115: ("supply of the electronics faulty", "check the 24 V supply"),
    0x5116: ("supply of the electronics faulty", "check the 24 V supply"),
    0x5410: ("digital outputs overloaded", "check the wiring of the outputs"),
    0x6180: ("internal software fault of the drive", "restart the drive"),
    0x6320: ("a parameter of the drive is out of range", "compare the drive's parameters with the bus file"),
    0x7121: ("motor blocked", "check the mechanics and the brake"),
    0x7380: ("encoder fault", "check the encoder cable"),
    0x7382: ("encoder fault", "check the encoder cable"),
    0x8110: ("CAN overrun: the node lost frames", "check the bus load and the bit rate"),
    0x8120: ("CAN error passive", "check wiring and terminating resistors"),
    0x8130: ("the node missed the gateway's heartbeat", "check that the gateway ran without a pause, and the wiring"),
    0x8140: ("the node recovered from bus-off", "check wiring and terminating resistors"),
    0x8210: ("PDO not processed: wrong length", "restart the gateway so that the mapping is written again"),
    0x8480: ("speed over its limit", "check speed limits and following behaviour"),
    0x8611: ("following error over its window", "look for a collision or a blocked axis"),
    0x8612: ("position limit reached", "move the axis back by hand or in set-up"),
    0x8700: ("SYNC missing or late", "check that the gateway ran without a pause, and the wiring"),
}

_GROUPS: dict[int, str] = {
    0x10: "generic error",
    0x20: "current",
    0x21: "current on the input side",
    0x22: "current inside the drive",
    0x23: "current on the output side",
    0x30: "voltage",
    0x31: "mains voltage",
    0x32: "voltage inside the drive",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "temperature of the drive",
    0x50: "hardware of the drive",
    0x60: "software of the drive",
    0x70: "additional module",
    0x80: "monitoring",
    0x81: "communication",
    0x82: "protocol",
    0x90: "external error",
    0xF0: "additional function",
    0xFF: "manufacturer specific",
}

_ASK_MANUAL = "look the code up in the drive's manual"


_NONE: Mapping[int, Meaning] = MappingProxyType({})


def decode_emergency(data: bytes, own: Mapping[int, Meaning] = _NONE) -> Emergency | None:
    """The content of an EMCY frame, or `None` when it is too short to be one; `own`: see `emergency_of`."""
    if len(data) < 3:
        return None
    return emergency_of(int.from_bytes(data[:2], "little"), data[2], own)


def emergency_of(code: int, register: int, own: Mapping[int, Meaning]) -> Emergency:
    """A code with what it means.

    `own`: codes that the drive's maker gives another meaning, or one at all.
    """
    meaning = own.get(code) or meaning_of(code)
    return Emergency(code, register, meaning.text, meaning.remedy, meaning.stops)


def meaning_of(code: int) -> Meaning:
    """What an emergency code means; an unknown one is named by its group (high byte)."""
    if _no_error(code):
        return Meaning("no error", "", stops=False)
    if code in _TABLE:
        return Meaning(*_TABLE[code], stops=code not in WARNINGS)
    high = code >> 8
    group = _GROUPS.get(high) or _GROUPS.get(high & 0xF0) or "unknown group"
    return Meaning(f"{group}, code not in the table", _ASK_MANUAL)


def _no_error(code: int) -> bool:
    return code >> 8 == 0
