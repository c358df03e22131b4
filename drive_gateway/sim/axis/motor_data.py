"""Motor data, from terminal to terminal as data sheets give them, and what follows from them for one phase.

`DATA_SHEET` holds the eight servomotors of a published data sheet with six poles and a holding brake of 130 Nm. What it
does not give is this project's own and marked so: peak current, everything thermal, and the motors of `OWN`.
"""

from dataclasses import dataclass, replace
from math import pi, sqrt

RAD_S_PER_RPM = pi / 30.0
REFERENCE_C = 20.0
"""Resistance and torque constant are given at this temperature."""
COPPER_PER_K = 0.0039
"""Rise of the resistance of copper."""
MAGNET_PER_K = -0.001
"""Change of the torque constant; the project's own, usual for NdFeB."""


@dataclass(frozen=True, slots=True)
class MotorData:
    """A three-phase synchronous motor with permanent magnets. Currents are rms, resistance and inductance are between
    two terminals, the voltage constant is rms from line to line."""

    name: str
    pole_pairs: int
    rated_speed_rpm: float
    rated_torque_nm: float
    rated_current_a: float
    stall_torque_nm: float
    stall_current_a: float
    """Continuous at standstill."""
    torque_constant_nm_a: float
    voltage_constant_v_krpm: float
    resistance_ohm: float
    inductance_h: float
    inertia_kg_m2: float
    """With the holding brake."""
    brake_torque_nm: float
    peak_factor: float = 3.0
    """Peak current over stall current; the project's own."""
    hot_c: float = 140.0
    """Temperature of the winding at which the drive switches off; the project's own."""
    rise_k: float = 100.0
    """Rise of the winding over its surroundings at the stall current; the project's own."""
    thermal_s: float = 1800.0
    """Thermal time constant of the winding and its housing; the project's own."""

    @property
    def phase_resistance(self) -> float:
        """[Ohm] of one phase."""
        return 0.5 * self.resistance_ohm

    @property
    def phase_inductance(self) -> float:
        """[H] of one phase."""
        return 0.5 * self.inductance_h

    @property
    def emf(self) -> float:
        """Peak of the voltage induced in one phase [V s/rad of the shaft]."""
        return self.voltage_constant_v_krpm * sqrt(2.0 / 3.0) / (1000.0 * RAD_S_PER_RPM)

    @property
    def torque_per_ampere(self) -> float:
        """[Nm/A], of the peak phase current that a Clarke transformation with constant amplitudes gives."""
        return self.torque_constant_nm_a / sqrt(2.0)

    @property
    def peak_current(self) -> float:
        """[A], amplitude of a phase, that is never passed: above it the magnets suffer."""
        return sqrt(2.0) * self.peak_factor * self.stall_current_a


def _sheet(
    name: str, rated: tuple[float, float, float], stall: tuple[float, float], constants: tuple[float, ...]
) -> MotorData:
    torque_constant, voltage_constant, resistance, inductance_mh, inertia_kg_cm2 = constants
    return MotorData(
        name=name,
        pole_pairs=3,
        rated_speed_rpm=rated[0],
        rated_torque_nm=rated[1],
        rated_current_a=rated[2],
        stall_torque_nm=stall[0],
        stall_current_a=stall[1],
        torque_constant_nm_a=torque_constant,
        voltage_constant_v_krpm=voltage_constant,
        resistance_ohm=resistance,
        inductance_h=1e-3 * inductance_mh,
        inertia_kg_m2=1e-4 * inertia_kg_cm2,
        brake_torque_nm=130.0,
    )


DATA_SHEET = (
    _sheet("83-220", (2200, 31.0, 14.0), (40, 18.2), (2.2, 135, 0.39, 8.5, 96)),
    _sheet("83-300", (3000, 27.0, 17.0), (40, 25.0), (1.6, 99, 0.21, 4.9, 96)),
    _sheet("84-220", (2200, 51.5, 23.5), (69, 31.4), (2.2, 135, 0.15, 4.8, 149)),
    _sheet("84-300", (3000, 48.5, 30.0), (69, 43.1), (1.6, 99, 0.10, 2.8, 149)),
    _sheet("85-150", (1500, 77.0, 22.5), (94, 27.6), (3.4, 198, 0.30, 8.6, 190)),
    _sheet("85-200", (2000, 72.0, 29.5), (94, 39.2), (2.4, 150, 0.15, 4.4, 190)),
    _sheet("86-150", (1500, 97.0, 31.0), (115, 37.1), (3.1, 198, 0.21, 5.6, 230)),
    _sheet("86-200", (2000, 85.0, 35.0), (115, 47.9), (2.4, 150, 0.11, 3.5, 230)),
)

_JOINT = MotorData(
    name="joint-large",
    pole_pairs=4,
    rated_speed_rpm=4000,
    rated_torque_nm=9.0,
    rated_current_a=9.0,
    stall_torque_nm=11.0,
    stall_current_a=11.0,
    torque_constant_nm_a=1.0,
    voltage_constant_v_krpm=60.5,
    resistance_ohm=0.9,
    inductance_h=6.0e-3,
    inertia_kg_m2=2.0e-3,
    brake_torque_nm=20.0,
)
OWN = (
    _JOINT,
    replace(
        _JOINT,
        name="joint-medium",
        rated_torque_nm=3.6,
        rated_current_a=4.2,
        stall_torque_nm=4.5,
        stall_current_a=5.2,
        torque_constant_nm_a=0.86,
        voltage_constant_v_krpm=52.0,
        resistance_ohm=2.0,
        inductance_h=9.0e-3,
        inertia_kg_m2=5.0e-4,
        brake_torque_nm=8.0,
    ),
    replace(
        _JOINT,
        name="joint-small",
        rated_torque_nm=1.3,
        rated_current_a=1.9,
        stall_torque_nm=1.6,
        stall_current_a=2.3,
        torque_constant_nm_a=0.7,
        voltage_constant_v_krpm=42.3,
        resistance_ohm=5.0,
        inductance_h=14.0e-3,
        inertia_kg_m2=8.0e-5,
        brake_torque_nm=3.0,
    ),
)
"""Motors for the joints of an arm on rectified mains; all numbers are the project's own."""

MOTORS = {motor.name: motor for motor in (*DATA_SHEET, *OWN)}
"""Every preset by name."""
