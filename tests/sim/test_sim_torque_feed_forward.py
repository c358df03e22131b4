"""The torque of each sample as a drive's feed-forward: on a motor with a heavy arm, as bytes, and when blocks stop."""

import numpy as np
import pytest

from drive_gateway.config.settings import TorqueSettings
from drive_gateway.sim.axis.full_servo import FullServo
from drive_gateway.sim.config.simulation import Level
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings
from tests.sim.heavy_arm import COUNTS, GEAR, RATED_NM, HeavyArm, torque_nm


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
    world = GatewayBench(settings(axis("J1", 1, torque=TorqueSettings(9000, 1.0, 1000.0))))
    world.bus.nodes[1].drives[0].shown._rated_mnm = 3600
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


def test_what_the_motor_gives_is_told_in_the_feedback(swung: dict[str, HeavyArm]) -> None:
    for world in swung.values():
        world.run(1.0)
        assert world.feedback is not None
        assert world.feedback.torque is not None
        carried = torque_nm(world.feedback.position, np.zeros(1))
        # Dry friction may carry up to 5 Nm of it.
        np.testing.assert_allclose(world.feedback.torque, carried, atol=6.0)
        assert abs(carried[0]) > 200.0


def test_a_robot_whose_drives_do_not_all_tell_their_torque_tells_none() -> None:
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 2, torque=TorqueSettings(9000, 1.0, 1000.0))))
    world.ready()
    assert world.feedback is not None
    assert world.feedback.torque is None
