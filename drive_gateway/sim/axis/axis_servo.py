"""What a drive needs of its axis: the surface that both levels of the simulation have."""

from typing import Protocol

MOTOR_WARM, STAGE_WARM, MEAN_CURRENT_HIGH, BUS_HIGH, BUS_LOW = (1 << bit for bit in range(5))
"""2002h: what a drive warns of."""


class AxisServo(Protocol):
    """Position [counts] and velocity [counts/s] of one axis, its command and what is wrong with it."""

    @property
    def position(self) -> float: ...
    @property
    def velocity(self) -> float: ...
    @property
    def demand(self) -> float: ...
    @property
    def error(self) -> float:
        """Following error [counts]: demand minus position."""

    @property
    def limited(self) -> bool:
        """The axis could do no more in the newest step."""

    @property
    def standing(self) -> bool: ...
    @property
    def top_speed(self) -> float:
        """[counts/s]"""

    def switch_on(self) -> None:
        """The drive's supply returns."""

    def hold(self) -> None:
        """The demand becomes the position: what was commanded before is forgotten."""

    def interpolate(self, target: float, period_s: float) -> None:
        """The demand runs from where it is to `target`, within one interpolation period."""

    def feed(self, velocity: float) -> None:
        """Velocity offset [counts/s], from now on."""

    def feed_torque(self, torque_nm: float, period_s: float) -> None:
        """Torque of the shaft that is fed forward, reached within one interpolation period."""

    @property
    def torque_nm(self) -> float:
        """Of the shaft."""

    @property
    def rated_current_a(self) -> float:
        """[A rms] of the motor; 0: not known."""

    @property
    def current_a(self) -> float:
        """[A rms] that makes the torque, with its sign."""

    @property
    def motor_c(self) -> float:
        """[degC] of its winding."""

    @property
    def has_torque(self) -> bool:
        """It knows mode cyclic torque."""

    def press(self, torque_nm: float, top_speed: float) -> None:
        """Give this torque of the shaft, turning with up to `top_speed` [rad/s], until the axis holds or brakes."""

    def follow(self, step_s: float) -> None:
        """One step of interpolation and servo loop."""

    def brake(self, step_s: float, deceleration: float) -> None:
        """One step towards standstill with `deceleration` [counts/s^2]; the demand goes with the axis."""

    def rest(self, step_s: float, deceleration: float) -> None:
        """One step with the power stage off and the brake on, which stops with `deceleration` [counts/s^2]."""

    def trips(self) -> list[int]:
        """Error codes of what was found since the last call, the worst first."""

    @property
    def warnings(self) -> int:
        """What is near its limit: bits of 2002h."""

    def persists(self, code: int) -> bool:
        """Whether the cause of an error code is still there."""

    def jump(self, counts: int) -> None:
        """Fault on command: the encoder reads wrong by so much from now on."""

    def block(self, blocked: bool) -> None:
        """Fault on command: something holds the axis with more than its motor can give."""

    def stick_brake(self, stuck: bool) -> None:
        """Fault on command: the holding brake does not open."""

    def heat(self, hot: bool) -> None:
        """Fault on command: the motor is hotter than it may be, or as cool as its surroundings."""

    def warm(self) -> None:
        """On command: the motor is nearly too hot."""
