"""Heartbeats of a node (CiA 301): the one it produces (1017h) and the one it watches (1016h)."""


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
