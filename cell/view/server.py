"""The one server of the page: `viser` behind the gate, on a port that nobody else has."""

import asyncio
import contextlib
import http
import io
import itertools
import socket
from collections.abc import Callable, Coroutine, Iterator
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from cell.view.control import Visitor
from cell.view.gate import Entered, Gate, Level, NoEntry

Handler = Callable[[ServerConnection], Coroutine[Any, Any, None]]
_ENTER = b"<!doctype html><meta http-equiv=refresh content='0;url=/'><title>zencell</title>"
"""Not a redirect: a browser that came from elsewhere would follow that without the cookie."""


@dataclass(frozen=True, slots=True)
class Here:
    """The connection on which the present message came."""

    visitor: Visitor
    connection: ServerConnection

    async def ping(self) -> float:
        """Wait until the browser has answered a ping; when it was sent, by the clock of the loop [s]."""
        sent = asyncio.get_running_loop().time()
        await (await self.connection.ping())
        return sent


_here: ContextVar[Here] = ContextVar("here")


def here() -> Here:
    """Whose message is being looked at; for `async` callbacks of `viser`, which run in the context of a connection."""
    return _here.get()


class PortTaken(Exception):
    """Somebody listens at the page's port already."""

    def __init__(self, host: str, port: int, who: str) -> None:
        super().__init__(f"port {port} of {host} is in use" + (f" by {who}" if who else ""))
        self.who = who


class Unguarded(Exception):
    """This version of `viser` does not start its server where the gate can stand in front of it."""


class GatedServer(viser.ViserServer):
    """`viser`, answering only what the gate lets through. It never opens its public tunnel, whoever asks for that."""

    def __init__(self, gate: Gate, listener: socket.socket) -> None:
        host, port = listener.getsockname()[:2]
        doorway = _Doorway(gate, listener)
        with doorway.in_place(), _quiet():
            super().__init__(host=host, port=port, verbose=False)
        if not doorway.used:
            self.stop()
            raise Unguarded(
                f"viser {viser.__version__} starts its server in another way; install the one that is asked for: "
                "pip install 'zencell[view]'"
            )

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002
        """There is none."""
        return None

    def stop(self) -> None:
        """End the server and its thread."""
        with _quiet():
            super().stop()


class _Doorway:
    """Takes the place of `websockets.asyncio.server.serve` while `viser` starts its server."""

    def __init__(self, gate: Gate, listener: socket.socket) -> None:
        self._gate = gate
        self._listener = listener
        self._serve = websockets.asyncio.server.serve
        self._numbers = itertools.count(1)
        self.used = False

    @contextlib.contextmanager
    def in_place(self) -> Iterator[None]:
        """`viser` looks the function up when it starts, and has no hook of its own."""
        setattr(websockets.asyncio.server, "serve", self.serve)  # noqa: B010
        try:
            yield
        finally:
            setattr(websockets.asyncio.server, "serve", self._serve)  # noqa: B010

    def serve(self, handler: Handler, _host: str, _port: int, *, process_request: Any, **options: Any) -> Any:
        """As the original, on our socket and behind the gate."""
        self.used = True

        def asked(connection: ServerConnection, request: Request) -> Response | None:
            return self._asked(connection, request, process_request)

        return self._serve(self._guarded(handler), sock=self._listener, process_request=asked, **options)

    def _asked(self, connection: ServerConnection, request: Request, answer: Any) -> Response | None:
        found = self._judged(request)
        if isinstance(found, NoEntry):
            return _response(found.status, found.text.encode() + b"\n", {})
        if isinstance(found, Entered):
            return _response(http.HTTPStatus.OK, _ENTER, {"Set-Cookie": found.cookie, "Content-Type": "text/html"})
        response: Response | None = answer(connection, request)
        if response is not None:
            response.headers.update(_SAFER)
        return response

    def _judged(self, request: Request) -> Level | Entered | NoEntry:
        pairs = [(name.lower(), value) for name, value in request.headers.raw_items()]
        headers = dict(pairs)
        if any(sum(name == each for name, _ in pairs) > 1 for each in ("host", "origin", "cookie", "upgrade")):
            return NoEntry(http.HTTPStatus.BAD_REQUEST, "a header stands there twice")
        return self._gate.judge(request.path, headers, "upgrade" in headers)

    def _guarded(self, handler: Handler) -> Handler:
        async def enter(connection: ServerConnection) -> None:
            level = self._judged(connection.request) if connection.request is not None else None
            if not isinstance(level, Level):
                return
            address = str((connection.remote_address or ("unknown",))[0])
            _here.set(Here(Visitor(next(self._numbers), address, level), connection))
            await handler(connection)

        return enter


_SAFER = {
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}


def _response(status: http.HTTPStatus, body: bytes, headers: dict[str, str]) -> Response:
    given = {"Content-Type": "text/plain", **_SAFER, **headers, "Content-Length": str(len(body))}
    return Response(status, status.phrase, Headers(given), body)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """`viser` prints its own address, without the token."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield


def listen(host: str, port: int) -> socket.socket:
    """A listening socket; port 0 takes a free one. Raises `PortTaken`, and `OSError` for what is no own address."""
    try:
        return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        if error.errno != 98:
            raise
        raise PortTaken(host, port, _listener_at(port)) from error


def _listener_at(port: int) -> str:
    """The process that listens at a TCP port, as far as this user may know it; empty where not."""
    lines = [line.split() for table in ("tcp", "tcp6") for line in _lines(Path("/proc/net") / table)[1:]]
    sockets = {f"socket:[{line[9]}]" for line in lines if line[3] == "0A" and line[1].endswith(f":{port:04X}")}
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if any(str(each.readlink()) in sockets for each in (process / "fd").iterdir()):
                words = (process / "cmdline").read_bytes().split(b"\0")
                return f"process {process.name}: {b' '.join(words).decode(errors='replace').strip()}"
    return ""


def _lines(file: Path) -> list[str]:
    try:
        return file.read_text().splitlines()
    except OSError:
        return []
