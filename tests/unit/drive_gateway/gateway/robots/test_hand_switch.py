"""An operator switches a digital output: when he may, what the drive is told, and what he is answered."""

from dataclasses import replace

import numpy as np
import pytest

from cell.core import Request
from cell.messages import Call, Estop, ForceOutput, Heard, Home, OutputEvent, PlayoutState, Reply, SwitchOutput
from drive_gateway.config.settings import HomingSettings, OutputSettings, RobotDrives
from tests.unit.gateway_world import TIMES, KindManager, World, axis, block, gateway_settings, s_motion

GRIPPER_BIT, GLUE_BIT = 1 << 16, 1 << 3
OUTPUTS = (OutputSettings("gripper", "J2", 16, keep=True), OutputSettings("glue", "J2", 3))


class HandWorld(World):
    """Gripper (kept at a stop) and glue (off at a stop) hang on the drive of J2, node 2."""

    def __init__(self, **changes: object) -> None:
        axes = (axis("J1", 1, **changes), axis("J2", 2, output_mask=GRIPPER_BIT | GLUE_BIT))
        super().__init__(replace(gateway_settings(axes), robots={"left": RobotDrives("left", axes, OUTPUTS)}))
        self.ready()

    @property
    def on(self) -> int:
        """What the drive shows."""
        return int.from_bytes(self.drives[2].objects[0x60FE, 1], "little")

    def order(self, output: str, on: bool, heard: Heard | None = None) -> str:
        """Order it, in view of the newest state if none is given; answers where the reply will be."""
        self.counted += 1
        request_id = f"r{self.counted}"
        call = Call(f"c{self.counted}", SwitchOutput("left", output, on, "anna@pc"))
        seen = heard or Heard(self.state.boot, self.state.sequence)
        self.tell(Request(request_id, replace(call, heard=seen)))
        return request_id

    def switch(self, output: str, on: bool) -> Reply:
        request_id = self.order(output, on)
        self.until(lambda: request_id in self.replies)
        return self.replies[request_id]

    def force(self, output: str, on: bool | None) -> Reply:
        return self.ask(ForceOutput("left", output, on, "anna@pc"))

    def refusal(self, output: str, on: bool) -> str:
        before = self.on
        reply = self.switch(output, on)
        assert not reply.ok
        assert self.on == before
        return reply.text

    def lives(self) -> None:
        """Enabled, and its agent sends blocks at rest."""
        self.living = self.enabled()
        self.until(lambda: self.feedback.block > 0)

    def moves(self, seconds: float, way: float) -> None:
        """Enabled, and all its axes begin to go so far."""
        owner = self.enabled()
        position, velocity = s_motion(seconds, way)
        self.send(owner, self.feedback.commanded + position, velocity)

    def held_by_a_program(self, owner: int, *events: OutputEvent, nominal: int = 20) -> None:
        """A program of the robot runs and stands, for example in a WAIT."""
        self.sequence += 1
        position = np.tile(self.feedback.commanded, (nominal + 1, 1))
        held = block(owner, self.sequence, self.feedback.tick + 5, position, np.zeros_like(position), nominal)
        self.tell(replace(held, program=True, events=events))
        self.until(lambda: self.feedback.block == self.sequence)


def test_with_drives_that_are_off_the_answer_is_what_the_drive_shows_and_nothing_else_changes() -> None:
    world = HandWorld()
    before = [(drive.status, drive.position, drive.controlword) for drive in world.drives.values()]
    reply = world.switch("gripper", on=True)
    assert reply.ok
    assert reply.text == "left: output gripper is on: node 2 (left J2) shows 60FEh:01 = 00010000h"
    assert world.on == GRIPPER_BIT
    assert world.feedback.outputs == 1
    assert [(drive.status, drive.position, drive.controlword) for drive in world.drives.values()] == before
    told = [event.text for event in world.events if event.code == "output_by_hand"]
    assert told == ["left: output gripper was switched on by hand, by anna@pc"]


def test_an_output_that_is_as_ordered_is_confirmed_and_no_event_says_that_it_was_switched() -> None:
    world = HandWorld()
    assert world.switch("gripper", on=False).ok
    assert "output_by_hand" not in world.codes()


def test_an_enabled_robot_whose_agent_runs_switches_everything_and_a_stop_rules_afterwards() -> None:
    world = HandWorld()
    world.lives()
    assert world.switch("glue", on=True).ok
    assert world.switch("gripper", on=True).ok
    assert world.on == GRIPPER_BIT | GLUE_BIT
    for message in world.drives[1].fail(0x5112):
        world.tell(message)
    world.until(lambda: world.feedback.state is PlayoutState.FAULT)
    world.cycle()
    assert world.on == GRIPPER_BIT


def test_after_a_fault_a_part_can_be_freed_and_what_must_be_off_at_a_stop_stays_off() -> None:
    world = HandWorld()
    world.lives()
    assert world.switch("gripper", on=True).ok
    for message in world.drives[1].fail(0x5112):
        world.tell(message)
    world.until(lambda: world.feedback.state is PlayoutState.FAULT)
    assert world.refusal("glue", on=True) == (
        "left: output glue has `at_stop: off` in the drives file, so it stays off while it stands in a fault; "
        "it can be switched on once the robot is enabled and its agent runs"
    )
    assert world.switch("gripper", on=False).ok
    assert world.on == 0
    assert world.feedback.state is PlayoutState.FAULT


def test_under_an_emergency_stop_too() -> None:
    world = HandWorld()
    world.tell(Estop("e1", True, "door", "test"))
    world.cycle()
    assert world.switch("gripper", on=True).ok
    assert "while its drives are off" in world.refusal("glue", on=True)


def test_a_program_that_runs_rules_the_outputs_until_it_is_halted_or_its_silent_agent_loses_the_robot() -> None:
    world = HandWorld()
    owner = world.enabled()
    world.held_by_a_program(owner)
    refused = (
        "left: its program runs and switches the outputs; first: cell halt left, "
        "or where its agent is silent wait until that has lost its claim"
    )
    assert world.refusal("gripper", on=True) == refused
    world.hold(owner)
    world.run(0.04)
    assert world.switch("gripper", on=True).ok
    world.held_by_a_program(owner)
    assert world.refusal("gripper", on=False) == refused
    world.until(lambda: "claim_ended" in world.codes())
    assert world.switch("gripper", on=False).ok


def test_the_programs_next_event_rules_again() -> None:
    world = HandWorld()
    owner = world.enabled()
    world.hold(owner)
    assert world.switch("gripper", on=True).ok
    tick = world.feedback.tick + 10
    world.held_by_a_program(owner, OutputEvent(tick, 1, 0, False))
    world.until(lambda: world.feedback.tick > tick)
    assert world.on == 0


def test_nothing_is_switched_while_the_robot_moves() -> None:
    world = HandWorld()
    world.moves(0.4, 0.1)
    world.run(0.1)
    assert world.refusal("gripper", on=True) == "left: it moves; switch output gripper when it stands"
    world.until(lambda: world.feedback.level == 0)
    world.run(0.1)
    assert world.switch("gripper", on=True).ok


def test_nor_while_its_drives_brake() -> None:
    world = HandWorld()
    world.moves(0.8, 0.3)
    world.run(0.2)
    for message in world.drives[2].fail(0x5112):
        world.tell(message)
    world.until(lambda: world.feedback.state is PlayoutState.STOPPING)
    assert world.refusal("gripper", on=True) == "left: its drives brake; switch output gripper when it stands"


def test_nor_while_an_axis_homes() -> None:
    world = HandWorld(homing=HomingSettings(37, fast=0.4, slow=0.05, acceleration=5.0, position=0.0, order=1))
    world.manager = KindManager()
    world.run(0.2)
    assert world.ask(Home("left", ())).ok
    assert world.refusal("gripper", on=True) == "left: it is being set up; switch outputs when that is done"


def test_a_node_that_is_not_operational_is_named_with_its_state() -> None:
    world = HandWorld()
    world.drives[2].alive = False
    world.until(lambda: "heartbeat_lost" in world.codes() or "tpdo_silent" in world.codes())
    world.run(0.5)
    text = world.refusal("gripper", on=True)
    assert text.startswith("left: output gripper is at node 2 (left J2): ")
    assert text.endswith("; it is told nothing before it is operational")


def test_an_unknown_output_is_told_with_those_that_exist() -> None:
    assert HandWorld().refusal("griper", on=True) == "left has no output griper; its outputs are gripper, glue"


@pytest.mark.parametrize(
    ("boot", "wait_s", "found"), [("g1", TIMES.command_s + 0.3, "s old"), ("g0", 0.0, "no longer known")]
)
def test_an_order_that_was_long_on_its_way_or_is_for_another_run_of_the_gateway_switches_nothing(
    boot: str, wait_s: float, found: str
) -> None:
    world = HandWorld()
    seen = Heard(boot, world.state.sequence)
    world.run(wait_s)
    request_id = world.order("gripper", on=True, heard=seen)
    world.until(lambda: request_id in world.replies)
    reply = world.replies[request_id]
    assert not reply.ok
    assert reply.text.startswith(
        "the call is too old to be carried out: it answers a state of gateway left_bus that is"
    )
    assert found in reply.text
    assert world.on == 0


def test_a_drive_that_does_not_show_what_it_was_told_is_an_answer_too() -> None:
    world = HandWorld()
    world.drives[2].deaf_to_outputs = True
    reply = world.switch("gripper", on=True)
    assert not reply.ok
    assert reply.text == (
        "left: output gripper was told to be on, but not confirmed within 1 s: "
        "node 2 (left J2) shows 60FEh:01 = 00000000h; look what it does before you rely on it"
    )


def test_a_drive_that_does_not_tell_its_outputs_cannot_confirm() -> None:
    world = HandWorld()
    world.drives[2].refuse[0x60FE, 1] = 0x08000000
    reply = world.switch("gripper", on=True)
    assert not reply.ok
    assert "node 2 (left J2) does not tell 60FEh:01, abort 08000000h, general error" in reply.text


def test_what_a_stop_has_undone_meanwhile_is_not_told_as_done() -> None:
    world = HandWorld()
    world.lives()
    world.drives[2].deaf_to_outputs = True
    request_id = world.order("glue", on=True)
    world.run(0.1)
    world.tell(Estop("e1", True, "door", "test"))
    world.until(lambda: request_id in world.replies)
    assert not world.replies[request_id].ok
    assert world.replies[request_id].text == (
        "left: output glue was switched on, and is off again: a stop, a program or another order came after"
    )


def test_a_forced_output_stays_so_over_a_running_program_which_rules_again_when_it_follows() -> None:
    world = HandWorld()
    owner = world.enabled()
    world.held_by_a_program(owner)
    assert (
        world.force("gripper", on=True).text
        == "left: output gripper is on: node 2 (left J2) shows 60FEh:01 = 00010000h"
    )
    tick = world.feedback.tick + 10
    world.held_by_a_program(owner, OutputEvent(tick, 1, 0, True), OutputEvent(tick + 5, 2, 0, False))
    world.until(lambda: world.feedback.event == 2)
    assert (world.on, world.feedback.outputs) == (GRIPPER_BIT, 1)
    world.until(lambda: bool(world.state.forced))
    assert world.state.forced == {"left": {"gripper": "anna@pc"}}
    assert world.force("gripper", on=None).text == "left: output gripper follows its program again, and is off"
    world.run(0.3)
    assert (world.on, world.state.forced) == (0, {})
    told = [(event.code, event.text) for event in world.events if event.code.startswith("output_")]
    assert told == [
        ("output_forced", "left: output gripper is forced on, by anna@pc"),
        ("output_follows", "left: output gripper follows its program again, by anna@pc"),
    ]


def test_what_is_forced_off_misses_no_event_and_no_hand_switches_it() -> None:
    world = HandWorld()
    owner = world.enabled()
    world.hold(owner)
    assert world.force("glue", on=False).ok
    tick = world.feedback.tick + 10
    world.held_by_a_program(owner, OutputEvent(tick, 1, 1, True))
    world.until(lambda: world.feedback.event == 1)
    assert world.on == 0
    assert world.refusal("glue", on=True) == (
        "left: output glue is forced off, by anna@pc; first: cell output left glue follow"
    )
    assert world.force("glue", on=None).text.endswith("follows its program again, and is on")
    world.run(0.02)
    assert world.on == GLUE_BIT


def test_a_forced_output_is_kept_while_the_robot_moves() -> None:
    world = HandWorld()
    world.moves(0.4, 0.1)
    world.run(0.1)
    assert world.force("gripper", on=True).ok
    assert world.on == GRIPPER_BIT


def test_a_stop_ends_what_is_forced_on_and_must_be_off_then_and_nothing_else() -> None:
    world = HandWorld()
    world.lives()
    assert world.force("glue", on=True).ok
    assert world.force("gripper", on=True).ok
    world.tell(Estop("e1", True, "door", "test"))
    world.run(0.5)
    assert world.on == GRIPPER_BIT
    assert world.state.forced == {"left": {"gripper": "anna@pc"}}
    refused = world.force("glue", on=True)
    assert not refused.ok
    assert "output glue has `at_stop: off` in the drives file, so it stays off while" in refused.text
    assert world.force("glue", on=False).ok
    world.run(0.3)
    assert world.state.forced == {"left": {"gripper": "anna@pc", "glue": "anna@pc"}}


def test_an_unknown_output_is_not_forced() -> None:
    reply = HandWorld().force("griper", on=True)
    assert (reply.ok, reply.text) == (False, "left has no output griper; its outputs are gripper, glue")
