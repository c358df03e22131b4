"""One drive that makes a motion of its own: prepared, switched on, started, watched, switched off again."""

from collections import deque
from enum import Enum

from cell.messages.drives import AxisStatus
from drive_gateway.canopen.pdo_map import SdoWrite
from drive_gateway.canopen.sdo import SdoDone
from drive_gateway.cia402.setup_objects import (
    ACKNOWLEDGED,
    ATTAINED,
    FAILED,
    HALT,
    HOMING,
    MODE,
    MODE_DISPLAY,
    PROFILE_POSITION,
    PROFILE_VELOCITY,
    REACHED,
    STANDING,
    START,
    TARGET_VELOCITY,
    Press,
    SetupOrder,
)
from drive_gateway.cia402.state_machine import controlword
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.trouble import HARD_WIRED, Trouble
from drive_gateway.gateway.watch.limit_switches import limit_switches

STAGE_S = 2.0
"""Time for each stage in which nothing moves."""
SETTLED_CYCLES = 6
"""Cycles after which a statusword surely answers the newest controlword or object."""
HALT_RESERVE = 2.0
"""An axis may need so many times its ramp until it has halted; then it gets a quick stop."""


class Stage(Enum):
    PREPARING = "being prepared"
    SWITCHING_ON = "switching on"
    READY = "ready"
    STARTING = "starting"
    ACKNOWLEDGING = "taking its set point"
    MOVING = "moving"
    HALTING = "halting"
    STOPPING = "quick stop"
    SWITCHING_OFF = "switching off"
    ENDED = "done"


_TARGETS = {
    Stage.SWITCHING_ON: AxisStatus.OPERATION_ENABLED,
    Stage.READY: AxisStatus.OPERATION_ENABLED,
    Stage.STARTING: AxisStatus.OPERATION_ENABLED,
    Stage.ACKNOWLEDGING: AxisStatus.OPERATION_ENABLED,
    Stage.MOVING: AxisStatus.OPERATION_ENABLED,
    Stage.HALTING: AxisStatus.OPERATION_ENABLED,
    Stage.STOPPING: AxisStatus.QUICK_STOP_ACTIVE,
}


_UNDER_WAY = (Stage.STARTING, Stage.ACKNOWLEDGING, Stage.MOVING, Stage.HALTING)


_UNTIMED = (Stage.READY, Stage.MOVING, Stage.HALTING, Stage.STOPPING, Stage.ENDED)
"""Nothing but the operator, the motion itself or the watch over stops ends these."""


class SetupAxis:
    """Feed `step` once per cycle; `controlword` and `target` are what the drive is told in it."""

    def __init__(self, node: Drive, order: SetupOrder, now: float) -> None:
        self.node = node
        self.order = order
        self.stage = Stage.PREPARING
        self.problem = ""
        """Why it ended early, but for a halt."""
        self.trouble: Trouble | None = None
        """Why its robot must be stopped."""
        self.halted = False
        """It was told to halt before its end."""
        self.velocity = 0
        """[counts/s] for 60FFh."""
        self.torque = 0
        """[per mille of the rated one] of mode cyclic torque, on top of what carries the robot."""
        self._began_at = node.counts or 0
        self._cycles = 0
        self._since = self._now = now
        self._enabled_since: float | None = None
        self._sent_stop = False
        self._way = _way(order, node.counts or 0)
        mode = SdoWrite(MODE, 0, order.mode.to_bytes(1, "little"))
        self._steps = deque([(write, write.index, write.sub) for write in order.writes] + [(mode, MODE_DISPLAY, 0)])
        self._write()

    @property
    def target(self) -> int:
        """[counts] for 607Ah: the set point, or where the axis is."""
        return self.node.counts or 0 if self.order.target is None else self.order.target

    @property
    def controlword(self) -> int:
        word = controlword(self.node.status, _TARGETS.get(self.stage, AxisStatus.SWITCH_ON_DISABLED))
        if self.stage is Stage.HALTING:
            word |= HALT
        homing = self.order.mode == HOMING and self.stage in (Stage.MOVING, Stage.HALTING)
        # A set point is taken on the rising edge, when the target has arrived for sure.
        setting = self.stage is Stage.STARTING and self._cycles > 3
        return word | START if homing or setting else word

    @property
    def attained(self) -> bool:
        """Its motion ended as it should."""
        return self.stage is Stage.ENDED and not self.problem and not self.halted

    def progress(self) -> str:
        """What it does, and with which torque it presses, for people."""
        doing = f"{self.node.axis.name} {self.stage.value}"
        if self.order.press is None or self.stage is not Stage.MOVING or self.node.torque is None:
            return doing
        # Two digits: each change is a line on the operator's screen.
        torque = float(f"{self.node.torque:.2g}")
        return f"{self.node.axis.name} gives {torque:g} {'N' if self.node.axis.linear else 'Nm'}"

    def start(self, now: float) -> None:
        """All axes are ready."""
        if self.order.mode == PROFILE_VELOCITY:
            self._set_velocity(self.order.velocity)
        position = self.order.mode == PROFILE_POSITION
        self._enter(Stage.STARTING if position else Stage.MOVING, now)

    def halt(self, problem: str, now: float) -> None:
        """Brake on the ramp of its motion and switch off; a torque has no ramp to rest, so there it is a quick stop."""
        if self.halted or self.stage not in _UNDER_WAY or self.order.press is not None:
            if self.stage is not Stage.HALTING:
                self.stop(problem, now)
            return
        self.halted = True
        self.node.rest.measure_anew()
        self._enter(Stage.HALTING, now)

    def stop(self, problem: str, now: float) -> None:
        """Stop by a quick stop and switch off."""
        if self.stage in (Stage.STOPPING, Stage.SWITCHING_OFF, Stage.ENDED):
            return
        self.problem = problem
        self.velocity = self.torque = 0
        self.node.rest.measure_anew()
        self._enter(Stage.STOPPING if not self.node.without_torque else Stage.SWITCHING_OFF, now)

    def step(self, now: float) -> None:
        """One cycle."""
        self._cycles += 1
        self._now = now
        word, status = self.node.statusword, self.node.status
        enabled = status is AxisStatus.OPERATION_ENABLED
        if self.stage in _UNDER_WAY and self.order.mode != HOMING:
            self._mind_the_ends(now)
        match self.stage:
            case Stage.PREPARING if not self._steps:
                self._enter(Stage.SWITCHING_ON, now)
            case Stage.SWITCHING_ON if enabled:
                self._await_brake(now)
            case stage if stage in _UNDER_WAY and not enabled:
                self.stop(f"{self.node.label} left Operation Enabled, it is in {status.words}", now)
            case Stage.STARTING if self._cycles > 3 and word & ACKNOWLEDGED:
                self._enter(Stage.ACKNOWLEDGING, now)
            case Stage.ACKNOWLEDGING if not word & ACKNOWLEDGED:
                self._enter(Stage.MOVING, now)
            case Stage.MOVING if self.order.press is not None:
                self._press(self.order.press, now)
            case Stage.MOVING:
                self._watch(word, now)
            case Stage.HALTING | Stage.STOPPING if self.node.rest.standing:
                self._enter(Stage.SWITCHING_OFF, now)
            case Stage.HALTING if now - self._since > HALT_RESERVE * self.order.ramp_s + self.node.rest.margin_s:
                self.stop(f"{self.node.label} did not halt, it got a quick stop", now)
            case Stage.SWITCHING_OFF if self.node.without_torque:
                self._enter(Stage.ENDED, now)
        self._mind_the_time(now)

    def _await_brake(self, now: float) -> None:
        """A motion that begins against a brake that is still opening begins with a jump; a torque does not."""
        if self._enabled_since is None:
            self._enabled_since = now
        if self.order.press is not None or now - self._enabled_since >= self.node.axis.brake_s:
            self._enter(Stage.READY, now)

    def _watch(self, word: int, now: float) -> None:
        if self.order.mode == PROFILE_VELOCITY and now - self._since >= self.order.stop_s and not self._sent_stop:
            self._sent_stop = True
            self._cycles = 0
            self._set_velocity(0)
        if self._cycles < SETTLED_CYCLES:
            return
        if self.order.mode == HOMING and word & FAILED:
            self.stop(f"{self.node.label} did not find its home point (homing error)", now)
        elif self._arrived(word):
            self._enter(Stage.SWITCHING_OFF, now)

    def _press(self, press: Press, now: float) -> None:
        """Torque moves what nothing holds: that ends it."""
        elapsed_s = now - self._since
        if abs((self.node.counts or 0) - self._began_at) > press.within:
            self.stop(f"{self.node.label} gave way: it moved farther than the {press.allowed} it may", now)
        elif elapsed_s >= press.lasts_s:
            self.torque = 0
            self._enter(Stage.SWITCHING_OFF, now)
        else:
            self.torque = press.at(elapsed_s)

    def _mind_the_ends(self, now: float) -> None:
        for switch in limit_switches([self.node], now):
            if switch.forbids(self._way):
                self.stop(switch.text, now)

    def _arrived(self, word: int) -> bool:
        if self.order.mode == HOMING:
            return bool(word & ATTAINED) and bool(word & REACHED)
        if self.order.mode == PROFILE_VELOCITY:
            return self._sent_stop and bool(word & STANDING)
        return bool(word & REACHED)

    def _mind_the_time(self, now: float) -> None:
        within_s = max(STAGE_S, self.node.axis.switch_on_s) if self.stage is Stage.SWITCHING_ON else STAGE_S
        if now - self._since <= within_s or self.stage in _UNTIMED:
            return
        if self.stage is not Stage.SWITCHING_OFF:
            more = "; give it more time by switch_on_s" if self.stage is Stage.SWITCHING_ON else ""
            self.stop(f"{self.node.label} got no further than {self.stage.value}: {self.node.said()}{more}", now)
            return
        self.problem = f"{self.node.label} did not switch off: {self.node.said()}"
        self.node.stop_by_network(now)
        self.trouble = Trouble("not_off", self.problem, HARD_WIRED, self.node.axis.node_id)
        self._enter(Stage.ENDED, now)

    def _enter(self, stage: Stage, now: float) -> None:
        self.stage, self._since, self._cycles = stage, now, 0

    def _write(self) -> None:
        """Write the next object, then read back what shows it."""
        write, index, sub = self._steps[0]

        def written(outcome: SdoDone) -> None:
            if outcome.problem:
                self.problem = f"{self.node.label} refused {write.index:04X}h:{write.sub:02X}: {outcome.problem}"
            elif self.stage is Stage.PREPARING:
                self.node.submit(index, sub, None, shown)

        def shown(outcome: SdoDone) -> None:
            if self.stage is not Stage.PREPARING:
                return
            if outcome.problem or outcome.data != write.data:
                # A drive may need a moment until it shows a mode; the time of the stage bounds the repeats.
                self.node.submit(index, sub, None, shown)
                return
            self._steps.popleft()
            self._since = self._now  # a drive may be slow in each of its answers
            if self._steps:
                self._write()

        self.node.submit(write.index, write.sub, write.data, written)

    def _set_velocity(self, velocity: int) -> None:
        self.velocity = velocity
        if self.node.velocity_by_pdo:
            return
        data = velocity.to_bytes(4, "little", signed=True)

        def written(outcome: SdoDone) -> None:
            if outcome.problem:
                self.problem = f"{self.node.label} refused its target velocity: {outcome.problem}"

        self.node.submit(TARGET_VELOCITY, 0, data, written)


def _way(order: SetupOrder, counts: int) -> int:
    """In whose direction the axis goes, or presses, from `counts`."""
    if order.press is not None:
        return order.press.per_mille
    return order.velocity if order.target is None else order.target - counts
