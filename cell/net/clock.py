"""The cell clock, for every process that hears the manager: agents, sensors, encoders."""

from collections import deque

from cell.messages import CellTime, ManagerState
from cell.net.freshness import NewestOf

_WINDOW_S = 2.0


class OtherClock:
    """How far another process' clock is ahead of the own one, by its least delayed message of the last two seconds.

    A message is never early, so what it says about the other clock is late by its delay, and the largest difference
    is the best one (Cristian, Probabilistic clock synchronization, 1989, in one direction).
    """

    def __init__(self) -> None:
        self._boots = NewestOf()
        self._ahead: deque[tuple[float, float]] = deque()

    @property
    def boot(self) -> str | None:
        """Whose clock it is; None before the first message."""
        return self._boots.boot

    def heard(self, boot: str, era: int, sequence: int, reading: float, at: float) -> None:
        """A message of `boot`, sent when the other clock showed `reading` [s], arrived at `at` [s]."""
        before = self._boots.boot
        if not self._boots.accept(boot, era, sequence):
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


class ManagerClock:
    """Cell time on the own clock; late by the shortest delay of a manager's state."""

    def __init__(self) -> None:
        self._clock = OtherClock()

    def heard(self, state: ManagerState, at: float) -> None:
        """A manager's state arrived at `at` [s]."""
        self._clock.heard(state.boot, state.epoch, state.sequence, state.cell_time, at)

    def moment(self, now: float) -> CellTime | None:
        """What `now` [s] is in the cell; None before a manager was heard."""
        ahead_s, boot = self._clock.ahead_s, self._clock.boot
        return None if ahead_s is None or boot is None else CellTime(boot, now + ahead_s)

    def until(self, moment: CellTime, now: float) -> float | None:
        """Seconds from `now` to a moment, negative when it is past; None when it is of a clock that is not heard."""
        present = self.moment(now)
        return None if present is None or present.boot != moment.boot else moment.seconds - present.seconds
