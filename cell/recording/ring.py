"""The last minutes of a cell in memory, as they arrived, until something happens that is worth a file."""

import pickle
import zlib
from bisect import bisect_right
from collections import deque
from collections.abc import Iterator
from operator import itemgetter
from threading import Lock

Told = tuple[float, str, bytes]
"""When a payload was said [s], its key, and what it was."""
MOST_KEYS = 1000
"""Whose newest payload from before the ring is kept: as many as a cell may have."""
BEFORE_S = 10.0
"""What was told longer before the ring is no state any more: all states are repeated."""


class Ring:
    """Holds payloads of the last `keep_s` in at most `most_bytes`, packed second by second; older ones go first.

    Of each key the newest one that had to go stays, so that what is told seldom (where a zone is) is known then too.
    """

    def __init__(self, keep_s: float, most_bytes: int) -> None:
        self._keep_s = keep_s
        self._most_bytes = most_bytes
        self._lock = Lock()
        self._new: list[Told] = []
        self._new_bytes = 0
        self._packed: deque[tuple[float, bytes]] = deque()
        """When each was packed, and what is in it, by keys."""
        self._bytes = 0
        self._before: dict[str, Told] = {}
        self.lost = 0
        """Payloads that found no room, because more came within a second than the ring may hold."""

    def store(self, at: float, key: str, payload: bytes) -> None:
        """Take a payload that was said at `at`; cheap, for the thread on which it arrives."""
        with self._lock:
            if self._new_bytes + len(payload) > self._most_bytes:
                self.lost += 1
                return
            self._new.append((at, key, payload))
            self._new_bytes += len(payload)

    def pack(self, until: float) -> None:
        """Pack what was said up to `until`, in the order of its times, and let go what is too old or too much.

        For one thread, each second.
        """
        with self._lock:
            new, self._new = _parted(self._new, until)
            self._new_bytes = sum(len(payload) for _, _, payload in self._new)
        if new:
            # Messages on one key are alike: next to each other they take half of the room and of the time.
            packed = zlib.compress(pickle.dumps(sorted(new, key=itemgetter(1))), 1)
            self._packed.append((until, packed))
            self._bytes += len(packed)
        while self._packed and (self._bytes > self._most_bytes or until - self._packed[0][0] > self._keep_s):
            _, oldest = self._packed.popleft()
            self._bytes -= len(oldest)
            for told in _unpacked(oldest):
                if told[1] in self._before or len(self._before) < MOST_KEYS:
                    self._before[told[1]] = told

    def begins(self) -> float:
        """Since when all that came is told, but for `lost`; 0 when that is nothing."""
        return _unpacked(self._packed[0][1])[0][0] if self._packed else 0.0

    def told(self) -> Iterator[Told]:
        """All that was packed, oldest first; what had to go lately comes before it. From the thread that packs."""
        begin = self.begins() - BEFORE_S
        yield from sorted(told for told in self._before.values() if told[0] >= begin)
        for _, packed in self._packed:
            yield from _unpacked(packed)


def _parted(told: list[Told], until: float) -> tuple[list[Told], list[Told]]:
    """What was said up to `until`, in order, and the rest."""
    ordered = sorted(told, key=itemgetter(0))
    count = bisect_right(ordered, until, key=itemgetter(0))
    return ordered[:count], ordered[count:]


def _unpacked(packed: bytes) -> list[Told]:
    told: list[Told] = pickle.loads(zlib.decompress(packed))
    return sorted(told, key=itemgetter(0))
