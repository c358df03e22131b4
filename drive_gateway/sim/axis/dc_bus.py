"""The DC bus that the drives of one cabinet share: supply, capacitors, braking resistor, discharge.

    C dV/dt = I_supply - P / V - I_chopper - V / R_bleed

The supply cannot take energy back. What braking axes return is used by the others, then charges the capacitors, then
heats the resistor; its chopper works in proportion to the voltage above its threshold.
"""

from dataclasses import dataclass

_STEP_S = 1e-4


@dataclass(frozen=True, slots=True)
class DcBusData:
    """Rectified mains; all values are the project's own, but for the discharge, which follows a published drawing."""

    supply_v: float = 560.0
    supply_ohm: float = 0.3
    supply_a: float = 60.0
    precharge_a: float = 5.0
    """Until the capacitors are charged for the first time."""
    capacitance_f: float = 3e-3
    chopper_v: float = 680.0
    chopper_per_v: float = 0.05
    """Duty cycle per volt above `chopper_v`."""
    chopper_ohm: float = 22.0
    bleeder_ohm: float = 78_920.0
    low_v: float = 400.0
    high_v: float = 780.0
    """Outside of these a drive opens its bridge."""


class DcBus:
    """The voltage of the bus. Consumers tell the energy that they took and until when; one interval later it counts."""

    def __init__(self, data: DcBusData, voltage: float | None = None) -> None:
        self.data = data
        self.voltage = data.supply_v if voltage is None else voltage
        self.charged = voltage is None
        self.duty = 0.0
        """Of the chopper, 0 to 1."""
        self.supplied = True
        self._time = self._end = 0.0
        self._pending_j = 0.0

    def switch_supply(self, on: bool) -> None:
        """The mains contactor, opened to play a loss of the mains."""
        self.supplied = on
        self.charged = self.charged and on

    def take(self, energy_j: float, until_s: float) -> None:
        """A drive took `energy_j` from the bus, or gave it back, up to its time `until_s`."""
        if until_s > self._end + 1e-9:
            self.advance(self._end - self._time, self._pending_j)
            self._time, self._end, self._pending_j = self._end, until_s, 0.0
        self._pending_j += energy_j

    def advance(self, seconds: float, energy_j: float) -> None:
        """Let time pass while `energy_j` is taken evenly."""
        steps = max(1, round(seconds / _STEP_S))
        if seconds > 0.0:
            for _ in range(steps):
                self._step(seconds / steps, energy_j / seconds)

    def _step(self, step_s: float, power_w: float) -> None:
        data, voltage = self.data, self.voltage
        self.duty = min(max(data.chopper_per_v * (voltage - data.chopper_v), 0.0), 1.0)
        current = self._supply() - self.duty * voltage / data.chopper_ohm - voltage / data.bleeder_ohm
        charge = current * step_s / data.capacitance_f
        # Power is drawn in energies, not in currents: V^2 is exact for it, however low the voltage.
        square = max(0.0, voltage * voltage - 2.0 * power_w * step_s / data.capacitance_f)
        self.voltage = max(0.0, square**0.5 + charge)
        if self.supplied and self.voltage > 0.95 * data.supply_v:
            self.charged = True

    def _supply(self) -> float:
        data = self.data
        if not self.supplied:
            return 0.0
        most = data.supply_a if self.charged else data.precharge_a
        return min(max((data.supply_v - self.voltage) / data.supply_ohm, 0.0), most)
