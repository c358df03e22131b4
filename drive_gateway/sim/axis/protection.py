"""What protects motor and drive, and the emergency codes by which it is told (CiA 301, CiA 402).

A limit that is passed trips once; the fault stays until its cause is gone, temperatures with a hysteresis.
"""

from dataclasses import dataclass

from drive_gateway.canopen.emcy import MOTOR_HOT
from drive_gateway.sim.axis.axis_servo import BUS_HIGH, BUS_LOW, MEAN_CURRENT_HIGH, MOTOR_WARM, STAGE_WARM
from drive_gateway.sim.axis.motor_data import COPPER_PER_K, REFERENCE_C, MotorData

MEAN_CURRENT = 0x2310
PEAK_CURRENT = 0x2320
OVER_VOLTAGE = 0x3210
UNDER_VOLTAGE = 0x3220
STAGE_HOT = 0x4210
BLOCKED = 0x7121
ENCODER = 0x7380
OVER_SPEED = 0x8480

OPENS_BRIDGE = frozenset({PEAK_CURRENT, OVER_VOLTAGE, UNDER_VOLTAGE, ENCODER})
"""With these there is nothing left to brake with: the bridge opens at once and the holding brake closes."""

AMBIENT_C = REFERENCE_C
COOLER_K = 15.0
"""A hot motor or stage must cool down this far below its limit."""
PEAK_S = 0.5
"""The peak current may flow this long: the red zone of a motor."""
BLOCKED_S = 0.3
"""At the current limit without turning for this long, the axis is blocked."""
STAGE_HOT_C = 95.0
WARM_K = 10.0
"""So far below their limits motor and stage warn; this and the next two are the project's own."""
_MUCH_USED = 0.5
"""Share of what the mean current may use up, above which it warns; it stops below half of that."""
_BUS_SHARE = 0.95
"""The DC bus warns above this share of its highest voltage, and below its lowest over it while the stage is on."""
_STAGE_RISE_K = 45.0
"""Of the power stage at the motor's stall current; like its time constant the project's own."""
_STAGE_S = 120.0


@dataclass(slots=True)
class Seen:
    """What a drive measured over one interval. Squares are of amplitudes of the phase current, [A^2]."""

    seconds: float
    mean_square: float
    peak_square: float
    dc_v: float
    speed: float
    blocked: bool
    encoder_bad: bool
    powered: bool


class Protection:
    """Two limits of the current, two of the voltage, two temperatures, speed, encoder, blocked axis.

    Args:
        motor: its currents and its limit of temperature.
        voltages: lowest and highest of the DC bus [V].
        top_speed: of the shaft [rad/s], above which it is too fast.
    """

    def __init__(self, motor: MotorData, voltages: tuple[float, float], top_speed: float) -> None:
        self._motor = motor
        self._low_v, self._high_v = voltages
        self._top_speed = top_speed
        self._continuous = 2.0 * motor.stall_current_a**2
        self._budget = (motor.peak_current**2 - self._continuous) * PEAK_S
        self._used = 0.0
        self._blocked_s = 0.0
        self._present: frozenset[int] = frozenset()
        self.motor_c = AMBIENT_C
        self.stage_c = AMBIENT_C
        self.warnings = 0
        """What is near its limit: bits of 2002h."""

    def update(self, seen: Seen) -> list[int]:
        """The codes of what is wrong now and was not before, the worst first."""
        self._warm(seen)
        excess = (seen.mean_square - self._continuous) * seen.seconds
        self._used = min(max(0.0, self._used + excess), self._budget)
        self._blocked_s = self._blocked_s + seen.seconds if seen.blocked else 0.0
        wrong = {
            PEAK_CURRENT: seen.peak_square > self._motor.peak_current**2,
            ENCODER: seen.encoder_bad,
            OVER_VOLTAGE: seen.dc_v > self._high_v,
            UNDER_VOLTAGE: seen.powered and seen.dc_v < self._low_v,
            OVER_SPEED: abs(seen.speed) > self._top_speed,
            MEAN_CURRENT: self._used >= self._budget or (MEAN_CURRENT in self._present and self._used > 0.0),
            MOTOR_HOT: self._hot(MOTOR_HOT, self.motor_c, self._motor.hot_c),
            STAGE_HOT: self._hot(STAGE_HOT, self.stage_c, STAGE_HOT_C),
            BLOCKED: self._blocked_s >= BLOCKED_S,
        }
        present = frozenset(code for code, is_wrong in wrong.items() if is_wrong)
        new = [code for code in wrong if code in present and code not in self._present]
        self._present = present
        self.warnings = self._near(seen)
        return new

    def present(self, code: int) -> bool:
        """Whether the cause of a code is still there."""
        return code in self._present

    @property
    def opens_bridge(self) -> bool:
        """Whether the bridge must not be on."""
        return not self._present.isdisjoint(OPENS_BRIDGE)

    def _near(self, seen: Seen) -> int:
        much = _MUCH_USED * (0.5 if self.warnings & MEAN_CURRENT_HIGH else 1.0)
        near = {
            MOTOR_WARM: self.motor_c > self._motor.hot_c - WARM_K,
            STAGE_WARM: self.stage_c > STAGE_HOT_C - WARM_K,
            MEAN_CURRENT_HIGH: self._used > much * self._budget,
            BUS_HIGH: seen.dc_v > _BUS_SHARE * self._high_v,
            BUS_LOW: seen.powered and seen.dc_v < self._low_v / _BUS_SHARE,
        }
        return sum(bit for bit, is_near in near.items() if is_near)

    def _hot(self, code: int, now_c: float, limit_c: float) -> bool:
        return now_c > (limit_c - COOLER_K if code in self._present else limit_c)

    def _warm(self, seen: Seen) -> None:
        """First-order bodies: copper loss 3/2 R i^2, which grows with the temperature; conduction loss of the stage."""
        motor, share = self._motor, seen.mean_square / self._continuous
        hot = (1.0 + COPPER_PER_K * (self.motor_c - REFERENCE_C)) / (1.0 + COPPER_PER_K * motor.rise_k)
        self.motor_c += (motor.rise_k * share * hot - (self.motor_c - AMBIENT_C)) * seen.seconds / motor.thermal_s
        self.stage_c += (_STAGE_RISE_K * share - (self.stage_c - AMBIENT_C)) * seen.seconds / _STAGE_S
