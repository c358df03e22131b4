"""Everything that makes up one fully simulated axis."""

from dataclasses import dataclass
from math import pi

from drive_gateway.sim.axis.encoder import EncoderData
from drive_gateway.sim.axis.gains import Gains, ServoData, gains
from drive_gateway.sim.axis.load import Load
from drive_gateway.sim.axis.mechanics import LoadData
from drive_gateway.sim.axis.motor_data import MotorData

BRAKE_OVERLAP_S = 0.1
"""Motor and brake hold together for this long at the start and at the end, so that the axis does not drop."""


@dataclass(frozen=True, slots=True)
class AxisData:
    """A motor, its gear and what hangs on it. The shaft turns forwards when the encoder counts up."""

    motor: MotorData
    gear: float
    """Turns of the motor per turn of the axis."""
    direction: int
    """-1 when the motor turns against the axis."""
    offset: float
    """Angle of the axis at encoder count zero [rad]."""
    load: LoadData
    torque: Load
    """On the axis, over its angle."""
    encoder: EncoderData
    servo: ServoData
    top_speed: float
    """[rad/s] of the shaft: the speed loop asks for no more."""
    seed: int

    @property
    def counts_per_rad(self) -> float:
        """Encoder counts per radian of the shaft."""
        return self.encoder.counts_per_turn / (2.0 * pi)

    @property
    def inertia(self) -> float:
        """Of motor and load, at the motor [kg m^2]."""
        return self.motor.inertia_kg_m2 + self.load.inertia_kg_m2 / self.gear**2

    @property
    def gains(self) -> Gains:
        return gains(self.motor, self.inertia, self.servo)

    def axis_angle(self, shaft: float) -> float:
        """Angle of the axis [rad] at an angle of the shaft."""
        return self.offset + self.direction * shaft / self.gear
