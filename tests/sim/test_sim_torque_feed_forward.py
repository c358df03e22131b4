"""The torque of each sample as a drive's feed-forward: on a motor with a heavy arm, as bytes, and when blocks stop."""

from dataclasses import replace
from math import pi
from struct import Struct

import numpy as np
import pytest

from cell.messages import Claim, EnableDrives, SetpointBlock
from drive_gateway.config.settings import TorqueSettings
from drive_gateway.config.simulation import Level, Simulation
from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.dc_bus import DcBusData
from drive_gateway.sim.axis.encoder import EncoderData
from drive_gateway.sim.axis.full_servo import FullServo
from drive_gateway.sim.axis.gains import ServoData
from drive_gateway.sim.axis.load import GRAVITY_M_S2, pendulum
from drive_gateway.sim.axis.mechanics import LoadData
from drive_gateway.sim.axis.motor_data import MOTORS
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
            "J1", 1, counts_per_unit=direction * COUNTS, offset=0.0, simulated_start=0.3,
            velocity_offset=feed_forward != "none", torque_offset=feed_forward == "torque",
            torque=TorqueSettings(round(1000 * RATED_NM), 1000 * direction / (GEAR * RATED_NM)),
        )  # fmt: skip
        data = AxisData(
            motor=MOTOR, gear=GEAR, direction=direction, offset=0.0, load=LoadData(INERTIA, 5.0, 5.0),
            torque=pendulum(MASS_KG, LENGTH_M, pi), encoder=EncoderData(131072), servo=SOFT,
            top_speed=2.4 * GEAR, seed=1,
        )  # fmt: skip
        simulation = Simulation(level=level, wire_time=False, dc_bus=DcBusData(), axes={("left", "J1"): data})
        super().__init__(replace(settings(arm), simulated_lag_s=0.004, simulation=simulation))
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


@pytest.fixture(scope="module")
def swung() -> dict[str, HeavyArm]:
    worlds = {kind: HeavyArm(kind) for kind in ("velocity", "torque")}
    for world in worlds.values():
        world.switch_on()
        world.swing()
    return worlds


def largest(world: HeavyArm) -> float:
    return max(map(abs, world.errors))


def test_the_following_error_of_a_heavy_arm_gets_smaller_by_more_than_ten_times(swung: dict[str, HeavyArm]) -> None:
    # Measured: 2.4 mrad with the velocity alone, 0.12 mrad with the torque beside it.
    assert largest(swung["velocity"]) > 2e-3
    assert largest(swung["torque"]) < 0.1 * largest(swung["velocity"])


def test_without_blocks_the_velocity_offset_is_zero_and_the_torque_carries_the_arm_where_it_is(
    swung: dict[str, HeavyArm],
) -> None:
    world = swung["torque"]
    assert world.feedback is not None
    assert world.feedback.state.name == "STARVED"
    carried = float(torque_nm(world.feedback.commanded, np.zeros(1))[0])
    assert world.offsets()[-1] == (0, round(1000 * carried / (GEAR * RATED_NM)))
    assert abs(world.offsets()[-1][1]) > 200


def test_an_arm_that_is_switched_on_does_not_sag_when_its_brake_opens() -> None:
    sagged = {}
    for kind in ("velocity", "torque"):
        world = HeavyArm(kind)
        world.errors.clear()
        world.switch_on()
        sagged[kind] = largest(world)
    assert sagged["velocity"] > 1e-3
    assert sagged["torque"] < 0.02 * sagged["velocity"]


def test_the_torque_goes_with_its_sample_in_per_mille_through_gear_and_direction() -> None:
    world = HeavyArm("torque", level=Level.FAST, direction=-1)
    assert world.asked_for_torques
    world.switch_on()
    world.frames.clear()
    q = world.swing(0.4, 0.8)
    velocities, torques = np.array(world.offsets()).T
    fastest = int(np.abs(velocities).argmax())
    # There the arm neither gains nor loses speed, half-way between both ends.
    expected = -1000 * torque_nm(np.array([q[[0, -1]].mean()]), np.zeros(1)) / (GEAR * RATED_NM)
    assert velocities[fastest] == pytest.approx(-0.4 * 1.875 / 0.8 * COUNTS, rel=1e-3)
    assert torques[fastest] == pytest.approx(expected[0], abs=1)


def test_a_gateway_without_torque_feed_forward_asks_for_none_and_sends_none() -> None:
    world = HeavyArm("velocity", level=Level.FAST)
    assert not world.asked_for_torques
    world.switch_on()
    assert {len(frame.data) for frame in world.frames if frame.id == 0x301} == {4}


def test_a_drive_with_a_motor_of_another_rated_torque_is_not_configured() -> None:
    world = GatewayBench(settings(axis("J1", 1, torque=TorqueSettings(9000, 1.0))))
    world.bus.nodes[1].drives[0]._shown._rated_mnm = 3600
    world.until(lambda: world.state is not None and "another drive" in world.state.problem)
    assert world.state is not None
    assert "rated torque of the motor in mNm (6076h:00) is 3600, the drives file says 9000" in world.state.problem


def test_a_drive_that_brakes_by_itself_keeps_carrying_its_arm() -> None:
    """The quick stop's own acceleration comes on top of what is fed forward."""
    world = HeavyArm("torque")
    world.switch_on()
    servo = world.bus.nodes[1].drives[0].servo
    assert isinstance(servo, FullServo)
    before = servo.position
    for _ in range(50):
        servo.brake(CYCLE_S, 10.0 * COUNTS)
    assert abs(servo.position - before) / COUNTS < 1e-4
