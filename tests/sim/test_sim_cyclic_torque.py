"""Mode cyclic torque as a set-up motion: an axis presses against what holds it, and is stopped where nothing does."""

from struct import Struct

import numpy as np
import pytest

from cell.messages import AxisStatus, PressAxis
from drive_gateway.config.settings import TorqueSettings
from drive_gateway.sim.config.simulation import Level
from tests.sim.gateway_bench import GatewayBench, axis, homing, settings
from tests.sim.heavy_arm import COUNTS, GEAR, RATED_NM, HeavyArm, torque_nm

COMMAND = Struct("<Hih")
PER_NM = 1000 / (GEAR * RATED_NM)
WITHIN = np.radians(1.0)


def place(world: HeavyArm) -> float:
    """Where the arm really is [rad]."""
    return world.bus.nodes[1].drives[0].position / COUNTS


def pressed(world: HeavyArm, torque: float, seconds: float = 0.3, within: float = WITHIN) -> str:
    world.frames.clear()
    return world.set_up(PressAxis("left", "J1", torque, seconds, within))


def torques(world: HeavyArm) -> np.ndarray:
    """[per mille] of all commands."""
    return np.array([COMMAND.unpack(frame.data)[2] for frame in world.frames if frame.id == 0x201])


def test_an_axis_whose_brake_stays_closed_presses_against_it_and_ends_without_torque() -> None:
    world = HeavyArm("torque")
    before = place(world)
    world.bus.nodes[1].drives[0].servo.stick_brake(True)
    assert pressed(world, 250.0) == "done"
    assert abs(place(world) - before) < 1e-3
    carrying = float(torque_nm(np.array([before]), np.zeros(1))[0])
    # Before and after it the mode is another one, and the target torque zero.
    told = torques(world)
    told = told[told != 0]
    assert told.max() == pytest.approx((250.0 + carrying) * PER_NM, abs=2)
    # The rated torque in half a second: 8 per mille in a cycle, up and down.
    assert np.abs(np.diff(told)).max() <= 9
    assert told[-1] == pytest.approx(carrying * PER_NM, abs=2)
    assert world.feedback is not None
    assert world.feedback.axes == (AxisStatus.SWITCH_ON_DISABLED,)


def test_the_motor_really_gives_the_torque() -> None:
    world = HeavyArm("torque")
    servo = world.bus.nodes[1].drives[0].servo
    servo.stick_brake(True)
    given: list[float] = []
    cycle = world.cycle

    def watched(late_s: float = 0.0) -> None:
        cycle(late_s)
        given.append(servo.machine.torque)  # type: ignore[attr-defined]

    world.cycle = watched  # type: ignore[method-assign]
    assert pressed(world, 250.0) == "done"
    carrying = float(torque_nm(np.array([place(world)]), np.zeros(1))[0])
    assert max(given) == pytest.approx((250.0 + carrying) / GEAR, rel=0.02)


def test_an_arm_that_nothing_holds_gives_way_is_stopped_and_named() -> None:
    world = HeavyArm("torque")
    before = place(world)
    assert pressed(world, 120.0) == "stopped"
    assert world.said[0] == "stopped: node 1 (left J1) gave way: it moved farther than the 1 deg it may"
    assert WITHIN < abs(place(world) - before) < 2.0 * WITHIN
    assert world.feedback is not None
    assert world.feedback.axes == (AxisStatus.SWITCH_ON_DISABLED,)


def test_below_its_friction_the_arm_is_carried_and_does_not_move() -> None:
    world = HeavyArm("torque")
    before = place(world)
    assert pressed(world, 2.0) == "done"
    assert abs(place(world) - before) < 1e-3


def test_the_motor_does_not_turn_faster_than_the_drive_is_told() -> None:
    world = HeavyArm("torque")
    fastest = 0.0
    assert world.ask(PressAxis("left", "J1", 850.0, 5.0, 0.2)).ok
    world.holder, world.said = "left", ("", "moving")
    while world.said[1] == "moving":
        world.cycle()
        fastest = max(fastest, abs(world.bus.nodes[1].drives[0].servo.velocity) / COUNTS)
    # A quarter of the axis' speed, which is 2 rad/s.
    assert fastest < 0.25 * 2.0 * 1.1


def test_the_operator_sees_what_the_axis_gives() -> None:
    world = HeavyArm("torque")
    world.bus.nodes[1].drives[0].servo.stick_brake(True)
    assert world.ask(PressAxis("left", "J1", 250.0, 1.0, WITHIN)).ok
    world.holder = "left"
    world.until(lambda: world.said[0] == "J1 gives 170 Nm")


def test_afterwards_mode_and_speed_are_those_of_blocks_again() -> None:
    world = HeavyArm("torque")
    world.bus.nodes[1].drives[0].servo.stick_brake(True)
    assert pressed(world, 50.0, 0.1) == "done"
    numbers = world.bus.nodes[1]._objects.numbers
    assert numbers[0x606100] == 8
    assert numbers[0x608000] == round(1.2 * 2.0 * GEAR * 30 / np.pi)
    assert not world.core._robots["left"].group.setup.busy


def test_who_lets_go_stops_it() -> None:
    world = HeavyArm("torque")
    world.bus.nodes[1].drives[0].servo.stick_brake(True)
    assert world.ask(PressAxis("left", "J1", 100.0, 20.0, WITHIN)).ok
    world.holder = "left"
    world.until(lambda: world.feedback.axes == (AxisStatus.OPERATION_ENABLED,), within_s=3.0)
    world.holder = ""
    world.until(lambda: world.feedback.axes == (AxisStatus.QUICK_STOP_ACTIVE,), within_s=1.0)
    world.until(lambda: "setup_stopped" in world.codes(), within_s=0.3)
    assert "the operator let go" in world.events[-1].text


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (("J2", 10.0, 1.0, 0.01), "left has no axis J2; its axes are J1"),
        (("J1", 0.0, 1.0, 0.01), "J1 with 0 Nm; allowed is up to 900, its motor's rated torque, not 0"),
        (("J1", -901.0, 1.0, 0.01), "J1 with -901 Nm; allowed is up to 900, its motor's rated torque, not 0"),
        (("J1", 10.0, 0.0, 0.01), "J1 for 0 s within 0.573 deg; allowed are above 0, up to 60 s and 11.46 deg"),
        (("J1", 10.0, 61.0, 0.01), "J1 for 61 s within 0.573 deg; allowed are above 0, up to 60 s and 11.46 deg"),
        (("J1", 10.0, 1.0, 0.3), "J1 for 1 s within 17.19 deg; allowed are above 0, up to 60 s and 11.46 deg"),
    ],
)
def test_what_cannot_be_is_refused_with_what_is_allowed(call: tuple[str, float, float, float], text: str) -> None:
    reply = HeavyArm("torque", level=Level.FAST).ask(PressAxis("left", *call))
    assert (reply.ok, reply.text) == (False, text)


def test_an_axis_without_a_rated_torque_takes_no_torque() -> None:
    world = GatewayBench(settings(axis("J1", 1)))
    world.ready()
    reply = world.ask(PressAxis("left", "J1", 1.0, 1.0, 0.01))
    assert reply.text == "node 1 (left J1) has no rated_torque_nm in the drives file, and so takes no torque"


def test_a_robot_that_is_not_referenced_must_home_first() -> None:
    rated = TorqueSettings(9000, 1.0, 1000.0)
    world = GatewayBench(settings(axis("J1", 1, torque=rated), axis("J2", 2, incremental=True, homing=homing(17, 0.1))))
    world.ready()
    assert "J2 of left not referenced; home first" in world.ask(PressAxis("left", "J1", 1.0, 1.0, 0.01)).text


@pytest.mark.parametrize("per_mille", [1.0, -1.0])
def test_an_axis_at_its_limit_switch_presses_away_from_it_only(per_mille: float) -> None:
    """The axis stands at its upper end; with a reversed motor that is the negative switch."""
    rated = TorqueSettings(9000, per_mille, 1000.0)
    counts = per_mille * 100_000.0
    world = GatewayBench(settings(axis("J1", 1, torque=rated, counts_per_unit=counts, limit_switches=(0.1, 0.5))))
    world.ready()
    side = "positive" if per_mille > 0 else "negative"
    refused = world.ask(PressAxis("left", "J1", 1.0, 1.0, 0.01)).text
    assert refused.startswith(f"node 1 (left J1) is at its {side} limit switch")
    assert world.ask(PressAxis("left", "J1", -1.0, 1.0, 0.01)).ok


def test_a_drive_without_torque_refuses_the_mode_and_is_named() -> None:
    world = HeavyArm("torque", level=Level.FAST)
    assert pressed(world, 10.0) == "stopped"
    assert world.said[0].startswith("stopped: node 1 (left J1) refused 6060h:00")
