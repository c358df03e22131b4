"""The cell clock and the gateway's ticks, on the agent's own clock."""

import math

from cell.messages import CellTime, DriveFeedback, ManagerState
from cell.net.clock import ManagerClock, OtherClock

SHORTEST_NOTICE_S = 0.2
"""A common start is ordered at least so early, for planning and for the first block."""


class CellClock:
    """What time it is in the cell, and which tick of the gateway belongs to it.

    Both are late by the shortest delay of a message: the network's, as messages carry their moment of arrival.
    """

    def __init__(self) -> None:
        self._manager = ManagerClock()
        self._gateway = OtherClock()

    def heard_state(self, state: ManagerState, at: float) -> None:
        """A manager's state arrived at `at` [s]."""
        self._manager.heard(state, at)

    def heard_feedback(self, feedback: DriveFeedback, cycle_s: float, at: float) -> None:
        """Feedback for a tick of `cycle_s` arrived at `at` [s]."""
        self._gateway.heard(feedback.boot, feedback.sequence, feedback.tick * cycle_s, at)

    def until(self, moment: CellTime, now: float) -> float | None:
        """Seconds from `now` to a moment, negative when it is past; None when it is of a clock that is not heard."""
        return self._manager.until(moment, now)

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
