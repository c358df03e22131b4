"""Who may open the page: the address has a token, the browser comes from this page, and names this computer.

`viser` answers anybody who reaches its port, also a page of a stranger that is open in the operator's browser. The gate
stands in front of every request, plain or websocket, inside the one server that listens:

- *Host* is one of the names under which the page is told, so no foreign name can be made to lead here (DNS rebinding).
- *Origin*, which a browser sends with every websocket, is that same address.
- The *token* of the printed address becomes a cookie that no other site's requests carry; each level has its own token.
"""

import hmac
import http
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit


class Level(IntEnum):
    """What the holder of a token may do; each includes those below."""

    WATCH = 1
    OPERATE = 2
    """Programs, jogging, drives on and off, the emergency stop."""
    CONFIGURE = 3
    """What stays: points, forced inputs, outputs."""


@dataclass(frozen=True, slots=True)
class NoEntry:
    """Why a request gets nothing."""

    status: http.HTTPStatus
    text: str


@dataclass(frozen=True, slots=True)
class Entered:
    """A request with a good token in its address: it gets the cookie, and the address without the token."""

    cookie: str


@dataclass(frozen=True, slots=True)
class Gate:
    """Judges requests; `names` are the hosts under which the page is told."""

    names: tuple[str, ...]
    highest: Level
    tokens: Mapping[Level, str] = field(init=False)

    def __post_init__(self) -> None:
        tokens = {level: secrets.token_urlsafe(24) for level in Level if level <= self.highest}
        object.__setattr__(self, "tokens", tokens)

    def judge(self, path: str, headers: Mapping[str, str], websocket: bool) -> Level | Entered | NoEntry:
        """What a request with these headers, names in lower case, gets: a level, a cookie, or nothing."""
        host = headers.get("host", "")
        if _split(host)[0] not in self.names:
            return NoEntry(http.HTTPStatus.FORBIDDEN, "this page is not told under that name")
        origin = headers.get("origin")
        if (websocket or origin is not None) and origin not in (f"http://{host}", f"https://{host}"):
            return NoEntry(http.HTTPStatus.FORBIDDEN, "a page of another origin gets nothing here")
        given = parse_qs(urlsplit(path).query).get("token", [""])[0]
        if level := self._level(given):
            return level if websocket else Entered(self._cookie(level, host))
        if level := self._level(_cookie_of(headers.get("cookie", ""), _cookie_name(host))):
            return level
        text = "open the page by the whole address that cell view has printed, with its token"
        return NoEntry(http.HTTPStatus.UNAUTHORIZED, text)

    def _level(self, token: str) -> Level | None:
        given = token.encode()
        found = [level for level, known in self.tokens.items() if hmac.compare_digest(given, known.encode())]
        return found[0] if found else None

    def _cookie(self, level: Level, host: str) -> str:
        return f"{_cookie_name(host)}={self.tokens[level]}; Path=/; HttpOnly; SameSite=Strict"


def _cookie_name(host: str) -> str:
    """Browsers keep cookies by host alone; two pages on two ports must not take each other's."""
    return f"zencell_{_split(host)[1]}"


def _split(host: str) -> tuple[str, int]:
    """Name and port of a Host header; no name where it is none."""
    try:
        found = urlsplit(f"//{host}")
        return found.hostname or "", found.port or 80
    except ValueError:
        return "", 0


def _cookie_of(header: str, name: str) -> str:
    try:
        found = SimpleCookie(header).get(name)
    except CookieError:
        return ""
    return found.value if found is not None else ""
