"""The drives of one robot as one: on together, handed over without a jump, off only at rest, stopped together."""

from collections.abc import Sequence
from enum import Enum

from cell.messages.drives import AxisStatus
from drive_gateway.canopen.pdo_map import target_object
from drive_gateway.canopen.sdo import Dialogue, SdoRead
from drive_gateway.cia402.state_machine import DISABLE_VOLTAGE, FAULT_RESET, INTERPOLATE
from drive_gateway.gateway.drives.drive import Drive

SWITCH_TIMEOUT_S = 1.5
"""Time for all drives of a robot to switch off or to be reset; a caller waits 2 s for the answer."""
RESET_LOW_CYCLES = 3
"""Cycles with the fault-reset bit low before its rising edge, so that no drive misses the edge."""
HANDOVER_CYCLES = 3
"""Cycles for which the target of the hand-over is sent before it is read back."""


class PowerState(Enum):
    OFF = "off"
    SWITCHING_ON = "switching on"
    HANDING_OVER = "taking over the measured position"
    ENABLING = "enabling operation"
    ON = "on"
    SWITCHING_OFF = "switching off"
    STOPPING = "quick stop"
    FAULT = "fault"
    RESETTING = "resetting"


_TARGET = {
    PowerState.OFF: AxisStatus.SWITCH_ON_DISABLED,
    PowerState.SWITCHING_ON: AxisStatus.SWITCHED_ON,
    PowerState.HANDING_OVER: AxisStatus.SWITCHED_ON,
    PowerState.ENABLING: AxisStatus.OPERATION_ENABLED,
    PowerState.ON: AxisStatus.OPERATION_ENABLED,
    PowerState.SWITCHING_OFF: AxisStatus.SWITCH_ON_DISABLED,
    PowerState.STOPPING: AxisStatus.QUICK_STOP_ACTIVE,
    PowerState.FAULT: AxisStatus.QUICK_STOP_ACTIVE,
    PowerState.RESETTING: AxisStatus.SWITCH_ON_DISABLED,
}
_TIMED = {
    PowerState.SWITCHING_ON,
    PowerState.HANDING_OVER,
    PowerState.ENABLING,
    PowerState.SWITCHING_OFF,
    PowerState.RESETTING,
}
_CAN_STOP = {AxisStatus.OPERATION_ENABLED, AxisStatus.QUICK_STOP_ACTIVE}
_STOPPABLE = {PowerState.SWITCHING_ON, PowerState.HANDING_OVER, PowerState.ENABLING, PowerState.ON}


class Power:
    """One state for all drives of a robot. It answers each drive's state with the controlword that leads on."""

    def __init__(self, nodes: Sequence[Drive]) -> None:
        self._nodes = nodes
        self._deadline = 0.0
        self._cycles = 0
        self._targets: Sequence[int] = ()
        self._confirmed: set[int] = set()
        self._held_since: float | None = None
        """All drives hold their axes against brakes that are still opening."""
        self._brake_s = max(node.axis.brake_s for node in nodes)
        self._switch_on_s = max(node.axis.switch_on_s for node in nodes)
        self.state = PowerState.OFF
        self._target = _TARGET[self.state]
        self.released = False
        """In a fault: at rest under an emergency stop, so the voltage goes off."""

    @property
    def off(self) -> bool:
        """No drive has torque, and every drive says so itself."""
        return all(node.without_torque for node in self._nodes)

    @property
    def _stands(self) -> bool:
        """A node that was silent when the reset began may be heard since, and move."""
        return all(node.rest.standing for node in self._nodes)

    @property
    def stoppable(self) -> bool:
        """The drives have torque, or are about to, and nothing stops them yet."""
        return self.state in _STOPPABLE

    def enter(self, state: PowerState, now: float) -> None:
        self.state = state
        self._target = _TARGET[state]
        self.released = False
        self._cycles = 0
        self._held_since = None
        if state not in (PowerState.HANDING_OVER, PowerState.ENABLING):
            self._deadline = now + (self._switch_on_s if state is PowerState.SWITCHING_ON else SWITCH_TIMEOUT_S)

    def late(self, now: float) -> bool:
        """The drives did not get where they should in time."""
        return self.state in _TIMED and now > self._deadline

    def hand_over(self, targets: Sequence[int], now: float) -> None:
        """All drives are switched on: from now on their target is `targets` [counts], which is then read back."""
        self.enter(PowerState.HANDING_OVER, now)
        self._targets = targets
        self._confirmed = set()

    def step(self, now: float) -> None:
        """Go on where all drives have arrived. The caller starts the hand-over, because it owns the command."""
        self._cycles += 1
        match self.state:
            case PowerState.HANDING_OVER:
                if self._cycles == HANDOVER_CYCLES:
                    for number, node in enumerate(self._nodes):
                        node.follow(self._read_target(number))
                if len(self._confirmed) == len(self._nodes):
                    self.enter(PowerState.ENABLING, now)
            case PowerState.ENABLING:
                self._await_brakes(now)
            case PowerState.SWITCHING_OFF if self.off:
                self.enter(PowerState.OFF, now)
            case PowerState.RESETTING if self.all_in(AxisStatus.SWITCH_ON_DISABLED) and self._stands:
                self.enter(PowerState.OFF, now)

    def _await_brakes(self, now: float) -> None:
        """What is commanded before its brake is open an axis does not follow, and makes up for it in a jump."""
        if not self.all_in(AxisStatus.OPERATION_ENABLED):
            self._held_since = None
            return
        if self._held_since is None:
            self._held_since = now
        if now - self._held_since >= self._brake_s:
            self.enter(PowerState.ON, now)

    def all_in(self, status: AxisStatus) -> bool:
        return all(node.status is status for node in self._nodes)

    def controlword(self, node: Drive) -> int:
        """The command for one drive in this cycle."""
        status = node.status
        if self.state is PowerState.RESETTING and status is AxisStatus.FAULT:
            return FAULT_RESET if self._cycles > RESET_LOW_CYCLES else DISABLE_VOLTAGE
        target = AxisStatus.SWITCH_ON_DISABLED if self.released else self._target
        if self.state is PowerState.OFF and status in _CAN_STOP and not node.rest.standing:
            # Found with torque and in motion: without torque it would run out uncontrolled.
            target = AxisStatus.QUICK_STOP_ACTIVE
        word = node.leading_to(target)
        interpolates = node.axis.interpolated and status is target is AxisStatus.OPERATION_ENABLED
        return word | INTERPOLATE if interpolates else word

    def _read_target(self, number: int) -> Dialogue:
        node = self._nodes[number]
        wanted = node.axis.wrapped(self._targets[number])
        while number not in self._confirmed:
            outcome = yield SdoRead(*target_object(node.axis.interpolated))
            if self.state is not PowerState.HANDING_OVER or outcome.abort_code is not None:
                return
            # Else lost, or a moment too early; the deadline of the hand-over bounds the repeats.
            if not outcome.problem and int.from_bytes(outcome.data, "little", signed=True) == wanted:
                self._confirmed.add(number)
