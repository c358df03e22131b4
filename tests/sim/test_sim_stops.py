"""Stops of drives that do not stop: named, never at rest, and ended by the last means that software has."""

import pytest

from cell.messages import (
    AxisStatus,
    Claim,
    Command,
    DisableDrives,
    EnableDrives,
    Estop,
    Event,
    Home,
    MoveAxes,
    Release,
    ResetDrives,
)
from cell.messages.drives import PlayoutState
from cell.messages.event import Severity
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.event_log import TELL_S
from drive_gateway.sim.axis.servo import Servo
from drive_gateway.sim.drives.power_state import DriveState
from drive_gateway.sim.drives.shown import Shown
from tests.sim.gateway_bench import TIMES, GatewayBench, axis, homing, settings
from tests.sim.long_move import LAYOUTS, moving, places

HOLD_S = 0.5
NMT_STOP = CanFrame(0x000, b"\x02\x01")
STOP_S = 0.1 + 0.02 + 2.0 * 1.2 * 2.0 / 40.0
"""Rest is measured for 0.1 s, a cycle may be 0.02 s late, and twice from 1.2 times the axis' speed to rest."""
SILENT_S = 0.2 + STOP_S
"""A silent drive must miss its gateway before."""

VELOCITY = MoveAxes("left", {"J1": -0.9}, True, 1.0, True)
POSITION = MoveAxes("left", {"J1": -0.9}, True, 1.0, False)
HOMING = Home("left", ("J1",))


def set_up(command: Command) -> GatewayBench:
    """J1 is on its way, and an operator holds it."""
    world = GatewayBench(settings(axis("J1", 1, incremental=True, homing=homing(17, 0.1)), axis("J2", 2)))
    world.ready()
    assert world.ask(command).ok
    world.holder = "left"
    world.until(lambda: abs(world.feedback.velocity[0]) > 0.35)
    return world


def controlwords(world: GatewayBench, since: int) -> list[int]:
    """What node 1 was told from frame number `since` on."""
    return [int.from_bytes(frame.data[:2], "little") for frame in world.frames[since:] if frame.id == 0x201]


def alarms(world: GatewayBench) -> list[Event]:
    return [event for event in world.events if event.code == "does_not_stop"]


def faulty(*codes: int) -> tuple[GatewayBench, int]:
    """J1 has reported these errors in motion, one a cycle; everything stands, and is claimed anew."""
    world = moving()
    world.run(0.6)
    for code in codes:
        world.bus.nodes[1].raise_emergency(code)
        world.run(world.settings.cycle_s)
    world.until(lambda: world.feedback.state is PlayoutState.FAULT)
    world.run(0.3)
    return world, world.ask(Claim("left", "b", "d")).claim.owner


def runaway(world: GatewayBench, node: int = 1, number: int = 1) -> Servo:
    """From now on nothing brakes this axis, neither its motor nor its brake."""
    servo = world.bus.nodes[node].drives[number - 1].servo
    assert isinstance(servo, Servo)
    velocity = servo.velocity

    def brake(step_s: float, _deceleration: float) -> None:
        servo.position += velocity * step_s
        servo.velocity = velocity
        servo.hold()

    servo.brake = brake  # type: ignore[method-assign]
    return servo


def caught(servo: Servo) -> None:
    """Somebody holds it."""
    del servo.brake


# Set-up motion


@pytest.mark.parametrize(("command", "ramp_s"), [(VELOCITY, 0.2), (POSITION, 0.2), (HOMING, 0.08)])
def test_an_operator_who_lets_go_halts_the_motion_on_its_ramp(command: Command, ramp_s: float) -> None:
    world = set_up(command)
    world.holder, began = "", len(world.frames)
    seen = set()
    world.until(lambda: any(word & 0x100 for word in controlwords(world, began)), within_s=HOLD_S + 0.2)
    halted = world.now
    while abs(world.feedback.velocity[0]) > 0.01:
        world.cycle()
        seen.add(world.feedback.axes[0])
    assert world.now - halted == pytest.approx(ramp_s, abs=0.05)
    assert seen == {AxisStatus.OPERATION_ENABLED}
    world.until(lambda: world.feedback.axes[0] is AxisStatus.SWITCH_ON_DISABLED, within_s=0.3)
    assert "the operator let go" in next(event for event in world.events if event.code == "setup_stopped").text
    assert not world.feedback.referenced


def test_a_drive_that_does_not_halt_gets_a_quick_stop() -> None:
    world = set_up(VELOCITY)
    setup = world.bus.nodes[1].drives[0].setup
    obey = setup.obey
    setup.obey = lambda mode, word: obey(mode, word & ~0x100)
    world.holder = ""
    world.until(lambda: world.feedback.axes[0] is AxisStatus.QUICK_STOP_ACTIVE, within_s=HOLD_S + 0.7)
    world.until(lambda: world.feedback.axes[0] is AxisStatus.SWITCH_ON_DISABLED, within_s=0.3)
    assert not [event for event in world.events if event.severity is Severity.ALARM]


@pytest.mark.parametrize("command", [VELOCITY, POSITION, HOMING])
@pytest.mark.parametrize("why", ["let go", "estop"])
def test_a_drive_that_is_deaf_in_set_up_is_named_and_stopped_through_its_node(command: Command, why: str) -> None:
    world = set_up(command)
    world.lost = lambda frame: frame.id == 0x201
    world.holder = ""
    if why == "estop":
        world.tell(Estop("e1", True, "op", "test"))
    world.until(lambda: bool(alarms(world)), within_s=STOP_S + 0.05 + (why == "let go") * (HOLD_S + 0.6))
    assert "node 1 (left J1) was told to stop" in alarms(world)[0].text
    assert "hard-wired emergency stop" in alarms(world)[0].remedy
    assert "moves" in world.ask(Claim("left", "b", "d")).text
    world.until(lambda: NMT_STOP in world.frames, within_s=0.05)
    world.run(0.1)
    stopped = places(world)
    world.run(0.5)
    assert places(world) == stopped

    world.lost = lambda _frame: False
    world.until(lambda: world.feedback.state is PlayoutState.FAULT and world.state.ready, within_s=5.0)
    assert len(alarms(world)) == 1
    if why == "estop":
        world.until(lambda: world.state.estop_confirmed == "e1", within_s=1.0)
    else:
        owner = world.ask(Claim("left", "b", "d")).claim.owner
        assert world.ask(ResetDrives("left", owner)).ok


def test_a_drive_that_stays_switched_on_after_set_up_is_an_alarm() -> None:
    world = set_up(POSITION)
    drive = world.bus.nodes[1].drives[0]
    command = drive._command
    drive._command = lambda word: None if word.name != "ENABLE_OPERATION" else command(word)
    world.until(lambda: "not_off" in world.codes())
    alarm = next(event for event in world.events if event.code == "not_off")
    assert alarm.text.startswith("left: node 1 (left J1) did not switch off")
    assert "hard-wired emergency stop" in alarm.remedy
    world.until(lambda: NMT_STOP in world.frames, within_s=0.05)
    assert world.feedback.state is PlayoutState.STOPPING


# Blocks


@pytest.mark.parametrize("layout", LAYOUTS)
def test_an_axis_that_runs_on_is_named_again_and_again_and_is_never_at_rest(layout: GatewaySettings) -> None:
    world = moving(layout)
    world.run(0.6)
    owner = world.feedback.owner
    servo = runaway(world)
    other = world.bus.nodes[2] if 2 in world.bus.nodes else world.bus.nodes[1]
    other.raise_emergency(0x4310, axis=len(other.drives))
    world.until(lambda: bool(alarms(world)), within_s=STOP_S + 0.05)
    assert "node 1 (left J1) was told to stop" in alarms(world)[0].text
    world.until(lambda: world.frames.count(NMT_STOP) > 0)
    world.until(lambda: len(alarms(world)) == 2, within_s=5.0)
    assert world.feedback.state is PlayoutState.STOPPING
    for order in (ResetDrives("left", owner), DisableDrives("left", owner)):
        refused = world.ask(order)
        assert not refused.ok
        assert "left may still move: node 1 (left J1)" in refused.text
    world.run(TIMES.owner_silent_s)
    assert not world.ask(Claim("left", "b", "d")).ok

    caught(servo)
    world.until(lambda: world.feedback.state is PlayoutState.FAULT, within_s=5.0)
    world.until(lambda: world.state.ready)
    world.run(0.2)
    owner = world.ask(Claim("left", "b", "d")).claim.owner
    assert world.ask(ResetDrives("left", owner)).ok


def test_a_runaway_in_the_second_stage_of_an_emergency_stop_is_never_confirmed() -> None:
    world = moving()
    world.run(0.6)
    world.tell(Estop("e1", True, "op", "test"))
    world.run(TIMES.estop_delay_s - 0.02)
    servo = runaway(world)
    assert not alarms(world)
    world.until(lambda: bool(alarms(world)), within_s=STOP_S + 0.1)
    assert "stop_deadline" in world.codes()
    world.run(0.5)
    assert world.state.estop_confirmed is None
    caught(servo)
    world.until(lambda: world.state.estop_confirmed == "e1", within_s=5.0)


def test_a_silent_node_counts_as_moving_until_its_drive_must_have_stopped_by_itself() -> None:
    world = moving()
    world.run(0.6)
    world.bus.nodes[2].silence()
    world.until(lambda: "tpdo_silent" in world.codes())
    lost = world.now
    world.until(lambda: world.feedback.state is PlayoutState.FAULT, within_s=1.0)
    assert world.now - lost == pytest.approx(SILENT_S, abs=0.01)


def test_an_axis_that_slips_after_a_fault_is_named_and_keeps_the_robot_in_fault() -> None:
    world, owner = faulty(0x4310)
    servo = world.bus.nodes[1].drives[0].servo
    servo.rest = lambda step_s, _brake: servo.jump(round(10_000 * step_s))
    world.until(lambda: bool(alarms(world)), within_s=STOP_S + 0.05)
    assert "its brake does not hold" in alarms(world)[0].text
    assert NMT_STOP not in world.frames
    for order in (ResetDrives("left", owner), DisableDrives("left", owner), Release("left", owner)):
        refused = world.ask(order)
        assert not refused.ok
        assert "move" in refused.text
    del servo.rest
    world.run(0.2)
    assert world.ask(ResetDrives("left", owner)).ok


def test_an_axis_that_slips_while_its_fault_is_being_reset_keeps_the_robot_in_fault() -> None:
    world, owner = faulty(0x4310)
    request = world.request(ResetDrives("left", owner))
    world.run(3 * world.settings.cycle_s)
    servo = world.bus.nodes[1].drives[0].servo
    servo.rest = lambda step_s, _brake: servo.jump(round(10_000 * step_s))
    world.until(lambda: request in world.replies)
    assert not world.replies[request].ok
    assert "left may still move: node 1 (left J1)" in world.replies[request].text
    assert world.feedback.state is PlayoutState.FAULT
    del servo.rest
    world.run(0.2)
    owner = world.ask(Claim("left", "b", "d")).claim.owner
    assert world.ask(ResetDrives("left", owner)).ok


def test_errors_that_a_reset_ends_one_after_another_are_no_new_fault() -> None:
    world, owner = faulty(0x4310, 0x2310)
    world.events.clear()
    assert world.ask(ResetDrives("left", owner)).ok
    assert not [event for event in world.events if event.severity is Severity.ALARM]
    assert world.ask(EnableDrives("left", owner)).ok


@pytest.mark.parametrize("code", [0x2310, 0x5530], ids=["the same", "another"])
def test_an_error_that_comes_back_in_a_reset_keeps_the_robot_in_fault(code: int) -> None:
    world, owner = faulty(0x2310)
    world.request(ResetDrives("left", owner))
    node = world.bus.nodes[1]
    world.until(lambda: node.state is DriveState.SWITCH_ON_DISABLED)
    node.raise_emergency(code)
    world.run(2.0)
    assert world.feedback.state is PlayoutState.FAULT
    assert not world.ask(EnableDrives("left", owner)).ok


def test_a_robot_that_is_stopping_is_not_set_up_and_nobody_is_told_to_disable_it() -> None:
    world = moving()
    world.bus.nodes[1].raise_emergency(0x2310)
    world.until(lambda: world.feedback.state is PlayoutState.STOPPING)
    assert "disable it" not in world.ask(HOMING).text


def test_an_axis_that_slips_while_its_robot_is_off_is_named_and_nothing_else_is_done() -> None:
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 2)))
    world.ready()
    world.events.clear()
    servo = world.bus.nodes[1].drives[0].servo
    servo.rest = lambda step_s, _brake: servo.jump(round(10_000 * step_s))
    world.run(0.4)
    assert not world.events, "less than its window of 5000 counts"
    world.run(0.2)
    assert [event.code for event in world.events] == ["moves_without_torque"]
    assert world.events[0].severity is Severity.ALARM
    assert "node 1 (left J1) moves without torque: its brake does not hold" in world.events[0].text
    world.run(TELL_S)
    assert len(world.events) == 2
    assert "times more in 10 s)" in world.events[1].text
    assert world.feedback.state is PlayoutState.FOLLOWING


def test_an_axis_that_gives_way_while_its_brake_opens_is_switched_off_and_told() -> None:
    world = GatewayBench(settings(axis("J1", 1, brake_s=0.2), axis("J2", 2)))
    world.ready()
    owner = world.ask(Claim("left", "b", "d")).claim.owner
    request = world.request(EnableDrives("left", owner))
    world.until(lambda: world.feedback.axes[0] is AxisStatus.OPERATION_ENABLED)
    world.run(0.1)
    assert not world.feedback.enabled
    world.bus.nodes[1].drives[0].servo.jump(6000)
    world.until(lambda: request in world.replies, within_s=0.05)
    assert world.replies[request].text == "left moved while it was enabled; check brakes and loads"
    world.until(lambda: set(world.feedback.axes) == {AxisStatus.SWITCH_ON_DISABLED}, within_s=0.5)


# Drives that were not switched off, and drives that mask their fault


def test_a_drive_found_in_motion_that_nobody_wants_is_stopped_before_it_is_switched_off() -> None:
    world = set_up(VELOCITY)
    world.core._robots["left"].group.setup.motion = None
    servo = world.bus.nodes[1].drives[0].servo
    world.until(lambda: world.feedback.axes[0] is AxisStatus.QUICK_STOP_ACTIVE, within_s=0.1)
    assert abs(servo.velocity) > 1000.0
    refused = world.ask(Claim("left", "b", "d")).text
    assert refused.startswith("robot left still moves; ask again when it is at rest; node 1 (left J1) not measured at ")
    world.until(lambda: world.feedback.axes[0] is AxisStatus.SWITCH_ON_DISABLED, within_s=0.5)
    assert servo.standing


def test_a_drive_that_shows_a_fault_as_its_reaction_is_reset_once_it_has_stood(monkeypatch: pytest.MonkeyPatch) -> None:
    update = Shown.update

    def masked(self: Shown, *what: object) -> None:
        update(self, *what)  # type: ignore[arg-type]
        if self._numbers[0x604100] & 0x4F == 0x08:
            self._numbers[0x604100] |= 0x1F

    monkeypatch.setattr(Shown, "update", masked)
    world = moving()
    world.run(0.6)
    world.bus.nodes[1].raise_emergency(0x4310)
    world.until(lambda: world.feedback.axes[0] is AxisStatus.FAULT_REACTION_ACTIVE)
    stopped = world.now
    world.until(lambda: world.feedback.axes[0] is AxisStatus.FAULT, within_s=2.0)
    assert world.now - stopped >= 1.0
    owner = world.ask(Claim("left", "b", "d")).claim.owner
    assert world.ask(ResetDrives("left", owner)).ok
    assert world.feedback.axes[0] is AxisStatus.SWITCH_ON_DISABLED
