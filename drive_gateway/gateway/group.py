"""The drives of one robot in the cycle: measure, look for troubles, go on with power, command the next sample."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import Times
from cell.core import Effect
from cell.messages.drives import AxisStatus, PlayoutState
from drive_gateway.cia402.units import AxisUnits
from drive_gateway.config.settings import GatewaySettings, RobotDrives
from drive_gateway.gateway.effects import Frame
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.measurement import FollowingMonitor, RestDetector
from drive_gateway.gateway.node import Node
from drive_gateway.gateway.playout import Playout
from drive_gateway.gateway.power import Power, PowerState
from drive_gateway.gateway.setup_desk import SetupDesk
from drive_gateway.gateway.trouble import Trouble

Floats = NDArray[np.float64]
Then = Callable[[bool, str], None]
"""Takes whether it was done, and what was done or found."""


@dataclass(frozen=True, slots=True)
class StopOrder:
    """Bring the robot to rest and switch it off; what still moves at `deadline` is stopped by its drives."""

    deadline: float
    reason: str


class DriveGroup:
    """All drives of one robot. What is asked for is answered through `Then`, at once or when the drives have it."""

    def __init__(self, drives: RobotDrives, settings: GatewaySettings, times: Times, log: EventLog) -> None:
        axes = drives.axes
        self.robot = drives.robot
        self.nodes = [Node(drives.robot, axis, settings) for axis in axes]
        self.position: Floats = np.zeros(len(axes))
        self.velocity: Floats = np.zeros(len(axes))
        self.measured = False
        """Every axis has been measured at least once."""
        # The first cycle sends SYNC 1 and then the sample of tick 2.
        self.playout = Playout(axes, settings.cycle_s, self.position, tick=1)
        self.power = Power(self.nodes)
        self.trouble: Trouble | None = None
        """Why the robot is in fault."""
        self.setup = SetupDesk(log)
        self._cycle_s = settings.cycle_s
        self._stop_time_s = times.estop_delay_s
        self._log = log
        self._units = AxisUnits(axes)
        self._window: Floats = np.array([axis.following_window for axis in axes])
        self._rest = RestDetector(axes)
        self._following = FollowingMonitor(axes, settings.overrun_limit_s)
        self._sent: deque[Floats] = deque([self.position] * 3, maxlen=3)
        self._order: StopOrder | None = None
        self._stopped_by = 0.0
        self._standing = False
        self._then: Then | None = None

    @property
    def operational(self) -> bool:
        return all(node.operational for node in self.nodes)

    @property
    def referenced(self) -> bool:
        """Every axis knows where it is, and none moves by itself."""
        return self.operational and self.setup.motion is None and all(node.referenced for node in self.nodes)

    @property
    def commanded(self) -> Floats:
        """`(n,)` [rad or m] the sample of the present tick."""
        return self._sent[-1]

    @property
    def at_rest(self) -> bool:
        """Nothing commands a motion, and none is measured while there is torque."""
        match self.power.state:
            case PowerState.STOPPING:
                return False
            case PowerState.OFF | PowerState.FAULT:
                return self.setup.motion is None
        return self.playout.at_rest and self._standing

    @property
    def idle(self) -> bool:
        """Switched off as far as this gateway can: nothing is commanded, nothing is waited for."""
        if self.power.state is PowerState.FAULT:
            return self.idle_nodes
        return self.power.state is PowerState.OFF and self.setup.motion is None

    @property
    def idle_nodes(self) -> bool:
        """Every node that can be heard says that it has no torque."""
        return all(not node.operational or node.without_torque for node in self.nodes)

    @property
    def switched_off(self) -> bool:
        """Off or in fault, standing as far as it is measured, and no node that can be heard has torque."""
        standing = self._standing or not self.measured
        return self.power.state in (PowerState.OFF, PowerState.FAULT) and standing and self.idle_nodes

    @property
    def secured(self) -> bool:
        """Measured at rest and without torque, by every drive's own word."""
        return self._standing and self.operational and self.power.off

    def enable(self, now: float, then: Then) -> None:
        """Switch on; the robot holds the position that is measured."""
        match self.power.state:
            case PowerState.ON:
                then(True, f"{self.robot} is enabled already")
            case PowerState.OFF if self._order is not None:
                then(False, f"{self.robot} stays off: {self._order.reason}")
            case PowerState.OFF if self.setup.busy:
                then(False, f"{self.robot} is being set up; enable it when that is done")
            case PowerState.OFF if self.operational and not self.referenced:
                names = ", ".join(node.axis.name for node in self.nodes if not node.referenced)
                then(False, f"{self.robot} is not referenced ({names}); home it first: cell home {self.robot}")
            case PowerState.OFF if self.operational and self.power.all_in(AxisStatus.SWITCH_ON_DISABLED):
                self._then = then
                self.power.enter(PowerState.SWITCHING_ON, now)
            case PowerState.OFF:
                then(False, f"{self.robot} cannot be enabled, all nodes must be in SWITCH_ON_DISABLED: {self.said()}")
            case PowerState.FAULT:
                then(False, f"{self.robot} is in fault ({self._fault_text()}); reset it first")
            case _:
                then(False, f"{self.robot} is busy: {self.power.state.value}; ask again when that is done")

    def disable(self, now: float, then: Then) -> None:
        """Switch off, only at rest: a drive that loses its torque in motion runs out uncontrolled."""
        match self.power.state:
            case PowerState.OFF if self.setup.motion is not None:
                self.setup.stop("it was disabled", now)
                then(True, f"{self.robot} stops its set-up motion and switches off")
            case PowerState.OFF:
                then(True, f"{self.robot} is off already")
            case PowerState.FAULT:
                self.power.released = True
                then(True, f"{self.robot} is in fault and loses its voltage: {self._fault_text()}")
            case PowerState.ON if self.at_rest:
                self._then = then
                self._switch_off(now)
            case PowerState.ON:
                then(False, f"{self.robot} moves; halt it first")
            case _:
                then(False, f"{self.robot} is busy: {self.power.state.value}; ask again when that is done")

    def reset(self, now: float, then: Then) -> None:
        """Acknowledge a fault. Nothing moves and nothing is enabled by this."""
        match self.power.state:
            case PowerState.FAULT:
                self._then = then
                self.power.enter(PowerState.RESETTING, now)
            case PowerState.OFF | PowerState.ON:
                then(True, f"{self.robot} has no fault")
            case _:
                then(False, f"{self.robot} is busy: {self.power.state.value}; ask again when that is done")

    def setup_problem(self) -> str:
        """Why the drives may not move by themselves now; empty when they may."""
        if self._order is not None:
            return f"{self.robot} stays off: {self._order.reason}"
        if self.setup.busy:
            return f"{self.robot} is being set up already"
        if self.power.state is PowerState.FAULT:
            return f"{self.robot} is in fault ({self._fault_text()}); reset it first"
        if self.power.state is not PowerState.OFF:
            return f"{self.robot} is {self.power.state.value}; disable it first"
        if not (self.operational and self._standing and self.power.all_in(AxisStatus.SWITCH_ON_DISABLED)):
            return f"{self.robot} must stand, all nodes in SWITCH_ON_DISABLED: {self.said()}"
        return ""

    def said(self) -> str:
        """What each node says."""
        return "; ".join(node.said() for node in self.nodes)

    def fault(self, trouble: Trouble, now: float) -> None:
        """Stop all drives of the robot with voltage on; nothing moves again before reset and enable."""
        self._log.alarm(trouble, self.robot)
        if self.power.state in (PowerState.STOPPING, PowerState.FAULT):
            self.trouble = self.trouble or trouble
            return
        self.trouble = trouble
        self._answer(False, f"{self.robot}: {trouble.text}; {trouble.remedy}")
        if self.power.state is PowerState.OFF and self.setup.motion is None:
            self._stand_in_fault(now)
        else:
            self.setup.abandon(trouble.text, now)
            self._quick_stop(now)

    def step(self, now: float, tick: int, order: StopOrder | None) -> list[Effect]:
        """One cycle after the SYNC numbered `tick`: first the RPDOs for the next one, then what the nodes need."""
        self._order = order
        after = [effect for node in self.nodes for effect in node.step(now, tick - 1)]
        self._measure(now)
        self._look_for_troubles(now)
        self.power.step(now)
        self._progress(now)
        self.setup.step(now)
        if order is not None:
            self._obey(order, now)
        return self._command() + after

    # Measuring and judging

    def _measure(self, now: float) -> None:
        counts = [node.counts for node in self.nodes]
        known = [count for count in counts if count is not None]
        if len(known) < len(counts):
            return
        self.measured = True
        self.position = self._units.position(known)
        self.velocity = self._units.velocity([node.counts_per_cycle / self._cycle_s for node in self.nodes])
        self._standing = self._rest.update(self.position, now)

    def _look_for_troubles(self, now: float) -> None:
        for node in self.nodes:
            for trouble in node.check():
                self.fault(trouble, now)
            if node.lost and self.power.state in (PowerState.OFF, PowerState.FAULT):
                node.bring_up_again(now)
            elif node.problem and node.problem != node.told_problem and not node.lost:
                self._log.warn("node_absent", node.problem, "correct the cause; the node is tried again by itself")
            node.told_problem = node.problem
            if node.status is AxisStatus.FAULT or node.status is AxisStatus.FAULT_REACTION_ACTIVE:
                self._drive_in_fault(node, now)
        if self.power.state is not PowerState.ON:
            self._following.forget()
            return
        for node in self.nodes:
            if node.status is not AxisStatus.OPERATION_ENABLED:
                text = f"{node.label} left Operation Enabled, it is in {node.status.name}"
                self.fault(Trouble("left_enabled", text, "check the drive's enable inputs", node.axis.node_id), now)
        # The answer to the last SYNC shows the position at which the sample before it had been reached.
        self._check_following(self._sent[0], now)

    def _check_following(self, demand: Floats, now: float) -> None:
        found = self._following.update(self.position, demand, now)
        if found is not None:
            node, error = self.nodes[found[0]], found[1]
            text = f"{node.label} is {error:.4g} beside its command, allowed {node.axis.following_window:.4g}"
            remedy = "look for a collision or a blocked axis, then reset"
            self.fault(Trouble("following_error", text, remedy, node.axis.node_id), now)

    def _drive_in_fault(self, node: Node, now: float) -> None:
        if self.power.state in (PowerState.STOPPING, PowerState.FAULT, PowerState.RESETTING):
            return
        emergency = node.emergency
        reason = "no emergency code" if emergency is None else f"{emergency.code:04X}h {emergency.meaning}"
        remedy = "look at the drive's display" if emergency is None else emergency.remedy
        code = None if emergency is None else emergency.code
        self.fault(Trouble("drive_fault", f"{node.label} is in fault: {reason}", remedy, node.axis.node_id, code), now)

    # Power

    def _progress(self, now: float) -> None:
        """What follows from where the drives have arrived."""
        match self.power.state:
            case PowerState.OFF:
                self._answer_if_waiting()
                if self.measured:
                    self.playout.follow(self.position)
            case PowerState.SWITCHING_ON:
                self.playout.follow(self.position)
                if self.power.all_in(AxisStatus.SWITCHED_ON):
                    self.power.hand_over(self._units.counts(self.position), now)
            case PowerState.HANDING_OVER | PowerState.ENABLING if self._moved():
                self._answer(False, f"{self.robot} moved while it was enabled; check brakes and loads")
                self._switch_off(now)
            case PowerState.ON if self.playout.state is PlayoutState.FOLLOWING:
                self.playout.go_live()
                self._log.info("enabled", f"{self.robot} is enabled")
                self._answer(True, f"{self.robot} is enabled: {len(self.nodes)} drives hold their position")
            case PowerState.STOPPING if self._has_stopped(now):
                self._after_stop(now)
        if self.power.late(now):
            self._too_late(now)

    def _answer_if_waiting(self) -> None:
        if self._then is not None:
            self.trouble = None
            self._log.info("disabled", f"{self.robot} is off")
            self._answer(True, f"{self.robot} is off: {len(self.nodes)} drives without torque")

    def _moved(self) -> bool:
        """An axis left the position that was taken over as its target."""
        return bool((np.abs(self.position - self.playout.position) > self._window).any())

    def _has_stopped(self, now: float) -> bool:
        if self._standing and self.operational:
            return True
        # After a fault the drives keep their voltage, so it may be declared without a measured standstill.
        return self.trouble is not None and now >= self._stopped_by

    def _after_stop(self, now: float) -> None:
        if self.trouble is None:
            self._switch_off(now)
        else:
            self._stand_in_fault(now)

    def _too_late(self, now: float) -> None:
        state = self.power.state
        found = self.said()
        if state is PowerState.RESETTING:
            self.power.enter(PowerState.FAULT, now)
            self._answer(False, f"{self.robot} could not be reset, a cause is still there: {found}")
        elif state is PowerState.SWITCHING_OFF:
            text = f"the drives did not switch off: {found}"
            self.fault(Trouble("not_off", text, "use the hard-wired emergency stop and look at the drives"), now)
        else:
            self._answer(False, f"{self.robot} got no further than {state.value}: {found}")
            self._switch_off(now)

    def _obey(self, order: StopOrder, now: float) -> None:
        self.setup.stop(order.reason, now)
        match self.power.state:
            case PowerState.SWITCHING_ON | PowerState.HANDING_OVER | PowerState.ENABLING:
                self._answer(False, f"{self.robot} stays off: {order.reason}")
                self._switch_off(now)
            case PowerState.ON if self.at_rest:
                self._switch_off(now)
            case PowerState.ON if now >= order.deadline:
                text = f"{self.robot} is not at rest in time ({order.reason}): quick stop"
                self._log.warn("stop_deadline", text, "look why the agent did not brake")
                self._quick_stop(now)
            case PowerState.FAULT if self._standing:
                self.power.released = True

    def _switch_off(self, now: float) -> None:
        self.playout.follow(self.playout.position)
        self.power.enter(PowerState.SWITCHING_OFF, now)

    def _quick_stop(self, now: float) -> None:
        self.playout.stop()
        self._rest.forget()
        self._standing = False
        self._stopped_by = now + self._stop_time_s
        self.power.enter(PowerState.STOPPING, now)

    def _stand_in_fault(self, now: float) -> None:
        self.playout.fail()
        self.power.enter(PowerState.FAULT, now)

    def _command(self) -> list[Effect]:
        position, _ = self.playout.advance()
        self._sent.append(position)
        counts = self._units.counts(position)
        return [
            Frame(self.setup.rpdo(node) or node.rpdo(self.power.controlword(node), count))
            for node, count in zip(self.nodes, counts, strict=True)
            if node.operational or node.lost
        ]

    def _answer(self, ok: bool, text: str) -> None:
        then, self._then = self._then, None
        if then is not None:
            then(ok, text)

    def _fault_text(self) -> str:
        return "unknown cause" if self.trouble is None else self.trouble.text
