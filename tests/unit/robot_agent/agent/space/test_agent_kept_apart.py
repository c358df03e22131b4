"""One agent whose manager clears room, or does not."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from cell.config.settings import SeparationSettings
from cell.messages import (
    Continue,
    Enable,
    Halt,
    Mode,
    Presence,
    ProgramState,
    ResetRobot,
    Return,
    Run,
    SetOverride,
    SetPart,
)
from robot_agent.kinematics import Model, load_model
from robot_agent.workspace import FOLLOWING_M, ROOM_M
from tests.unit.agent_runs import at_rest, until
from tests.unit.agent_world import AgentWorld
from tests.unit.repository import ROOT
from tests.unit.robot_agent.agent.operator.jog_key import Key, jog
from tests.unit.robot_agent.agent.program.mounted_arm import BARE, PICK

KEPT_APART = SeparationSettings(0.03)
THERE_AND_BACK = "MJ J1=25 F=100\nMJ J1=-25 F=100\nEND"
FAST = "MJ J1=120 J2=40 J3=-40 F=100\nEND"
"""Up to 20 mm from one sample of what is planned to the next one."""
DELTA = load_model(ROOT / "cell_configs" / "models" / "delta.yaml")
UP_AND_DOWN = "MJ J1=10 J2=10 J3=10\nML Z=-750 F=2000\n" + "ML Z=-620\nML Z=-730\nML Z=-610\nML Z=-710\n" * 2 + "END"
"""So fast that a robot 20 cycles behind is on the way there while it is commanded to places far on the way back."""


def _ready(program: str, separation: SeparationSettings | None = KEPT_APART, arm: Model = BARE) -> AgentWorld:
    world = AgentWorld(program, arm=arm, separation=separation)
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    if arm is BARE:
        world.call(SetPart(None))
        world.run(0.1)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    return world


def _running(
    program: str,
    clears: int | None = None,
    separation: SeparationSettings | None = KEPT_APART,
    arm: Model = BARE,
) -> AgentWorld:
    world = _ready(program, separation, arm)
    world.clears = clears
    world.call(Run())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    return world


def _owned(presence: Presence) -> set[int]:
    return set(presence.way.sections.ids[: presence.way.owned].tolist())


def _used(presence: Presence) -> set[int]:
    return set(presence.way.sections.ids[: presence.way.committed].tolist())


def _lagging(world: AgentWorld, behind: int) -> Iterator[NDArray[np.float64]]:
    """Run a program whose robot is measured so many cycles behind its command, and a little off.

    Gives, after each step, the joints `(m, n)` that it had been commanded and had yet to come to.
    """
    rng = np.random.default_rng(1)
    while world.state.program.state is not ProgramState.DONE:
        yet_to_come = np.array(world.played[-1 - behind :])
        world.measured = yet_to_come[0] + rng.normal(scale=1e-4, size=world.commanded.shape)
        world.step()
        yield yet_to_come


def _least_room_m(world: AgentWorld, joints: NDArray[np.float64]) -> float:
    """How much room its owned sections leave the robot at the worst of some joints `(m, n)` [m]."""
    way, model = world.presences[-1].way, world.planner.model
    points, owned = model.capsules(joints), way.sections[: way.owned]
    away = np.linalg.norm(points[:, None] - owned.points, axis=-1).max(axis=-1)
    return float((owned.radii - model.capsule_radii - away).min(axis=-1).max(axis=1).min())


def test_where_all_is_cleared_a_program_takes_as_long_as_without() -> None:
    took = []
    for separation in (KEPT_APART, None):
        world = _running(THERE_AND_BACK, separation=separation)
        start = world.now
        until(world, lambda world=world: world.state.program.state is ProgramState.DONE)
        took.append(world.now - start)
    assert took[0] - took[1] < 0.2


def test_nothing_moves_where_nothing_is_cleared_and_the_state_says_who_is_in_the_way() -> None:
    world = _running(THERE_AND_BACK, clears=0)
    world.run(1.0)
    assert world.state.waiting_for == "right is in the way"
    assert np.ptp(np.array(world.played), axis=0).max() == 0.0
    world.clears = None
    until(world, lambda: world.state.program.state is ProgramState.DONE)


def test_what_is_cleared_bit_by_bit_is_gone_bit_by_bit_and_never_more() -> None:
    world = _running(THERE_AND_BACK, clears=1)
    until(world, lambda: world.state.program.line == 2, 30.0)
    for before, after in zip(world.presences, world.presences[1:], strict=False):
        assert _used(after) <= _owned(before) | {
            int(each) for each in before.way.sections.ids[before.way.owned : before.way.owned + 1]
        }


@pytest.mark.parametrize("behind", [4, 20])
def test_a_robot_that_comes_back_the_way_it_went_owns_nothing_again_that_it_has_given_back(behind: int) -> None:
    world = _running(UP_AND_DOWN, arm=DELTA)
    for _ in _lagging(world, behind):
        before, after = world.presences[-2:]
        assert _owned(after) <= set(before.way.sections.ids.tolist())


@pytest.mark.parametrize("behind", [4, 20])
def test_nothing_is_given_back_before_the_robot_has_passed_it_where_its_command_is_on_the_way_back_already(
    behind: int,
) -> None:
    world = _running(UP_AND_DOWN, arm=DELTA)
    for yet_to_come in _lagging(world, behind):
        assert _least_room_m(world, yet_to_come) > FOLLOWING_M - 3e-4


def test_a_robot_that_is_kept_beside_its_path_owns_where_it_is_and_not_all_places_where_it_was_measured() -> None:
    world = _running(THERE_AND_BACK)
    world.run(0.4)
    rng, owned = np.random.default_rng(1), []
    for _ in range(100):
        world.measured = world.commanded + 0.02 + rng.normal(scale=1e-5, size=world.commanded.shape)
        world.step()
        owned.append(world.presences[-1].way.owned)
        assert _least_room_m(world, world.measured[None]) > 0.0
    assert world.state.tcp_speed_m_s == 0.0
    assert owned[-1] == owned[-50]


def test_a_robot_without_torque_that_is_pushed_owns_where_it_is_and_not_all_its_way() -> None:
    world = _ready("END")
    world.quick_stop()
    owned = []
    for _ in range(100):
        world.push(0.003)
        world.step()
        owned.append(world.presences[-1].way.owned)
    assert max(owned) < 10


def test_who_stands_beside_its_path_owns_where_it_stands_and_not_all_in_which_it_could_have_braked() -> None:
    world = _running(FAST)
    world.run(0.8)
    world.quick_stop(np.full(world.commanded.shape, 0.15))
    until(world, lambda: world.state.mode is Mode.FAULT)
    world.run(0.3)
    way = world.presences[-1].way
    assert way.owned == 1
    room = way.sections.radii[0, : len(world.planner.model.capsule_radii)] - world.planner.model.capsule_radii
    assert room == pytest.approx(FOLLOWING_M + ROOM_M, abs=1e-4)


def test_who_has_lost_its_drives_has_no_plan_any_more() -> None:
    world = _running(THERE_AND_BACK)
    world.run(0.4)
    assert world.presences[-1].way.plan > 0
    world.quick_stop()
    until(world, lambda: world.presences[-1].way.plan == 0)


def test_a_halted_robot_gives_up_what_it_does_not_use() -> None:
    world = _running(THERE_AND_BACK)
    world.run(0.4)
    assert _owned(world.presences[-1]) > _used(world.presences[-1])
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED and at_rest(world))
    assert _owned(world.presences[-1]) == _used(world.presences[-1])
    assert len(world.presences[-1].way.sections) == world.presences[-1].way.owned, "and asks for nothing"
    world.call(Continue())
    until(world, lambda: world.state.program.state is ProgramState.DONE)


def test_at_the_end_of_its_way_back_to_a_fast_path_a_robot_stays_in_what_was_cleared_for_it() -> None:
    """It stands between two samples of its path, and a section of that may be another robot's by now (seed 110176)."""
    world = _running(FAST)
    world.run(0.8)
    world.quick_stop(np.full(world.commanded.shape, 0.15))
    until(world, lambda: world.state.mode is Mode.FAULT)
    for order, then in ((ResetRobot(), Mode.DISABLED), (Enable(), Mode.OFF_PATH), (Return(), Mode.RETURNING)):
        world.call(order)
        until(world, lambda then=then: world.state.mode is then)
    before = len(world.presences)
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.run(0.2)
    for said, after in pairwise(world.presences[before:]):
        assert _owned(after) <= set(said.way.sections.ids.tolist()), "asked before"
    world.call(Continue())
    until(world, lambda: world.state.program.state is ProgramState.DONE)


def test_a_silent_manager_ends_what_is_owned_beyond_the_way_to_rest() -> None:
    world = _running(THERE_AND_BACK)
    world.run(0.3)
    world.manager_silent = True
    world.run(0.6)
    assert _owned(world.presences[-1]) == _used(world.presences[-1])


def test_backwards_what_lies_behind_is_asked_for() -> None:
    world = _running(THERE_AND_BACK)
    world.run(0.3)
    world.call(SetOverride(-0.5))
    world.run(0.5)
    way = world.presences[-1].way
    assert way.owned > way.committed
    back = world.played[-1][0]
    world.run(0.3)
    assert world.played[-1][0] < back


def test_a_jog_asks_for_what_is_in_front_of_it_and_stands_without() -> None:
    world = _ready("END")
    world.clears = 0
    key = Key(world, jog("J1", 0.3))
    key.hold(1.0)
    stood = world.played[-1].copy()
    assert np.abs(stood - world.played[0]).max() < 0.02
    assert "right is in the way" in world.state.waiting_for
    world.clears = None
    key.hold(2.0)
    assert world.played[-1][0] - stood[0] > 0.1


def test_a_part_is_taken_once_there_is_room_for_it() -> None:
    world = _running(PICK)
    until(world, lambda: bool(world.state.tcp_speed_m_s))
    executive = world.agent.executive
    assert executive is not None
    until(world, lambda: executive.at_motion_end)
    world.clears = 0
    world.run(1.0)
    assert world.state.part == ""
    assert world.state.waiting_for == "right is in the way"
    world.clears, before = None, len(world.presences)
    until(world, lambda: world.state.part == "rod")
    world.run(0.1)
    capsules = [len(each.body.radii_m) for each in world.presences]
    taken = next(k for k in range(before, len(capsules)) if capsules[k] > capsules[before - 1])
    assert _used(world.presences[taken]) <= set(world.presences[taken - 1].way.sections.ids.tolist()), "asked before"
    until(world, lambda: world.state.program.state is ProgramState.DONE)
