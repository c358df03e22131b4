"""What is written to a drive before it makes a motion of its own, in set-up: homing, profile position and velocity."""

from dataclasses import dataclass

from drive_gateway.canopen.pdo_map import SdoWrite
from drive_gateway.cia402.profile import Trapezoid
from drive_gateway.config.settings import AxisSettings, HomingSettings

PROFILE_POSITION, PROFILE_VELOCITY, HOMING = 1, 3, 6
MODE, MODE_DISPLAY, TARGET_VELOCITY = 0x6060, 0x6061, 0x60FF

START = 1 << 4
"""Controlword: new set point, or homing begins."""
REACHED, ACKNOWLEDGED, ATTAINED, STANDING, FAILED = 1 << 10, 1 << 12, 1 << 12, 1 << 12, 1 << 13
"""Statusword; bits 12 and 13 mean what the mode says."""


@dataclass(frozen=True, slots=True)
class SetupOrder:
    """One motion of one drive: its mode, the objects written before, and the target or the speed and its time."""

    mode: int
    writes: tuple[SdoWrite, ...]
    target: int | None = None
    """[counts] of a profile position."""
    velocity: int = 0
    """[counts/s] of a profile velocity."""
    stop_s: float = 0.0
    """A profile velocity is taken back to zero after this time."""


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
    return SetupOrder(HOMING, writes)


def position_order(axis: AxisSettings, target: int, motion: Trapezoid, acceleration: float) -> SetupOrder:
    """A motion to `target` [counts] at the speed of `motion`."""
    counts = abs(axis.counts_per_unit)
    speed = _u32(0x6081, 0, abs(motion.velocity) * counts)
    return SetupOrder(PROFILE_POSITION, (speed, *_ramps(acceleration * counts)), target=target)


def velocity_order(axis: AxisSettings, motion: Trapezoid, acceleration: float) -> SetupOrder:
    """The same way in mode profile velocity: the speed of `motion`, and zero from its `stop_s` on."""
    counts = abs(axis.counts_per_unit)
    writes = (SdoWrite(TARGET_VELOCITY, 0, bytes(4)), *_ramps(acceleration * counts))
    velocity = round(motion.velocity * axis.counts_per_unit)
    return SetupOrder(PROFILE_VELOCITY, writes, velocity=velocity, stop_s=motion.stop_s)


def _ramps(counts: float) -> tuple[SdoWrite, SdoWrite]:
    return _u32(0x6083, 0, counts), _u32(0x6084, 0, counts)


def _u32(index: int, sub: int, value: float) -> SdoWrite:
    return SdoWrite(index, sub, max(1, round(value)).to_bytes(4, "little"))
