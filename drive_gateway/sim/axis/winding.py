"""The electrical half of a motor: three phases in star, as one space vector, solved in closed form over each step.

    L di/dt = v - R i - j w psi e^(j angle),   w psi = emf * speed of the shaft

Within a step the voltage (the mean of one PWM period) and the speed are constant, so the step's length costs no
exactness and the current needs no small steps.
"""

from cmath import exp as cexp
from math import cos, exp, sin

from drive_gateway.sim.axis.motor_data import MotorData


class Winding:
    """`current` [A] is a space vector in the stator's frame; angles are electric ones [rad]."""

    def __init__(self, motor: MotorData, step_s: float) -> None:
        self._inductance = motor.phase_inductance
        self._emf = motor.emf
        self._pairs = motor.pole_pairs
        self._step_s = step_s
        self.current = 0j
        self.set_resistance(motor.phase_resistance)

    def set_resistance(self, ohm: float) -> None:
        """The resistance of one phase, which rises with the temperature."""
        self._decay_rate = ohm / self._inductance
        self._decay = exp(-self._decay_rate * self._step_s)
        self._conductance = (1.0 - self._decay) / ohm

    def step(self, voltage: complex, shaft: float, speed: float) -> None:
        """One step with `voltage` [V] on the terminals, the shaft at `shaft` [rad], turning with `speed` [rad/s]."""
        electric = self._pairs * shaft
        turned = cexp(1j * self._pairs * speed * self._step_s) - self._decay
        induced = 1j * self._emf * speed * complex(cos(electric), sin(electric))
        drawn = induced * turned / (self._inductance * complex(self._decay_rate, self._pairs * speed))
        self.current = self.current * self._decay + voltage * self._conductance - drawn

    def open(self) -> None:
        """The bridge is off: the current is gone within less than a step, through the diodes."""
        self.current = 0j
