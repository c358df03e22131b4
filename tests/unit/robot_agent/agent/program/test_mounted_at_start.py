"""A cell file that vouches for what is mounted whenever an agent starts, and when that counts no more."""

from dataclasses import replace
from pathlib import Path

import pytest

from cell.config.settings import MountedAtStart
from cell.messages import Halt, Mode, Run, SetPart, SetTool
from robot_agent.agent.mount_note import MountNote
from robot_agent.kinematics import SixAxis
from tests.unit.agent_runs import ended, until
from tests.unit.agent_world import AgentWorld
from tests.unit.robot_agent.agent.program.mounted_arm import ARM, CHANGE, PLATE, ROD, answer, capsules, ready

WITH_PARTS = SixAxis(replace(ARM.description, parts={"rod": ROD, "plate": PLATE}))
AND_BACK = "MJ J1=10\nT=lance\nMJ J1=20 F=10\nT=gripper\nEND"


def vouched(program: str, *, doubt: bool = False, arm: SixAxis = WITH_PARTS) -> AgentWorld:
    at_start = MountedAtStart.AS_DESCRIBED
    return ready(program, tool="", arm=arm, mounted_at_start=at_start, mount_in_doubt=doubt)


def test_a_program_that_changes_tools_runs_without_a_word_of_an_operator() -> None:
    world = vouched(AND_BACK)
    assert (world.state.tool, world.state.part) == ("gripper", "")
    assert capsules(world.presences[-1]) == len(ARM.description.capsules) + 1
    assert answer(world, Run()).ok
    assert world.mount_in_doubt
    until(world, ended(world))
    world.step()
    assert not world.mount_in_doubt


def test_where_the_agent_ends_before_its_program_the_next_one_asks() -> None:
    world = vouched(AND_BACK)
    assert answer(world, Run()).ok
    until(world, lambda: world.state.tool == "lance")
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED)
    assert world.mount_in_doubt
    after = vouched(AND_BACK, doubt=True)
    assert (after.state.tool, after.state.part) == (None, None)
    refused = answer(after, Run())
    assert "does not count: the agent ended before a program that changes it had; look, then `cell tool" in refused.text
    assert answer(after, SetTool("gripper")).ok
    assert answer(after, SetPart(None)).ok
    after.step()
    assert not after.mount_in_doubt
    assert answer(after, Run()).ok


def test_a_program_that_ends_with_another_tool_leaves_that_in_doubt_until_the_first_one_is_back() -> None:
    world = vouched(CHANGE.replace("T=gripper", "T=lance"))
    assert answer(world, Run()).ok
    until(world, ended(world))
    world.step()
    assert world.mount_in_doubt
    for tool, doubt in (("lance", True), ("gripper", False)):
        assert answer(world, SetTool(tool)).ok
        answer(world, SetPart(None))
        world.step()
        assert world.mount_in_doubt is doubt


@pytest.mark.parametrize("at_start", MountedAtStart)
def test_nothing_is_noted_of_a_program_that_changes_nothing(at_start: MountedAtStart) -> None:
    world = ready("MJ J1=10\nEND", tool="", mounted_at_start=at_start)
    assert answer(world, Run()).ok
    until(world, ended(world))
    assert not world.mount_in_doubt


def test_a_note_outlives_the_process_that_made_it(tmp_path: Path) -> None:
    for kept in (True, False, True):
        note = MountNote(tmp_path, "left")
        note.keep(not kept)
        note.keep(kept)
        note.close()
        assert MountNote(tmp_path, "left").doubtful is kept
    assert not MountNote(tmp_path, "right").doubtful
