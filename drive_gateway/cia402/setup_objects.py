"""What is written to a drive before it makes a motion of its own, in set-up: homing, profile position and velocity,
or gives a torque."""

from dataclasses import dataclass

from drive_gateway.canopen.pdo_map import TARGET_POSITION, SdoWrite
from drive_gateway.cia402.preparation import MOTOR_SPEED
from drive_gateway.cia402.profile import Trapezoid
from drive_gateway.config.settings import AxisSettings, HomingSettings, TorqueSettings

PROFILE_POSITION, PROFILE_VELOCITY, HOMING, CYCLIC_TORQUE = 1, 3, 6, 10
MODE, MODE_DISPLAY, TARGET_VELOCITY = 0x6060, 0x6061, 0x60FF

START = 1 << 4
"""Controlword: new set point, or homing begins."""
HALT = 1 << 8
"""Controlword: brake on the ramp of the motion and stay enabled (605Dh = 1, the value drives have of themselves)."""
REACHED, ACKNOWLEDGED, ATTAINED, STANDING, FAILED = 1 << 10, 1 << 12, 1 << 12, 1 << 12, 1 << 13
"""Statusword; bits 12 and 13 mean what the mode says."""

POSITION_WINDOW = 1e-4
"""[rad or m] a profile position has arrived when the axis stays this near to its target (6067h), ..."""
LEAST_WINDOW_COUNTS = 3.0
POSITION_TIME_MS = 50
"""... for this long (6068h)."""


PRESS_RAMP_S = 0.5
"""From no torque to the rated one."""


@dataclass(frozen=True, slots=True)
class Press:
    """A torque that rises evenly, stays, and falls again, and what the axis may move meanwhile."""

    per_mille: int
    """Of the motor's rated torque."""
    hold_s: float
    within: float
    """[counts] from where it began."""
    allowed: str
    """`within` for people."""

    @property
    def ramp_s(self) -> float:
        return PRESS_RAMP_S * abs(self.per_mille) / 1000.0

    @property
    def lasts_s(self) -> float:
        return self.hold_s + 2.0 * self.ramp_s

    def at(self, elapsed_s: float) -> int:
        """[per mille] after so long; 0 before and after."""
        near_end = min(elapsed_s, self.lasts_s - elapsed_s)
        share = 1.0 if near_end >= self.ramp_s else max(0.0, near_end) / self.ramp_s
        return round(share * self.per_mille)


@dataclass(frozen=True, slots=True)
class SetupOrder:
    """One motion of one drive: its mode, the objects written before, and the target, the speed and its time, or the
    torque."""

    mode: int
    writes: tuple[SdoWrite, ...]
    target: int | None = None
    """[counts] of a profile position."""
    velocity: int = 0
    """[counts/s] of a profile velocity."""
    stop_s: float = 0.0
    """A profile velocity is taken back to zero after this time."""
    ramp_s: float = 0.0
    """From its highest speed to rest, on the ramp on which it halts."""
    press: Press | None = None
    """Of mode cyclic torque."""


def homing_order(axis: AxisSettings, homing: HomingSettings) -> SetupOrder:
    """Homing as configured: method, speeds, ramp, and what the home position is called."""
    counts = abs(axis.counts_per_unit)
    home = round((homing.position - axis.offset) * axis.counts_per_unit)
    writes = (
        SdoWrite(0x6098, 0, homing.method.to_bytes(1, "little", signed=True)),
        _u32(0x6099, 1, homing.fast * counts),
        _u32(0x6099, 2, homing.slow * counts),
        _u32(0x609A, 0, homing.acceleration * counts),
        SdoWrite(0x607C, 0, home.to_bytes(4, "little", signed=True)),
    )
    return SetupOrder(HOMING, writes, ramp_s=homing.fast / homing.acceleration)


def position_order(axis: AxisSettings, target: int, motion: Trapezoid, acceleration: float) -> SetupOrder:
    """A motion to `target` [counts] at the speed of `motion`."""
    counts = abs(axis.counts_per_unit)
    # The process image of interpolated position has another set point.
    counted = axis.wrapped(target).to_bytes(4, "little", signed=True)
    place = (SdoWrite(TARGET_POSITION, 0, counted),) if axis.interpolated else ()
    writes = (
        *place,
        _u32(0x6067, 0, max(LEAST_WINDOW_COUNTS, POSITION_WINDOW * counts)),
        SdoWrite(0x6068, 0, POSITION_TIME_MS.to_bytes(2, "little")),
        _u32(0x6081, 0, abs(motion.velocity) * counts),
    )
    ramp_s = abs(motion.velocity) / acceleration
    return SetupOrder(PROFILE_POSITION, (*writes, *_ramps(acceleration * counts)), target=target, ramp_s=ramp_s)


def velocity_order(axis: AxisSettings, motion: Trapezoid, acceleration: float) -> SetupOrder:
    """The same way in mode profile velocity: the speed of `motion`, and zero from its `stop_s` on."""
    counts = abs(axis.counts_per_unit)
    writes = (SdoWrite(TARGET_VELOCITY, 0, bytes(4)), *_ramps(acceleration * counts))
    velocity = round(motion.velocity * axis.counts_per_unit)
    ramp_s = abs(motion.velocity) / acceleration
    return SetupOrder(PROFILE_VELOCITY, writes, velocity=velocity, stop_s=motion.stop_s, ramp_s=ramp_s)


def press_order(torque: TorqueSettings, speed: float, press: Press) -> SetupOrder:
    """A torque, with a motor that does not turn faster than the axis' `speed` [rad/s or m/s]."""
    return SetupOrder(CYCLIC_TORQUE, (_u32(MOTOR_SPEED, 0, speed * torque.rpm),), press=press)


def _ramps(counts: float) -> tuple[SdoWrite, SdoWrite]:
    return _u32(0x6083, 0, counts), _u32(0x6084, 0, counts)


def _u32(index: int, sub: int, value: float) -> SdoWrite:
    return SdoWrite(index, sub, max(1, round(value)).to_bytes(4, "little"))
