"""Gains of the servo loops and the values that a drive proposes for them from motor and inertia."""

from dataclasses import dataclass
from math import pi

from drive_gateway.sim.axis.motor_data import MotorData

STEP_S = 1e-4
"""Period of all three loops, and of the model under them."""
SPEED_FILTER_S = 3e-4
"""Time constant of the filter behind the encoder: a step of the encoder must not look like a speed."""
CURRENT_HZ = 600.0
"""Bandwidth of the current loop: its delay of one and a half periods leaves a phase margin of 58 degrees."""


@dataclass(frozen=True, slots=True)
class ServoData:
    """What a commissioning engineer chooses; the gains follow."""

    speed_hz: float = 50.0
    """Bandwidth of the speed loop."""
    reset_s: float = 0.02
    """Reset time of the speed loop's integral."""
    position_per_s: float = 30.0
    """Gain of the position loop."""


@dataclass(frozen=True, slots=True)
class Gains:
    """Position [1/s]; speed [A s/rad] and its integral [A/rad]; current [V/A] and its integral [V/(A s)]."""

    position: float
    speed: float
    speed_integral: float
    current: float
    current_integral: float


def gains(motor: MotorData, inertia: float, data: ServoData) -> Gains:
    """Gains for a motor that turns `inertia` [kg m^2] in all.

    Speed: crossover at `speed_hz`, Kv = 2 pi f I / kT. Current: the zero of the controller on the pole of the winding.
    """
    speed = 2.0 * pi * data.speed_hz * inertia / motor.torque_per_ampere
    current = 2.0 * pi * CURRENT_HZ
    return Gains(
        position=data.position_per_s,
        speed=speed,
        speed_integral=speed / data.reset_s,
        current=current * motor.phase_inductance,
        current_integral=current * motor.phase_resistance,
    )
