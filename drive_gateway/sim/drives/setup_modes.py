"""The modes in which a drive makes its own motion (CiA 402): profile position, profile velocity, homing.

The demand is handed to the axis step by step. The meaning of controlword bits 4 to 8 and statusword bits 10, 12 and 13
is the mode's (CiA 402-2); in profile velocity bit 12 is 1 at standstill.
"""

from drive_gateway.sim.axis.axis_servo import AxisServo
from drive_gateway.sim.drives.homing import Homing, HomingSpeeds, HomingState
from drive_gateway.sim.drives.option_codes import OptionCodes
from drive_gateway.sim.drives.position_bounds import PositionRange, SoftwareLimits
from drive_gateway.sim.drives.profile import Profile
from drive_gateway.sim.drives.reference import Reference
from drive_gateway.sim.drives.user_units import UserUnits
from drive_gateway.sim.drives.windows import VelocityWindows
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import AxisObjects

PROFILE_POSITION, PROFILE_VELOCITY, HOMING = 1, 3, 6
SETUP_MODES = (PROFILE_POSITION, PROFILE_VELOCITY, HOMING)

_START, _AT_ONCE, _RELATIVE, _HALT = 1 << 4, 1 << 5, 1 << 6, 1 << 8
_REACHED, _MODE_12, _MODE_13 = 1 << 10, 1 << 12, 1 << 13

_POSITION_WINDOW, _POSITION_TIME = key_of(0x6067), key_of(0x6068)
_TARGET_POSITION, _TARGET_VELOCITY = key_of(0x607A), key_of(0x60FF)
_HOME_OFFSET, _METHOD = key_of(0x607C), key_of(0x6098)
_SPEED, _ACCELERATION, _DECELERATION = key_of(0x6081), key_of(0x6083), key_of(0x6084)
_HOMING_FAST, _HOMING_SLOW, _HOMING_RAMP = key_of(0x6099, 1), key_of(0x6099, 2), key_of(0x609A)


class SetupModes:
    """Trajectory of an enabled drive in one of `SETUP_MODES`. Positions of the profile are those of the axis itself."""

    def __init__(
        self, objects: AxisObjects, servo: AxisServo, reference: Reference, options: OptionCodes, units: UserUnits
    ) -> None:
        self._numbers = objects.numbers
        self._units = units
        self._options = options
        self._range = PositionRange(objects.numbers)
        self._limits = SoftwareLimits(objects)
        self._windows = VelocityWindows(objects.numbers, units)
        self._servo = servo
        self._reference = reference
        self._profile = Profile(servo.position)
        self.homing = Homing(reference, self._profile)
        self.reached_lasts_s = 0.0
        """Target reached is still shown so long after a new set point was taken."""
        self._reached_before_s = 0.0
        self._word = 0
        self._target: float | None = None
        self._next: float | None = None
        self._acknowledged = False
        self._inside_s = 0.0

    def begin(self) -> None:
        """The drive was enabled, or the mode changed: stand where the axis is."""
        self._profile.begin(self._servo.position)
        self.homing.idle()
        self._target = self._next = None
        self._acknowledged = False
        self._inside_s = 0.0
        self._windows.begin()

    def obey(self, mode: int, word: int) -> None:
        """Take the mode's bits of a controlword."""
        rising, falling = word & ~self._word, self._word & ~word
        self._word = word
        if mode == HOMING:
            if rising & _START:
                self.homing.start(self._numbers[_METHOD], self._servo.position)
            if falling & _START or word & _HALT:
                self.homing.abort()
        elif mode == PROFILE_POSITION:
            if rising & _START and not self._acknowledged:
                self._take_target(word)
            if falling & _START and self._next is None:
                self._acknowledged = False

    def advance(self, mode: int, step_s: float) -> None:
        """Move the demand by one step and hand it to the axis."""
        numbers, profile = self._numbers, self._profile
        halted = bool(self._word & _HALT)
        self._reached_before_s = max(0.0, self._reached_before_s - step_s)
        per_s, per_s2 = self._units.velocity, self._units.acceleration
        ramps = (per_s2 * numbers[_ACCELERATION], per_s2 * numbers[_DECELERATION])
        if mode == HOMING:
            fast, slow = per_s * numbers[_HOMING_FAST], per_s * numbers[_HOMING_SLOW]
            speeds = HomingSpeeds(fast, slow, per_s2 * numbers[_HOMING_RAMP])
            self.homing.step(self._servo.position, speeds, numbers[_HOME_OFFSET], step_s)
        elif mode == PROFILE_VELOCITY:
            wanted = 0.0 if halted else self._wanted_velocity
            slower = abs(wanted) < abs(profile.velocity)
            braking = self._options.halt_deceleration() if halted else ramps[1]
            profile.run(wanted, braking if slower else ramps[0], step_s)
            self._windows.step(self._servo.velocity, wanted, step_s)
        elif halted:
            profile.run(0.0, self._options.halt_deceleration(), step_s)
        elif self._target is not None:
            profile.approach(self._target, per_s * numbers[_SPEED], ramps, step_s)
            self._arrive(step_s)
        self._servo.interpolate(profile.position, step_s)

    def bits(self, mode: int) -> int:
        """Bits 10, 12 and 13 of the statusword."""
        if mode == HOMING:
            still = self._profile.velocity == 0.0
            attained = self.homing.state is HomingState.ATTAINED
            failed = self.homing.state is HomingState.FAILED
            return still * _REACHED | attained * _MODE_12 | failed * _MODE_13
        if mode == PROFILE_VELOCITY:
            velocity = self._servo.velocity
            wanted = 0.0 if self._word & _HALT else self._wanted_velocity
            reached = self._windows.reached(velocity, wanted)
            return reached * _REACHED | self._windows.standing(velocity) * _MODE_12
        halted = bool(self._word & _HALT) and self._profile.velocity == 0.0
        reached = halted or (self._inside_s * 1000.0 >= self._numbers[_POSITION_TIME] and self._inside)
        return (reached or self._reached_before_s > 0.0) * _REACHED | self._acknowledged * _MODE_12

    @property
    def _wanted_velocity(self) -> float:
        """[counts/s]"""
        return self._units.velocity_sign * self._units.velocity * self._numbers[_TARGET_VELOCITY]

    @property
    def _inside(self) -> bool:
        return self._target is None or abs(self._servo.position - self._target) <= self._numbers[_POSITION_WINDOW]

    def _take_target(self, word: int) -> None:
        """A new set point: at once, or after the one that goes on; a referenced axis stops at 607Dh."""
        shown = self._numbers[_TARGET_POSITION]
        if word & _RELATIVE:
            shown += round(self._profile.position - self._reference.shift)
        if self._reference.known:
            shown = self._limits.within(shown)
        target = shown + self._reference.shift
        if not word & _RELATIVE:
            target = self._range.nearest(target, self._profile.position)
        self._acknowledged = True
        self._reached_before_s = self.reached_lasts_s
        travels = self._target is not None and self._profile.position != self._target
        if travels and not word & _AT_ONCE:
            self._next = target
        else:
            self._target, self._next = target, None
        self._inside_s = 0.0

    def _arrive(self, step_s: float) -> None:
        if self._profile.position == self._target and self._next is not None:
            self._target, self._next = self._next, None
            self._acknowledged = bool(self._word & _START)
        self._inside_s = self._inside_s + step_s if self._inside else 0.0
