"""How the drives of one robot are watched: where they are, whether they stand, and what is wrong with them."""

from collections.abc import Iterator, Sequence

import numpy as np

from cell.messages.drives import AxisStatus
from drive_gateway.cia402.state_machine import FOLLOWS_COMMAND
from drive_gateway.cia402.units import AxisUnits
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.drives.power import Power, PowerState
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.nodes.node import Node
from drive_gateway.gateway.trouble import Trouble
from drive_gateway.gateway.watch.drive_warnings import DriveWarnings
from drive_gateway.gateway.watch.limit_switches import LimitSwitch, limit_switches
from drive_gateway.gateway.watch.measurement import Floats, FollowingMonitor

_FAULT = (AxisStatus.FAULT, AxisStatus.FAULT_REACTION_ACTIVE)


class Watch:
    """The newest measurement of all axes, and the troubles of each cycle.

    Args:
        nodes: the drives, in the order of the robot's axes.
        power: what they were told last.
        settings: their gateway's.
        log: where news is told that is no trouble.
    """

    def __init__(self, nodes: Sequence[Drive], power: Power, settings: GatewaySettings, log: EventLog) -> None:
        axes = [node.axis for node in nodes]
        self.position: Floats = np.zeros(len(axes))
        self.velocity: Floats = np.zeros(len(axes))
        self.torque: Floats | None = None
        """`None`: not every drive tells what it gives."""
        self.measured = False
        """Every axis has been measured at least once."""
        self.standing = False
        """Every axis is measured at rest; a silent one has had the time to stop by itself."""
        self.limit_switches: tuple[LimitSwitch, ...] = ()
        """Those that end a motion now."""
        self._nodes = nodes
        self._power = power
        self._log = log
        self._cycle_s = settings.cycle_s
        self._units = AxisUnits(axes)
        self._warnings = DriveWarnings(nodes, log)
        self._following = FollowingMonitor(axes, settings.overrun_limit_s)

    def measure(self, now: float) -> None:
        """Take what the nodes said; positions stay as they are as long as one node has said nothing yet."""
        standing = True
        for node in self._nodes:
            if not node.operational:
                node.rest.silent(now)
                if node.found_with_torque:
                    self._tell_find(node)
            elif node.status is AxisStatus.FAULT_REACTION_ACTIVE:
                node.judge_reaction(now)
            standing = standing and node.rest.standing
        self.standing = standing
        known = [node.counts for node in self._nodes if node.counts is not None]
        if len(known) < len(self._nodes):
            return
        self.measured = True
        self.position = self._units.position(known)
        self.velocity = self._units.velocity([node.counts_per_cycle / self._cycle_s for node in self._nodes])
        told = [node.per_mille for node in self._nodes if node.per_mille is not None]
        self.torque = self._units.torque(told) if len(told) == len(self._nodes) else None
        for node, count in zip(self._nodes, known, strict=True):
            self._judge(node, count)
        self._warnings.step(now)

    def forget_rest(self) -> None:
        """Something moves now: standstill must be measured anew."""
        for node in self._nodes:
            node.rest.measure_anew()
        self.standing = False

    def troubles(self, demand: Floats, now: float) -> Iterator[Trouble]:
        """What is wrong in this cycle, one by one: what is done about one may change the power before the next.

        `demand` `(n,)` [rad or m] is the sample that the measurement answers.
        """
        for node in self._nodes:
            for trouble in node.node.check():
                if trouble.stops:
                    yield trouble
                else:
                    self._log.warn_repeated("drive_warning", trouble.text, trouble.remedy, trouble.text, now)
            idle = self._power.state in (PowerState.OFF, PowerState.FAULT)
            attend(node.node, idle or node.rest.only_measured, now, self._log)
            if node.status in _FAULT and not self._in_fault:
                yield _fault_of(node)
        self.limit_switches = tuple(limit_switches(self._nodes, now))
        if self._power.state is not PowerState.ON:
            self._following.forget()
            return
        for switch in self.limit_switches:
            yield switch.trouble
        at_end = [switch.node for switch in self.limit_switches]
        for node in self._nodes:
            if node.status is not AxisStatus.OPERATION_ENABLED and node not in at_end:
                text = f"{node.label} left Operation Enabled, it is in {node.status.words}"
                yield Trouble("left_enabled", text, "check the drive's enable inputs", node.axis.node_id)
        found = self._following.update(self.position, demand, now)
        for node, error in zip(self._nodes, self._following.largest.tolist(), strict=True):
            node.largest_error = error
        if found is not None:
            yield _following_error(self._nodes[found[0]], found[1])

    def _judge(self, node: Drive, counts: int) -> None:
        """After a start: does an absolute encoder show where the axis was? It must stand to be compared."""
        reference = node.reference
        if reference.judged or not node.operational or (reference.compares and not self.standing):
            return
        reference.judge(counts)
        if not reference.known:
            self._log.warn("not_referenced", f"{node.label}: {reference.why}", reference.remedy)

    def _tell_find(self, node: Drive) -> None:
        node.found_with_torque = False
        text = f"{node.label} had torque when this gateway started; reset of its communication stops it"
        self._log.warn("found_with_torque", text, "look how the gateway before ended, then enable the robot again")

    @property
    def _in_fault(self) -> bool:
        return self._power.state in (PowerState.STOPPING, PowerState.FAULT, PowerState.RESETTING)


def attend(node: Node, idle: bool, now: float, log: EventLog) -> None:
    """A node that was lost is brought up again when nothing moves (`idle`); an absent one is told once."""
    if node.may_return(now, idle):
        node.bring_up_again(now)
    elif node.problem and node.problem != node.told_problem and not node.lost:
        log.warn("node_absent", node.problem, "correct the cause; the node is tried again by itself")
    node.told_problem = node.problem
    for text in node.take_lacking():
        log.warn("object_missing", text, "where that is too much, use a device that has the object")


def _fault_of(node: Drive) -> Trouble:
    emergency = node.emergency
    reason = "no emergency code" if emergency is None else f"{emergency.code:04X}h {emergency.meaning}"
    remedy = "look at the drive's display" if emergency is None else emergency.remedy
    code = None if emergency is None else emergency.code
    return Trouble("drive_fault", f"{node.label} is in fault: {reason}", remedy, node.axis.node_id, code)


def _following_error(node: Drive, error: float) -> Trouble:
    deaf = "" if node.statusword & FOLLOWS_COMMAND else "; its statusword says that it does not follow it (bit 12 is 0)"
    text = f"{node.label} is {error:.4g} beside its command, allowed {node.axis.following_window:.4g}{deaf}"
    return Trouble("following_error", text, "look for a collision or a blocked axis", node.axis.node_id)
