"""The load of the bus as it is, beside the one that is configured."""

from collections.abc import Callable

from drive_gateway.config.bus_load import BusLoad
from drive_gateway.gateway.event_log import EventLog

WINDOW_S = 1.0


class MeasuredLoad:
    """Share of the wire that all frames took in the newest second, with the worst-case stuffing of the estimate.

    Args:
        planned: the load of what is configured, and what is kept free beside it.
        bitrate: of the wire [bit/s].
        settled: whether no node is being brought up; the many SDO of that may exceed every budget.
        log: takes the warning when the budget is exceeded.
    """

    def __init__(self, planned: BusLoad, bitrate: int, settled: Callable[[], bool], log: EventLog) -> None:
        self._planned = planned
        self._bitrate = bitrate
        self._settled = settled
        self._log = log
        self._begin: tuple[float, int] | None = None
        self._steady = False
        self.share: float | None = None
        """0 to 1, above 1 on a bus without a wire; `None` before the first second is over."""

    def counted(self, bits: int, now: float) -> None:
        """All frames that were sent and received since the start had this many bits; called in each cycle."""
        if self._begin is None:
            self._begin = now, bits
            return
        since, before = self._begin
        if now - since < WINDOW_S:
            return
        self._begin = now, bits
        self.share = (bits - before) / ((now - since) * self._bitrate)
        # Only a second that also began with all nodes up is judged.
        was_steady, self._steady = self._steady, self._settled()
        if was_steady and self._steady and self.share > self._planned.total:
            self._log.warn_repeated(
                "bus_load",
                f"the bus is loaded to {100.0 * self.share:.0f} %; what is configured takes "
                f"{100.0 * self._planned.cyclic:.0f} %, and {100.0 * self._planned.kept:.0f} % is kept free beside it",
                "look with `drive-gateway log` who sends what no drives file asks for",
                about="bus",
                now=now,
            )
