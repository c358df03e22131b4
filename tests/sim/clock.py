"""Virtual time: events in order of their time."""

import heapq
from collections.abc import Callable
from typing import Any


class Clock:
    """Runs what was planned with `after`, in order; time stands still while something runs."""

    def __init__(self) -> None:
        self.now = 1000.0
        self._planned = 0
        self._events: list[tuple[float, int, Callable[..., object], tuple[Any, ...]]] = []
        self.on_pause: list[Callable[[], None]] = []
        """Called whenever time stops running."""

    def after(self, delay_s: float, action: Callable[..., object], *arguments: Any) -> None:
        """Call `action` in `delay_s`; what is planned for the same moment comes in the order of planning."""
        self._planned += 1
        heapq.heappush(self._events, (self.now + delay_s, self._planned, action, arguments))

    def run_until(self, deadline: float, done: Callable[[], bool] | None = None) -> bool:
        """Advance to `deadline`, or until `done()`; true when done."""
        is_done = self._run_until(deadline, done)
        for look in self.on_pause:
            look()
        return is_done

    def _run_until(self, deadline: float, done: Callable[[], bool] | None) -> bool:
        events = self._events
        while events and events[0][0] <= deadline:
            if done is not None and done():
                return True
            self.now, _, action, arguments = heapq.heappop(events)
            action(*arguments)
        self.now = max(self.now, deadline)
        return done is not None and done()
