"""A part that is attached: it belongs to the body from ATTACH to DETACH, whatever happens in between."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from cell.config.settings import ThingSettings
from cell.messages import (
    Continue,
    Enable,
    Estop,
    Halt,
    Mode,
    ProgramState,
    ResetRobot,
    Run,
    SetPart,
)
from robot_agent.dynamics import axis_torques
from robot_agent.kinematics import SixAxis
from robot_agent.model import LinkMass
from tests.unit.agent_runs import at_rest, ended, until
from tests.unit.agent_world import AgentWorld
from tests.unit.body_cover import covers
from tests.unit.robot_agent.agent.operator.jog_key import Key, jog
from tests.unit.robot_agent.agent.program.mounted_arm import (
    BARE,
    PICK,
    answer,
    capsules,
    failed,
    holding,
    in_front_of_zone,
    pole,
)


def ready(
    program: str,
    part: str | None = "",
    arm: SixAxis = BARE,
    things: tuple[ThingSettings, ...] = (),
    outputs: tuple[str, ...] = (),
    torques: bool = False,
) -> AgentWorld:
    """An enabled robot, and an operator who has said what it holds; empty: nothing, None: nobody has."""
    world = AgentWorld(program, arm=arm, things=things)
    world.outputs, world.torques = outputs, torques
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    if part is not None:
        assert answer(world, SetPart(part or None)).ok
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    return world


def running(program: str, part: str = "", arm: SixAxis = BARE, things: tuple[ThingSettings, ...] = ()) -> AgentWorld:
    world = ready(program, part, arm, things)
    world.call(Run())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    return world


def test_the_body_grows_before_the_first_motion_with_the_part_and_shrinks_at_rest_after_it() -> None:
    world = running(PICK)
    grown: list[np.ndarray] = []
    while not ended(world)():
        world.step()
        if capsules(world.presences[-1]) > len(BARE.body):
            grown.append(world.commanded)
            assert world.state.part == "rod"
            assert covers(world.presences[-1].body, holding("rod").capsules(world.commanded), 1e-6)
    first, last = np.degrees(grown[0][0]), np.degrees(grown[-1][0])
    assert (first, last) == (pytest.approx(10.0), pytest.approx(20.0))
    assert np.degrees(np.array(grown)[:, 0]).max() == pytest.approx(20.0)
    assert world.state.part == ""


def test_motions_are_planned_with_what_is_held_then() -> None:
    world = running(PICK)
    until(world, ended(world))
    assert [(planned.lines, planned.mounted.parts) for planned in world.planned] == [
        ((1,), ()),
        ((3,), ("rod",)),
        ((5,), ()),
    ]
    assert {planned.mounted.parts: planned.sweep.points.shape[1] - len(BARE.body) for planned in world.planned[:2]} == {
        (): 0,
        ("rod",): 1,
    }


def test_a_thing_that_is_clear_without_the_part_stops_the_program_with_it_by_line() -> None:
    world = running("MJ J1=10\nMJ J1=20\nMJ J1=10\nATTACH rod\nMJ J1=20\nEND", things=(pole(),))
    until(world, failed(world))
    assert "line 5: the part rod comes" in world.state.program.error
    assert "too near to pole" in world.state.program.error
    assert world.commanded[0] == pytest.approx(np.radians(10.0))


def test_a_part_may_touch_what_its_thing_lets_it_touch() -> None:
    world = running("MJ J1=10\nATTACH rod\nMJ J1=20\nEND", things=(pole(may_touch=("rod",)),))
    until(world, ended(world))


def test_a_program_keeps_what_is_held_and_the_next_run_has_it() -> None:
    world = running("MJ J1=10\nATTACH rod\nMJ J1=20\nEND")
    until(world, ended(world))
    assert world.state.part == "rod"
    world.call(Run())
    until(world, failed(world))
    assert "ATTACH rod while the robot holds rod: DETACH comes first" in world.state.program.error
    assert capsules(world.presences[-1]) == len(BARE.body) + 1


def test_there_is_nothing_to_detach_in_an_empty_gripper() -> None:
    world = running("MJ J1=10\nDETACH\nEND")
    until(world, failed(world))
    assert "DETACH while the robot holds no part" in world.state.program.error


def test_after_a_start_of_the_agent_the_body_has_all_parts_until_an_operator_says_which() -> None:
    world = ready(PICK, part=None)
    assert world.state.part is None
    assert capsules(world.presences[-1]) == len(BARE.body) + 2
    refused = answer(world, Run())
    assert not refused.ok
    assert "`cell part left rod|plate|none`" in refused.text
    assert answer(world, SetPart("plate")).ok
    until(world, lambda: world.state.part == "plate")
    assert covers(world.presences[-1].body, holding("plate").capsules(world.commanded), 1e-6)
    assert not answer(world, SetPart("rods")).ok


def test_a_program_without_parts_runs_with_the_body_of_all_of_them() -> None:
    world = ready("MJ J1=10\nEND", part=None)
    world.call(Run())
    until(world, ended(world))
    assert [planned.mounted.parts for planned in world.planned] == [("rod", "plate")]


def test_a_word_about_the_gripper_ends_a_halted_program() -> None:
    world = running("MJ J1=10\nATTACH rod\nMJ J1=40 F=10\nEND")
    until(world, lambda: world.state.part == "rod" and world.state.program.line == 3)
    assert not answer(world, SetPart(None)).ok
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED and at_rest(world)())
    until(world, lambda: answer(world, SetPart("rod")).ok)
    assert world.state.mode is Mode.HALTED
    assert answer(world, SetPart(None)).ok
    until(world, lambda: world.state.mode is Mode.READY)
    assert "an operator said that left holds nothing" in world.state.program.error
    assert capsules(world.presences[-1]) == len(BARE.body)
    assert not answer(world, Continue()).ok


def test_a_part_stays_held_through_a_fault_and_on_the_way_back() -> None:
    world = running("MJ J1=10\nATTACH rod\nMJ J1=40 F=10\nDETACH\nEND")
    until(world, lambda: world.state.part == "rod" and world.commanded[0] > np.radians(20.0))
    world.quick_stop(0.001)
    until(world, lambda: world.state.mode is Mode.FAULT)
    assert world.state.part == "rod"
    assert capsules(world.presences[-1]) == len(BARE.body) + 1
    world.call(ResetRobot())
    until(world, lambda: world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.call(Continue())
    until(world, ended(world))
    assert {planned.mounted.parts for planned in world.planned if planned.id < 0} == {("rod",)}
    assert world.state.part == ""


def test_a_part_that_is_taken_out_after_a_fault_ends_the_interrupted_program() -> None:
    world = running("MJ J1=10\nATTACH rod\nMJ J1=40 F=10\nDETACH\nEND")
    until(world, lambda: world.commanded[0] > np.radians(20.0))
    world.quick_stop(0.001)
    until(world, lambda: world.state.mode is Mode.FAULT)
    assert not answer(world, SetPart(None)).ok
    world.call(ResetRobot())
    until(world, lambda: world.state.mode is Mode.DISABLED)
    assert world.state.program.state is ProgramState.INTERRUPTED
    assert "left still moves" in answer(world, SetPart(None)).text
    until(world, lambda: answer(world, SetPart(None)).ok)
    assert capsules(world.presences[-1]) == len(BARE.body)
    assert world.state.program.state is ProgramState.FAILED
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)


def test_a_part_that_reaches_into_a_zone_is_attached_once_the_zone_is_granted() -> None:
    place = in_front_of_zone()
    world = running(f"MJ J2=-20 J3=30 J5=60\nMJ {place}\nATTACH rod\nWAIT 0.5\nMJ J2=-20 J3=30 J5=60\nEND")
    until(world, lambda: "zone handover" in world.state.waiting_for)
    until(world, at_rest(world))
    assert world.state.program.line == 2
    assert world.state.part == ""
    assert capsules(world.presences[-1]) == len(BARE.body)
    assert world.presences[-1].wants == {"handover": 0.0}
    world.grant()
    until(world, lambda: world.state.part == "rod")
    assert "handover" in world.presences[-1].holds
    until(world, ended(world))


def test_a_zone_is_entered_earlier_with_a_part() -> None:
    entered: dict[str, float] = {}
    for part in ("", "rod"):
        world = running("MJ J2=-20 J3=30 J5=60\nMJ J2=50 J3=-25 J5=30 F=50\nEND", part)
        until(world, lambda world=world: len(world.planned) == 2)  # type: ignore[misc]
        entered[part] = world.planned[1].crossings[0].enter_tau
    assert entered["rod"] < entered[""] - 0.02


def test_the_torques_carry_the_part_from_attach_on() -> None:
    masses = tuple(LinkMass(link, 5.0, (0.1, 0.02, 0.0), 0.01 * np.eye(3), "a test") for link in range(1, 7))
    arm = SixAxis(replace(BARE.description, masses=masses))
    carrying = {part: axis_torques(holding(part, arm=arm), np.eye(4)) for part in ("", "rod")}
    world = ready(PICK, arm=arm, torques=True)
    world.call(Run())
    seen = set()
    while not ended(world)():
        before = len(world.blocks)
        world.step()
        part = world.state.part or ""
        for block in world.blocks[before:]:
            torques = carrying[part]
            assert torques is not None
            assert block.torque is not None
            np.testing.assert_allclose(block.torque[-1], torques.standing(block.position[-1:])[0], atol=1e-6)
            seen.add(part)
    assert seen == {"", "rod"}


def test_a_jog_that_comes_with_the_word_about_the_gripper_keeps_the_part_away() -> None:
    world = ready("HOME\nEND", things=(pole(),))
    world.call(SetPart("rod"))
    Key(world, jog("J1", 0.25, press="p")).hold(3.0, until=lambda: "pole" in world.state.waiting_for)
    assert world.state.waiting_for == "pole is in the way of the part rod"


ROUNDS = """LABEL again
MJ J1=10
ATTACH rod
SET DO gripper
MJ J1=16
RESET DO gripper
WAIT 0.05
DETACH
MJ J1=10
GOTO again 3
END"""
EVENTS = st.sampled_from(["halt", "continue", "enable", "run", "fault", "brake", "estop"])


@settings(max_examples=4, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(st.lists(st.tuples(st.integers(1, 50), EVENTS), max_size=6))
def test_the_body_covers_links_and_tool_and_what_a_closed_gripper_holds(events: list[tuple[int, str]]) -> None:
    """The gripper is that of the gateway, which switches when the output is played."""
    world = ready(ROUNDS, outputs=("gripper",))
    world.call(Run())
    for steps, event in [*events, (60, "halt")]:
        for _ in range(steps):
            world.step()
            closed = bool(world.switched) and world.switched[-1][1].value
            model = holding("rod") if closed else BARE
            body = world.presences[-1].body
            mine = replace(body, poses=body.poses[:, : len(model.body)])  # the part comes last
            assert covers(mine, model.capsules(world.played[-6]), 1e-3)
        happens(world, event)


def happens(world: AgentWorld, event: str) -> None:
    match event:
        case "halt":
            world.call(Halt())
        case "continue":
            world.call(Continue())
        case "enable":
            world.call(Enable())
        case "run":
            world.call(Run())
        case "fault":
            world.quick_stop()
            world.step()
            world.call(ResetRobot())
        case "brake":
            world.brake(np.full(6, 8.0))
            until(world, lambda: world.faulty)
            world.call(ResetRobot())
        case _:
            world.agent.receive(Estop("e1", True, "a test", "a test"), world.now)
