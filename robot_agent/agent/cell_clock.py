"""The cell clock and the gateway's ticks, on the agent's own clock."""

import math
from collections import deque

from cell.messages import CellTime, DriveFeedback, ManagerState
from cell.net.freshness import NewestOf

SHORTEST_NOTICE_S = 0.2
"""A common start is ordered at least so early, for planning and for the first block."""
_WINDOW_S = 2.0


class _OtherClock:
    """How far another clock is ahead of the own one, by the message of the last seconds that was least delayed.

    A message is never early, so what it says about the other clock is late by its delay, and the largest difference
    is the best one (Cristian, Probabilistic clock synchronization, 1989, in one direction).
    """

    def __init__(self) -> None:
        self._boots = NewestOf()
        self._ahead: deque[tuple[float, float]] = deque()

    @property
    def boot(self) -> str | None:
        return self._boots.boot

    def heard(self, boot: str, sequence: int, reading: float, at: float) -> None:
        """A message of `boot`, sent when the other clock showed `reading` [s], arrived at `at` [s]."""
        before = self._boots.boot
        if not self._boots.accept(boot, sequence):
            return
        if boot != before:
            self._ahead.clear()
        self._ahead.append((at, reading - at))
        while at - self._ahead[0][0] > _WINDOW_S:
            self._ahead.popleft()

    @property
    def ahead_s(self) -> float | None:
        """None before the first message."""
        return max((ahead for _, ahead in self._ahead), default=None)


class CellClock:
    """What time it is in the cell, and which tick of the gateway belongs to it.

    Both are late by the shortest delay of a message: the network's, as messages carry their moment of arrival.
    """

    def __init__(self) -> None:
        self._manager = _OtherClock()
        self._gateway = _OtherClock()

    def heard_state(self, state: ManagerState, at: float) -> None:
        """A manager's state arrived at `at` [s]."""
        self._manager.heard(state.boot, state.sequence, state.cell_time, at)

    def heard_feedback(self, feedback: DriveFeedback, cycle_s: float, at: float) -> None:
        """Feedback for a tick of `cycle_s` arrived at `at` [s]."""
        self._gateway.heard(feedback.boot, feedback.sequence, feedback.tick * cycle_s, at)

    def until(self, moment: CellTime, now: float) -> float | None:
        """Seconds from `now` to a moment, negative when it is past; None when it is of a clock that is not heard."""
        ahead_s = self._manager.ahead_s
        if ahead_s is None or moment.boot != self._manager.boot:
            return None
        return moment.seconds - (now + ahead_s)

    def start_tick(self, moment: CellTime, now: float, cycle_s: float) -> int | str:
        """The gateway's first tick at or behind a moment at which to start; why there is none, for people."""
        left_s, ahead_s = self.until(moment, now), self._gateway.ahead_s
        if left_s is None or ahead_s is None:
            return "the start is given by the clock of a manager that this robot does not hear: order it again"
        if left_s < SHORTEST_NOTICE_S:
            found = f"{-left_s:.2f} s in the past" if left_s < 0.0 else f"only {left_s:.2f} s ahead"
            allowed = f"{SHORTEST_NOTICE_S:g} s ahead or more: order it again, earlier"
            return f"the start at cell time {moment.seconds:.2f} s is {found}, allowed is {allowed}"
        return math.ceil((now + left_s + ahead_s) / cycle_s)
