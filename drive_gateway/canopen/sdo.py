"""Confirmed access to a node's object dictionary, as effect and message, and the rule of one request per node."""

from collections import deque
from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass
from inspect import GEN_CLOSED, getgeneratorstate

from cell.core import Effect
from drive_gateway.canopen.axis_objects import index_of

STORE_PARAMETERS = 0x1010
SAVE = b"save"
"""What a write to 1010h must hold, so that nothing is stored by mistake."""
RESTORE_DEFAULTS = 0x1011
LOAD = b"load"
"""What a write to 1011h must hold, so that nothing is lost by mistake."""
ABSENT = frozenset({0x06020000, 0x06090011})
"""Abort codes: no such object, no such sub-index."""


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

    `problem` is empty on success. `abort_code` is set when the node refused, and `problem` names it then; a node that
    did not answer has none.
    """

    request_id: str
    data: bytes
    abort_code: int | None = None
    problem: str = ""


@dataclass(frozen=True, slots=True)
class SdoRead:
    """One object of a node's dictionary that is read."""

    index: int
    sub: int


@dataclass(frozen=True, slots=True)
class SdoWrite:
    """One confirmed write to a node's object dictionary; `data` is little-endian, as long as the object."""

    index: int
    sub: int
    data: bytes


SdoRequest = SdoRead | SdoWrite
Dialogue = Generator[SdoRequest, SdoDone, None]
"""Requests to one node, each made when the one before is answered: it yields a request and is sent the outcome.

Once it is closed nothing more of it goes out; a channel that forgets drops it likewise.
"""


@dataclass(frozen=True, slots=True)
class _Course:
    """A dialogue that is carried out."""

    dialogue: Dialogue
    axis: int
    asked: bool


class SdoChannel:
    """One node's requests: in order, and never a second one before the first is answered."""

    def __init__(self, node_id: int) -> None:
        self._node_id = node_id
        self._count = 0
        self._waiting: deque[tuple[_Course, SdoRequest]] = deque()
        self._outstanding: str | None = None
        self._course: _Course | None = None
        """Whose request is on its way, if anybody's."""

    @property
    def idle(self) -> bool:
        """Nothing is on its way, and nothing waits."""
        return self._outstanding is None and not self._waiting

    def follow(self, dialogue: Dialogue, axis: int = 1, asked: bool = False) -> None:
        """Carry a dialogue out to its end.

        Args:
            dialogue: its indices are those of axis 1.
            axis: of the node, which is meant.
            asked: somebody waits for it.
        """
        with suppress(StopIteration):
            self._waiting.append((_Course(dialogue, axis, asked), next(dialogue)))

    def poll(self) -> Sdo | None:
        """The next request to send, if the node is free for one."""
        while self._waiting and getgeneratorstate(self._waiting[0][0].dialogue) == GEN_CLOSED:
            self._waiting.popleft()
        if self._outstanding is not None or not self._waiting:
            return None
        self._course, request = self._waiting.popleft()
        self._count += 1
        self._outstanding = f"{self._node_id}/{self._count}"
        index = index_of(request.index, self._course.axis)
        data = request.data if isinstance(request, SdoWrite) else None
        return Sdo(self._outstanding, self._node_id, index, request.sub, data)

    def done(self, outcome: SdoDone) -> None:
        """Take an outcome; one that was not waited for is ignored."""
        if outcome.request_id != self._outstanding:
            return
        course, self._course, self._outstanding = self._course, None, None
        if course is not None:
            with suppress(StopIteration):
                self._waiting.append((course, course.dialogue.send(outcome)))

    def forget(self) -> None:
        """Drop what nobody waits for. A request on its way stays outstanding; its outcome counts if it was asked."""
        self._waiting = deque(waiting for waiting in self._waiting if waiting[0].asked)
        if self._course is not None and not self._course.asked:
            self._course = None
