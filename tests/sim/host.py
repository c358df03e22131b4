"""A computer of the cell: its clocks differ from those of the others."""

from collections.abc import Callable


class Host:
    """A monotonic clock with an offset and a rate of its own, and a wall clock that may be set."""

    def __init__(self, world_time: Callable[[], float], offset_s: float, drift_ppm: float, unix_s: float) -> None:
        """`unix_s`: what the wall clock shows now."""
        self._world_time = world_time
        self._since = world_time()
        self._shown = self._since + offset_s
        self._drift_ppm = drift_ppm
        self._unix_ahead_s = unix_s - self._shown

    @property
    def now(self) -> float:
        """The monotonic clock [s]."""
        return self._shown + (self._world_time() - self._since) * (1.0 + 1e-6 * self._drift_ppm)

    @property
    def unix(self) -> float:
        """The wall clock [s]."""
        return self.now + self._unix_ahead_s

    @property
    def drift(self) -> float:
        """How much faster than the world's time it runs [ppm]."""
        return self._drift_ppm

    @drift.setter
    def drift(self, ppm: float) -> None:
        self._shown, self._since = self.now, self._world_time()
        self._drift_ppm = ppm

    def lasts(self, own_s: float) -> float:
        """The world's time [s] in which the monotonic clock advances by `own_s`."""
        return own_s / (1.0 + 1e-6 * self._drift_ppm)

    def step(self, seconds: float) -> None:
        """The wall clock is set; the monotonic one never is."""
        self._unix_ahead_s += seconds
