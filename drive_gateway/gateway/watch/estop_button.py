"""From an emergency-stop button at a drive's input to the emergency stop of the whole cell."""

from cell.messages.estop import Estop

REPEAT_S = 0.05
"""While the button is pressed the stop is said this often: one that is lost does not matter."""


class EstopButtons:
    """All buttons of one gateway. A stop lasts until it is reset; while a button is still pressed it is set anew.

    Args:
        gateway: whose drives have the buttons.
        boot: of this process, so that no stop has the id of an older one.
    """

    def __init__(self, gateway: str, boot: str) -> None:
        self._gateway = gateway
        self._boot = boot
        self._count = 0
        self._present: Estop | None = None
        self._due = 0.0

    def step(self, pressed: str, now: float) -> Estop | None:
        """`pressed` says which button is, empty when none is; answers what the cell must hear now."""
        if not pressed:
            return None
        if self._present is None:
            self._count += 1
            self._present = Estop(f"{self._gateway}-{self._boot}-{self._count}", True, self._gateway, pressed)
            self._due = now
        if now < self._due:
            return None
        self._due = now + REPEAT_S
        return self._present

    def cleared(self, stop_id: str) -> None:
        """The manager reset a stop."""
        if self._present is not None and self._present.id == stop_id:
            self._present = None
