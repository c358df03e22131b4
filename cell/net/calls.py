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

WAITING_LIMIT = 64
REMEMBER_S = 60.0
"""So long a call is known by its id; nobody repeats one for longer."""
REMEMBERED = 1024


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A query that has no answer yet."""

    verb: str
    query: zenoh.Query
    until: float


@dataclass(slots=True)
class _Known:
    """A call the core was asked for, once: who waits for its outcome, and the outcome."""

    call_id: str
    request_id: str
    since: float
    within_s: float
    waiting: list[_Waiting]
    outcome: bytes | None = None


class Calls:
    """Queries on `<prefix>/cmd/*` as requests for a core.

    A call that is repeated under its id is carried out once; each query of it gets the one outcome. Its id is known for
    60 s, unless more than 1024 other calls come. Where carrying it out twice does harm, its echo (`Call.heard`) must
    date it as well: after a restart no id is known. A query without an outcome after its command's `answer_within_s`,
    one that cannot be read, and one that finds 64 others waiting get an error reply.
    """

    def __init__(self, keys: Keys, prefix: str, now: Callable[[], float] = time.monotonic) -> None:
        self._keys = keys
        self._now = now
        self._prefix = prefix
        self._lock = Lock()
        self._arrived: deque[zenoh.Query] = deque()
        self._known: OrderedDict[str, _Known] = OrderedDict()
        self._unanswered: dict[str, _Known] = {}
        """By request id: what the core has not answered."""
        self._count = 0

    def store(self, query: zenoh.Query) -> None:
        """Called by Zenoh's thread. Beyond twice the limit they are dropped; their callers see that nobody answers."""
        with self._lock:
            if len(self._arrived) < 2 * WAITING_LIMIT:
                self._arrived.append(query)

    def take(self) -> list[Request]:
        """New requests, in order; also ends queries that have waited too long."""
        now = self._now()
        for known in self._unanswered.values():
            late = [waiting for waiting in known.waiting if now > waiting.until]
            if late:
                known.waiting = known.waiting[len(late) :]
                _fail(late, f"not answered within {known.within_s:g} s; this may still be carried out")
        self._forget(now)
        with self._lock:
            arrived, self._arrived = self._arrived, deque()
        requests = (self._admit(query, now) for query in arrived)
        return [request for request in requests if request is not None]

    def answer(self, answer: Answer) -> None:
        """Send the core's reply. The answer to a call that is no longer known goes nowhere."""
        known = self._unanswered.pop(answer.request_id, None)
        if known is None:
            return
        waiting, known.waiting = known.waiting, []
        if not isinstance(answer.reply, Reply):
            _fail(waiting, f"answered with {type(answer.reply).__name__}, which is no reply")
            return
        known.outcome = encode(answer.reply)
        for one in waiting:
            self._reply(one.verb, one.query, known.outcome)

    def close(self) -> None:
        """Tell everyone who still waits that this process stops."""
        for known in self._unanswered.values():
            _fail(known.waiting, "the process stops; this may have been carried out")
        self._unanswered.clear()

    def _forget(self, now: float) -> None:
        while self._known:
            oldest = next(iter(self._known.values()))
            if now - oldest.since <= REMEMBER_S and len(self._known) <= REMEMBERED:
                return
            _fail(oldest.waiting, "too many calls came after it; this may still be carried out")
            del self._known[oldest.call_id]
            self._unanswered.pop(oldest.request_id, None)

    def _admit(self, query: zenoh.Query, now: float) -> Request | None:
        verb = str(query.key_expr).rsplit("/", 1)[-1]
        payload = query.payload.to_bytes() if query.payload is not None else b""
        try:
            call = decode_call(self._prefix, verb, payload)
        except CodecError as error:
            _refuse(query, str(error))
            return None
        known = self._known.get(call.id)
        if known is not None and known.outcome is not None:
            self._reply(verb, query, known.outcome)
            return None
        if known is not None:
            known.waiting.append(_Waiting(verb, query, now + known.within_s))
            return None
        waiting = sum(bool(unanswered.waiting) for unanswered in self._unanswered.values())
        if waiting >= WAITING_LIMIT:
            _refuse(query, f"{waiting} calls wait already; try again")
            return None
        self._count += 1
        request = Request(f"{self._prefix}#{self._count}", call)
        within_s = call.command.answer_within_s
        known = _Known(call.id, request.request_id, now, within_s, [_Waiting(verb, query, now + within_s)])
        self._known[call.id] = self._unanswered[request.request_id] = known
        return request

    def _reply(self, verb: str, query: zenoh.Query, data: bytes) -> None:
        # A caller may ask a pattern (who is there?); the reply carries the key of the one that answers.
        query.reply(self._keys.command(self._prefix, verb), data, encoding=zenoh.Encoding.APPLICATION_JSON)
        query.drop()  # type: ignore[no-untyped-call]


def _fail(waiting: list[_Waiting], reason: str) -> None:
    for one in waiting:
        _refuse(one.query, reason)


def _refuse(query: zenoh.Query, reason: str) -> None:
    query.reply_err(reason, encoding=zenoh.Encoding.TEXT_PLAIN)
    query.drop()  # type: ignore[no-untyped-call]
