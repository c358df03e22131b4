"""One axis with a heavy arm on a motor of the full level, and what its agent would send."""

from math import pi
from struct import Struct

import numpy as np

from cell.messages import Claim, EnableDrives, SetpointBlock
from drive_gateway.config.settings import TorqueSettings
from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.encoder import EncoderData
from drive_gateway.sim.axis.gains import ServoData
from drive_gateway.sim.axis.load import GRAVITY_M_S2, pendulum
from drive_gateway.sim.axis.mechanics import LoadData
from drive_gateway.sim.axis.motor_data import MOTORS
from drive_gateway.sim.config.simulation import Level, Simulation
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings

GEAR, RATED_NM = 100.0, 9.0
COUNTS = 131072 * GEAR / (2 * pi)
MASS_KG, LENGTH_M, INERTIA = 55.0, 0.5, 20.0
MOTOR = MOTORS["joint-large"]
SOFT = ServoData(speed_hz=10.0, reset_s=0.1, position_per_s=5.0)
OFFSETS = Struct("<ih")


def torque_nm(q: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Of an arm that stands upright at zero, rotor included."""
    inertia = INERTIA + MOTOR.inertia_kg_m2 * GEAR**2
    return inertia * acceleration - MASS_KG * GRAVITY_M_S2 * LENGTH_M * np.sin(q)


class HeavyArm(GatewayBench):
    """One axis with a soft servo loop, and what its agent would send."""

    def __init__(self, feed_forward: str, level: Level = Level.FULL, direction: int = 1) -> None:
        arm = axis(
            "J1", 1, counts_per_unit=direction * COUNTS, offset=0.0,
            brake_s=0.12, velocity_offset=feed_forward != "none", torque_offset=feed_forward == "torque",
            torque=TorqueSettings(
                round(1000 * RATED_NM), 1000 * direction / (GEAR * RATED_NM), GEAR * 30 / pi
            ),
        )  # fmt: skip
        data = AxisData(
            motor=MOTOR, gear=GEAR, direction=direction, offset=0.0, load=LoadData(INERTIA, 5.0, 5.0),
            torque=pendulum(MASS_KG, LENGTH_M, pi), encoder=EncoderData(131072), servo=SOFT,
            top_speed=2.4 * GEAR, seed=1,
        )  # fmt: skip
        place = ("left", "J1")
        super().__init__(settings(arm), Simulation(lag_s=0.004, starts={place: 0.3}, level=level, axes={place: data}))
        self.ready()
        claim = self.ask(Claim("left", "agent", "d")).claim
        assert claim is not None
        self.asked_for_torques, self.owner = claim.torques, claim.owner
        self.sequence = 0
        self.errors: list[float] = []
        self.stand()

    def cycle(self, late_s: float = 0.0) -> None:
        super().cycle(late_s)
        if hasattr(self, "errors"):
            self.errors.append(self.bus.nodes[1].drives[0].servo.error / COUNTS)

    def send(self, position: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> None:
        self.sequence += 1
        assert self.feedback is not None
        block = SetpointBlock(
            "left", self.owner, self.sequence, 0, self.feedback.tick + 5, CYCLE_S, len(position),
            position[:, None], velocity[:, None], torque_nm(position, acceleration)[:, None],
        )  # fmt: skip
        self.tell(block)

    def stand(self) -> None:
        """A sign of life: where the arm is, and what carries it there."""
        assert self.feedback is not None
        self.send(np.repeat(self.feedback.commanded, 3), np.zeros(3), np.zeros(3))
        self.run(3 * CYCLE_S)

    def switch_on(self) -> None:
        """Until the brake has opened."""
        reply = self.ask(EnableDrives("left", self.owner))
        assert reply.ok, reply.text
        self.run(0.25)

    def swing(self, way: float = 1.2, seconds: float = 1.2) -> np.ndarray:
        """A quintic from rest to rest, played out; answers the positions."""
        t = np.append(np.arange(0.0, seconds + CYCLE_S / 2, CYCLE_S) / seconds, [1.0, 1.0])
        assert self.feedback is not None
        q = self.feedback.commanded[0] + way * (10 * t**3 - 15 * t**4 + 6 * t**5)
        speed = way * (30 * t**2 - 60 * t**3 + 30 * t**4) / seconds
        self.send(q, speed, way * (60 * t - 180 * t**2 + 120 * t**3) / seconds**2)
        self.run(seconds + 0.1)
        return q

    def offsets(self) -> list[tuple[int, int]]:
        return [OFFSETS.unpack(frame.data) for frame in self.frames if frame.id == 0x301]  # type: ignore[misc]
