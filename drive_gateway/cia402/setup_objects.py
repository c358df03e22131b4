"""What is written to a drive before it makes a motion of its own, in set-up: homing, profile position and velocity,
or gives a torque."""

from dataclasses import dataclass
from math import inf

from drive_gateway.canopen.drive_objects import (
    HOME_OFFSET,
    HOMING_ACCELERATION,
    HOMING_METHOD,
    HOMING_SPEEDS,
    MOTOR_SPEED,
    POSITION_WINDOW,
    POSITION_WINDOW_TIME,
    PROFILE_ACCELERATION,
    PROFILE_DECELERATION,
    PROFILE_SPEED,
    TARGET_POSITION,
    TARGET_VELOCITY,
)
from drive_gateway.canopen.sdo import SdoWrite
from drive_gateway.cia402.profile import Trapezoid
from drive_gateway.config.settings import SETUP_SHARE, AxisSettings, HomingSettings, TorqueSettings

PROFILE_POSITION, PROFILE_VELOCITY, HOMING, CYCLIC_TORQUE = 1, 3, 6, 10

START = 1 << 4
"""Controlword: new set point, or homing begins."""
HALT = 1 << 8
"""Controlword: brake on the ramp of the motion and stay enabled (605Dh = 1, the value drives have of themselves)."""
REACHED, ACKNOWLEDGED, ATTAINED, STANDING, FAILED = 1 << 10, 1 << 12, 1 << 12, 1 << 12, 1 << 13
"""Statusword; bits 12 and 13 mean what the mode says."""

WINDOW = 1e-4
"""[rad or m] a profile position has arrived when the axis stays this near to its target (6067h), ..."""
LEAST_WINDOW_COUNTS = 3.0
COARSEST = 0.02
"""A profile velocity may be rounded by this share: it stops by time."""
FROM_ABOVE = frozenset({2, 3, 4, 18, 19, 20, 33})
"""Homing methods of an axis that may stand at its positive end (CiA 402-2), or looks for a pulse below it."""
HOME_HERE = (35, 37)
"""Homing methods without a motion (CiA 402-2)."""
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
    """[the drive's unit] of a profile velocity."""
    fastest: float = inf
    """[counts/s] that the drive was told not to exceed."""
    lasts_s: float = 0.0
    """From the start of a profile position to its end."""
    stop_s: float = 0.0
    """A profile velocity is taken back to zero after this time."""
    ramp_s: float = 0.0
    """From its highest speed to rest, on the ramp on which it halts."""
    press: Press | None = None
    """Of mode cyclic torque."""
    free: int = 1
    """Direction of the counts (1 or -1) in which the axis can go a little from where it is."""
    trial: bool = False
    """The drive's units are tried (`FirstMotion`)."""
    back: bool = False
    """After the trial the axis goes back: what follows stops by time, from where it stood."""
    still: bool = False
    """Nothing moves: the home point is where the axis stands."""


def homing_order(axis: AxisSettings, homing: HomingSettings) -> SetupOrder:
    """Homing as configured: method, speeds, ramp, and what the home position is called."""
    counts, units = abs(axis.counts_per_unit), axis.units
    fast, slow = (max(1, units.speed(speed * counts)) for speed in (homing.fast, homing.slow))
    home = round((homing.position - axis.offset) * axis.counts_per_unit)
    writes = (
        SdoWrite(HOMING_METHOD, 0, homing.method.to_bytes(1, "little", signed=True)),
        _u32(HOMING_SPEEDS, 1, fast),
        _u32(HOMING_SPEEDS, 2, slow),
        _u32(HOMING_ACCELERATION, 0, units.ramp(homing.acceleration * counts)),
        SdoWrite(HOME_OFFSET, 0, home.to_bytes(4, "little", signed=True)),
    )
    return SetupOrder(
        HOMING,
        writes,
        fastest=max(fast, slow) * units.velocity,
        ramp_s=homing.fast / homing.acceleration,
        still=homing.method in HOME_HERE,
        free=-1 if homing.method in FROM_ABOVE else 1,
    )


def position_order(axis: AxisSettings, target: int, motion: Trapezoid, acceleration: float) -> SetupOrder:
    """A motion to `target` [counts] at the speed of `motion`."""
    counts = abs(axis.counts_per_unit)
    speed = max(1, axis.units.speed(abs(motion.velocity) * counts))
    # The process image of interpolated position has another set point.
    counted = axis.wrapped(target).to_bytes(4, "little", signed=True)
    place = (SdoWrite(TARGET_POSITION, 0, counted),) if axis.interpolated else ()
    writes = (
        *place,
        _u32(POSITION_WINDOW, 0, position_window(axis)),
        SdoWrite(POSITION_WINDOW_TIME, 0, POSITION_TIME_MS.to_bytes(2, "little")),
        _u32(PROFILE_SPEED, 0, speed),
    )
    return SetupOrder(
        PROFILE_POSITION,
        (*writes, *_ramps(axis, acceleration)),
        target=target,
        free=1 if motion.velocity * axis.counts_per_unit >= 0.0 else -1,
        fastest=speed * axis.units.velocity,
        lasts_s=motion.duration_s,
        ramp_s=abs(motion.velocity) / acceleration,
    )


def position_window(axis: AxisSettings) -> float:
    """[counts] within which a profile position has arrived."""
    return max(LEAST_WINDOW_COUNTS, WINDOW * abs(axis.counts_per_unit))


def velocity_order(axis: AxisSettings, motion: Trapezoid, acceleration: float) -> SetupOrder:
    """The same way in mode profile velocity: the speed of `motion`, and zero from its `stop_s` on.

    Raises:
        ValueError: the drive's unit of velocity is too coarse for this speed.
    """
    wanted = motion.velocity * axis.counts_per_unit
    velocity = axis.units.speed(wanted)
    if abs(velocity * axis.units.velocity - wanted) > COARSEST * abs(wanted):
        found = f"{wanted / axis.units.velocity:.4g} {axis.units.velocity_name}"
        raise ValueError(f"{axis.name} by velocity at {found}, of which its drive takes whole numbers")
    return SetupOrder(
        PROFILE_VELOCITY,
        (SdoWrite(TARGET_VELOCITY, 0, bytes(4)), *_ramps(axis, acceleration)),
        velocity=velocity,
        free=1 if velocity >= 0 else -1,
        fastest=abs(velocity) * axis.units.velocity,
        stop_s=motion.stop_s,
        ramp_s=abs(motion.velocity) / acceleration,
    )


def trial_order(axis: AxisSettings, direction: int, back: bool) -> SetupOrder:
    """The first motion: a profile velocity that grows from one unit of the drive (`FirstMotion`)."""
    ramp = SETUP_SHARE * axis.acceleration
    writes = (SdoWrite(TARGET_VELOCITY, 0, bytes(4)), *_ramps(axis, ramp))
    return SetupOrder(
        PROFILE_VELOCITY, writes, ramp_s=SETUP_SHARE * axis.speed / ramp, free=direction, trial=True, back=back
    )


def press_order(torque: TorqueSettings, speed: float, press: Press) -> SetupOrder:
    """A torque, with a motor that does not turn faster than the axis' `speed` [rad/s or m/s]."""
    return SetupOrder(CYCLIC_TORQUE, (_u32(MOTOR_SPEED, 0, speed * torque.rpm),), press=press)


def _ramps(axis: AxisSettings, acceleration: float) -> tuple[SdoWrite, SdoWrite]:
    """Of `acceleration` [rad/s^2 or m/s^2] up and down."""
    ramp = axis.units.ramp(acceleration * abs(axis.counts_per_unit))
    return _u32(PROFILE_ACCELERATION, 0, ramp), _u32(PROFILE_DECELERATION, 0, ramp)


def _u32(index: int, sub: int, value: float) -> SdoWrite:
    return SdoWrite(index, sub, max(1, round(value)).to_bytes(4, "little"))
