"""Whether simulated drives keep up with the clock; drives that do not stop with faults that are not their own."""

WINDOW_S = 1.0
MOST_BUSY = 0.9
"""Share of a window; above, frames wait and nothing is left to catch up with."""
TELL_S = 10.0
REMEDY = "use `level: fast` or fewer axes at the full level, or take load off this host"


class ComputingTime:
    """Adds up how long the drives were computed, in windows of a second."""

    def __init__(self) -> None:
        self._since: float | None = None
        self._busy_s = 0.0
        self._quiet_until = 0.0

    def worked(self, begin: float, end: float) -> str:
        """The drives were computed from `begin` to `end` [s]; what there is to say of it, mostly nothing."""
        if self._since is None:
            self._since = begin
        self._busy_s += end - begin
        passed_s = end - self._since
        if passed_s < WINDOW_S:
            return ""
        share, self._since, self._busy_s = self._busy_s / passed_s, end, 0.0
        if share <= MOST_BUSY or end < self._quiet_until:
            return ""
        self._quiet_until = end + TELL_S
        return (
            f"the simulated drives do not keep up with the clock: computing them took {100.0 * share:.0f} % of the "
            f"last {passed_s:.1f} s; set points come late, and drives stop with faults such as 8700h"
        )
