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
