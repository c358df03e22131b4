"""A drive's own trajectory: a speed ramp, and a trapezoid of speed to a position, step by step."""

from math import copysign, sqrt


class Profile:
    """Demanded position and velocity; each step changes the velocity by no more than its ramp."""

    def __init__(self, position: float) -> None:
        self.position = position
        self.velocity = 0.0

    def begin(self, position: float) -> None:
        """Start from standstill at `position`."""
        self.position, self.velocity = position, 0.0

    def run(self, velocity: float, ramp: float, step_s: float) -> None:
        """One step towards a velocity."""
        change = velocity - self.velocity
        most = ramp * step_s
        before = self.velocity
        self.velocity = velocity if abs(change) <= most else before + copysign(most, change)
        self.position += 0.5 * (before + self.velocity) * step_s

    def approach(self, target: float, speed: float, ramps: tuple[float, float], step_s: float) -> None:
        """One step of the trapezoid to `target`: at most `speed`, with (acceleration, deceleration)."""
        left = target - self.position
        acceleration, deceleration = ramps
        # The speed from which the axis still stops in time when it is lowered once per step.
        most = deceleration * (sqrt(0.25 * step_s**2 + 2.0 * abs(left) / deceleration) - 0.5 * step_s)
        wanted = copysign(min(speed, most), left)
        faster = abs(wanted) > abs(self.velocity) and wanted * self.velocity >= 0.0
        change = (acceleration if faster else deceleration) * step_s
        self.velocity += max(-change, min(change, wanted - self.velocity))
        if abs(left) <= abs(self.velocity) * step_s and abs(self.velocity) <= deceleration * step_s:
            self.begin(target)
        else:
            self.position += self.velocity * step_s
