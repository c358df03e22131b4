"""The torque that a master feeds forward, run evenly from one set point to the next, as the position is."""


class FedTorque:
    """Torque of the shaft [Nm]; as long as nobody gave one, `given` is false."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """The stage is off: what was fed forward is forgotten."""
        self.given = False
        self._torque = self._slope = self._left_s = 0.0

    def toward(self, torque_nm: float, period_s: float) -> None:
        """Reach a torque within one interpolation period; the first one at once."""
        if not self.given:
            self.given, self._torque = True, torque_nm
        self._slope = (torque_nm - self._torque) / period_s
        self._left_s = period_s

    def step(self, step_s: float) -> float:
        """Let time pass; the torque then."""
        part = min(step_s, self._left_s)
        self._left_s -= part
        self._torque += self._slope * part
        return self._torque
