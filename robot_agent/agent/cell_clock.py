"""The cell clock and the gateway's ticks, on the agent's own clock."""

import math

from cell.messages import CellTime, ClockStatus, DriveFeedback, ManagerState
from cell.net.clock import ManagerClock, OtherClock
from cell.net.freshness import Sent

SHORTEST_NOTICE_S = 0.2
"""A common start is ordered at least so early, for planning and for the first block."""
LONGEST_S = 3600.0
"""And at most so early; its first motion is made to last so long at most."""


class CellClock:
    """What time it is in the cell, and which tick of the gateway belongs to it.

    Both are late by the shortest delay of a message: the network's, as messages carry their moment of arrival.
    """

    def __init__(self, robot: str, sent: Sent, allowed_s: float) -> None:
        """`sent` are this robot's presences, which the manager answers; `allowed_s`: of error, for a common moment."""
        self._robot = robot
        self._sent = sent
        self._allowed_s = allowed_s
        self._manager = ManagerClock()
        self._gateway = OtherClock()
        self._cycle_s = 0.0

    def ticks_last(self, cycle_s: float) -> None:
        """The gateway's cycle, once it is known; feedback from here on says when its ticks are."""
        self._cycle_s, self._gateway = cycle_s, OtherClock()

    def arrived(self, message: object, at: float) -> None:
        """A message arrived at `at` [s]; what the manager's state and the gateway's feedback say of clocks counts."""
        if isinstance(message, ManagerState):
            self._manager.heard(message, at, self._sent.age(message.heard.get(self._robot), at))
        elif isinstance(message, DriveFeedback) and self._cycle_s > 0.0:
            self._gateway.heard(message.boot, message.owner, message.sequence, message.tick * self._cycle_s, at)

    def until(self, moment: CellTime, now: float) -> float | None:
        """Seconds from `now` to a moment, negative when it is past; None when it is of a clock that is not heard."""
        return self._manager.until(moment, now)

    def moment(self, now: float) -> CellTime | None:
        """What `now` [s] is in the cell; None before a manager was heard."""
        return self._manager.moment(now)

    def age(self, moment: CellTime, now: float) -> float:
        """How long ago a moment is at most [s] that somebody told who knows cell time well enough."""
        left_s = self.until(moment, now)
        return math.inf if left_s is None else self._manager.error_s(now) + self._allowed_s - left_s

    def status(self, now: float) -> ClockStatus | None:
        """What is known of cell time at `now` [s], and how well; None before a state answered this robot."""
        return self._manager.status(now)

    def uncertain(self, now: float) -> str:
        """Why nothing may begin at a common moment, for people; empty when it may."""
        error_s = self._manager.error_s(now)
        if error_s <= self._allowed_s:
            return ""
        known = "is not known yet" if error_s == math.inf else f"is known to within {1000.0 * error_s:.0f} ms only"
        return f"cell time {known}, allowed are {1000.0 * self._allowed_s:g} ms (times: clock_error_s)"

    def tick_at(self, moment: CellTime, now: float) -> int | None:
        """The gateway's first tick at or after a moment; None when it is of a clock that is not heard."""
        left_s, ahead_s = self.until(moment, now), self._gateway.ahead_s
        return None if left_s is None or ahead_s is None else math.ceil((now + left_s + ahead_s) / self._cycle_s)

    def start_tick(self, moment: CellTime, now: float) -> int | str:
        """The gateway's first tick at or after a moment at which to start; why there is none, for people."""
        left_s, ahead_s = self.until(moment, now), self._gateway.ahead_s
        if left_s is None or ahead_s is None:
            return "the start is given by the clock of a manager that this robot does not hear: order it again"
        if left_s < SHORTEST_NOTICE_S:
            found = f"{_said(-left_s)} s in the past" if left_s < 0.0 else f"only {_said(left_s)} s ahead"
            allowed = f"{SHORTEST_NOTICE_S:g} s ahead or more: order it again, earlier"
            return f"the start at cell time {_said(moment.seconds)} s is {found}, allowed is {allowed}"
        if not left_s <= LONGEST_S:
            return f"the start is {_said(left_s)} s ahead, allowed is {LONGEST_S:g} s at most: order it again, later"
        if uncertain := self.uncertain(now):
            return f"no common start: {uncertain}; see what delays the messages between this robot and the manager"
        return math.ceil((now + left_s + ahead_s) / self._cycle_s)


def _said(seconds: float) -> str:
    """For people."""
    return f"{seconds:.2f}" if abs(seconds) < 1e6 else f"{seconds:.3g}"
