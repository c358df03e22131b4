"""The software emergency stop as a gateway keeps it. It supports and never replaces a hard-wired one."""

from cell.messages.estop import Estop


class EstopLatch:
    """Active emergency stops by id, since when, and the ids that were cleared and mean nothing any more."""

    def __init__(self) -> None:
        self._active: dict[str, Estop] = {}
        self._cleared: set[str] = set()
        self._newest = ""
        self.since: float | None = None
        """When the first of the active stops was received; the gateway's own timer runs from here."""

    @property
    def active(self) -> Estop | None:
        """The stop that was repeated last, if any is active."""
        return self._active.get(self._newest)

    def receive(self, estop: Estop, now: float) -> bool:
        """Take a stop or its clearing; true when this changed anything."""
        if estop.id in self._cleared:
            return False
        if estop.active:
            new = estop.id not in self._active
            self._active[estop.id] = estop
            self._newest = estop.id
            if self.since is None:
                self.since = now
            return new
        self._cleared.add(estop.id)
        known = self._active.pop(estop.id, None) is not None
        if self._active:
            self._newest = next(iter(self._active))
        else:
            self.since = None
        return known
