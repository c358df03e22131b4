"""What strangers put on keys of their own: plain text, of which only the newest matters."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

_LONGEST = 1000
"""Bytes that are looked at."""


@dataclass(frozen=True, slots=True)
class PlainText:
    """The newest text on a key, and when it arrived [s] by the own clock."""

    key: str
    text: str
    at: float


class PlainSlots:
    """The newest text of each key; Zenoh's callback only stores."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._lock = Lock()
        self._new: dict[str, PlainText] = {}

    def store(self, key: str, payload: bytes) -> None:
        """Called by Zenoh's thread."""
        text = payload[:_LONGEST].decode(errors="replace")
        with self._lock:
            self._new[key] = PlainText(key, text, self._now())

    def take_new(self) -> list[PlainText]:
        """What arrived since the last call."""
        with self._lock:
            new, self._new = self._new, {}
        return list(new.values())
