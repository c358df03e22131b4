"""The axis of a simulated drive: interpolation from SYNC to SYNC, a position loop with a lag, braking.

The demand runs linearly to the newest target within one interpolation period and then stands. With the bandwidth
w = 1 / lag the axis follows it as x'' = w^2 (u - x) + 2 w ((u' + f) / 2 - x'): critically damped with the time constant
`lag`, half of the demanded velocity fed forward, and half of a velocity offset f that the drive is given. At a constant
speed u' = v the error settles at (v - f) / w, so without an offset the axis runs behind its demand by exactly the lag.
Each step is the closed solution, so its length does not matter. Torque is unlimited; the speed of the motor is not.
This is the fast level of the simulation; `FullServo` is the full one, whose command this axis is.
"""

from math import exp

from drive_gateway.canopen.emcy import MOTOR_HOT
from drive_gateway.sim.axis.axis_servo import MOTOR_WARM
from drive_gateway.sim.axis.protection import AMBIENT_C

_SHORTEST_LAG_S = 1e-4
"""A lag of zero is taken as this: no axis follows at once."""
_HOT_C, _WARM_C = 141.0, 136.0
"""Motors of the full level are too hot above 140 degC."""


class Servo:
    """Position [counts] and velocity [counts/s] of one axis. `top_speed` [counts/s] is what the motor can do."""

    def __init__(self, position: float, lag_s: float, top_speed: float) -> None:
        self._bandwidth = 1.0 / max(lag_s, _SHORTEST_LAG_S)
        self.top_speed = top_speed
        self._target = position
        self._rate = 0.0
        self._ramp_left = 0.0
        self._feed = 0.0
        self.position = position
        self.velocity = 0.0
        self.demand = position
        self.limited = False
        """The motor's speed held the axis back in the newest step."""
        self._blocked = self._stuck = self._hot = self._warm = self._told = False

    @property
    def standing(self) -> bool:
        return self.velocity == 0.0

    @property
    def error(self) -> float:
        """Following error [counts]: demand minus position."""
        return self.demand - self.position

    def hold(self) -> None:
        """The demand becomes the position: what was commanded before is forgotten."""
        self.demand = self.position
        self._rate = self._ramp_left = self._feed = 0.0
        self.limited = False

    def interpolate(self, target: float, period_s: float) -> None:
        """The demand runs from where it is to `target`, within one interpolation period."""
        self._target = target
        self._rate = (target - self.demand) / period_s
        self._ramp_left = period_s

    def feed(self, velocity: float) -> None:
        """Velocity offset [counts/s], from now on: with the demand's own velocity nothing is left of the lag."""
        self._feed = velocity

    @property
    def torque_nm(self) -> float:
        """None is known at this level."""
        return 0.0

    @property
    def rated_current_a(self) -> float:
        """None is known at this level."""
        return 0.0

    @property
    def current_a(self) -> float:
        """None is known at this level."""
        return 0.0

    @property
    def motor_c(self) -> float:
        """[degC] that of its surroundings, unless it was heated on command."""
        return _HOT_C if self._hot else _WARM_C if self._warm else AMBIENT_C

    @property
    def has_torque(self) -> bool:
        """Not at this level."""
        return False

    def press(self, _torque_nm: float, _top_speed: float) -> None:
        """Nothing: without torque the mode is refused."""

    def feed_torque(self, _torque_nm: float, _period_s: float) -> None:
        """Nothing: this level has no torque."""

    def follow(self, step_s: float) -> None:
        """One step of interpolation and position loop."""
        self.limited = False
        held = self.position
        if self._ramp_left > 0.0:
            part = min(step_s, self._ramp_left)
            self._track(part, self._rate)
            step_s -= part
            self._ramp_left -= part
            if self._ramp_left < 1e-9:
                self._ramp_left = 0.0
                self.demand = self._target
        if step_s > 0.0:
            self._track(step_s, 0.0)
        if self._blocked or self._stuck:
            self.position, self.velocity, self.limited = held, 0.0, True

    def rest(self, step_s: float, deceleration: float) -> None:
        """One step with the power stage off: the brake stops the axis, not at once, and holds it."""
        if not self.standing:
            self.brake(step_s, deceleration)

    def switch_on(self) -> None:
        """The drive's supply returns; its encoder is absolute."""
        self._told = False

    def trips(self) -> list[int]:
        """The code of a hot motor, once; this level knows no other trouble of its own."""
        if self._told or not self._hot:
            return []
        self._told = True
        return [MOTOR_HOT]

    @property
    def warnings(self) -> int:
        """Of a motor that is nearly too hot, or is so: bits of 2002h."""
        return MOTOR_WARM if self._warm or self._hot else 0

    def persists(self, code: int) -> bool:
        """Whether the cause of an error code is still there."""
        return code == MOTOR_HOT and self._hot

    def jump(self, counts: int) -> None:
        """Fault on command: the encoder reads wrong by so much from now on."""
        self.position += counts

    def block(self, blocked: bool) -> None:
        """Fault on command: something holds the axis."""
        self._blocked = blocked

    def stick_brake(self, stuck: bool) -> None:
        """Fault on command: the holding brake does not open."""
        self._stuck = stuck

    def heat(self, hot: bool) -> None:
        """Fault on command: the motor is hotter than it may be, or has cooled down."""
        self._hot, self._warm = hot, False
        self._told = self._told and hot

    def warm(self) -> None:
        """On command: the motor is nearly too hot."""
        self._warm = True

    def brake(self, step_s: float, deceleration: float) -> None:
        """One step towards standstill with `deceleration` [counts/s^2]; the demand goes with the axis."""
        speed = abs(self.velocity)
        braking_s = min(step_s, speed / deceleration)
        change = deceleration * braking_s
        left = 0.0 if speed <= deceleration * step_s else speed - change
        mean = 0.5 * (speed + left)
        self.position += (mean if self.velocity > 0.0 else -mean) * braking_s
        self.velocity = left if self.velocity > 0.0 else -left
        self.hold()

    def _track(self, step_s: float, rate: float) -> None:
        w = self._bandwidth
        settled = (rate - self._feed) / w
        y = self.demand - self.position - settled
        slope = rate - self.velocity + w * y
        decay = exp(-w * step_s)
        self.demand += rate * step_s
        next_y = (y + slope * step_s) * decay
        velocity = rate - (slope * decay - w * next_y)
        position = self.demand - settled - next_y
        self._take(position, velocity, step_s)

    def _take(self, position: float, velocity: float, step_s: float) -> None:
        top = self.top_speed
        reach = top * step_s
        moved = position - self.position
        if -top <= velocity <= top and -reach <= moved <= reach:
            self.position, self.velocity = position, velocity
            return
        self.limited = True
        self.position += min(max(moved, -reach), reach)
        self.velocity = min(max(velocity, -top), top)
