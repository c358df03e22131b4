"""What a simulated drive shows: its statusword, its measurements, its encoder."""

from collections.abc import MutableMapping

from drive_gateway.sim.axis.axis_servo import AxisServo
from drive_gateway.sim.drives.position_bounds import PositionRange, clipped
from drive_gateway.sim.drives.power_state import DriveState
from drive_gateway.sim.drives.reference import Reference
from drive_gateway.sim.drives.setup_modes import HOMING
from drive_gateway.sim.drives.user_units import UserUnits
from drive_gateway.sim.services.dictionary import key_of

_STATUSWORD = key_of(0x6041)
_POSITION_DEMAND = key_of(0x6062)
_POSITION_ACTUAL = key_of(0x6064)
_VELOCITY_ACTUAL = key_of(0x606C)
_DISPLAY_LAG_US, _DISPLAY_VELOCITY = key_of(0x2073), key_of(0x2074)
_FOLLOWING_ERROR_ACTUAL = key_of(0x60F4)
_RATED_TORQUE, _TORQUE_ACTUAL = key_of(0x6076), key_of(0x6077)
_RATED_CURRENT, _CURRENT_ACTUAL, _MOTOR_TEMPERATURE = key_of(0x6075), key_of(0x6078), key_of(0x2003)
_WARNINGS, _INPUTS, _MODE_DISPLAY = key_of(0x2002), key_of(0x60FD), key_of(0x6061)
_ENCODER_SERIAL, _ENCODER_STATUS = key_of(0x2010, 1), key_of(0x2010, 2)

_VOLTAGE_ENABLED = 1 << 4
_REMOTE = 1 << 9
_INTERNAL_LIMIT = 1 << 11
_FOLLOWING_ERROR = 1 << 13
_WARNING = 1 << 7
_LIMIT_SWITCHES = 3
"""Bits of 60FDh."""
_MOST_TORQUE = (1 << 15) - 1


class Shown:
    """Writes the objects that only the drive itself writes."""

    def __init__(
        self,
        numbers: MutableMapping[int, int],
        servo: AxisServo,
        reference: Reference,
        units: UserUnits,
        rated_mnm: int,
    ) -> None:
        """`rated_mnm`: rated torque of the motor [mNm]; 0: not known."""
        self._numbers = numbers
        self._range = PositionRange(numbers)
        self._rated_mnm = rated_mnm
        self._servo = servo
        self._units = units
        self.hunts_by = 0
        """[counts] The position that it shows goes up and down by so much while it is controlled."""
        self._shown_times = 0
        self._reference = reference

    def update(self, state: DriveState, mode_bits: int, following_error: bool) -> None:
        """`mode_bits` are those of the statusword that the mode of operation means."""
        servo, numbers, reference = self._servo, self._numbers, self._reference
        word = state.value | _REMOTE | mode_bits
        if state is not DriveState.NOT_READY_TO_SWITCH_ON:
            word |= _VOLTAGE_ENABLED
        if servo.limited:
            word |= _INTERNAL_LIMIT
        if following_error:
            word |= _FOLLOWING_ERROR
        numbers[_WARNINGS] = warnings = servo.warnings
        at_switch = numbers[_INPUTS] & _LIMIT_SWITCHES and numbers[_MODE_DISPLAY] != HOMING
        if warnings or at_switch:
            word |= _WARNING
        shift = reference.shift
        numbers[_STATUSWORD] = word
        numbers[_RATED_TORQUE] = self._rated_mnm
        if self._rated_mnm:
            per_mille = round(1e6 * servo.torque_nm / self._rated_mnm)
            numbers[_TORQUE_ACTUAL] = max(-_MOST_TORQUE, min(_MOST_TORQUE, per_mille))
        numbers[_RATED_CURRENT] = rated_ma = round(1000.0 * servo.rated_current_a)
        if rated_ma:
            numbers[_CURRENT_ACTUAL] = round(1e6 * servo.current_a / rated_ma)
        numbers[_MOTOR_TEMPERATURE] = round(10.0 * servo.motor_c)
        numbers[_ENCODER_SERIAL], numbers[_ENCODER_STATUS] = reference.serial, reference.battery_empty
        numbers[_POSITION_ACTUAL] = self._range.shown(servo.position - shift + self._hunting(state))
        numbers[_VELOCITY_ACTUAL] = clipped(servo.velocity / self._units.velocity)
        numbers[_POSITION_DEMAND] = self._range.shown(servo.demand - shift)
        numbers[_FOLLOWING_ERROR_ACTUAL] = clipped(servo.error)

    def _hunting(self, state: DriveState) -> int:
        """A loop with static friction goes to and fro around its place (a limit cycle)."""
        self._shown_times += 1
        controlled = state in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
        return self.hunts_by * (1 if self._shown_times // 20 % 2 else -1) if controlled else 0


class FilteredVelocity:
    """The velocity for displays (2074h): a first-order lag (2073h) behind the measured one, which controls nothing."""

    def __init__(self, numbers: MutableMapping[int, int]) -> None:
        self._numbers = numbers
        self._velocity = 0.0

    def reset(self) -> None:
        """The drive starts at standstill."""
        self._velocity = 0.0

    def follow(self, velocity: float, step_s: float) -> None:
        """Take the measured velocity [counts/s] of one step."""
        share = step_s / (step_s + 1e-6 * self._numbers[_DISPLAY_LAG_US])
        self._velocity += share * (velocity - self._velocity)
        self._numbers[_DISPLAY_VELOCITY] = round(self._velocity)
