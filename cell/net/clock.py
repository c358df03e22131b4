"""The cell clock, for every process that hears the manager: agents, sensors, encoders."""

from collections import deque
from math import inf

from cell.messages import CellTime, ClockStatus, ManagerState
from cell.net.freshness import NewestOf

_WINDOW_S = 2.0
DRIFT = 1e-3
"""Two clocks come apart by no more than this [s/s]: NTP changes the rate of a clock by up to 500 ppm."""


class _Largest:
    """The largest of the numbers of the last two seconds. What a later one exceeds is forgotten, so each costs once."""

    def __init__(self) -> None:
        self._kept: deque[tuple[float, float]] = deque()
        """Moments [s] and numbers, each number less than the one before."""

    def add(self, at: float, number: float) -> None:
        kept = self._kept
        while kept and kept[-1][1] <= number:
            kept.pop()
        kept.append((at, number))
        while at - kept[0][0] > _WINDOW_S:
            kept.popleft()

    def forget(self) -> None:
        self._kept.clear()

    @property
    def number(self) -> float:
        """Minus infinity of none."""
        return self._kept[0][1] if self._kept else -inf


class OtherClock:
    """How far another process' clock is ahead of the own one, by its least delayed message of the last two seconds.

    A message is never early, so what it says about the other clock is late by its delay, and the largest difference
    is the best one. Nor is a message made before what it answers was sent, so by its answers the other clock is not
    further ahead than that (Cristian, Probabilistic clock synchronization, 1989). The middle between the two is no
    better: an answer waits until its sender's next cycle, and that makes the two ways unequal.
    """

    def __init__(self) -> None:
        self._boots = NewestOf()
        self._ahead = _Largest()
        """How far the other clock is ahead at least, by moment of arrival."""
        self._surest = _Largest()
        """The same at the own time 0, while both come apart."""
        self._at_most = _Largest()
        """Minus how far it is ahead at most at the own time 0, while both come apart, by moment of sending."""
        self.ahead_s: float | None = None
        """None before the first message."""

    @property
    def boot(self) -> str | None:
        """Whose clock it is; None before the first message."""
        return self._boots.boot

    def heard(self, boot: str, era: int, sequence: int, reading: float, at: float, round_s: float = inf) -> None:
        """A message of `boot`, sent when the other clock showed `reading` [s], arrived at `at` [s].

        It answers what this process sent `round_s` [s] earlier; infinite: nothing that it knows of.
        """
        before = self._boots.boot
        if not self._boots.accept(boot, era, sequence):
            return
        if boot != before:
            for known in (self._ahead, self._surest, self._at_most):
                known.forget()
        ahead_s = reading - at
        self._ahead.add(at, ahead_s)
        self.ahead_s = self._ahead.number
        self._surest.add(at, ahead_s + DRIFT * at)
        if round_s < inf:
            sent = at - round_s
            self._at_most.add(sent, DRIFT * sent - (reading - sent))

    def error_s(self, now: float) -> float:
        """How far `ahead_s` is from the truth at `now` [s] at most, while no two clocks come apart faster than `DRIFT`.

        Infinite before the first answer.
        """
        ahead_s = self.ahead_s
        if ahead_s is None:
            return inf
        least = self._surest.number - DRIFT * now
        most = DRIFT * now - self._at_most.number
        return max(most - ahead_s, ahead_s - least)


class ManagerClock:
    """Cell time on the own clock; late by the shortest delay of a manager's state."""

    def __init__(self) -> None:
        self._clock = OtherClock()

    def heard(self, state: ManagerState, at: float, round_s: float = inf) -> None:
        """A manager's state arrived at `at` [s]; it answers what this process sent `round_s` [s] before."""
        self._clock.heard(state.boot, state.epoch, state.sequence, state.cell_time, at, round_s)

    def moment(self, now: float) -> CellTime | None:
        """What `now` [s] is in the cell; None before a manager was heard."""
        ahead_s, boot = self._clock.ahead_s, self._clock.boot
        return None if ahead_s is None or boot is None else CellTime(boot, now + ahead_s)

    def until(self, moment: CellTime, now: float) -> float | None:
        """Seconds from `now` to a moment, negative when it is past; None when it is of a clock that is not heard."""
        present = self.moment(now)
        return None if present is None or present.boot != moment.boot else moment.seconds - present.seconds

    def error_s(self, now: float) -> float:
        """How far `moment` is from the truth at most [s]; infinite before a state answered this process."""
        return self._clock.error_s(now)

    def status(self, now: float) -> ClockStatus | None:
        """What is known of cell time at `now` [s], and how well; None before a state answered this process."""
        moment, error_s = self.moment(now), self.error_s(now)
        return None if moment is None or error_s == inf else ClockStatus(moment.seconds - now, error_s)
