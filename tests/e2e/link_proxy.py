"""A TCP proxy in front of an endpoint: a network that cuts, delays and holds what it should carry.

A stream keeps its own order. What links do to each other is another matter: a proxy for each link can let one be
overtaken by the others, and `delay` with `keep_after_end` delivers what an ended connection carried after the one that
took its place has begun.
"""

import contextlib
import socket
import threading
import time
from collections import deque
from types import TracebackType
from typing import Self

TO_TARGET, TO_CALLER = "to the target", "to the caller"
_CHUNK = 65536
_POLL_S = 0.02


class LinkProxy:
    """Listens on a port of its own and connects whoever comes to the target. A context manager."""

    def __init__(self, target: str) -> None:
        """`target`: an endpoint such as `tcp/127.0.0.1:7450`; it need not listen yet."""
        host, _, port = target.partition("/")[2].rpartition(":")
        self._target = host, int(port)
        self._server = socket.create_server(("127.0.0.1", 0))
        self._lock = threading.Condition()
        self._delay_s = {TO_TARGET: 0.0, TO_CALLER: 0.0}
        self._held = {TO_TARGET: False, TO_CALLER: False}
        self._cut = False
        self._keep = False
        self._closed = False
        self._connections: list[_Connection] = []
        self.carried = {TO_TARGET: 0, TO_CALLER: 0}
        """Bytes, by direction."""
        self._accepting = threading.Thread(target=self._accept, daemon=True)

    @property
    def endpoint(self) -> str:
        """Where to connect instead of the target."""
        return f"tcp/127.0.0.1:{self._server.getsockname()[1]}"

    def __enter__(self) -> Self:
        self._accepting.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        with self._lock:
            self._closed = True
            self._lock.notify_all()
        self._server.close()
        self._end_connections()

    def cut(self) -> None:
        """Every connection ends now, and new ones end at once."""
        with self._lock:
            self._cut = True
        self._end_connections()

    def hold(self, direction: str) -> None:
        """Carry nothing in one direction; what comes waits, and connections stay as long as their ends want them."""
        with self._lock:
            self._held[direction] = True

    def delay(self, direction: str, seconds: float, *, keep_after_end: bool = False) -> None:
        """Carry everything in one direction so much later; optionally after the end of its connection too."""
        with self._lock:
            self._delay_s[direction] = seconds
            self._keep = keep_after_end

    def mend(self) -> None:
        """Carry everything again; what was held is delivered now."""
        with self._lock:
            self._cut = False
            self._held = dict.fromkeys(self._held, False)
            self._delay_s = dict.fromkeys(self._delay_s, 0.0)
            self._lock.notify_all()

    # Of the connections

    def due(self, direction: str) -> float:
        """When what comes now is delivered [s, time.monotonic()]."""
        with self._lock:
            return time.monotonic() + self._delay_s[direction]

    def wait_free(self, direction: str, due: float, ended: threading.Event) -> bool:
        """Wait until something may be delivered; false when it never will be."""
        with self._lock:
            while True:
                if self._closed or (ended.is_set() and not self._keep):
                    return False
                left = due - time.monotonic()
                if not self._held[direction] and (left <= 0.0 or self._delay_s[direction] == 0.0):
                    return True
                self._lock.wait(min(max(left, 0.001), _POLL_S))

    def count(self, direction: str, size: int) -> None:
        with self._lock:
            self.carried[direction] += size

    def _accept(self) -> None:
        while True:
            try:
                caller, _ = self._server.accept()
            except OSError:
                return
            with self._lock:
                cut = self._cut
            try:
                target = None if cut else socket.create_connection(self._target, timeout=1.0)
            except OSError:
                target = None
            if target is None:
                caller.close()
                continue
            target.settimeout(None)
            with contextlib.suppress(OSError):  # its caller may be gone again already
                connection = _Connection(self, caller, target)
                with self._lock:
                    self._connections = [one for one in self._connections if not one.ended.is_set()]
                    self._connections.append(connection)

    def _end_connections(self) -> None:
        with self._lock:
            ending, self._connections = self._connections, []
        for connection in ending:
            connection.end()


class _Connection:
    """Two sockets and what is under way between them."""

    def __init__(self, proxy: LinkProxy, caller: socket.socket, target: socket.socket) -> None:
        self._proxy = proxy
        self._sockets = caller, target
        self.ended = threading.Event()
        for direction, source, sink in ((TO_TARGET, caller, target), (TO_CALLER, target, caller)):
            for each in (source, sink):
                each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            waiting: deque[tuple[float, bytes]] = deque()
            came = threading.Semaphore(0)
            for work in (self._read, self._write):
                threading.Thread(target=work, args=(direction, source, sink, waiting, came), daemon=True).start()

    def end(self) -> None:
        """Both ends see that the connection is over."""
        self.ended.set()
        for each in self._sockets:
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    def _read(
        self,
        direction: str,
        source: socket.socket,
        _sink: socket.socket,
        waiting: deque[tuple[float, bytes]],
        came: threading.Semaphore,
    ) -> None:
        while True:
            try:
                data = source.recv(_CHUNK)
            except OSError:
                data = b""
            waiting.append((self._proxy.due(direction), data))
            came.release()
            if not data:
                return

    def _write(
        self,
        direction: str,
        _source: socket.socket,
        sink: socket.socket,
        waiting: deque[tuple[float, bytes]],
        came: threading.Semaphore,
    ) -> None:
        while True:
            came.acquire()
            due, data = waiting.popleft()
            if not data or not self._proxy.wait_free(direction, due, self.ended):
                self.end()
                return
            try:
                sink.sendall(data)
            except OSError:
                self.end()
                return
            self._proxy.count(direction, len(data))
