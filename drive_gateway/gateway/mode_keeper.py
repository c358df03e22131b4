"""Drives that made a motion of their own go back to the mode of blocks before their robot is enabled."""

from collections.abc import Sequence

from drive_gateway.canopen.sdo import SdoDone
from drive_gateway.cia402.preparation import Preparation, play
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
        self._write(node, play(node.axis))

    def _write(self, node: Drive, items: Sequence[Preparation]) -> None:
        """Write and read back one object after another; a drive that shows something else is asked again."""
        first = items[0]

        def written(_outcome: SdoDone) -> None:
            node.submit(first.shown_index, first.shown_sub, None, shown)

        def shown(outcome: SdoDone) -> None:
            if node not in self._other:
                return
            if outcome.data != first.write.data:
                self._other[node] = False
            elif items[1:]:
                self._write(node, items[1:])
            else:
                del self._other[node]

        node.submit(first.write.index, first.write.sub, first.write.data, written)
