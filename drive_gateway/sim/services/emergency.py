"""The errors of a node (CiA 301): emergency frames, error register 1001h and error history 1003h."""

from collections.abc import Callable
from struct import Struct

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import Objects

COMMUNICATION_LOST = 0x8100
HEARTBEAT_LOST = 0x8130
PDO_TOO_SHORT = 0x8210
FOLLOWING_ERROR = 0x8611
SETPOINTS_MISSING = 0x8700

_ERROR_REGISTER = key_of(0x1001)
_HISTORY = key_of(0x1003)
_HISTORY_LENGTH = 8
_LAYOUT = Struct("<HB5x")
_NO_ERROR = 0x0000

_GENERIC, _CURRENT, _VOLTAGE, _TEMPERATURE, _COMMUNICATION, _PROFILE = (1 << bit for bit in range(6))
_BIT_BY_GROUP = {
    0x20: _CURRENT,
    0x30: _VOLTAGE,
    0x40: _TEMPERATURE,
    0x80: _PROFILE,
}


def register_bits(code: int) -> int:
    """The bits that an error code sets in the error register; bit 0 comes with every error."""
    if code >> 8 in (0x81, 0x82):
        return _GENERIC | _COMMUNICATION
    return _GENERIC | _BIT_BY_GROUP.get(code >> 8 & 0xF0, 0)


class Emergencies:
    """The errors that are there now. Frames wait in `pending` until the node may send them."""

    def __init__(self, objects: Objects, node_id: int) -> None:
        self._numbers = objects.numbers
        self._cob_id = 0x080 + node_id
        self._active: list[int] = []
        self.held: Callable[[int], bool] = lambda _code: False
        """Whether a drive of the node still has a code as its fault, so that it is not gone."""
        self.pending: list[CanFrame] = []
        objects.guards[_HISTORY] = _only_zero
        objects.followers[_HISTORY] = lambda _value: self.clear_history()

    def reset(self) -> None:
        """The node restarts: nothing is wrong and nothing is told."""
        self._active.clear()
        self.pending.clear()

    def occur(self, code: int) -> None:
        """An error appears; one that is there already is not told again."""
        if code in self._active:
            return
        self._active.append(code)
        self._remember(code)
        self._tell(code)

    def repeat(self, code: int) -> None:
        """An error that should have been acknowledged is still there."""
        self._tell(code)

    def vanish(self, code: int) -> None:
        """An error is gone; the last one to go is told by code 0000h."""
        if code not in self._active or self.held(code):
            return
        self._active.remove(code)
        self._tell(self._active[-1] if self._active else _NO_ERROR)

    def say(self, code: int, register: int) -> None:
        """Tell a code with this error register, whatever is there."""
        self.pending.append(CanFrame(self._cob_id, _LAYOUT.pack(code, register)))

    def clear_history(self) -> None:
        """Delete what 1003h remembers."""
        for sub in range(_HISTORY_LENGTH + 1):
            self._numbers[_HISTORY + sub] = 0

    def _remember(self, code: int) -> None:
        for sub in range(_HISTORY_LENGTH, 1, -1):
            self._numbers[_HISTORY + sub] = self._numbers[_HISTORY + sub - 1]
        self._numbers[_HISTORY + 1] = code
        self._numbers[_HISTORY] = min(self._numbers[_HISTORY] + 1, _HISTORY_LENGTH)

    def _tell(self, code: int) -> None:
        register = 0
        for active in self._active:
            register |= register_bits(active)
        self._numbers[_ERROR_REGISTER] = register
        self.say(code, register)


def _only_zero(value: int) -> None:
    """The history can only be cleared."""
    if value:
        raise AccessRefused(Abort.RANGE)
