"""Drives that made a motion of their own go back to the mode of blocks before their robot is enabled."""

from dataclasses import dataclass

from drive_gateway.canopen.sdo import Dialogue, SdoDone, SdoRead
from drive_gateway.cia402.preparation import Preparation, play
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.event_log import EventLog

RETRY_S = 0.1
"""A drive that keeps another value is asked again after this time."""
PATIENCE_S = 1.0
"""A drive may need a moment for a change of mode; after this time somebody is told."""


@dataclass(slots=True)
class _Return:
    """The way back of one drive."""

    asked: bool = False
    due: float = 0.0
    since: float | None = None
    """When it was first asked."""
    found: str = ""
    """What stands in the way, for people."""
    told: bool = False


class ModeKeeper:
    """The drives whose mode is not confirmed (6061h) to be that one."""

    def __init__(self, log: EventLog) -> None:
        self._log = log
        self._other: dict[Drive, _Return] = {}

    @property
    def settled(self) -> bool:
        """Every drive shows the mode in which blocks are played."""
        return not self._other

    @property
    def problem(self) -> str:
        """Of the drives that were told to go back and have not done so in time; empty when there are none."""
        return "; ".join(each.found for each in self._other.values() if each.told)

    def left(self, node: Drive) -> None:
        """This drive is given another mode."""
        self._other[node] = _Return()

    def step(self, now: float) -> None:
        """Ask each drive without torque for its mode; a drive that was lost is configured again anyway."""
        for node, each in list(self._other.items()):
            if not node.operational:
                del self._other[node]
            elif not each.asked and node.without_torque and now >= each.due:
                each.asked, each.due = True, now + RETRY_S
                each.since = now if each.since is None else each.since
                node.follow(self._go_back(node, each))
            elif each.since is not None and each.found and not each.told and now - each.since > PATIENCE_S:
                each.told = True
                remedy = "look into the manual of the drive; the robot stays off until it takes it"
                self._log.warn("mode_refused", each.found, remedy)

    def _go_back(self, node: Drive, each: _Return) -> Dialogue:
        """Write and read back one object after another; a drive that shows something else is asked again."""
        for item in play(node.axis):
            told = yield item.write
            shown = yield SdoRead(item.shown_index, item.shown_sub)
            if self._other.get(node) is not each:
                return
            if shown.data != item.write.data:
                each.asked = False
                each.found = _found(node, item, shown) + (f" and answers {told.problem}" if told.problem else "")
                return
        del self._other[node]


def _found(node: Drive, item: Preparation, outcome: SdoDone) -> str:
    wanted = int.from_bytes(item.write.data, "little", signed=True)
    found = outcome.problem or f"shows {int.from_bytes(outcome.data, 'little', signed=True)}"
    shown = f"{item.shown_index:04X}h:{item.shown_sub:02X}"
    return f"{node.label} does not take {item.what} {wanted}: {shown} {found}"
