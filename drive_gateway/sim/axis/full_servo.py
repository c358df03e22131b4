"""The full level of an axis: the same surface as the fast one (`Servo`), with a motor, a loop and limits behind it.

The fast level's axis is the command here: it interpolates from SYNC to SYNC, smooths with its lag and makes the braking
ramps. Its position, velocity and acceleration are what the cascade follows; where a master feeds torque forward, that
torque takes the place of what its own inertia asks for, but not while the drive brakes by itself.
"""

from collections.abc import Callable

from drive_gateway.sim.axis.axis_data import BRAKE_OVERLAP_S, AxisData
from drive_gateway.sim.axis.cascade import Cascade
from drive_gateway.sim.axis.dc_bus import DcBus
from drive_gateway.sim.axis.fed_torque import FedTorque
from drive_gateway.sim.axis.gains import STEP_S
from drive_gateway.sim.axis.machine import Machine
from drive_gateway.sim.axis.protection import AMBIENT_C, WARM_K, Protection, Seen
from drive_gateway.sim.axis.servo import Servo

_STILL_RAD_S = 0.5
"""The shaft stands when it turns slower than this."""
_TOO_FAST = 1.25
"""Over the set speed's limit, where overspeed is a fault."""
_IMPLAUSIBLE = 3.0
"""An encoder that moves this much faster than overspeed within one step has jumped."""


class FullServo:
    """Position [counts] and velocity [counts/s] as the encoder shows them. `top_speed` [counts/s] bounds the command.

    Args:
        data: the axis.
        counts: where it stands; an absolute encoder reads this.
        lag_s: lag of the command behind the set points.
        bus: DC bus, shared with the other axes of the cabinet.
    """

    def __init__(self, data: AxisData, counts: float, lag_s: float, bus: DcBus) -> None:
        self._per_rad = data.counts_per_rad
        self.machine = Machine(data, counts / self._per_rad)
        self.cascade = Cascade(data.motor, data.gains, _TOO_FAST * data.top_speed)
        self.protection = Protection(data.motor, (bus.data.low_v, bus.data.high_v), _TOO_FAST * data.top_speed)
        self._bus = bus
        self._inertia = data.inertia
        self._rated_current_a = data.motor.rated_current_a
        self._hot_c = data.motor.hot_c + 1.0
        self.top_speed = data.top_speed * self._per_rad
        self._counts = 0
        self._command = Servo(0.0, lag_s, self.top_speed)
        self._fed = FedTorque()
        self._pressed: tuple[float, float] | None = None
        """Torque [Nm] and top speed [rad/s] of the shaft in mode cyclic torque."""
        self._implausible = _IMPLAUSIBLE * _TOO_FAST * self.top_speed * STEP_S
        self._time = self._due = 0.0
        self._since_switched_s = 0.0
        self._powered = self._dead = self._braking = self._jumped = False
        self._peak = self._sum = self._mean_speed = 0.0
        self._peak_allowed = data.motor.peak_current**2
        self._voltage = 0j
        self._new: list[int] = []
        self.switch_on()

    @property
    def position(self) -> float:
        return float(self._counts)

    @property
    def velocity(self) -> float:
        """Mean of the newest interval: the loop's own value is too noisy to be shown."""
        return 0.0 if self.standing else self._mean_speed

    @property
    def demand(self) -> float:
        return self._command.demand

    @property
    def error(self) -> float:
        """Following error [counts]: demand minus position."""
        return self._command.demand - self._counts

    @property
    def limited(self) -> bool:
        """The motor's speed, current or voltage held the axis back in the newest step."""
        return self._powered and (self._command.limited or self.cascade.limited)

    @property
    def standing(self) -> bool:
        """The command stands, and so does the shaft."""
        return self._command.velocity == 0.0 and abs(self.cascade.speed) < _STILL_RAD_S

    def trips(self) -> list[int]:
        """Error codes of what was found since the last call, the worst first."""
        found, self._new = self._new, []
        return found

    @property
    def warnings(self) -> int:
        """What is near its limit: bits of 2002h."""
        return self.protection.warnings

    def persists(self, code: int) -> bool:
        """Whether the cause of an error code is still there."""
        return self.protection.present(code)

    def switch_on(self) -> None:
        """The drive's supply returns: the encoder wraps its turns."""
        angle = self.machine.mechanics.angle
        self.machine.encoder.switch_on(angle)
        self._counts = self.machine.encoder.read(angle)
        self._reset_loop()
        self._open()
        self.hold()

    @property
    def torque_nm(self) -> float:
        """What the motor gives now."""
        return self.machine.torque

    @property
    def rated_current_a(self) -> float:
        """[A rms] of the motor."""
        return self._rated_current_a

    @property
    def current_a(self) -> float:
        """[A rms] across the magnets' field."""
        return self.machine.current_a

    @property
    def motor_c(self) -> float:
        """[degC] of its winding."""
        return self.protection.motor_c

    @property
    def has_torque(self) -> bool:
        """It knows mode cyclic torque."""
        return True

    def press(self, torque_nm: float, top_speed: float) -> None:
        """Give this torque of the shaft, turning with up to `top_speed` [rad/s], until the axis holds or brakes."""
        self._pressed = torque_nm, top_speed

    def hold(self) -> None:
        """The demand becomes the position: what was commanded before is forgotten."""
        self._pressed = None
        self._stand()

    def _stand(self) -> None:
        self._command.position = float(self._counts)
        self._command.velocity = 0.0
        self._command.hold()

    def interpolate(self, target: float, period_s: float) -> None:
        """The demand runs from where it is to `target`, within one interpolation period."""
        self._command.interpolate(target, period_s)

    def feed(self, velocity: float) -> None:
        """Velocity offset [counts/s], from now on."""
        self._command.feed(velocity)

    def feed_torque(self, torque_nm: float, period_s: float) -> None:
        """Torque of the shaft that is fed forward, reached within one interpolation period."""
        self._fed.toward(torque_nm, period_s)

    def follow(self, step_s: float) -> None:
        """Let the loop follow the set points; the stage is switched on first, the brake opens a little later."""
        self._braking = False
        self._run(step_s, self._follow)

    def brake(self, step_s: float, deceleration: float) -> None:
        """Brake by the motor with `deceleration` [counts/s^2] and stand; by the holding brake if the bridge is open."""
        command, self._pressed = self._command, None
        if not self._braking:
            self._braking = True
            command.position, command.velocity = float(self._counts), self.cascade.speed * self._per_rad
        self._run(step_s, lambda step: command.brake(step, deceleration))

    def rest(self, step_s: float, _deceleration: float) -> None:
        """The stage is to be off: at standstill the brake closes first and the motor holds until it has.

        How hard the brake stops a moving axis follows from its torque.
        """
        self._braking, self._pressed = False, None
        self._run(step_s, None)

    # Faults on command

    def jump(self, counts: int) -> None:
        """The encoder reads wrong by so much from now on."""
        self.machine.encoder.jump(counts)

    def block(self, blocked: bool) -> None:
        """Something holds the axis with more than its motor can give."""
        self.machine.overloaded = blocked

    def stick_brake(self, stuck: bool) -> None:
        """The holding brake does not open."""
        self.machine.brake_stuck = stuck

    def heat(self, hot: bool) -> None:
        """The motor is a little hotter than it may be, and cools down by itself; or is as cool as its surroundings."""
        self.protection.motor_c = self._hot_c if hot else AMBIENT_C

    def warm(self) -> None:
        """On command: the motor is nearly too hot, and cools down by itself."""
        self.protection.motor_c = self._hot_c - 0.5 * WARM_K

    # Steps of the loop

    def _follow(self, step_s: float) -> None:
        if self.machine.brake_closed or self._pressed is not None:
            self._stand()
        else:
            self._command.follow(step_s)

    def _run(self, step_s: float, command: Callable[[float], None] | None) -> None:
        steps = int((self._due + step_s) / STEP_S + 1e-6)
        self._due += step_s - steps * STEP_S
        if steps == 0:
            return
        self._peak = self._sum = 0.0
        dc_v, before = self._bus.voltage, self._counts
        self._switch(command is not None, steps * STEP_S)
        self.machine.begin(self._time)
        for _ in range(steps):
            self._observe()
            if self._powered:
                self._drive(command, dc_v)
            else:
                self.machine.coast()
                if self.machine.resting and self.standing:
                    break  # and so it stays for the rest of the interval
        self._mean_speed = (self._counts - before) / (steps * STEP_S)
        if not self._powered:
            self.hold()
        self._account(steps, dc_v)

    def _switch(self, on: bool, step_s: float) -> None:
        """Power stage and brake: together for the overlap, whichever of them is to go on alone."""
        self._since_switched_s += step_s
        if on and not self._powered and not self._dead:
            self._powered = True
            self._since_switched_s = 0.0
            self._voltage = 0j
            self._reset_loop()
            self.hold()
        elif not on and self._powered and not self.machine.brake_closed:
            self._since_switched_s = 0.0
            self.machine.brake_closed = True
        over = self._since_switched_s >= BRAKE_OVERLAP_S
        if on and self._powered:
            self.machine.brake_closed = self.machine.brake_closed and not over
        elif self._powered and (over or not self.standing):
            self._open()

    def _reset_loop(self) -> None:
        self.cascade.reset(self._counts / self._per_rad, self.machine.mechanics.angle)

    def _open(self) -> None:
        """Bridge off, brake closed."""
        self._powered = False
        self._fed.reset()
        self.machine.brake_closed = True

    def _observe(self) -> None:
        counts = self.machine.encoder.read(self.machine.mechanics.angle)
        if abs(counts - self._counts) > self._implausible:
            self._jumped = True
            self._open()
            self._counts = counts
            self._reset_loop()
        self._counts = counts
        self.cascade.observe(counts / self._per_rad)

    def _drive(self, command: Callable[[float], None] | None, dc_v: float) -> None:
        reference, before = self._command, self._command.velocity
        if command is not None:
            command(STEP_S)
        torque = self._fed.step(STEP_S)
        if self._braking or not self._fed.given:
            torque += self._inertia * (reference.velocity - before) / (STEP_S * self._per_rad)
        measured = self.machine.winding.current
        self.machine.drive(self._voltage, dc_v)
        if self._pressed is not None:
            self._voltage = self.cascade.give(*self._pressed, measured, dc_v)
        else:
            self._voltage = self.cascade.step(
                reference.position / self._per_rad, reference.velocity / self._per_rad, torque, measured, dc_v
            )
        square = measured.real * measured.real + measured.imag * measured.imag
        self._sum += square
        if square > self._peak:
            self._peak = square
            if square > self._peak_allowed:
                self._open()

    def _account(self, steps: int, dc_v: float) -> None:
        """Energy, heat and limits of one interval."""
        seconds = steps * STEP_S
        self._time += seconds
        self._bus.take(self.machine.taken(), self._time)
        speed = self.cascade.speed
        stuck = self._powered and self.cascade.limited and abs(speed) < _STILL_RAD_S
        bad = self.machine.encoder.failed or self._jumped
        seen = Seen(seconds, self._sum / steps, self._peak, dc_v, speed, stuck, bad, self._powered)
        found = self.protection.update(seen)
        self.machine.warm(self.protection.motor_c)
        self._jumped = False
        self._new += found
        self._dead = self.protection.opens_bridge
        if self._dead:
            self._open()
