"""A computer of the cell: its clocks differ from those of the others."""

from tests.sim.clock import Clock


class Host:
    """A monotonic clock with an offset and a rate of its own, and a wall clock that may be set."""

    def __init__(self, clock: Clock, ahead_s: float, drift_ppm: float, unix_s: float) -> None:
        """`ahead_s`: of the monotonic clock before the world's; `unix_s`: what the wall clock shows now."""
        self._clock = clock
        self._since = clock.now
        self._shown = clock.now + ahead_s
        self._drift_ppm = drift_ppm
        self._rate = 1.0 + 1e-6 * drift_ppm
        self._unix_ahead_s = unix_s - self._shown

    def read(self) -> float:
        """The monotonic clock [s]."""
        return self._shown + (self._clock.now - self._since) * self._rate

    @property
    def now(self) -> float:
        """The monotonic clock [s]."""
        return self.read()

    def at(self, world_s: float) -> float:
        """What the monotonic clock shows at a time of the world [s]."""
        return self._shown + (world_s - self._since) * self._rate

    def unix(self) -> float:
        """The wall clock [s]."""
        return self.read() + self._unix_ahead_s

    @property
    def drift(self) -> float:
        """How much faster than the world's time it runs [ppm]; may be set."""
        return self._drift_ppm

    @drift.setter
    def drift(self, ppm: float) -> None:
        self._shown, self._since = self.read(), self._clock.now
        self._drift_ppm, self._rate = ppm, 1.0 + 1e-6 * ppm

    def lasts(self, own_s: float) -> float:
        """The world's time [s] in which the monotonic clock advances by `own_s`."""
        return own_s / self._rate

    def step(self, seconds: float) -> None:
        """The wall clock is set; the monotonic one never is."""
        self._unix_ahead_s += seconds
