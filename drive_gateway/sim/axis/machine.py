"""The physical part of an axis, stepped together: bridge, winding, motor and load, brake, encoder."""

from math import cos, sin, sqrt

from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.commutation import bridged
from drive_gateway.sim.axis.encoder import Encoder
from drive_gateway.sim.axis.gains import STEP_S
from drive_gateway.sim.axis.mechanics import Mechanics
from drive_gateway.sim.axis.motor_data import COPPER_PER_K, MAGNET_PER_K, REFERENCE_C
from drive_gateway.sim.axis.robot_load import ShaftLoad
from drive_gateway.sim.axis.winding import Winding

OVERLOAD = 1.5
"""An overload on command is this many times what the motor can give at its peak."""


class Machine:
    """One motor with its load, standing at `shaft` [rad] at first. Knows nothing of a controller."""

    def __init__(self, data: AxisData, shaft: float) -> None:
        self._data = data
        self._motor = data.motor
        self._per_gear = data.direction / data.gear
        self._torque_per_ampere = data.motor.torque_per_ampere
        self.winding = Winding(data.motor, STEP_S)
        self.mechanics = Mechanics(data.motor.inertia_kg_m2, data.load, data.gear, shaft, STEP_S)
        self.encoder = Encoder(data.encoder, shaft, data.seed)
        self.brake_closed = True
        self.brake_stuck = False
        self.overloaded = False
        self.robot: ShaftLoad | None = None
        """The shaft's share of a whole robot."""
        self._carried = 0.0
        self.used_j = 0.0
        """Energy taken from the DC bus since it was last asked for."""

    @property
    def torque(self) -> float:
        """Of the motor [Nm]: only the current across the magnets' field counts."""
        electric = self._motor.pole_pairs * self.mechanics.angle
        current = self.winding.current
        return self._torque_per_ampere * (current.imag * cos(electric) - current.real * sin(electric))

    @property
    def current_a(self) -> float:
        """[A rms] the part of the current that gives torque, with its sign."""
        return self.torque / (sqrt(2.0) * self._torque_per_ampere)

    @property
    def resting(self) -> bool:
        """The brake is closed and holds; nothing gives way behind it."""
        return self.brake_closed and self.mechanics.resting

    def warm(self, motor_c: float) -> None:
        """A hot winding has more resistance, hot magnets give less torque."""
        above = motor_c - REFERENCE_C
        self.winding.set_resistance(self._motor.phase_resistance * (1.0 + COPPER_PER_K * above))
        self._torque_per_ampere = self._motor.torque_per_ampere * (1.0 + MAGNET_PER_K * above)

    def begin(self, time_s: float) -> None:
        """A few steps follow, the first at `time_s` [s]."""
        if self.robot is not None:
            self._carried = self.robot(time_s)

    def drive(self, voltage: complex, dc_v: float) -> None:
        """One step with the bridge on."""
        mechanics, winding = self.mechanics, self.winding
        applied = bridged(voltage, dc_v)
        before = winding.current
        winding.step(applied, mechanics.angle, mechanics.speed)
        mean = 0.5 * (before + winding.current)
        self.used_j += 1.5 * STEP_S * (applied.real * mean.real + applied.imag * mean.imag)
        self._move(self.torque)

    def coast(self) -> None:
        """One step with the bridge open."""
        self.winding.open()
        self._move(0.0)

    def _move(self, torque: float) -> None:
        data, mechanics = self._data, self.mechanics
        load = data.torque(data.axis_angle(mechanics.load_angle)) * self._per_gear + self._carried
        brake = self._motor.brake_torque_nm if self.brake_closed or self.brake_stuck else 0.0
        if self.overloaded:
            brake += OVERLOAD * self._motor.peak_current * self._motor.torque_per_ampere
        mechanics.step(torque, load, brake)

    def taken(self) -> float:
        """The energy [J] since the last call; negative when the motor gave some back."""
        used, self.used_j = self.used_j, 0.0
        return used
