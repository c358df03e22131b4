"""The drive behind a node: CiA 402 objects, power state machine, modes of operation, monitoring and reactions.

While the power stage is off a brake holds the axis. When the stage goes off in motion the brake stops it, not at once.
"""

from collections.abc import Callable

from drive_gateway.config.settings import MOTOR_SPEED_RESERVE, AxisSettings
from drive_gateway.sim.axis.axis_servo import AxisServo
from drive_gateway.sim.axis.servo import Servo
from drive_gateway.sim.drives.cyclic_modes import CYCLIC_TORQUE, CyclicModes
from drive_gateway.sim.drives.option_codes import OptionCodes
from drive_gateway.sim.drives.power_state import FAULT_RESET, Command, DriveState, command_of, commanded
from drive_gateway.sim.drives.reference import Reference
from drive_gateway.sim.drives.setup_modes import HOMING, SETUP_MODES, SetupModes
from drive_gateway.sim.drives.shown import FilteredVelocity, Shown
from drive_gateway.sim.drives.user_units import UserUnits
from drive_gateway.sim.drives.windows import FollowingWindow
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.emergency import COMMUNICATION_LOST, FOLLOWING_ERROR, SETPOINTS_MISSING, Emergencies
from drive_gateway.sim.services.objects import AxisObjects

CONTROLWORD = key_of(0x6040)
_ABORT_CONNECTION = key_of(0x6007)
_ERROR_CODE = key_of(0x603F)
_MODE = key_of(0x6060)
_SUPPORTED_MODES = key_of(0x6502)
_MODE_DISPLAY = key_of(0x6061)
_STANDSTILL = key_of(0x606F)
_INPUTS = key_of(0x60FD)

_BRAKE_FACTOR = 2.0
"""The holding brake stops the axis harder than the quick stop does."""

_ENABLE_INPUTS = 3 << 16
"""60FDh: the inputs for power stage and controller, both are needed for torque."""

_S = DriveState
_WITH_STAGE = (_S.READY_TO_SWITCH_ON, _S.SWITCHED_ON, _S.OPERATION_ENABLED, _S.QUICK_STOP_ACTIVE)
_BRAKING = (_S.QUICK_STOP_ACTIVE, _S.FAULT_REACTION_ACTIVE)
_ABORT_COMMANDS = {2: Command.DISABLE_VOLTAGE, 3: Command.QUICK_STOP}
_ABORT_BY_FAULT = 1


class Drive:
    """One axis and its drive, in encoder counts. `advance` must be called before anything else at a new time.

    Args:
        axis: speed and counts of the axis.
        start: [rad or m] where it stands at first.
        cycle_s: cycle of the position controller [s]: motion and monitoring are never evaluated more coarsely.
        lag_s: lag of the axis behind its demand [s].
        objects: those of the axis; the drive registers itself for its own.
        emergencies: where faults are told.
        cause_present: whether the cause of an error code is still there, so that the fault cannot be reset.
        servo: the axis behind the drive; `None`: one of the fast level.
    """

    def __init__(
        self,
        axis: AxisSettings,
        start: float,
        cycle_s: float,
        lag_s: float,
        objects: AxisObjects,
        emergencies: Emergencies,
        cause_present: Callable[[int], bool],
        servo: AxisServo | None = None,
    ) -> None:
        scale = abs(axis.counts_per_unit)
        counts = (start - axis.offset) * axis.counts_per_unit
        self.servo: AxisServo = servo or Servo(counts, lag_s, MOTOR_SPEED_RESERVE * axis.speed * scale)
        self._brake = _BRAKE_FACTOR * axis.quick_stop * scale
        self._cycle_s = cycle_s
        self._numbers = objects.numbers
        self.reference = Reference(axis, start)
        self.units = UserUnits()
        self.obeys_in_reaction = False
        """It takes its voltage off when it is told so while it brakes in its reaction to a fault."""
        self._options = OptionCodes(objects, self.units, self._brake)
        self.setup = SetupModes(objects, self.servo, self.reference, self._options, self.units)
        self._cyclic = CyclicModes(objects, self.servo, self.reference, self._mode_in_force, self.units)
        self.state = DriveState.NOT_READY_TO_SWITCH_ON
        self._displayed = FilteredVelocity(objects.numbers)
        self._window = FollowingWindow(objects.numbers)
        rated_mnm = 0 if axis.torque is None else axis.torque.rated_mnm
        self.shown = Shown(objects.numbers, self.servo, self.reference, self.units, rated_mnm)
        self._emergencies = emergencies
        self._cause_present = cause_present
        self._now: float | None = None
        self._inputs = self._numbers[_INPUTS]
        self._register(objects)
        self.reset()

    def _register(self, objects: AxisObjects) -> None:
        objects.guards[_MODE] = self._known_mode
        objects.followers[_MODE] = self._set_mode
        objects.followers[CONTROLWORD] = self._obey

    @property
    def position(self) -> float:
        """[counts]"""
        return self.servo.position

    @property
    def top_speed(self) -> float:
        """[counts/s] that the axis cannot exceed."""
        return self.servo.top_speed

    def reset(self) -> None:
        """Transition 0: the drive restarts without power; the axis is where it is."""
        if not self.servo.has_torque:
            self._numbers[_SUPPORTED_MODES] &= ~(1 << CYCLIC_TORQUE - 1)
        self.servo.switch_on()
        self.reference.switched_on(self.servo.position)
        self.state = DriveState.NOT_READY_TO_SWITCH_ON
        self.faults: list[int] = []
        self._before = 0
        self._leaving: DriveState | None = None
        self._window.begin()
        self._displayed.reset()
        self._cyclic.set_period()
        self._show()

    def started(self) -> None:
        """Transition 1: the self-test is done; a fault that it found stays."""
        if not self.faults:
            self._enter(DriveState.SWITCH_ON_DISABLED)

    def advance(self, now: float) -> None:
        """Let time pass up to `now`: move, watch, show."""
        if self._now is None:
            self._now = now
        if self._now >= now:
            return
        while self._now < now:
            # A step that is a little longer is as good: SYNC is never exact.
            end = now if now - self._now < 1.5 * self._cycle_s else self._now + self._cycle_s
            step_s, self._now = end - self._now, end
            self._cyclic.now = end
            self._move(step_s)
            self._displayed.follow(self.servo.velocity, step_s)
            if self.state is not DriveState.NOT_READY_TO_SWITCH_ON:
                for code in self.servo.trips():
                    self.fault(code)
            if self.state is DriveState.OPERATION_ENABLED and self._leaving is None:
                self._watch(step_s)
        if self._numbers[_MODE] != self._numbers[_MODE_DISPLAY]:
            self._set_mode(self._numbers[_MODE])
        self._show()

    def fault(self, code: int) -> None:
        """Transition 13: with torque the axis is braked first (605Eh), without it the fault comes at once (14)."""
        self._emergencies.occur(code)
        self._numbers[_ERROR_CODE] = code
        if code not in self.faults:
            self.faults.append(code)
        braked = not self._options.voltage_off_at_once(DriveState.FAULT_REACTION_ACTIVE)
        if braked and self.state in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE):
            self._enter(DriveState.FAULT_REACTION_ACTIVE)
        elif self.state is not DriveState.FAULT_REACTION_ACTIVE:
            self._enter(DriveState.FAULT)

    def connection_lost(self, code: int = COMMUNICATION_LOST) -> None:
        """The master is gone (heartbeat, NMT stop or reset): what 6007h says, if the power stage is on."""
        if self.state not in (DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE):
            return
        option = self._numbers[_ABORT_CONNECTION]
        if option == _ABORT_BY_FAULT:
            self.fault(code)
        elif option in _ABORT_COMMANDS:
            self._command(_ABORT_COMMANDS[option])

    # Objects

    def _known_mode(self, mode: int) -> None:
        if mode < 1 or not self._numbers[_SUPPORTED_MODES] >> mode - 1 & 1:
            raise AccessRefused(Abort.RANGE)

    def _set_mode(self, mode: int) -> None:
        """A drive in motion goes on in its mode; it shows and takes the new one when it stands (`advance`)."""
        standing = self._slow
        if mode == self._numbers[_MODE_DISPLAY] or (self.state is DriveState.OPERATION_ENABLED and not standing):
            return
        self._numbers[_MODE_DISPLAY] = mode
        self.servo.hold()
        self._cyclic.begin()
        self.setup.begin()
        self._show()

    def _obey(self, controlword: int) -> None:
        rising = controlword & ~self._before
        self._before = controlword
        if self.state is not DriveState.FAULT:
            self._command(command_of(controlword))
        elif rising & FAULT_RESET:
            self._acknowledge()
        if self.state is DriveState.OPERATION_ENABLED:
            self.setup.obey(self._numbers[_MODE_DISPLAY], controlword)
            self._cyclic.obey(controlword)

    def _mode_in_force(self) -> int:
        return self._numbers[_MODE_DISPLAY] if self.state is DriveState.OPERATION_ENABLED else 0

    # States

    def input(self, bit: int, closed: bool) -> None:
        """A digital input (60FDh) opens or closes. Without its enable inputs the drive has no torque."""
        mask = 1 << bit
        self._inputs = self._inputs | mask if closed else self._inputs & ~mask
        if not self._permitted and self.state in _WITH_STAGE:
            self._enter(DriveState.SWITCH_ON_DISABLED)
        self._show()

    @property
    def _permitted(self) -> bool:
        return self._inputs & _ENABLE_INPUTS == _ENABLE_INPUTS

    def _command(self, command: Command) -> None:
        if self.obeys_in_reaction and self.state is _S.FAULT_REACTION_ACTIVE and command is Command.DISABLE_VOLTAGE:
            self._enter(DriveState.FAULT)
            return
        target = commanded(self.state, command, self._options.stays_in_quick_stop())
        self._leaving = None
        if target is self.state:
            return
        if self._options.voltage_off_at_once(target):
            target = DriveState.SWITCH_ON_DISABLED
        if self._options.brakes_before(self.state, target) and not self.servo.standing:
            self._leaving = target
            return
        unpowered = target is DriveState.READY_TO_SWITCH_ON and not self._permitted
        at_end = target is DriveState.OPERATION_ENABLED and self._at_end
        if not unpowered and not at_end:
            self._enter(target)

    def _acknowledge(self) -> None:
        """Transition 15, if every cause is gone."""
        present = [code for code in self.faults if self._cause_present(code) or self.servo.persists(code)]
        if present:
            self._emergencies.repeat(present[-1])
            return
        gone, self.faults = self.faults, []
        for code in gone:
            self._emergencies.vanish(code)
        self._numbers[_ERROR_CODE] = 0
        self._enter(DriveState.SWITCH_ON_DISABLED)

    def _enter(self, state: DriveState) -> None:
        if state is DriveState.OPERATION_ENABLED:
            self.servo.hold()
            self._cyclic.begin()
            self.setup.begin()
            self._window.begin()
        self.state = state
        self._leaving = None
        self._show()

    # Motion

    def _move(self, step_s: float) -> None:
        servo = self.servo
        if self.state in _BRAKING or self._leaving is not None:
            servo.brake(step_s, self._options.deceleration(self.state))
            if servo.standing:
                self._stopped()
        elif self.state is DriveState.OPERATION_ENABLED:
            if self._numbers[_MODE_DISPLAY] in SETUP_MODES:
                self.setup.advance(self._numbers[_MODE_DISPLAY], step_s)
            servo.follow(step_s)
        else:
            servo.rest(step_s, self._brake)

    def _stopped(self) -> None:
        """Transitions 12 and 14, and 5 and 8 after their ramp."""
        if self._leaving is not None:
            self._enter(self._leaving)
        elif self.state is DriveState.FAULT_REACTION_ACTIVE:
            self._enter(DriveState.FAULT)
        elif not self._options.stays_in_quick_stop():
            self._enter(DriveState.SWITCH_ON_DISABLED)

    def _watch(self, step_s: float) -> None:
        if self._cyclic.missing:
            self.fault(SETPOINTS_MISSING)
        elif self._at_end:
            self._enter(DriveState.QUICK_STOP_ACTIVE)
        elif self._window.left(self.servo.error, step_s):
            self.fault(FOLLOWING_ERROR)

    @property
    def _at_end(self) -> bool:
        """It runs into a limit switch; homing looks for them, so it may."""
        if self._numbers[_MODE_DISPLAY] == HOMING or self._slow:
            return False
        return self.reference.switches.stop(self.servo.position, self.servo.velocity)

    @property
    def _slow(self) -> bool:
        return abs(self.servo.velocity) <= self.units.velocity * self._numbers[_STANDSTILL]

    def _show(self) -> None:
        """Statusword and measurements into their objects."""
        mode = self._numbers[_MODE_DISPLAY]
        bits = self._cyclic.bits
        if self.state is DriveState.OPERATION_ENABLED and mode in SETUP_MODES:
            bits |= self.setup.bits(mode)
        self._numbers[_INPUTS] = self._inputs | self.reference.switches.inputs(self.servo.position)
        self.shown.update(self.state, bits, FOLLOWING_ERROR in self.faults)
