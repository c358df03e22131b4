"""The large streams of a process once more, many messages in one, for whoever records a cell.

Each message that a process hears wakes it, and whoever passes it on: to record feedback of every bus cycle one by one
costs more than to make it. So what is published of the `BUNDLED` kinds is told again in bundles, on a key of the
process, while somebody hears that. Of a process that is killed the last bundle is missing.

| offset | type | field |
|---|---|---|
| 0 | 4 bytes | magic `ZBU1` |
| then | f32, u16, u32 | of each message: age_s when the bundle left, length of its key, length of its payload |
| then | utf-8 | its key, below `cell/<cell>/` |
| then | bytes | its payload |
"""

import struct
import time
from collections.abc import Callable

from cell.messages import DriveFeedback, PlannedWay, Presence, SetpointBlock
from cell.net.errors import CodecError

BUNDLED = (DriveFeedback, PlannedWay, Presence, SetpointBlock)
"""Nearly all bytes that a cell says."""
EVERY_S = 0.1
"""So much is in a bundle at most."""
MOST_BYTES = 32_768
"""A bundle leaves that has so much: it fits one batch of Zenoh's, so a loop never waits for a link to take it."""
OLDEST_S = 3600.0
"""No message in a bundle is older."""
_MAGIC = b"ZBU1"
_ENTRY = struct.Struct("<fHI")


class Bundler:
    """What one process has published since its last bundle.

    Args:
        send: publishes a bundle.
        wanted: whether somebody hears bundles at present.
    """

    def __init__(
        self, send: Callable[[bytes], None], wanted: Callable[[], bool], now: Callable[[], float] = time.monotonic
    ) -> None:
        self._send = send
        self._wanted = wanted
        self._now = now
        self._kept: list[tuple[float, bytes, bytes]] = []
        self._bytes = 0

    def add(self, key: str, payload: bytes) -> None:
        """This was published just now; the bundle leaves once it is full."""
        now = self._now()
        self._kept.append((now, key.encode(), payload))
        self._bytes += len(payload)
        if self._bytes >= MOST_BYTES or now - self._kept[0][0] >= EVERY_S:
            self.flush()

    def flush(self) -> None:
        """What there is leaves, if somebody wants it."""
        kept, self._kept, self._bytes = self._kept, [], 0
        if not kept or not self._wanted():
            return
        now = self._now()
        parts = [_MAGIC]
        for at, key, payload in kept:
            parts += (_ENTRY.pack(min(now - at, OLDEST_S), len(key), len(payload)), key, payload)
        self._send(b"".join(parts))


def unbundled(data: bytes) -> list[tuple[str, bytes, float]]:
    """Key below that of the cell, payload and age [s] of each message in a bundle. Raises `CodecError`."""
    if data[:4] != _MAGIC:
        raise CodecError("bundle", f"magic {data[:4]!r}, expected {_MAGIC!r}")
    found, at = [], 4
    try:
        while at < len(data):
            age_s, key_length, length = _ENTRY.unpack_from(data, at)
            at += _ENTRY.size
            key = data[at : at + key_length].decode()
            at += key_length
            payload = data[at : at + length]
            at += length
            if not 0.0 <= age_s <= OLDEST_S:
                raise CodecError("bundle", f"a message that is {age_s} s old, allowed is 0 to {OLDEST_S:g}")
            found.append((key, payload, age_s))
    except (struct.error, UnicodeDecodeError) as error:
        raise CodecError("bundle", str(error)) from error
    if at != len(data):
        raise CodecError("bundle", f"{len(data)} bytes end {at - len(data)} bytes early")
    return found
