"""The cell clock, for every process that hears the manager: agents, sensors, encoders."""

from collections import deque
from math import inf

from cell.messages import CellTime, ClockStatus, ManagerState
from cell.net.freshness import NewestOf

_WINDOW_S = 2.0
DRIFT = 1e-3
"""Two clocks come apart by no more than this [s/s]: NTP changes the rate of a clock by up to 500 ppm."""


class OtherClock:
    """How far another process' clock is ahead of the own one, by its least delayed message of the last two seconds.

    A message is never early, so what it says about the other clock is late by its delay, and the largest difference
    is the best one. Nor is a message made before what it answers was sent, so by its answers the other clock is not
    further ahead than that (Cristian, Probabilistic clock synchronization, 1989). The middle between the two is no
    better: an answer waits until its sender's next cycle, and that makes the two ways unequal.
    """

    def __init__(self) -> None:
        self._boots = NewestOf()
        self._ahead: deque[tuple[float, float]] = deque()
        """Arrival [s], and how far the other clock is ahead at least."""
        self._surest = (0.0, 0.0)
        """Of these, the one by which the other clock is ahead most while both come apart."""
        self.ahead_s: float | None = None
        """None before the first message."""
        self._at_most: deque[tuple[float, float]] = deque()
        """When an answered message was sent [s], and how far the other clock is ahead at most."""

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
            self._ahead.clear()
            self._at_most.clear()
        self._ahead.append((at, reading - at))
        while at - self._ahead[0][0] > _WINDOW_S:
            self._ahead.popleft()
        self.ahead_s = max(ahead for _, ahead in self._ahead)
        self._surest = max(self._ahead, key=lambda known: known[1] + DRIFT * known[0])
        if round_s < inf:
            self._at_most.append((at - round_s, reading - at + round_s))
            while at - round_s - self._at_most[0][0] > _WINDOW_S:
                self._at_most.popleft()

    def error_s(self, now: float) -> float:
        """How far `ahead_s` is from the truth at `now` [s] at most, while no two clocks come apart faster than `DRIFT`.

        Infinite before the first answer.
        """
        ahead_s = self.ahead_s
        if ahead_s is None:
            return inf
        at, ahead = self._surest
        least = ahead - DRIFT * (now - at)
        most = min((ahead + DRIFT * (now - sent) for sent, ahead in self._at_most), default=inf)
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
