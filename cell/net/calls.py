"""The serving side of calls: queries that wait until the core has answered."""

import time
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

import zenoh

from cell.core import Answer, Request
from cell.messages import Reply
from cell.net.codec import decode_call, encode
from cell.net.errors import CodecError
from cell.net.keys import Keys

ANSWER_WITHIN_S = 2.0
WAITING_LIMIT = 64
_REMEMBERED = 256


@dataclass(slots=True)
class _Pending:
    """A call the core has taken and not answered yet; the same call, repeated, joins it."""

    call_id: str
    since: float
    queries: list[tuple[str, zenoh.Query]]


class Calls:
    """Queries on `<prefix>/cmd/*` as requests for a core.

    A call that is repeated under its id is carried out once and answered each time. What the core does not answer
    within 2 s, what cannot be read, and what is too much gets an error reply.
    """

    def __init__(self, keys: Keys, prefix: str, now: Callable[[], float] = time.monotonic) -> None:
        self._keys = keys
        self._now = now
        self._prefix = prefix
        self._lock = Lock()
        self._arrived: deque[zenoh.Query] = deque()
        self._pending: dict[str, _Pending] = {}
        self._answered: OrderedDict[str, bytes] = OrderedDict()
        self._count = 0

    def store(self, query: zenoh.Query) -> None:
        """Called by Zenoh's thread. What is far too much is let go; its callers see that nobody answers."""
        with self._lock:
            if len(self._arrived) < 2 * WAITING_LIMIT:
                self._arrived.append(query)

    def take(self) -> list[Request]:
        """New requests, in order; also ends those that have waited too long."""
        now = self._now()
        for request_id, pending in list(self._pending.items()):
            if now - pending.since > ANSWER_WITHIN_S:
                del self._pending[request_id]
                self._fail(pending, f"not answered within {ANSWER_WITHIN_S:g} s; it may still be carried out")
        with self._lock:
            arrived, self._arrived = self._arrived, deque()
        requests = (self._admit(query, now) for query in arrived)
        return [request for request in requests if request is not None]

    def answer(self, answer: Answer) -> None:
        """Send the core's reply. An answer to a request that has ended already goes nowhere."""
        pending = self._pending.pop(answer.request_id, None)
        if pending is None:
            return
        if not isinstance(answer.reply, Reply):
            self._fail(pending, f"answered with {type(answer.reply).__name__}, which is no reply")
            return
        data = encode(answer.reply)
        self._answered[pending.call_id] = data
        if len(self._answered) > _REMEMBERED:
            self._answered.popitem(last=False)
        for verb, query in pending.queries:
            self._reply(verb, query, data)

    def close(self) -> None:
        """Tell everyone who still waits that this process stops."""
        for pending in self._pending.values():
            self._fail(pending, "the process stops")
        self._pending.clear()

    def _admit(self, query: zenoh.Query, now: float) -> Request | None:
        verb = str(query.key_expr).rsplit("/", 1)[-1]
        payload = query.payload.to_bytes() if query.payload is not None else b""
        try:
            call = decode_call(self._prefix, verb, payload)
        except CodecError as error:
            _refuse(query, str(error))
            return None
        if call.id in self._answered:
            self._reply(verb, query, self._answered[call.id])
            return None
        for pending in self._pending.values():
            if pending.call_id == call.id:
                pending.queries.append((verb, query))
                return None
        if len(self._pending) >= WAITING_LIMIT:
            _refuse(query, f"{len(self._pending)} calls wait already; try again")
            return None
        self._count += 1
        request = Request(f"{self._prefix}#{self._count}", call)
        self._pending[request.request_id] = _Pending(call.id, now, [(verb, query)])
        return request

    def _reply(self, verb: str, query: zenoh.Query, data: bytes) -> None:
        # A caller may ask a pattern (who is there?); the reply carries the key of the one that answers.
        query.reply(self._keys.command(self._prefix, verb), data, encoding=zenoh.Encoding.APPLICATION_JSON)
        query.drop()  # type: ignore[no-untyped-call]

    @staticmethod
    def _fail(pending: _Pending, reason: str) -> None:
        for _, query in pending.queries:
            _refuse(query, reason)


def _refuse(query: zenoh.Query, reason: str) -> None:
    query.reply_err(reason, encoding=zenoh.Encoding.TEXT_PLAIN)
    query.drop()  # type: ignore[no-untyped-call]
