"""When a robot that nobody uses is switched off: torque only while it is needed."""

from cell.messages import Mode


class IdleClock:
    """Time without a program; a program that waits or is halted is in use. `after_s` `None`: never."""

    def __init__(self, after_s: float | None) -> None:
        self._after_s = after_s
        self._since: float | None = None

    def due(self, mode: Mode, now: float) -> bool:
        """True once, when the robot has been ready for that long."""
        if self._after_s is None or mode is not Mode.READY:
            self._since = None
            return False
        if self._since is None:
            self._since = now
        if now - self._since < self._after_s:
            return False
        self._since = now
        return True
