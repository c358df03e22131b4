"""How late the bus cycles come. No sample is skipped or caught up for it: one per SYNC, and the clock is the SYNC."""


class Lateness:
    """Counts cycles that begin more than half a cycle late, measured from the cycle before."""

    def __init__(self, cycle_s: float) -> None:
        self._cycle_s = cycle_s
        self._last: float | None = None
        self.late_cycles = 0
        self.worst_s = 0.0

    def cycle(self, now: float) -> float:
        """A cycle begins; by how much it is late [s]."""
        last, self._last = self._last, now
        if last is None:
            return 0.0
        late_s = max(0.0, now - last - self._cycle_s)
        self.worst_s = max(self.worst_s, late_s)
        if late_s > 0.5 * self._cycle_s:
            self.late_cycles += 1
        return late_s
