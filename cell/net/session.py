"""A process' Zenoh session: what it publishes, hears, serves and asks, and the order in which all of it ends."""

import uuid
from collections.abc import Callable
from threading import Event
from types import TracebackType
from typing import Any, Self

import zenoh
from zenoh.handlers import Callback

from cell.core import Ask, AskDone
from cell.messages import STATES, Call, Command, Heard, Reply, Urgency
from cell.net.bundle import BUNDLED, Bundler, unbundled
from cell.net.calls import Calls
from cell.net.codec import decode, encode, encode_call
from cell.net.endpoint import who_answers
from cell.net.errors import (
    CallError,
    CallFailed,
    CallTimedOut,
    CodecError,
    ConfigurationError,
    EndpointInUse,
    NetError,
    NoAnswer,
    Unreachable,
)
from cell.net.inbox import Inbox
from cell.net.keys import Keys
from cell.net.latest import Decoder, Latest, log_problem
from cell.net.liveliness import TokenWatch
from cell.net.options import Link, ZenohOptions, effective_link, zenoh_config

__all__ = ["CellSession", "Link", "ZenohOptions"]

_PRIORITY = {
    Urgency.REAL_TIME: zenoh.Priority.REAL_TIME,
    Urgency.INTERACTIVE: zenoh.Priority.INTERACTIVE_HIGH,
    Urgency.HIGH: zenoh.Priority.DATA_HIGH,
    Urgency.NORMAL: zenoh.Priority.DATA,
}


def new_call(command: Command, heard: Heard | None = None) -> Call:
    """A call under a fresh id."""
    return Call(uuid.uuid4().hex, command, heard)


class CellSession:
    """A context manager around one Zenoh session; nothing of it survives the `with` block, whatever happens inside.

    `keys`, `watch()` and the other methods that declare something may be used only inside the block. Payloads that
    cannot be read are reported once per key to `report`.
    """

    def __init__(
        self,
        cell: str,
        link: Link,
        role: str,
        name: str,
        boot: str,
        zenoh_options: ZenohOptions | None = None,
        report: Callable[[str], None] = log_problem,
    ) -> None:
        self.keys = Keys(cell)
        self.role, self.name, self.boot = role, name, boot
        self.decoder = Decoder(self.keys, report)
        self._report = report
        self._options = zenoh_options or ZenohOptions()
        self._link = effective_link(link, self._options)
        self._config = zenoh_config(self._link, self._options)
        self._session: zenoh.Session | None = None
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._last: dict[str, bytes] = {}
        """The newest payload on each key."""
        self._bundler: Bundler | None = None
        self._subscribers: list[zenoh.Subscriber[Any]] = []
        self._queryables: list[zenoh.Queryable[Any]] = []
        self._calls: list[Calls] = []
        self._tokens: list[zenoh.LivelinessToken] = []
        self._outcomes = Inbox(self.decoder)

    # Opening and closing

    def __enter__(self) -> Self:
        """Open the session. Raises `EndpointInUse`, `Unreachable` (clients only) and `ConfigurationError`."""
        try:
            self._session = zenoh.open(self._config)
        except zenoh.ZError as error:
            raise self._why_not(str(error)) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Stop hearing, then serving, then publishing, then being alive. May be repeated.

        A peer that has frozen can keep Zenoh from closing in time; that is reported, and the session is given up.
        """
        session, self._session = self._session, None
        if session is None:
            return
        publishers, self._publishers = self._publishers, {}
        bundler, self._bundler = self._bundler, None
        try:
            if bundler is not None:
                bundler.flush()
            for subscriber in self._subscribers:
                subscriber.undeclare()  # type: ignore[no-untyped-call]
            for calls in self._calls:
                calls.close()
            declared: list[Any] = [*self._queryables, *publishers.values(), *self._tokens]
            for item in declared:
                item.undeclare()
        finally:
            try:
                session.close()  # type: ignore[no-untyped-call]
            except zenoh.ZError as error:
                self._report(f"the session did not close in order: {str(error).split(' at /')[0]}")

    def _why_not(self, reason: str) -> NetError:
        if "listener" in reason or "Address already in use" in reason:
            endpoint = next((e for e in self._link.listen if e in reason), ", ".join(self._link.listen))
            if "in use" in reason:
                return EndpointInUse(endpoint, who_answers(endpoint, self._options))
            return ConfigurationError(f"listen on {endpoint}", reason.split(" at /")[0])
        if self._link.mode == "client":
            return Unreachable(self._link.connect, reason.split(" at /")[0])
        return ConfigurationError("open", reason.split(" at /")[0])

    @property
    def _open(self) -> zenoh.Session:
        if self._session is None:
            raise NetError("the session is closed; use it inside its `with` block")
        return self._session

    # State

    def publish(self, message: object) -> None:
        """Send a state message on its key; what cannot leave at once is dropped, the next one will come."""
        key = self.keys.of(message)
        publisher = self._publishers.get(key)
        if publisher is None:
            priority = _PRIORITY[STATES[type(message)].urgency]
            publisher = self._publishers[key] = self._open.declare_publisher(
                key,
                congestion_control=zenoh.CongestionControl.DROP,
                priority=priority,
                express=priority == zenoh.Priority.REAL_TIME,
            )
        payload = self._last[key] = encode(message)
        publisher.put(payload)
        if isinstance(message, BUNDLED):
            self._bundle(key, payload)

    def _bundle(self, key: str, payload: bytes) -> None:
        """See `cell.net.bundle`."""
        if self._bundler is None:
            mine = self.keys.bundle(self.role, self.name)
            publisher = self._publishers[mine] = self._open.declare_publisher(
                mine, congestion_control=zenoh.CongestionControl.DROP, priority=zenoh.Priority.DATA_LOW
            )
            self._bundler = Bundler(publisher.put, lambda: publisher.matching_status.matching)  # type: ignore[attr-defined]
        self._bundler.add(key.removeprefix(self.keys.prefix), payload)

    def tell_last(self, key_pattern: str) -> None:
        """Answer queries on matching keys with what was published there last; see `last`."""
        pattern = zenoh.KeyExpr(self.keys.prefix + key_pattern)

        def asked(query: zenoh.Query) -> None:
            for key, payload in list(self._last.items()):
                if pattern.includes(zenoh.KeyExpr(key)) and query.key_expr.intersects(zenoh.KeyExpr(key)):
                    query.reply(key, payload)
            query.drop()  # type: ignore[no-untyped-call]

        self._queryables.append(self._open.declare_queryable(pattern, Callback(asked, indirect=False)))

    def last(self, key_pattern: str, timeout_s: float) -> list[object]:
        """The newest messages on matching keys, as their senders tell them (`tell_last`)."""
        latest = Latest(self.decoder)
        for reply in self._open.get(self.keys.prefix + key_pattern, timeout=timeout_s):
            if reply.ok is not None:
                latest.store(str(reply.ok.key_expr), reply.ok.payload.to_bytes())
        return latest.take_new()

    def watch(self, *key_patterns: str, came: Event | None = None) -> Latest:
        """The newest state on matching keys, own messages left out; patterns are relative to `cell/<cell>/`.

        `came` is set whenever one has come.
        """
        latest = Latest(self.decoder)
        self._subscribe(key_patterns, latest.store, came)
        return latest

    def queue(self, *key_patterns: str, size: int = 256, came: Event | None = None) -> Inbox:
        """Every message on matching keys in order, own messages left out; at most `size` wait. `came` as in `watch`."""
        inbox = Inbox(self.decoder, size)
        self._subscribe(key_patterns, inbox.store, came)
        return inbox

    def _subscribe(
        self, patterns: tuple[str, ...], store: Callable[[str, bytes], None], came: Event | None = None
    ) -> None:
        def stored(key: str, data: bytes) -> None:
            store(key, data)
            if came is not None:
                came.set()

        for pattern in patterns:
            self.hear(self.keys.prefix + pattern, stored)

    def hear(self, key: str, store: Callable[[str, bytes], None]) -> None:
        """Hand every payload on a whole key, the cell's or somebody else's, to `store`, on Zenoh's thread.

        `key` may be a pattern; own messages are left out.
        """

        def heard(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                store(str(sample.key_expr), sample.payload.to_bytes())

        self._subscribers.append(
            self._open.declare_subscriber(key, Callback(heard, indirect=False), allowed_origin=zenoh.Locality.REMOTE)
        )

    def hear_bundles(self, store: Callable[[str, bytes, float], None]) -> None:
        """Hand every payload of the large streams to `store`, with its key and its age [s], on Zenoh's thread."""

        def heard(key: str, data: bytes) -> None:
            try:
                messages = unbundled(data)
            except CodecError as error:
                self.decoder.refuse(key, str(error))
                return
            for below, payload, age_s in messages:
                store(self.keys.prefix + below, payload, age_s)

        self.hear(self.keys.bundle("*", "*"), heard)

    # Calls

    def serve(self, prefix: str) -> Calls:
        """Take calls to `prefix` (`"manager"`, `"robot/left"`, `"gateway/left_bus"`)."""
        calls = Calls(self.keys, prefix)
        handler = Callback(calls.store, indirect=False)
        self._queryables.append(self._open.declare_queryable(self.keys.command(prefix, "*"), handler, complete=True))
        self._calls.append(calls)
        return calls

    def ask(self, to: str, call: Call, timeout_s: float) -> Reply:
        """Call `to` and wait. Raises `NoAnswer`, `CallTimedOut` or `CallFailed`; none of them means yes."""
        replies: list[zenoh.Reply] = list(self._get(to, call, timeout_s, None))
        return _outcome(to, call.command.verb, replies)

    def ask_later(self, ask: Ask) -> None:
        """Call without waiting; the outcome comes as `AskDone` from `outcomes()`."""
        if not isinstance(ask.call, Call):
            raise TypeError(f"an Ask carries a Call, found {type(ask.call).__name__}")
        verb, replies = ask.call.command.verb, list[zenoh.Reply]()

        def done() -> None:
            try:
                outcome = AskDone(ask.ask_id, _outcome(ask.to, verb, replies))
            except CallError as error:
                outcome = AskDone(ask.ask_id, None, str(error))
            self._outcomes.tell(outcome)

        self._get(ask.to, ask.call, ask.timeout_s, Callback(replies.append, drop=done, indirect=False))

    def outcomes(self) -> list[object]:
        """`AskDone` of the calls that ended since the last look."""
        return self._outcomes.take()

    def _get(self, to: str, call: Call, timeout_s: float, handler: Any) -> Any:
        return self._open.get(
            self.keys.command(to, call.command.verb),
            handler,
            payload=encode_call(call),
            encoding=zenoh.Encoding.APPLICATION_JSON,
            timeout=timeout_s,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.INTERACTIVE_HIGH,
        )

    # Being there

    def declare_alive(self) -> None:
        """Show this process' liveliness token."""
        key = self.keys.alive(self.role, self.name, self.boot)
        self._tokens.append(self._open.liveliness().declare_token(key))

    def token_watch(self) -> TokenWatch:
        """Follow the tokens of the cell's other processes."""
        watch = TokenWatch(self.keys)

        def heard(sample: zenoh.Sample) -> None:
            watch.store(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        self._subscribers.append(
            self._open.liveliness().declare_subscriber(
                f"{self.keys.prefix}alive/**", Callback(heard, indirect=False), history=True
            )
        )
        return watch

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Where this process listens."""
        return self._link.listen

    def links(self) -> int:
        """Transports that are up."""
        return len(self._open.info.transports())


def _outcome(to: str, verb: str, replies: list[zenoh.Reply]) -> Reply:
    """The one reply among what came back, or the error that says what came instead."""
    if not replies:
        raise NoAnswer(to, verb, "nobody answers; is it running? If it was, this may have been carried out")
    good = next((reply.ok for reply in replies if reply.ok is not None), None)
    if good is not None:
        try:
            return decode(Reply, good.payload.to_bytes())
        except CodecError as error:
            raise CallFailed(to, verb, f"answered with something that is no reply ({error})") from error
    failed = next(reply.err for reply in replies if reply.err is not None)
    text = failed.payload.to_string()
    if text == "Timeout":
        raise CallTimedOut(to, verb, "no answer in time; this may have been carried out")
    raise CallFailed(to, verb, text)
