"""Error control of a node (CiA 301): heartbeats (1016h, 1017h), or node guarding (100Ch, 100Dh)."""


class HeartbeatProducer:
    """Says when the next heartbeat is due; the schedule does not drift."""

    def __init__(self) -> None:
        self._period_s = 0.0
        self._next = 0.0

    def configure(self, period_ms: int, now: float) -> None:
        """A new period; 0 switches it off."""
        self._period_s = period_ms / 1000.0
        self._next = now + self._period_s

    def due(self, now: float) -> bool:
        if self._period_s == 0.0 or now < self._next:
            return False
        self._next = max(self._next + self._period_s, now)
        return True


class HeartbeatConsumer:
    """Watches one other node, from its first heartbeat on."""

    def __init__(self) -> None:
        self._timeout_s = 0.0
        self._heard: float | None = None
        self.node_id = 0
        """Node whose heartbeat is watched; 0: nobody's."""
        self.lost = False

    def configure(self, entry: int) -> None:
        """A new entry of 1016h: Node-ID << 16 | time in ms. Watching begins with the next heartbeat."""
        self.node_id = entry >> 16 & 0x7F if entry & 0xFFFF else 0
        self._timeout_s = (entry & 0xFFFF) / 1000.0
        self._heard = None
        self.lost = False

    def heard(self, now: float) -> bool:
        """A heartbeat came; returns whether it ends a loss."""
        returned, self.lost = self.lost, False
        self._heard = now
        return returned

    def missed(self, now: float) -> bool:
        """Whether the watched node falls silent just now."""
        if self.lost or self._heard is None or now - self._heard <= self._timeout_s:
            return False
        self.lost = True
        return True


class GuardedLife:
    """Node guarding: a poll is answered with a toggle bit; after the first one the next must come in time."""

    def __init__(self) -> None:
        self._heard: float | None = None
        self._toggle = 0
        self.lost = False

    def restart(self) -> None:
        self._heard = None
        self._toggle = 0
        self.lost = False

    def polled(self, state: int, now: float) -> int:
        """The byte of the answer."""
        self._heard = now
        self.lost = False
        answer = state | self._toggle
        self._toggle ^= 0x80
        return answer

    def missed(self, guard_ms: int, factor: int, now: float) -> bool:
        """Whether the master falls silent just now; 0 in either object switches this off."""
        life_s = guard_ms * factor / 1000.0
        if self.lost or self._heard is None or life_s == 0.0 or now - self._heard <= life_s:
            return False
        self.lost = True
        return True
