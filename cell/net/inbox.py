"""A bounded queue in order of arrival, for what must not be merged: events, e-stops, outcomes of calls."""

import time
from collections import deque
from collections.abc import Callable
from threading import Lock

from cell.core import Arrived
from cell.net.latest import Decoder


class Inbox:
    """Messages of others wait up to a number, and those that do not fit are counted; own messages always fit."""

    def __init__(self, decoder: Decoder, size: int = 256, now: Callable[[], float] = time.monotonic) -> None:
        self._decoder = decoder
        self._now = now
        self._size = size
        self._lock = Lock()
        self._waiting: deque[tuple[Callable[[], object | None], float]] = deque()
        self._dropped = 0

    @property
    def dropped(self) -> int:
        """Payloads that found the queue full."""
        return self._dropped

    def store(self, key: str, payload: bytes, age_s: float = 0.0) -> None:
        """Called by Zenoh's thread. `age_s`: what came in a bundle was sent before."""
        at = self._now() - age_s
        with self._lock:
            if len(self._waiting) < self._size:
                self._waiting.append((lambda: self._decoder.decode(key, payload), at))
            else:
                self._dropped += 1

    def tell(self, message: object) -> None:
        """Add a message that is already one (`AskDone`, `TokenGone`)."""
        at = self._now()
        with self._lock:
            self._waiting.append((lambda: message, at))

    def take(self) -> list[object]:
        """Everything that waits, in order."""
        return [arrived.message for arrived in self.take_arrived()]

    def take_arrived(self) -> list[Arrived]:
        """The same, each with the moment at which it arrived."""
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
        decoded = ((read(), at) for read, at in waiting)
        return [Arrived(message, at) for message, at in decoded if message is not None]
