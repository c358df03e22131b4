"""The servo loop of a drive: position, speed and current, one inside the other, field oriented.

    speed   = Kp (x_set - x) + v_set
    i_q     = PI(speed - v) + torque / kT,   i_d = 0
    V_d,V_q = PI(i_set - i) + j w L i + j emf

The voltage that is computed in one period acts in the next, as in a real drive.
"""

from cmath import exp as cexp
from math import cos, sin, sqrt

from drive_gateway.sim.axis.gains import SPEED_FILTER_S, STEP_S, Gains
from drive_gateway.sim.axis.motor_data import MotorData
from drive_gateway.sim.axis.regulator import Regulator

CURRENT_MARGIN = 0.85
"""The set current stays this far below the current at which the stage switches off."""
_ROOT_3 = sqrt(3.0)
_AHEAD = 1.5
"""From the sample to the middle of the period in which its voltage acts."""


class Cascade:
    """Angles and speeds are of the shaft as its encoder sees them [rad, rad/s], currents are amplitudes [A]."""

    def __init__(self, motor: MotorData, gains: Gains, top_speed: float) -> None:
        self._gains = gains
        self._pairs = motor.pole_pairs
        self._inductance = motor.phase_inductance
        self._emf = motor.emf
        self._torque_per_ampere = motor.torque_per_ampere
        self._top_speed = top_speed
        self._most = CURRENT_MARGIN * motor.peak_current
        self._smoothing = STEP_S / (STEP_S + SPEED_FILTER_S)
        self._speed_loop = Regulator(gains.speed, gains.speed_integral, STEP_S)
        self._limiter = Regulator(gains.speed, gains.speed_integral, STEP_S)
        self._current_integral = 0j
        self._angle = self._ahead_of_encoder = 0.0
        self.injected = 0.0
        """[A] added after the speed loop: a probe for its open loop."""
        self.speed = 0.0
        self.regulated = 0.0
        """[A] what the speed loop asks for, before the probe."""
        self.set_current = 0.0
        self.limited = False
        """Current or voltage are at their limit."""

    def reset(self, angle: float, magnets: float) -> None:
        """The power stage is switched on with the shaft at `angle`, as its encoder says.

        The drive finds where the `magnets` really stand, which an incremental encoder does not know.
        """
        self._ahead_of_encoder = magnets - angle
        self._speed_loop.reset()
        self._limiter.reset()
        self._current_integral = 0j
        self._angle = angle
        self.speed = self.regulated = self.set_current = 0.0
        self.limited = False

    def observe(self, angle: float) -> None:
        """One reading of the encoder; from it the filtered speed."""
        self.speed += self._smoothing * ((angle - self._angle) / STEP_S - self.speed)
        self._angle = angle

    def step(self, position: float, speed: float, torque: float, measured: complex, dc_v: float) -> complex:
        """One period: set position, speed and torque fed forward [Nm], and the measured current, to the voltage [V].

        The current and the voltage are space vectors in the stator's frame.
        """
        wanted = self._gains.position * (position - self._angle) + speed
        wanted = min(max(wanted, -self._top_speed), self._top_speed)
        ahead = torque / self._torque_per_ampere
        self.regulated = self._speed_loop.step(wanted - self.speed, ahead, self._most)
        self.set_current = self.regulated + self.injected
        return self._voltage(measured, dc_v)

    def give(self, torque: float, top_speed: float, measured: complex, dc_v: float) -> complex:
        """One period of mode cyclic torque, to the voltage; towards `top_speed` a speed limiter takes over.

        Limiter and speed loop follow what is given, so that either goes on from there without a step.
        """
        wanted = min(max(torque / self._torque_per_ampere, -self._most), self._most)
        forwards = self.speed >= 0.0
        error = (top_speed if forwards else -top_speed) - self.speed
        bound = self._limiter.step(error, 0.0, self._most)
        current = min(wanted, bound) if forwards else max(wanted, bound)
        if current == wanted:
            self._limiter.resume(wanted, error)
        self._speed_loop.resume(current, 0.0)
        self.regulated = self.set_current = current
        return self._voltage(measured, dc_v)

    def _voltage(self, measured: complex, dc_v: float) -> complex:
        electric = self._pairs * (self._angle + self._ahead_of_encoder)
        turning = self._pairs * self.speed
        current = measured * complex(cos(electric), -sin(electric))
        error = 1j * self.set_current - current
        induced = 1j * (turning * self._inductance * current + self._emf * self.speed)
        integral = self._current_integral + self._gains.current_integral * STEP_S * error
        voltage = self._gains.current * error + integral + induced
        most, size = dc_v / _ROOT_3, abs(voltage)
        if size > most:
            voltage *= most / size
        else:
            self._current_integral = integral
        self.limited = size > most or self._speed_loop.limited
        return voltage * cexp(1j * (electric + _AHEAD * turning * STEP_S))
