"""The modes in which set points come with the bus cycle (CiA 402): cyclic synchronous position, interpolated position,
cyclic synchronous torque.

The demand runs to each set point within one interpolation period (60C2h). In interpolated position controlword bit 4
enables the interpolation, and statusword bit 12 says that it is active; without it the axis holds its place. In cyclic
torque the axis gives the target torque as it comes, up to the highest motor speed (6080h).
"""

from collections.abc import Callable

from drive_gateway.sim.axis.axis_servo import AxisServo
from drive_gateway.sim.axis.motor_data import RAD_S_PER_RPM
from drive_gateway.sim.drives.position_bounds import PositionRange
from drive_gateway.sim.drives.reference import Reference
from drive_gateway.sim.drives.user_units import UserUnits
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import AxisObjects

INTERPOLATED_POSITION, CYCLIC_SYNCHRONOUS_POSITION, CYCLIC_TORQUE = 7, 8, 10

_INTERPOLATE = 1 << 4
_FOLLOWS_COMMAND = 1 << 12
_SETPOINT_TIMEOUT = key_of(0x2000)
_TARGET_POSITION = key_of(0x607A)
_TARGET_TORQUE = key_of(0x6071)
_MOTOR_SPEED = key_of(0x6080)
_RATED_TORQUE = key_of(0x6076)
_VELOCITY_OFFSET = key_of(0x60B1)
_TORQUE_OFFSET = key_of(0x60B2)
_INTERPOLATION_DATA = key_of(0x60C1, 1)
_PERIOD_VALUE = key_of(0x60C2, 1)
_PERIOD_EXPONENT = key_of(0x60C2, 2)


class CyclicModes:
    """Set points of one drive. `mode` answers the displayed mode while the drive is enabled, else 0."""

    def __init__(
        self, objects: AxisObjects, servo: AxisServo, reference: Reference, mode: Callable[[], int], units: UserUnits
    ) -> None:
        self._numbers = objects.numbers
        self._servo = servo
        self._reference = reference
        self._mode = mode
        self._units = units
        self._range = PositionRange(objects.numbers)
        self._interpolating = False
        self._setpoint_at = 0.0
        self.now = 0.0
        for key in (_PERIOD_VALUE, _PERIOD_EXPONENT, _SETPOINT_TIMEOUT):
            objects.followers[key] = self.set_period
        objects.followers[_TARGET_POSITION] = lambda target: self._aim(CYCLIC_SYNCHRONOUS_POSITION, target)
        objects.followers[_INTERPOLATION_DATA] = lambda target: self._aim(INTERPOLATED_POSITION, target)
        objects.followers[_TARGET_TORQUE] = self._press
        objects.followers[_VELOCITY_OFFSET] = self._feed
        objects.followers[_TORQUE_OFFSET] = self._feed_torque

    @property
    def active(self) -> bool:
        """Set points are followed, so they must come."""
        mode = self._mode()
        return mode in (CYCLIC_SYNCHRONOUS_POSITION, CYCLIC_TORQUE) or (
            mode == INTERPOLATED_POSITION and self._interpolating
        )

    @property
    def bits(self) -> int:
        """Bit 12 of the statusword."""
        return self.active * _FOLLOWS_COMMAND

    @property
    def missing(self) -> bool:
        """No set point came for too long."""
        return self.active and self.now - self._setpoint_at > self._patience_s

    def begin(self) -> None:
        """The drive was enabled, or the mode changed: stand where the axis is."""
        self._interpolating = False
        self._setpoint_at = self.now

    def obey(self, word: int) -> None:
        """Take bit 4 of a controlword."""
        wanted = bool(word & _INTERPOLATE)
        if wanted and not self._interpolating:
            self._setpoint_at = self.now
        if self._mode() == INTERPOLATED_POSITION and self._interpolating and not wanted:
            self._servo.hold()
        self._interpolating = wanted

    def set_period(self, _value: int = 0) -> None:
        """Take over the interpolation period and how many of them may pass without a set point."""
        self._period_s = self._numbers[_PERIOD_VALUE] * 10.0 ** self._numbers[_PERIOD_EXPONENT]
        self._patience_s = self._numbers[_SETPOINT_TIMEOUT] * self._period_s + 1e-9

    def _aim(self, mode: int, target: int) -> None:
        if self._mode() == mode and self.active:
            place = self._range.nearest(target + self._reference.shift, self._servo.demand)
            self._servo.interpolate(place, self._period_s)
            self._setpoint_at = self.now

    def _feed(self, velocity: int) -> None:
        if self.active:
            self._servo.feed(self._units.velocity * velocity)

    def _feed_torque(self, per_mille: int) -> None:
        if self.active:
            self._servo.feed_torque(self._torque_nm(per_mille), self._period_s)

    def _press(self, per_mille: int) -> None:
        if self._mode() == CYCLIC_TORQUE:
            self._servo.press(self._torque_nm(per_mille), self._numbers[_MOTOR_SPEED] * RAD_S_PER_RPM)
            self._setpoint_at = self.now

    def _torque_nm(self, per_mille: int) -> float:
        """Of the shaft."""
        return per_mille * self._numbers[_RATED_TORQUE] * 1e-6
