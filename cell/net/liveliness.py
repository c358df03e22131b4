"""Liveliness tokens of the cell's processes: a token that goes is news, a token that stays proves nothing."""

from collections import deque
from threading import Lock

from cell.messages.common import TokenGone
from cell.net.keys import Alive, Keys


class TokenWatch:
    """Who has a token at the moment, and who lost it since the last look."""

    def __init__(self, keys: Keys) -> None:
        self._keys = keys
        self._lock = Lock()
        self._alive: set[Alive] = set()
        self._gone: deque[TokenGone] = deque(maxlen=256)

    def store(self, key: str, present: bool) -> None:
        """Called by Zenoh's thread."""
        alive = self._keys.alive_of(key)
        if alive is None:
            return
        with self._lock:
            if present:
                self._alive.add(alive)
            elif alive in self._alive:
                self._alive.discard(alive)
                self._gone.append(TokenGone(alive.role, alive.name, alive.boot))

    def alive(self) -> frozenset[Alive]:
        """The processes whose tokens are present."""
        with self._lock:
            return frozenset(self._alive)

    def take(self) -> list[TokenGone]:
        """Tokens that went since the last call, in order."""
        with self._lock:
            gone = list(self._gone)
            self._gone.clear()
        return gone
