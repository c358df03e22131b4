"""What stands for Zenoh: payloads go from session to session by their keys, through the network's weather.

Codec, slots, queues, calls and their outcomes are those of `cell.net`. A session that is frozen or killed loses what a
real one loses.
"""

import heapq
import re
import threading
from collections.abc import Callable
from typing import Any

from cell.core import Ask, AskDone
from cell.messages import Call, Reply
from cell.net.calls import Calls
from cell.net.codec import encode, encode_call
from cell.net.errors import CallError
from cell.net.inbox import Inbox
from cell.net.keys import Keys
from cell.net.latest import Decoder, Latest
from cell.net.liveliness import TokenWatch
from cell.net.session import _outcome
from tests.sim.clock import Clock
from tests.sim.host import Host
from tests.sim.network import Network

LEASE_S = 0.5
"""Of a link: a peer that is silent for longer counts as gone (`cell.net.options`)."""
_RECONNECT_S = (0.05, 0.25)
_LOOK_S = 0.05
_MOST_WAITING = 512

_Store = Callable[..., None]


class SimSession:
    """A process' session: of `cell.net.session.CellSession` all that shells and operators' tools use."""

    def __init__(
        self, exchange: "Exchange", process: str, host: Host, boot: str, report: Callable[[str], None]
    ) -> None:
        role, _, name = process.partition("/")
        self.process, self.host, self.boot = process, host, boot
        self.role, self.name = role, name or role
        self.keys = exchange.keys
        self.decoder = Decoder(self.keys, report)
        self.is_open = True
        self.subscriptions: list[tuple[re.Pattern[str], _Store]] = []
        self.serves: dict[str, Calls] = {}
        self.tokens: TokenWatch | None = None
        self.alive = ""
        """The key of its liveliness token, once it is declared."""
        self._exchange = exchange
        self._outcomes = Inbox(self.decoder, now=self._arrival)
        self._tell_outcome: _Store = self._outcomes.tell
        self._waiting: list[tuple[float, int, _Store, tuple[Any, ...]]] = []
        self._deaf: list[tuple[float, float]] = []
        self._at = 0.0
        exchange.join(self)

    # As CellSession

    def publish(self, message: object) -> None:
        self._exchange.publish(self, message)

    def watch(self, *key_patterns: str, came: threading.Event | None = None) -> Latest:  # noqa: ARG002
        latest = Latest(self.decoder, self._arrival)
        self._subscribe(key_patterns, latest.store)
        return latest

    def queue(self, *key_patterns: str, size: int = 256, came: threading.Event | None = None) -> Inbox:  # noqa: ARG002
        inbox = Inbox(self.decoder, size, self._arrival)
        self._subscribe(key_patterns, inbox.store)
        return inbox

    def hear(self, key: str, store: _Store) -> None:
        self.subscriptions.append((re.compile(re.escape(key)), store))
        self._exchange.forget_routes()

    def serve(self, prefix: str) -> Calls:
        calls = self.serves[prefix] = Calls(self.keys, prefix, self.host.read)
        return calls

    def ask_later(self, ask: Ask) -> None:
        def done(reply: Reply | None, problem: str) -> None:
            self.receive(self._exchange.clock.now, self._tell_outcome, AskDone(ask.ask_id, reply, problem))

        assert isinstance(ask.call, Call)
        self._exchange.ask(self, ask.to, ask.call, ask.timeout_s, done)

    def outcomes(self) -> list[object]:
        return self._outcomes.take()

    def declare_alive(self) -> None:
        self.alive = self.keys.alive(self.role, self.name, self.boot)

    def token_watch(self) -> TokenWatch:
        self.tokens = TokenWatch(self.keys)
        return self.tokens

    @property
    def endpoints(self) -> tuple[str, ...]:
        return (f"simulated/{self.process}",)

    # What comes

    def receive(self, at: float, store: _Store, *arguments: Any) -> None:
        """Something arrives at `at` [s]; it is stored when the process looks, as of then."""
        self._exchange.arrivals += 1
        heapq.heappush(self._waiting, (at, self._exchange.arrivals, store, arguments))
        if len(self._waiting) > _MOST_WAITING and not self._deaf:
            self.take_in()

    def take_in(self) -> None:
        """Store what has arrived by now."""
        waiting, now = self._waiting, self._exchange.clock.now
        if not waiting or waiting[0][0] > now:
            return
        while waiting and waiting[0][0] <= now:
            at, _, store, arguments = heapq.heappop(waiting)
            if self._deaf:
                if store is not self._tell_outcome and self.deaf(at):
                    # That a call is over its own session tells, with or without a link.
                    continue
                # Zenoh's threads were frozen too: for them it arrives now.
                at = max([at, *(end for begin, end in self._deaf if begin <= at < end)])
            self._at = self.host.at(at)
            store(*arguments)
        self._deaf = [each for each in self._deaf if each[1] + _RECONNECT_S[1] > now]

    def _arrival(self) -> float:
        return self._at

    def _subscribe(self, patterns: tuple[str, ...], store: _Store) -> None:
        self.subscriptions += [(_matcher(self.keys.prefix + pattern), store) for pattern in patterns]
        self._exchange.forget_routes()

    # What a machine does to it

    def freeze(self, begin: float, end: float) -> None:
        """Its threads stand still; for longer than a lease, and others give its links up."""
        if self._deaf and begin <= self._deaf[-1][1]:
            before, until = self._deaf.pop()
            begin, end = before, max(until, end)
        self._deaf.append((begin, end))

    def deaf(self, at: float) -> bool:
        """Whether it has no links at `at` [s]."""
        reconnected = self._exchange.reconnect_s
        return any(end - begin > LEASE_S and begin + LEASE_S <= at < end + reconnected for begin, end in self._deaf)

    def close(self) -> None:
        """The process ended: its sockets close."""
        self.is_open = False
        self._waiting.clear()
        self._exchange.leave(self)


class _Bytes:
    """A payload as Zenoh shows it."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    def to_bytes(self) -> bytes:
        return self._data

    def to_string(self) -> str:
        return self._data.decode()


class _Sample:
    """What a reply carries."""

    def __init__(self, data: bytes) -> None:
        self.payload = _Bytes(data)


class _Reply:
    """A reply as Zenoh shows it: good, or an error."""

    def __init__(self, ok: bytes | None, err: bytes | None) -> None:
        self.ok = None if ok is None else _Sample(ok)
        self.err = None if err is None else _Sample(err)


class _Query:
    """One copy of a call, as the one that is asked sees it."""

    def __init__(self, asked: "_Asked", key: str, data: bytes) -> None:
        self._asked = asked
        self.key_expr = key
        self.payload = _Bytes(data)

    def reply(self, _key: str, data: bytes, encoding: object) -> None:  # noqa: ARG002
        self._asked.answered(_Reply(data, None))

    def reply_err(self, reason: str, encoding: object) -> None:  # noqa: ARG002
        self._asked.answered(_Reply(None, reason.encode()))

    def drop(self) -> None:
        pass


class _Asked:
    """A call under way, as the one that asks sees it: it ends once."""

    def __init__(
        self, exchange: "Exchange", frm: SimSession, to: str, call: Call, done: Callable[[Reply | None, str], None]
    ) -> None:
        self._exchange = exchange
        self._frm = frm
        self._to = to
        self._verb = call.command.verb
        self._done = done
        self.open = True
        self.server: SimSession | None = None
        """Of the process that is asked."""

    def answered(self, reply: _Reply) -> None:
        """A reply leaves; it may be lost."""
        clock, server = self._exchange.clock, self.server
        if server is None or server.deaf(clock.now):
            return
        for delay_s in self._exchange.network.delays(server.process, self._frm.process)[:1]:
            clock.after(delay_s, self._arrives, reply)

    def _arrives(self, reply: _Reply) -> None:
        if not self._frm.deaf(self._exchange.clock.now):
            self.end([reply])

    def nobody(self) -> None:
        """The link tells that there is nobody who could answer."""
        self._exchange.clock.after(self._exchange.network.late(self._to, self._frm.process), self.end, [])

    def late(self) -> None:
        self.end([_Reply(None, b"Timeout")])

    def end(self, replies: list[_Reply]) -> None:
        if not self.open:
            return
        self.open = False
        self._exchange.ended(self)
        if not self._frm.is_open:
            return
        try:
            reply, problem = _outcome(self._to, self._verb, replies), ""  # type: ignore[arg-type]
        except CallError as error:
            reply, problem = None, str(error)
        self._done(reply, problem)


class Exchange:
    """Carries payloads between the sessions of one cell."""

    def __init__(self, cell: str, clock: Clock, network: Network, reconnect_share: float) -> None:
        """`reconnect_share`: of the time within which links come back."""
        self.keys = Keys(cell)
        self.clock = clock
        self.network = network
        self.reconnect_s = _RECONNECT_S[0] + reconnect_share * (_RECONNECT_S[1] - _RECONNECT_S[0])
        self.arrivals = 0
        self.on_published: list[Callable[[SimSession, object], None]] = []
        self._sessions: dict[str, SimSession] = {}
        self._routes: dict[str, list[tuple[SimSession, list[_Store]]]] = {}
        self._asked: list[_Asked] = []
        self._shown: dict[tuple[SimSession, str], bool] = {}
        self._bad_since: dict[tuple[SimSession, str], float] = {}
        self._tokens: dict[str, SimSession] = {}
        clock.after(_LOOK_S, self._look_at_links)

    # Sessions

    def join(self, session: SimSession) -> None:
        self._sessions[session.process] = session
        self.forget_routes()

    def leave(self, session: SimSession) -> None:
        """Who watched its token or waits for its answer hears of it, as far as the links are whole."""
        if self._sessions.get(session.process) is session:
            del self._sessions[session.process]
        self.forget_routes()
        for asked in list(self._asked):
            if asked.server is session and self._linked(session, asked._frm):
                asked.nobody()
        for observer in self._observers():
            if self._linked(session, observer):
                self._tell(observer, session.alive, session.process, False)

    def forget_routes(self) -> None:
        self._routes.clear()

    # State

    def publish(self, frm: SimSession, message: object, to: Callable[[str], bool] | None = None) -> None:
        """Send a state message to all others, or only to the processes that `to` names."""
        key, payload = self.keys.of(message), encode(message)
        for look in self.on_published:
            look(frm, message)
        if frm._deaf and frm.deaf(self.clock.now):
            return
        routes = self._routes.get(key)
        if routes is None:
            routes = self._routes[key] = self._matching(key)
        now, delays = self.clock.now, self.network.delays
        for session, stores in routes:
            if session is frm or (to is not None and not to(session.process)):
                continue
            for delay_s in delays(frm.process, session.process):
                for store in stores:
                    session.receive(now + delay_s, store, key, payload)

    def _matching(self, key: str) -> list[tuple[SimSession, list[_Store]]]:
        found = []
        for session in self._sessions.values():
            stores = [store for pattern, store in session.subscriptions if pattern.fullmatch(key)]
            if stores:
                found.append((session, stores))
        return found

    # Calls

    def ask(
        self, frm: SimSession, to: str, call: Call, timeout_s: float, done: Callable[[Reply | None, str], None]
    ) -> None:
        """Call `to`; `done` gets the reply, or None and what came instead, once."""
        data = encode_call(call)
        for look in self.on_published:
            look(frm, call)
        asked = _Asked(self, frm, to, call, done)
        self._asked.append(asked)
        self.clock.after(timeout_s, asked.late)
        server = next((each for each in self._sessions.values() if to in each.serves), None)
        if server is None:
            asked.nobody()
            return
        asked.server = server
        if frm.deaf(self.clock.now):
            return
        query_key = self.keys.command(to, call.command.verb)
        for delay_s in self.network.delays(frm.process, server.process):
            query = _Query(asked, query_key, data)
            server.receive(self.clock.now + delay_s, server.serves[to].store, query)

    def ended(self, asked: _Asked) -> None:
        self._asked.remove(asked)

    # Liveliness

    def _observers(self) -> list[SimSession]:
        return [session for session in self._sessions.values() if session.tokens is not None]

    def _look_at_links(self) -> None:
        """Tokens go with links that are bad for longer than their lease, and come back with them."""
        self.clock.after(_LOOK_S, self._look_at_links)
        now, observers = self.clock.now, self._observers()
        self._tokens |= {session.alive: session for session in self._sessions.values() if session.alive}
        for key, session in list(self._tokens.items()):
            for observer in observers:
                if observer is session:
                    continue
                if session.is_open and self._linked(session, observer):
                    bad_s = self._bad_since.pop((observer, key), None)
                    if not self._shown.get((observer, key), False):
                        late_s = 0.0 if bad_s is None else self.reconnect_s
                        self._tell(observer, key, session.process, True, late_s)
                elif self._shown.get((observer, key), False):
                    since = self._bad_since.setdefault((observer, key), now)
                    if now - since >= LEASE_S or (not session.is_open and self._linked(session, observer)):
                        self._tell(observer, key, session.process, False)
            if not session.is_open and not any(self._shown.get((observer, key), False) for observer in observers):
                del self._tokens[key]

    def _linked(self, one: SimSession, other: SimSession) -> bool:
        """Whether both hear each other; who is frozen hears nobody."""
        now = self.clock.now
        frozen = any(begin <= now < end for each in (one, other) for begin, end in each._deaf)
        passes = self.network.passes
        return not frozen and passes(one.process, other.process) and passes(other.process, one.process)

    def _tell(self, observer: SimSession, key: str, frm: str, present: bool, late_s: float = 0.0) -> None:
        if not key or self._shown.get((observer, key), False) is present or observer.tokens is None:
            return
        self._shown[observer, key] = present
        at = self.clock.now + late_s + self.network.late(frm, observer.process)
        observer.receive(at, observer.tokens.store, key, present)


def _matcher(pattern: str) -> re.Pattern[str]:
    """Zenoh's wildcards: `*` is one chunk, `**` any number of them."""
    chunks = {"*": "[^/]+", "**": ".*"}
    return re.compile("/".join(chunks.get(chunk, re.escape(chunk)) for chunk in pattern.split("/")))
