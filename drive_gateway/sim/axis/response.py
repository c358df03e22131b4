"""Step and frequency response of a simulated servo loop, measured on it as on a machine.

The open speed loop is measured while it is closed: a sine is added to the set current after the speed controller. What
the controller answers to what reaches the motor is -L, so no stability is risked by opening anything.
"""

from cmath import exp as cexp
from cmath import phase
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, degrees, inf, log10, pi

from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.cascade import Cascade
from drive_gateway.sim.axis.gains import STEP_S
from drive_gateway.sim.axis.load import constant
from drive_gateway.sim.axis.machine import Machine
from drive_gateway.sim.axis.mechanics import LoadData

DC_V = 560.0
_PROBE = 0.05
"""Amplitude of the sine, of the motor's peak current."""
_SETTLE_S = 0.15
_LEAST_S = 0.1
_LEAST_PERIODS = 8


@dataclass(frozen=True, slots=True)
class Point:
    """Open and closed speed loop at one frequency, as complex gains."""

    hz: float
    open: complex

    @property
    def closed(self) -> complex:
        return self.open / (1.0 + self.open)


@dataclass(frozen=True, slots=True)
class Margins:
    """How far the loop is from instability; infinite when the curve never gets there."""

    gain: float
    """1 / |L| where the phase passes -180 degrees."""
    gain_hz: float
    phase_deg: float
    """Above -180 degrees where |L| passes 1."""
    crossover_hz: float


@dataclass(frozen=True, slots=True)
class Step:
    """Answer of the speed to a step of its set point: instants [s], speed over the step's height."""

    times: tuple[float, ...]
    speed: tuple[float, ...]

    @property
    def rise_s(self) -> float:
        """From 10 % to 90 %; infinite when it never gets there."""
        return self._first(0.9) - self._first(0.1)

    @property
    def overshoot(self) -> float:
        return max(0.0, max(self.speed) - 1.0)

    @property
    def settled_s(self) -> float:
        """After this the speed stays within 5 %."""
        outside = [time for time, speed in zip(self.times, self.speed, strict=True) if abs(speed - 1.0) > 0.05]
        return outside[-1] if outside else 0.0

    def _first(self, level: float) -> float:
        return next((t for t, speed in zip(self.times, self.speed, strict=True) if speed >= level), inf)


class _Loop:
    """The speed loop alone: the position loop and what disturbs a small signal are left out."""

    def __init__(self, data: AxisData) -> None:
        load = data.load
        linear = LoadData(load.inertia_kg_m2, 0.0, load.viscous_nm_s, load.stiffness_nm_rad, load.damping_nm_s)
        quiet = replace(data.encoder, noise_counts=0.0, counts_per_turn=1 << 24)
        data = replace(data, load=linear, encoder=quiet, torque=constant(0.0))
        self._per_rad = data.counts_per_rad
        self.machine = Machine(data, 0.0)
        self.machine.brake_closed = False
        self.cascade = Cascade(data.motor, replace(data.gains, position=0.0), 2.0 * data.top_speed)
        self._voltage = 0j

    def step(self, speed: float) -> None:
        machine = self.machine
        self.cascade.observe(machine.encoder.read(machine.mechanics.angle) / self._per_rad)
        measured = machine.winding.current
        machine.drive(self._voltage, DC_V)
        self._voltage = self.cascade.step(0.0, speed, 0.0, measured, DC_V)


def frequencies(lowest: float, highest: float, count: int) -> list[float]:
    """Evenly spaced on a logarithmic scale [Hz]."""
    return [lowest * (highest / lowest) ** (k / (count - 1)) for k in range(count)]


def frequency_response(data: AxisData, hz: Sequence[float]) -> list[Point]:
    """The open speed loop at each frequency, below half of the loop's rate."""
    return [Point(frequency, _open_loop(data, frequency)) for frequency in hz]


def _open_loop(data: AxisData, hz: float) -> complex:
    loop = _Loop(data)
    amplitude = _PROBE * data.motor.peak_current
    settle = round(_SETTLE_S / STEP_S)
    periods = max(_LEAST_PERIODS, ceil(_LEAST_S * hz))
    measured = round(periods / hz / STEP_S)
    answer = reached = 0j
    for k in range(settle + measured):
        turn = cexp(-2j * pi * hz * k * STEP_S)
        loop.cascade.injected = -amplitude * turn.imag
        loop.step(0.0)
        if k >= settle:
            answer += loop.cascade.regulated * turn
            reached += loop.cascade.set_current * turn
    return -answer / reached


def step_response(data: AxisData, seconds: float) -> Step:
    """The answer to a step of a hundredth of the top speed."""
    loop, height = _Loop(data), 0.01 * data.top_speed
    times, speeds = [], []
    for k in range(round(seconds / STEP_S)):
        loop.step(height)
        times.append((k + 1) * STEP_S)
        speeds.append(loop.machine.mechanics.speed / height)
    return Step(tuple(times), tuple(speeds))


def margins(points: Sequence[Point]) -> Margins:
    """Gain and phase margin of the open loop; between two points gain and phase are interpolated over log(f).

    The gain margin is the smallest over all passages of -180 degrees above the crossover, the phase margin the smallest
    over all passages of gain 1.
    """
    curve = list(_unwrapped(points))
    gain, gain_hz, phase_deg, crossover_hz = inf, inf, inf, inf
    for (hz0, db0, deg0), (hz1, db1, deg1) in pairwise(curve):
        if (db0 > 0.0) != (db1 > 0.0):
            part = db0 / (db0 - db1)
            above = 180.0 + deg0 + part * (deg1 - deg0)
            if above < phase_deg:
                phase_deg, crossover_hz = above, hz0 * (hz1 / hz0) ** part
        if (deg0 > -180.0) != (deg1 > -180.0):
            part = (deg0 + 180.0) / (deg0 - deg1)
            margin = 10.0 ** (-(db0 + part * (db1 - db0)) / 20.0)
            if margin < gain:
                gain, gain_hz = margin, hz0 * (hz1 / hz0) ** part
    return Margins(gain, gain_hz, phase_deg, crossover_hz)


def _unwrapped(points: Sequence[Point]) -> list[tuple[float, float, float]]:
    """Frequency, gain [dB] and a phase [degrees] without jumps that begins between -360 and 0."""
    curve: list[tuple[float, float, float]] = []
    before = -180.0
    for point in points:
        angle = degrees(phase(point.open))
        angle -= 360.0 * round((angle - before) / 360.0)
        curve.append((point.hz, 20.0 * log10(abs(point.open)), angle))
        before = angle
    return curve
