"""Virtual time: events in order of their time."""

import heapq
import itertools
from collections.abc import Callable


class Clock:
    """Runs what was planned with `after`, in order; time stands still while something runs."""

    def __init__(self) -> None:
        self.now = 1000.0
        self._order = itertools.count()
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self.on_pause: list[Callable[[], None]] = []
        """Called whenever time stops running."""

    def after(self, delay_s: float, action: Callable[[], None]) -> None:
        heapq.heappush(self._events, (self.now + delay_s, next(self._order), action))

    def run_until(self, deadline: float, done: Callable[[], bool] = lambda: False) -> bool:
        """Advance to `deadline`, or until `done()`; true when done."""
        is_done = self._run_until(deadline, done)
        for look in self.on_pause:
            look()
        return is_done

    def _run_until(self, deadline: float, done: Callable[[], bool]) -> bool:
        while self._events and self._events[0][0] <= deadline:
            if done():
                return True
            self.now, _, action = heapq.heappop(self._events)
            action()
        self.now = max(self.now, deadline)
        return done()
