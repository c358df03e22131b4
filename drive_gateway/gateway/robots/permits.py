"""What the drives of one robot may be told now, and the reason when they may not."""

from collections.abc import Sequence
from dataclasses import dataclass

from cell.messages.drives import AxisStatus
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.drives.power import Power, PowerState
from drive_gateway.gateway.io.io_node import IoNode
from drive_gateway.gateway.setup.setup_desk import SetupDesk
from drive_gateway.gateway.trouble import HARD_WIRED, Trouble
from drive_gateway.gateway.watch.inputs import InputKind, OpenInput
from drive_gateway.gateway.watch.limit_switches import LimitSwitch
from drive_gateway.gateway.watch.watch import Watch


@dataclass(frozen=True, slots=True)
class StopOrder:
    """Bring the robot to rest and switch it off; what still moves at `deadline` is stopped by its drives."""

    deadline: float
    reason: str


_OFF = AxisStatus.SWITCH_ON_DISABLED.words


class Permits:
    """Each method answers why not, for people; empty when it may be.

    Args:
        robot: its name.
        nodes: its drives.
        power: what they were told.
        watch: what they measure.
        setup: what they do by themselves.
        io_nodes: without which it does not run.
    """

    def __init__(
        self,
        robot: str,
        nodes: Sequence[Drive],
        power: Power,
        watch: Watch,
        setup: SetupDesk,
        io_nodes: Sequence[IoNode],
    ) -> None:
        self._robot = robot
        self._nodes = nodes
        self._power = power
        self._watch = watch
        self._setup = setup
        self._io_nodes = io_nodes
        self.order: StopOrder | None = None
        """What keeps the robot off."""
        self.trouble: Trouble | None = None
        """Why the robot is in fault."""
        self.inputs: tuple[OpenInput, ...] = ()
        """Safety inputs that are open, the worst first."""

    @property
    def estop_pressed(self) -> str:
        """Which emergency-stop button is pressed, for people; empty when none is."""
        return "; ".join(item.text for item in self.inputs if item.kind is InputKind.ESTOP and item.heard)

    def enable(self) -> str:
        """Switching on, from `OFF`."""
        if self._power.state is PowerState.FAULT:
            return self.in_fault()
        if self._power.state is not PowerState.OFF:
            return self.busy()
        if self.order is not None:
            return f"{self._robot} stays off: {self.order.reason}"
        if self._setup.problem:
            return f"{self._robot} stays off: {self._setup.problem}"
        if wrong := self.wrong_units() or self.unread_units():
            return f"{self._robot} stays off: {wrong}"
        if self._setup.busy:
            return f"{self._robot} is being set up; enable it when that is done"
        operational = all(node.operational for node in self._nodes)
        lost = [node for node in self._nodes if not node.reference.known]
        if operational and lost:
            return f"{self._robot} is not referenced: {_missing(lost)}"
        if operational and self.inputs:
            return f"{self._robot} stays off: {self._open()}"
        if operational and self._watch.limit_switches:
            return f"{self._robot} stays off: {_at_ends(self._watch.limit_switches)}"
        if not operational or not self._power.all_in(AxisStatus.SWITCH_ON_DISABLED):
            return f"{self._robot} cannot be enabled, all nodes must be in {_OFF}: {self.said()}"
        absent = [io.said() for io in self._io_nodes if not io.operational]
        return f"{self._robot} cannot be enabled without its I/O nodes: {'; '.join(absent)}" if absent else ""

    def setup(self) -> str:
        """Motion that the drives make by themselves."""
        if self.order is not None:
            return f"{self._robot} stays off: {self.order.reason}"
        if self._setup.busy:
            return f"{self._robot} is being set up already"
        if self._power.state is PowerState.FAULT:
            return self.in_fault()
        if self._power.state is PowerState.ON:
            return f"{self._robot} is on; disable it first"
        if self._power.state is not PowerState.OFF:
            return self.busy()
        if self.inputs:
            return f"{self._robot} stays off: {self._open()}"
        if wrong := self.wrong_units() or self.unread_units():
            return f"{self._robot} stays off: {wrong}"
        operational = all(node.operational for node in self._nodes)
        if not (operational and self._watch.standing and self._power.all_in(AxisStatus.SWITCH_ON_DISABLED)):
            return f"{self._robot} must stand, all nodes in {_OFF}: {self.said()}"
        return ""

    def wrong_units(self) -> str:
        """Which drives say that they take speeds or ramps in another unit than they are told in."""
        return "; ".join(node.shown_units.problem for node in self._nodes if node.shown_units.problem)

    def unread_units(self) -> str:
        """Which drives have not said yet in which units they take speeds and ramps."""
        unread = [node.label for node in self._nodes if node.operational and not node.shown_units.read]
        return f"the units of {', '.join(unread)} are being read (60A9h, 60AAh); ask again" if unread else ""

    def accept(self) -> str:
        """An operator's word about where axes are."""
        if not (all(node.operational for node in self._nodes) and self._watch.standing and self._power.off):
            return f"{self._robot} must stand, switched off: {self.said()}"
        return ""

    def _open(self) -> str:
        return "; ".join(f"{item.text}, {item.remedy}" for item in self.inputs)

    def restless(self) -> str:
        """Losing the voltage after a fault: a drive that is not measured at rest would run out uncontrolled."""
        restless = [node.label for node in self._nodes if not node.rest.standing]
        if not restless:
            return ""
        return f"{self._robot} may still move: {', '.join(restless)} not measured at rest; {HARD_WIRED} until it stands"

    def moving(self) -> str:
        """Which axes keep others from the robot, and what helps one that only seems to move."""
        restless = [node.label for node in self._nodes if not node.rest.standing]
        which = ", ".join(restless)
        return f"; {which} not measured at rest (rest_window: for one that hunts around its place)" if restless else ""

    def busy(self) -> str:
        if self._power.state is PowerState.STOPPING and self.restless():
            return self.restless()
        return f"{self._robot} is busy: {self._power.state.value}; ask again when that is done"

    def in_fault(self) -> str:
        remedy = "" if self.trouble is None else f"{self.trouble.remedy}, then "
        return f"{self._robot} is in fault ({self.cause()}); {remedy}reset it"

    def cause(self) -> str:
        """Of the fault."""
        return "unknown cause" if self.trouble is None else self.trouble.text

    def said(self) -> str:
        """What each node says."""
        return "; ".join(node.said() for node in self._nodes)


def _at_ends(switches: Sequence[LimitSwitch]) -> str:
    return "; ".join(f"{switch.text}, {switch.remedy}" for switch in switches)


def _missing(nodes: Sequence[Drive]) -> str:
    """What each axis needs, axes that need the same together."""
    names: dict[str, list[str]] = {}
    for node in nodes:
        names.setdefault(node.reference.missing, []).append(node.axis.name)
    return "; ".join(f"{', '.join(axes)}: {missing}" for missing, axes in names.items())
