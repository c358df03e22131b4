"""The loop around a core: an absolute schedule that slips after a stall, and a core that learns of a freeze."""

import gc
import os
import secrets
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from itertools import islice
from threading import Event

from cell.core import Core, Effect, Frozen

FREEZE_S = 0.25
"""A gap between two steps above this is a freeze: what waits in the queues may be that old."""
AHEAD_S = 1e-3
"""So long before a cycle a loop with `ahead` takes what has come by then."""
SWITCH_S = 1e-4
"""So long another thread waits for the interpreter while a loop computes."""
CLOSEST = 0.8
"""Of a cycle: no two first effects leave closer. A drive that gets two SYNCs at once gets two targets at once."""
SLIP = 0.2
"""Of a cycle: where the first effect leaves so much too late after the one before, the schedule slips with it."""
REST = 2.0
"""A loop whose cycles are asked for rests, after a burst of one period, so many times as long as it works."""


class Priority(IntEnum):
    """Of SCHED_FIFO (sched(7)): who comes first where several want a processor. All other threads come after these."""

    MANAGER = 40
    BUS = 50
    """Loops in time with a bus, and simulated drives, which are computers of their own elsewhere."""
    FEEDING = 60
    """Threads that bring a loop its messages. What they do is short, and to wait for the loops of other processes would
    take a message longer than all the rest of its way."""


def new_boot() -> str:
    """A fresh name for this run of this process."""
    return secrets.token_hex(4)


class Turns:
    """Hands a core what has come, at the moment of the handing, and tells it when its process was frozen."""

    def __init__(self, core: Core, now: Callable[[], float] = time.monotonic) -> None:
        self._core = core
        self._now = now
        self._last = now()

    def begin(self) -> float:
        """From here on gaps count; answers the time [s]."""
        self._last = self._now()
        return self._last

    def hand_over(self, source: Callable[[], Iterable[object]]) -> float:
        """Give the core what `source` returns; answers the time [s] at which it did."""
        messages = list(source())
        # Only now: a process that freezes while it takes its messages finds new ones when it wakes.
        before, self._last = self._last, self._now()
        if self._last - before > FREEZE_S:
            self._core.receive(Frozen(self._last - before), self._last)
        for message in messages:
            self._core.receive(message, self._last)
        return self._last


def run_core(
    core: Core,
    *,
    period_s: float,
    inbox: Callable[[], Iterable[object]],
    perform: Callable[[Effect], None],
    stop: Event,
    on_late: Callable[[float], None] | None = None,
    trim: Callable[[], float] | None = None,
    ahead: Callable[[], Iterable[object]] | None = None,
    soon: Event | None = None,
    switch_s: float = SWITCH_S,
    priority: Priority | None = None,
) -> None:
    """Step `core` every `period_s` until `stop` is set.

    In each cycle the core gets what `inbox()` returns, steps once, and its effects go to `perform` one by one.
    The first effect of a step leaves at least `CLOSEST` of a cycle after that of the step before. Small delays do not
    add up; after a larger one all later cycles come later too, none is caught up. One of more than a period is told to
    `on_late` [s]. `trim` says after each step by how much [s] the next cycle comes later than a period.
    With `ahead` the core gets what that returns `AHEAD_S` before a cycle is due, so that little is left for the cycle.
    With `soon` the next cycle begins when that is set, before a period is over; cycles may be near each other then, but
    in the long run the loop works a third of the time at most (`REST`).
    After `switch_s` other threads get the interpreter from the loop: what Zenoh brings comes sooner with less, while
    threads that compute much themselves take turns too often then.
    `priority` asks for SCHED_FIFO and does without when the process may not.
    """
    turns = Turns(core)
    with _steady_interpreter(switch_s), scheduling(priority):
        schedule = _Schedule(turns.begin(), CLOSEST if soon is None else 0.0)
        while not stop.is_set():
            schedule.begin()
            effects = iter(core.step(turns.hand_over(lambda: schedule.apart(inbox()))))
            for first in islice(effects, 1):
                perform(first)
            late_s = schedule.left()
            for effect in effects:
                perform(effect)
            if on_late is not None and late_s > period_s:
                on_late(late_s)
            schedule.advance(period_s, 0.0 if trim is None else trim())
            if ahead is not None and _slept_until(schedule.due - AHEAD_S):
                turns.hand_over(ahead)
            if soon is not None:
                schedule.wait_for(soon)
            _slept_until(schedule.due)


class _Schedule:
    """When cycles are due [s], by what really left in the cycles before."""

    def __init__(self, begin: float, closest: float) -> None:
        """No two first effects leave closer than `closest` of a cycle."""
        self.due = begin
        self._closest = closest
        self._began = self._left = self._rested = begin
        self._cycle_s = 0.0
        self._closest_s = 0.0
        self._slipped_s = 0.0

    def begin(self) -> None:
        """A cycle begins. What a loop with too much to do is behind by is not made up for either."""
        self._began = time.monotonic()
        late_s = self._began - self.due
        self._slipped_s = late_s if late_s > SLIP * self._cycle_s else 0.0
        self.due += self._slipped_s

    def apart(self, messages: Iterable[object]) -> Iterable[object]:
        """Answers `messages` when enough time has passed since the cycle before."""
        _slept_until(self._left + self._closest_s)
        return messages

    def left(self) -> float:
        """The first effect of the cycle has left; answers how much too late after the one before [s]."""
        now = time.monotonic()
        late_s = now - self._left - self._cycle_s
        if late_s - self._slipped_s > SLIP * self._cycle_s:
            self.due += late_s - self._slipped_s
        self._left = now
        return late_s

    def advance(self, period_s: float, trim_s: float) -> None:
        """The next cycle is due a period and `trim_s` later. How close it may come does not change with the trim."""
        self._cycle_s = period_s + trim_s
        self._closest_s = self._closest * period_s
        self.due += self._cycle_s

    def wait_for(self, soon: Event) -> None:
        """The next cycle is due when this is set, if that is sooner."""
        rested = max(self._rested, self._began) + (1.0 + REST) * (time.monotonic() - self._began)
        self._rested = min(rested, self.due + self._cycle_s)
        _slept_until(self._rested - self._cycle_s)
        if soon.wait(max(0.0, self.due - time.monotonic())):
            soon.clear()
            self.due = min(self.due, time.monotonic())


def _slept_until(due: float) -> bool:
    """Wait; False when the moment was over already."""
    left = due - time.monotonic()
    if left > 0.0:
        time.sleep(left)
    return left >= 0.0


@contextmanager
def _steady_interpreter(switch_s: float) -> Iterator[None]:
    """No long pauses: a full garbage collection over everything that was loaded takes 10 ms and more."""
    interval = sys.getswitchinterval()
    gc.collect()
    gc.freeze()
    sys.setswitchinterval(switch_s)
    try:
        yield
    finally:
        sys.setswitchinterval(interval)
        gc.unfreeze()


@contextmanager
def scheduling(priority: Priority | None) -> Iterator[None]:
    """SCHED_FIFO for the calling thread where the system has it and allows it; None leaves it as it is.

    Threads that it starts have no part in it, except those of a `FEEDING` one: what works beside a loop (SDO, files)
    must not come before others.
    """
    if priority is None:
        yield
        return
    policy, param = os.sched_getscheduler(0), os.sched_getparam(0)
    # A thread may set this flag of sched(7), and not take it back; without a real-time policy it changes nothing.
    alone = 0 if priority is Priority.FEEDING else os.SCHED_RESET_ON_FORK
    allowed = True
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | alone, os.sched_param(priority))
    except PermissionError:
        allowed = False
    try:
        yield
    finally:
        if allowed:
            os.sched_setscheduler(0, policy | alone, param)
