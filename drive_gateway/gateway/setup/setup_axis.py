"""One drive that makes a motion of its own: prepared, switched on, started, watched, switched off again."""

from enum import Enum

from cell.messages.drives import AxisStatus
from drive_gateway.canopen.drive_objects import MODE, MODE_DISPLAY, TARGET_VELOCITY
from drive_gateway.canopen.sdo import Dialogue, SdoRead, SdoWrite
from drive_gateway.cia402.setup_objects import (
    ACKNOWLEDGED,
    ATTAINED,
    FAILED,
    HALT,
    HOMING,
    PROFILE_POSITION,
    PROFILE_VELOCITY,
    REACHED,
    STANDING,
    START,
    Press,
    SetupOrder,
    position_window,
)
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.setup.first_motion import FirstMotion
from drive_gateway.gateway.trouble import HARD_WIRED, Trouble
from drive_gateway.gateway.watch.limit_switches import limit_switches

STAGE_S = 2.0
"""Time for each stage in which nothing moves."""
SETTLED_CYCLES = 6
"""Cycles after which a statusword surely answers the newest controlword or object."""
HALT_RESERVE = 2.0
"""An axis may need so many times its ramp until it has halted; then it gets a quick stop."""
SETTLED_S = 0.1
"""A drive that is enabled in homing shows the bits of that mode after this time, however late its statusword comes."""
LATE = 2.0
"""A profile position takes no more than so many times its time, and a stage's more."""
OVER_SPEED = 1.5
"""Times the speed that it was told, and ..."""
OVER_SPEED_COUNTS = 4.0
"""... so many counts in a cycle more, is too fast, ..."""
OVER_SPEED_CYCLES = 3
"""... for so many cycles: at its home point a drive counts on from another number within one."""


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
        """[the drive's unit] for 60FFh."""
        self.torque = 0
        """[per mille of the rated one] of mode cyclic torque, on top of what carries the robot."""
        self._began_at = node.counts or 0
        self._cycles = 0
        self._since = self._now = now
        self._enabled_since: float | None = None
        self._sent_stop = False
        self._cleared = False
        """No set point is acknowledged, so the edge of the next one counts."""
        self._low = 0
        """Statusword bits that were 0 since homing began."""
        self._too_fast = 0
        self._unconfirmed = 0
        """Velocities that were written and are not confirmed."""
        self._first: FirstMotion | None = None
        self._way = _way(order, node.counts or 0)
        self._prepared = False
        """Its drive shows all that it was told before the motion."""
        self._preparation = self._prepare()
        node.follow(self._preparation)

    @property
    def target(self) -> int:
        """[counts] for 607Ah: the set point, or where the axis is."""
        return self.node.counts or 0 if self.order.target is None else self.order.target

    @property
    def controlword(self) -> int:
        word = self.node.leading_to(_TARGETS.get(self.stage, AxisStatus.SWITCH_ON_DISABLED))
        # A drive that answers late would go on until it takes the velocity of the way back.
        turning = self._unconfirmed and self._first is not None and self._first.turning
        if self.stage is Stage.HALTING or (turning and self.stage is Stage.MOVING):
            word |= HALT
        homing = self.order.mode == HOMING and self.stage in (Stage.MOVING, Stage.HALTING)
        # A set point is taken on the rising edge, when the target has arrived for sure.
        setting = self.stage is Stage.STARTING and self._cleared
        return word | START if homing or setting else word

    @property
    def attained(self) -> bool:
        """Its motion ended as it should."""
        return self.stage is Stage.ENDED and not self.problem and not self.halted

    def progress(self) -> str:
        """What it does, and with which torque it presses, for people."""
        trying = self.order.trial and self.stage is Stage.MOVING
        doing = f"{self.node.axis.name} {'tries its units' if trying else self.stage.value}"
        if self.order.press is None or self.stage is not Stage.MOVING or self.node.torque is None:
            return doing
        # Two digits: each change is a line on the operator's screen.
        torque = float(f"{self.node.torque:.2g}")
        return f"{self.node.axis.name} gives {torque:g} {'N' if self.node.axis.linear else 'Nm'}"

    def start(self, now: float) -> None:
        """All axes are ready."""
        if self.order.mode == PROFILE_VELOCITY:
            self._set_velocity(self.order.velocity)
        if self.order.trial:
            self._first = FirstMotion(self.node.axis, self.order.free, self.node.counts or 0, now, self.order.back)
        # What stands at once may have been found before the next statusword; else homing must show that it began.
        self._low = ~self.node.statusword if self.order.still else 0
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
        if self.stage in _UNDER_WAY:
            self._mind_the_speed(now)
        match self.stage:
            case Stage.PREPARING if self._prepared:
                self._enter(Stage.SWITCHING_ON, now)
            case Stage.SWITCHING_ON if enabled:
                self._await_brake(now)
            case stage if stage in _UNDER_WAY and not enabled:
                self.stop(f"{self.node.label} left Operation Enabled, it is in {status.words}", now)
            case Stage.STARTING if not self._cleared:
                self._cleared = self._cycles > 3 and not word & ACKNOWLEDGED
            case Stage.STARTING if word & ACKNOWLEDGED:
                self._enter(Stage.ACKNOWLEDGING, now)
            case Stage.ACKNOWLEDGING if not word & ACKNOWLEDGED:
                self._enter(Stage.MOVING, now)
            case Stage.MOVING if self.order.press is not None:
                self._press(self.order.press, now)
            case Stage.MOVING if self._first is not None:
                self._try_units(self._first, now)
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
        opens_s = max(self.node.axis.brake_s, SETTLED_S if self.order.mode == HOMING else 0.0)
        if self.order.press is not None or now - self._enabled_since >= opens_s:
            self._enter(Stage.READY, now)

    def _watch(self, word: int, now: float) -> None:
        if self.order.mode == PROFILE_VELOCITY and now - self._since >= self.order.stop_s and not self._sent_stop:
            self._sent_stop = True
            self._cycles = 0
            self.node.rest.measure_anew()
            self._set_velocity(0)
        self._low |= ~word
        if self._cycles < SETTLED_CYCLES:
            return
        if self.order.mode == HOMING and word & self._low & FAILED:
            self.stop(f"{self.node.label} did not find its home point (homing error)", now)
        elif self._arrived(word):
            self._enter(Stage.SWITCHING_OFF, now)
        else:
            self._mind_the_end(word, now)

    def _mind_the_end(self, word: int, now: float) -> None:
        """A motion that goes on says so; one that has a time ends within it."""
        if self.order.mode == HOMING and now - self._since > STAGE_S and word & ~self._low & (ATTAINED | FAILED):
            kept = "attained (bit 12)" if word & ATTAINED else "error (bit 13)"
            said = f"its statusword {word:04X}h keeps homing {kept} of an earlier homing"
            self.stop(f"{self.node.label} does not show that homing began: {said}; switch its supply off and on", now)
        elif self.order.target is not None and now - self._since > LATE * self.order.lasts_s + STAGE_S:
            said = "says target reached" if word & REACHED else "does not say target reached (bit 10)"
            left = self.order.target - (self.node.counts or 0)
            why = "look at its own limits (607Dh, 607Fh), velocity_unit and acceleration_unit"
            self.stop(f"{self.node.label} {said}, {left} counts before the target that it was given; {why}", now)

    def _try_units(self, first: FirstMotion, now: float) -> None:
        if self._unconfirmed:
            first.unconfirmed(now)
        velocity = first.step(self.node.counts or 0, now)
        if first.problem:
            self.stop(f"{self.node.label} {first.problem}", now)
            return
        if velocity != self.velocity:
            self._set_velocity(velocity)
        if first.done:
            self.node.rest.measure_anew()
            self._enter(Stage.HALTING, now)

    def _mind_the_speed(self, now: float) -> None:
        """Faster than it was told: another unit, another ratio, or nobody holds it."""
        measured = abs(self.node.velocity * self.node.axis.counts_per_unit)
        reserve = measured * OVER_SPEED_COUNTS / max(abs(self.node.counts_per_cycle), OVER_SPEED_COUNTS)
        if measured - reserve <= OVER_SPEED * self.order.fastest:
            self._too_fast = 0
            return
        self._too_fast += 1
        if self._too_fast >= OVER_SPEED_CYCLES:
            times = f"{measured / self.order.fastest:.3g} times as fast as it was told"
            keys = "velocity_unit and counts_per_turn in the drives file"
            self.stop(f"{self.node.label} moves {times}; correct {keys}", now)

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
        way = self.velocity if self._first is not None else self._way
        for switch in limit_switches([self.node], now):
            if switch.forbids(way):
                self.stop(switch.text, now)

    def _arrived(self, word: int) -> bool:
        """The drive says so, of this motion and of none before, and is measured to stand."""
        if not self.node.rest.standing:
            return False
        if self.order.mode == HOMING:
            return bool(word & self._low & ATTAINED) and bool(word & REACHED)
        if self.order.mode == PROFILE_VELOCITY:
            return self._sent_stop and bool(word & STANDING)
        near = max(2.0 * position_window(self.node.axis), self.node.rest.window)
        return bool(word & REACHED) and abs(self.target - (self.node.counts or 0)) <= near

    def _mind_the_time(self, now: float) -> None:
        within_s = max(STAGE_S, self.node.axis.switch_on_s) if self.stage is Stage.SWITCHING_ON else STAGE_S
        if now - self._since <= within_s or self.stage in _UNTIMED:
            return
        if self.stage is not Stage.SWITCHING_OFF:
            more = "; give it more time by switch_on_s" if self.stage is Stage.SWITCHING_ON else ""
            found = f"{self.node.label} got no further than {self.stage.value}: {self.node.said()}"
            self.stop(f"{found}{self._without_mode}{more}", now)
            return
        self.problem = f"{self.node.label} did not switch off: {self.node.said()}"
        self.node.stop_by_network(now)
        self.trouble = Trouble("not_off", self.problem, HARD_WIRED, self.node.axis.node_id)
        self._enter(Stage.ENDED, now)

    @property
    def _without_mode(self) -> str:
        if not self.order.trial or self.stage is not Stage.PREPARING:
            return ""
        return "; its units are tried in mode profile velocity: where it has none, try_units: false in the drives file"

    def _enter(self, stage: Stage, now: float) -> None:
        self._preparation.close()
        self.stage, self._since, self._cycles = stage, now, 0

    def _prepare(self) -> Dialogue:
        """Write each object and read what shows it until it is as written; the time of the stage bounds the repeats."""
        objects = [(write, (write.index, write.sub)) for write in self.order.writes]
        mode = SdoWrite(MODE, 0, self.order.mode.to_bytes(1, "little"))
        for write, shown_by in [*objects, (mode, (MODE_DISPLAY, 0))]:
            told = yield write
            if told.problem:
                found = f"{self.node.label} refused {write.index:04X}h:{write.sub:02X}: {told.problem}"
                self.problem = f"{found}{self._without_mode}"
                return
            self._since = self._now  # a drive may be slow in each of its answers
            while (yield SdoRead(*shown_by)).data != write.data:
                pass  # a drive may need a moment until it shows a mode
            self._since = self._now
        self._prepared = True

    def _set_velocity(self, velocity: int) -> None:
        self.velocity = velocity
        if self.node.velocity_by_pdo:
            return
        self._unconfirmed += 1
        self.node.follow(self._write_velocity(velocity.to_bytes(4, "little", signed=True)))

    def _write_velocity(self, data: bytes) -> Dialogue:
        told = yield SdoWrite(TARGET_VELOCITY, 0, data)
        self._unconfirmed -= 1
        if told.problem:
            self.problem = f"{self.node.label} refused its target velocity: {told.problem}"


def _way(order: SetupOrder, counts: int) -> int:
    """In whose direction the axis goes, or presses, from `counts`."""
    if order.press is not None:
        return order.press.per_mille
    if order.trial:
        return order.free
    return order.velocity if order.target is None else order.target - counts
