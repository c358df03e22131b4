"""Errors of `cell.net`. All derive from `NetError`."""

from collections.abc import Sequence


class NetError(Exception):
    """Root of everything that `cell.net` raises."""


class CodecError(NetError):
    """Bytes that are no message of the expected kind, or a message that may not become bytes."""

    def __init__(self, kind: str, reason: str) -> None:
        super().__init__(f"{kind}: {reason}")
        self.kind = kind
        self.reason = reason


class ConfigurationError(NetError):
    """Zenoh refuses its configuration: a file, an endpoint or a `--cfg` setting."""

    def __init__(self, where: str, reason: str) -> None:
        super().__init__(f"Zenoh configuration, {where}: {reason}")
        self.where = where
        self.reason = reason


class EndpointInUse(NetError):
    """The endpoint this process must listen on belongs to another program; `who` says to which."""

    def __init__(self, endpoint: str, who: str) -> None:
        super().__init__(f"{endpoint} is in use; {who}: stop it or choose another endpoint with -l")
        self.endpoint = endpoint
        self.who = who


class Unreachable(NetError):
    """Nobody can be reached at the endpoints a client connects to."""

    def __init__(self, endpoints: Sequence[str], reason: str) -> None:
        super().__init__(
            f"nobody answers at {', '.join(endpoints) or 'any endpoint'} ({reason}): "
            "start the cell, or name its manager's endpoint with -e"
        )
        self.endpoints = tuple(endpoints)
        self.reason = reason


class CallError(NetError):
    """A call that brought no reply. None of its kinds means yes."""

    def __init__(self, to: str, verb: str, reason: str) -> None:
        super().__init__(f"{verb} to {to}: {reason}")
        self.to = to
        self.verb = verb
        self.reason = reason


class NoAnswer(CallError):
    """Nobody serves this call, or whoever did was gone before answering; it may have been carried out."""


class CallTimedOut(CallError):
    """Somebody may serve this call, but did not answer in time; it may have been carried out, or be so soon."""


class CallFailed(CallError):
    """The other side refused to handle the call, or stopped before it answered; `reason` is what it said."""
