"""Confirmed access to a node's object dictionary, as effect and message, and the rule of one request per node."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from cell.core import Effect

STORE_PARAMETERS = 0x1010
SAVE = b"save"
"""What a write to 1010h must hold, so that nothing is stored by mistake."""
RESTORE_DEFAULTS = 0x1011
LOAD = b"load"
"""What a write to 1011h must hold, so that nothing is lost by mistake."""


@dataclass(frozen=True, slots=True)
class Sdo(Effect):
    """Write `data` to an object, or read it when `data` is `None`; the outcome comes back as `SdoDone`."""

    request_id: str
    node_id: int
    index: int
    sub: int
    data: bytes | None


@dataclass(frozen=True, slots=True)
class SdoDone:
    """The outcome of an `Sdo`: the bytes read (empty after a write), or why it failed.

    `problem` is empty on success. `abort_code` is set when the node refused; a node that did not answer has none.
    """

    request_id: str
    data: bytes
    abort_code: int | None = None
    problem: str = ""


ABORT_CODES: dict[int, str] = {
    0x05030000: "toggle bit not alternated",
    0x05040000: "SDO protocol timed out",
    0x05040001: "unknown command specifier",
    0x05040002: "invalid block size",
    0x05040003: "invalid sequence number",
    0x05040004: "CRC error",
    0x05040005: "out of memory",
    0x06010000: "unsupported access to an object",
    0x06010001: "attempt to read a write-only object",
    0x06010002: "attempt to write a read-only object",
    0x06020000: "object does not exist",
    0x06040041: "object cannot be mapped to a PDO",
    0x06040042: "mapped objects exceed the PDO's length",
    0x06040043: "parameter incompatible",
    0x06040047: "internal incompatibility in the device",
    0x06060000: "access failed because of a hardware error",
    0x06070010: "data type or length does not match",
    0x06070012: "data type does not match, too long",
    0x06070013: "data type does not match, too short",
    0x06090011: "sub-index does not exist",
    0x06090030: "value out of range",
    0x06090031: "value too high",
    0x06090032: "value too low",
    0x06090036: "maximum less than minimum",
    0x060A0023: "resource not available",
    0x08000000: "general error",
    0x08000020: "data cannot be stored",
    0x08000021: "data cannot be stored because of local control",
    0x08000022: "data cannot be stored in the present device state",
    0x08000023: "no object dictionary present",
    0x08000024: "no data available",
}


def abort_text(code: int) -> str:
    """An abort code by its number and its name (CiA 301)."""
    return f"abort {code:08X}h, {ABORT_CODES.get(code, 'code not in CiA 301')}"


class SdoChannel:
    """One node's requests: in order, and never a second one before the first is answered."""

    def __init__(self, node_id: int) -> None:
        self._node_id = node_id
        self._count = 0
        self._waiting: deque[tuple[Sdo, Callable[[SdoDone], None], bool]] = deque()
        self._outstanding: str | None = None
        self._then: Callable[[SdoDone], None] | None = None
        self._asked = False

    def submit(
        self, index: int, sub: int, data: bytes | None, then: Callable[[SdoDone], None], asked: bool = False
    ) -> None:
        """Queue a write (`data`) or a read (`None`); `then` takes the outcome. `asked`: somebody waits for it."""
        self._count += 1
        self._waiting.append((Sdo(f"{self._node_id}/{self._count}", self._node_id, index, sub, data), then, asked))

    def poll(self) -> Sdo | None:
        """The next request to send, if the node is free for one."""
        if self._outstanding is not None or not self._waiting:
            return None
        request, self._then, self._asked = self._waiting.popleft()
        self._outstanding = request.request_id
        return request

    def done(self, outcome: SdoDone) -> None:
        """Take an outcome; one that was not waited for is ignored."""
        if outcome.request_id != self._outstanding:
            return
        then, self._then, self._outstanding = self._then, None, None
        if then is not None:
            then(outcome)

    def forget(self) -> None:
        """Drop what nobody waits for. A request on its way stays outstanding; its outcome counts if it was asked."""
        self._waiting = deque(waiting for waiting in self._waiting if waiting[2])
        if not self._asked:
            self._then = None
