"""One slot per key: of a state only the newest matters, and a busy key never starves another."""

import logging
import time
from collections.abc import Callable
from threading import Lock

from cell.core import Arrived
from cell.net.codec import decode
from cell.net.errors import CodecError
from cell.net.keys import Keys


def log_problem(text: str) -> None:
    """Where undecodable payloads are reported unless the process says otherwise."""
    logging.getLogger("cell.net").warning(text)


MOST_KEYS = 1000
"""On which payloads wait, or could not be read: as many as a cell may have; strangers' keys do not take memory."""


class Decoder:
    """Turns payloads into messages; what cannot be read is counted, and reported once per key."""

    def __init__(self, keys: Keys, report: Callable[[str], None] = log_problem) -> None:
        self._keys = keys
        self._report = report
        self.failures: dict[str, int] = {}

    def decode(self, key: str, payload: bytes) -> object | None:
        """The message on `key`, or None when this is none."""
        kind = self._keys.type_of(key)
        reason = "no message of this cell travels on this key"
        if kind is not None:
            try:
                message: object = decode(kind, payload)
            except CodecError as error:
                reason = str(error)
            else:
                if self._keys.of(message) == key:
                    return message
                reason = f"the message names another sender, it belongs on {self._keys.of(message)}"
        self.refuse(key, reason)
        return None

    def refuse(self, key: str, reason: str) -> None:
        """What came on this key is no message."""
        if key not in self.failures and len(self.failures) >= MOST_KEYS:
            return
        self.failures[key] = self.failures.get(key, 0) + 1
        if self.failures[key] == 1:
            self._report(f"{key}: ignored, {reason}")


class Latest:
    """The newest payload of each key. Zenoh's callback only stores; decoding is the reader's work."""

    def __init__(self, decoder: Decoder, now: Callable[[], float] = time.monotonic) -> None:
        self._decoder = decoder
        self._now = now
        self._lock = Lock()
        self._new: dict[str, tuple[bytes, float]] = {}

    def store(self, key: str, payload: bytes) -> None:
        """Called by Zenoh's thread."""
        at = self._now()
        with self._lock:
            if key in self._new or len(self._new) < MOST_KEYS:
                self._new[key] = (payload, at)

    def take_new(self) -> list[object]:
        """The newest message of each key that arrived since the last call."""
        return [arrived.message for arrived in self.take_arrived()]

    def take_arrived(self) -> list[Arrived]:
        """The same, each with the moment at which it arrived."""
        with self._lock:
            new, self._new = self._new, {}
        decoded = ((self._decoder.decode(key, payload), at) for key, (payload, at) in new.items())
        return [Arrived(message, at) for message, at in decoded if message is not None]
