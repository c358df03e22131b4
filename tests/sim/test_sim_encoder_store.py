"""Absolute encoders over the end of a gateway: what was stored at rest against what the drives show afterwards."""

from collections.abc import Callable

import pytest

from cell.messages import AcceptPosition, AxisStatus, Claim, DisableDrives, EnableDrives, Home
from drive_gateway.config.settings import EncoderSettings
from tests.sim.gateway_bench import GatewayBench, axis, homing, settings

TURN = 10_000
ENCODER = EncoderSettings(
    counts_per_turn=TURN, window=TURN // 16, serial=(0x2010, 1), status=(0x2010, 2), battery_mask=1
)
AXES = settings(
    axis("J1", 1, absolute=ENCODER, homing=homing(35, 0.5), brake_s=0.3),
    axis("J2", 2, absolute=ENCODER, counts_per_unit=-80_000.0),
)


def stored() -> GatewayBench:
    """A robot that was enabled, switched off, and whose gateway has ended."""
    world = GatewayBench(AXES)
    world.ready()
    owner = world.enabled()
    assert world.ask(DisableDrives("left", owner)).ok
    world.until(lambda: {name for name, each in world.stored.items() if not each.in_use} == {"left.J1", "left.J2"})
    world.alive = False
    world.run(1.0)
    return world


def enabling(world: GatewayBench) -> str:
    """Empty when the robot can be enabled, else why not."""
    owner = world.ask(Claim("left", "again", "d")).claim.owner
    reply = world.ask(EnableDrives("left", owner))
    return "" if reply.ok else reply.text


def restarted(world: GatewayBench) -> GatewayBench:
    world.restart_gateway()
    world.ready()
    return world


def test_a_record_holds_turns_place_in_the_turn_serial_and_calibration() -> None:
    record = stored().stored["left.J1"]
    assert (record.turns, record.position, record.serial) == (2, 5_000, 1)
    assert len(record.calibration) == 8


def test_an_axis_is_compared_when_it_stands() -> None:
    world = stored()
    servo = world.bus.nodes[1].drives[0].servo
    servo.rest = lambda step_s, _brake: servo.jump(round(500 * step_s))
    world.restart_gateway()
    world.run(0.8)
    assert set(world.feedback.axes) == {AxisStatus.SWITCH_ON_DISABLED}
    assert not world.state.ready
    assert "not referenced: J1, J2: not checked yet" in enabling(world)
    del servo.rest
    world.until(lambda: world.state.ready, within_s=0.5)
    assert enabling(world) == ""


def test_nothing_is_stored_while_the_robot_has_torque_or_before_its_brakes_hold() -> None:
    world = GatewayBench(AXES)
    world.until(lambda: world.state is not None and world.state.ready)
    owner = world.enabled()
    world.run(0.1)
    assert not world.stored
    assert world.ask(DisableDrives("left", owner)).ok
    world.run(0.2)
    assert not world.stored
    world.until(lambda: set(world.stored) == {"left.J1", "left.J2"})


def test_an_axis_that_is_where_it_was_is_referenced() -> None:
    assert enabling(restarted(stored())) == ""


def test_a_small_deviation_is_accepted() -> None:
    world = stored()
    world.bus.nodes[1].servo.jump(TURN // 20)
    assert enabling(restarted(world)) == ""


def test_a_larger_deviation_needs_an_operators_word() -> None:
    world = stored()
    world.bus.nodes[2].servo.jump(TURN // 4)
    restarted(world)
    assert not world.feedback.referenced
    assert "J2: it stands -1.79 deg beside where it was switched off; look where it is, then: cell accept" in (
        enabling(world)
    )
    assert world.ask(AcceptPosition("left", ())).ok
    assert world.feedback.referenced
    assert enabling(world) == ""


def turns_lost(world: GatewayBench) -> None:
    world.bus.nodes[1].servo.jump(-3 * TURN + 100)


def encoder_exchanged(world: GatewayBench) -> None:
    world.bus.nodes[1].exchange_encoder(77)


def battery_empty(world: GatewayBench) -> None:
    world.bus.nodes[1].empty_battery()


@pytest.mark.parametrize(
    ("happened", "found"),
    [
        (turns_lost, "jumped by -3 whole turns of the motor"),
        (encoder_exchanged, "has serial number 77, it was 1"),
        (battery_empty, "the battery of its encoder was empty"),
    ],
)
def test_what_an_encoder_cannot_know_needs_a_reference_run(
    happened: Callable[[GatewayBench], None], found: str
) -> None:
    world = stored()
    happened(world)
    restarted(world)
    assert not world.feedback.referenced
    assert found in enabling(world)
    refused = world.ask(AcceptPosition("left", ("J1",)))
    assert not refused.ok
    assert "home it" in refused.text
    assert world.set_up(Home("left", ("J1",))) == "done"
    assert world.feedback.referenced
    assert enabling(world) == ""


def test_of_a_gateway_that_ended_while_there_was_torque_an_operators_word_is_enough() -> None:
    world = restarted(stored())
    assert enabling(world) == ""
    world.until(lambda: all(each.in_use for each in world.stored.values()))
    world.alive = False
    world.run(1.0)
    turns_lost(world)
    restarted(world)
    assert world.state is not None
    assert "it had torque when it was last heard" in world.state.nodes[0].reference_missing
    assert world.ask(AcceptPosition("left", ())).ok
    assert world.feedback.referenced


def test_another_meaning_of_the_counts_needs_an_operators_word() -> None:
    world = stored()
    world.settings = settings(axis("J1", 1, absolute=ENCODER, offset=0.3), AXES.robots["left"].axes[1])
    assert "gear, direction or offset in the drives file are others" in enabling(restarted(world))


def test_a_node_that_was_lost_in_motion_may_have_braked_and_no_more() -> None:
    for jump, known in ((0, True), (6 * TURN + TURN // 3, False)):
        world = restarted(stored())
        world.bus.nodes[1].silence()
        world.run(1.0)
        world.bus.nodes[1].servo.jump(jump)
        world.bus.nodes[1].silence(False)
        world.ready()
        assert world.feedback.referenced is known


@pytest.mark.parametrize(
    ("torque", "said"),
    [(True, "it had torque when it was last heard"), (False, "jumped by 6 whole turns of the motor")],
)
def test_turns_that_are_missing_after_a_silence_were_lost_only_where_there_was_no_torque(
    torque: bool, said: str
) -> None:
    world = restarted(stored())
    if torque:
        assert enabling(world) == ""
    node = world.bus.nodes[1]
    node.silence()
    world.run(1.0)
    node.servo.jump(6 * TURN)
    node.silence(False)
    world.ready()
    assert world.state is not None
    assert said in world.state.nodes[0].reference_missing
