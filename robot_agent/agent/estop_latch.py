"""The emergency stop as this robot knows it."""

from cell.messages import Estop


class EstopLatch:
    """One stop at a time; one that was cleared stays so, whatever old message still says it is active."""

    def __init__(self) -> None:
        self.active: Estop | None = None
        self._cleared: set[str] = set()

    def heard(self, estop: Estop) -> bool:
        """Take a message; true when it begins a stop."""
        if not estop.active:
            self._cleared.add(estop.id)
            if self.active is not None and self.active.id == estop.id:
                self.active = None
            return False
        if estop.id in self._cleared or self.active is not None:
            return False
        self.active = estop
        return True
