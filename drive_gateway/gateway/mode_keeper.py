"""Drives that made a motion of their own go back to the mode of blocks before their robot is enabled."""

from drive_gateway.canopen.sdo import SdoDone
from drive_gateway.cia402.preparation import played_mode
from drive_gateway.cia402.setup_objects import MODE, MODE_DISPLAY
from drive_gateway.gateway.drive import Drive


class ModeKeeper:
    """The drives whose mode is not confirmed (6061h) to be that one."""

    def __init__(self) -> None:
        self._other: dict[Drive, bool] = {}

    @property
    def settled(self) -> bool:
        """Every drive shows the mode in which blocks are played."""
        return not self._other

    def left(self, node: Drive) -> None:
        """This drive is given another mode."""
        self._other[node] = False

    def step(self) -> None:
        """Ask each drive without torque for its mode; a drive that was lost is configured again anyway."""
        for node, asked in list(self._other.items()):
            if not node.operational:
                del self._other[node]
            elif not asked and node.without_torque:
                self._ask(node)

    def _ask(self, node: Drive) -> None:
        self._other[node] = True
        mode = played_mode(node.axis)

        def written(_outcome: SdoDone) -> None:
            node.submit(MODE_DISPLAY, 0, None, shown)

        def shown(outcome: SdoDone) -> None:
            if outcome.data == mode:
                self._other.pop(node, None)
            elif node in self._other:
                self._other[node] = False

        node.submit(MODE, 0, mode, written)
