"""Whether one axis stands, and how long a stop of it may take.

What is measured tells. An axis that is not heard counts as moving until its drive must have missed the gateway and
braked by itself; one that was seen not to stop counts as moving until it is measured at rest.
"""

from drive_gateway.config.settings import MOTOR_SPEED_RESERVE, AxisSettings, GatewaySettings

REST_S = 0.1
"""An axis stands when it was measured within its window for this long."""
LEAST_COUNTS = 3.0
"""The window is never smaller: an encoder between two counts shows one or the other."""
BRAKING_RESERVE = 2.0
"""A loaded axis may need so many times the braking time that its speed and its deceleration give."""


class AxisRest:
    """Feed `take` with each measurement, and `silent` in each cycle in which the node is not operational."""

    def __init__(self, axis: AxisSettings, settings: GatewaySettings) -> None:
        self.standing = False
        """It stands, or it is silent and has had the time to stop by itself."""
        self.margin_s = REST_S + settings.overrun_limit_s
        """[s] until rest is measured, in a computer that is as late as it may be."""
        self.stop_s = self.margin_s + BRAKING_RESERVE * MOTOR_SPEED_RESERVE * axis.speed / axis.quick_stop
        """[s] from the order to stop to measured rest, at the longest."""
        self.silent_stop_s = settings.heartbeat_timeout_s + self.stop_s
        """[s] from silence to rest, at the longest: the drive must miss its gateway first."""
        self.moved_at = 0.0
        """When it was last seen to leave the window around where it had been."""
        self.window = max(axis.rest_window * abs(axis.counts_per_unit), LEAST_COUNTS)
        """[counts]"""
        self._anchor: int | None = None
        self._still_since = 0.0
        self._silent_since: float | None = None
        self._distrusted = False
        self.only_measured = False
        """It is silent, has had the time to stop, and is not trusted: it must be heard again."""

    def take(self, counts: int, now: float) -> None:
        """One measured position."""
        if self._silent_since is not None:
            self._silent_since = now
        if self._anchor is None:
            self._anchor, self._still_since = counts, now
            self.standing = False
        elif abs(counts - self._anchor) > self.window:
            self._anchor, self._still_since, self.moved_at = counts, now, now
            self.standing = False
        elif not self.standing and now - self._still_since >= REST_S:
            self.standing = True
            self._distrusted = False

    def measure_anew(self) -> None:
        """Something moves it from now on: what was measured before says nothing."""
        self._anchor = None
        self.standing = False

    def distrust(self) -> None:
        """It was told to stop and did not, so from now on its silence is no rest."""
        self._distrusted = True
        self.measure_anew()

    def heard(self) -> None:
        """Its node is operational from now on."""
        self._silent_since = None
        self.only_measured = False
        self.measure_anew()

    def silent(self, now: float) -> None:
        """Its node is not operational in this cycle."""
        if self._silent_since is None:
            self._silent_since = now
            self.measure_anew()
        elif now - self._silent_since >= self.silent_stop_s:
            self.standing, self.only_measured = not self._distrusted, self._distrusted
