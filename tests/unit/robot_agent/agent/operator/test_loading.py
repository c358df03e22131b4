"""A robot takes another program, or its present one anew, without a restart of its agent."""

from pathlib import Path

import numpy as np
import pytest

from cell.messages import Command, Continue, Enable, Estop, Halt, Load, Mode, PointKind, ProgramState, Reply, Run, Teach
from tests.unit.agent_runs import at_rest, ended, until
from tests.unit.agent_world import AgentWorld

AWAY = "MJ J1=60 F=50\nHOME\nEND"


def standing(folder: Path, program: str = "MJ J1=20\nEND") -> AgentWorld:
    (folder / "left.prog").write_text(program)
    world = AgentWorld(program, points_file=folder / "left.points.yaml")
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    return world


def enabled(folder: Path, program: str = "MJ J1=20\nEND") -> AgentWorld:
    world = standing(folder, program)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    return world


def answer(world: AgentWorld, command: Command) -> Reply:
    call = world.call(command)
    until(world, lambda: call in world.replies)
    world.step()
    return world.replies[call]


def j1(world: AgentWorld) -> float:
    return float(np.degrees(world.commanded[0]))


def test_another_program_runs_without_a_restart_and_its_name_is_told(tmp_path: Path) -> None:
    world = enabled(tmp_path)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "lid.prog").write_text("MJ J1=-15\nEND\n")
    reply = answer(world, Load("parts/lid.prog"))
    assert (reply.ok, reply.text) == (
        True,
        "left has taken lid.prog, 2 lines; `cell run left` starts it; "
        "after the next start of its agent left.prog of the cell file counts again",
    )
    assert (world.state.program.name, world.state.program.state) == ("lid.prog", ProgramState.LOADED)
    assert [event.code for event in world.events][-1] == "program_loaded"
    world.call(Run())
    until(world, ended(world))
    assert j1(world) == pytest.approx(-15.0)


def test_the_present_program_is_read_anew_with_what_it_calls_and_its_points(tmp_path: Path) -> None:
    world = enabled(tmp_path)
    (tmp_path / "left.prog").write_text("CALL side.prog 1\nEND\n")
    (tmp_path / "side.prog").write_text("MJ P=aside\n")
    (tmp_path / "left.points.yaml").write_text("points: {aside: {J1: 7, J2: 0, J3: 0, J4: 0, J5: 30, J6: 0}}\n")
    assert answer(world, Load()).text == "left has taken left.prog, 3 lines; `cell run left` starts it"
    world.call(Run())
    until(world, ended(world))
    assert j1(world) == pytest.approx(7.0)


def test_how_far_it_is_planned_is_told_with_the_file_that_the_line_is_in(tmp_path: Path) -> None:
    world = enabled(tmp_path)
    (tmp_path / "left.prog").write_text("WAIT 0.1\nCALL side.prog 1\nMJ J1=5\nEND\n")
    (tmp_path / "side.prog").write_text("WAIT 0.1\nWAIT 0.1\nMJ J1=7\n")
    assert answer(world, Load()).ok
    assert (world.state.program.planned_in, world.state.program.planned_to) == ("", 0)
    told = set[tuple[str, int]]()
    world.call(Run())

    def is_over() -> bool:
        told.add((world.state.program.planned_in, world.state.program.planned_to))
        return world.state.program.state is ProgramState.DONE

    until(world, is_over)
    assert {("side.prog", 3), ("left.prog", 3)} <= told <= {("", 0), ("side.prog", 3), ("left.prog", 3)}


def test_without_a_file_the_one_that_was_loaded_last_is_read(tmp_path: Path) -> None:
    world = standing(tmp_path)
    (tmp_path / "lid.prog").write_text("MJ J1=-15\nEND\n")
    assert answer(world, Load("lid.prog")).ok
    (tmp_path / "lid.prog").write_text("MJ J1=-15\nMJ J1=0\nEND\n")
    assert answer(world, Load()).text.startswith("left has taken lid.prog, 3 lines")


def test_all_mistakes_are_told_and_the_old_program_stays(tmp_path: Path) -> None:
    world = enabled(tmp_path)
    (tmp_path / "lid.prog").write_text("MJ J9=1\nMOVE\nCALL none.prog 1\nEND\n")
    (tmp_path / "left.points.yaml").write_text("points: {aside: {J1: 7}}\n")
    reply = answer(world, Load("lid.prog"))
    assert not reply.ok
    first, *mistakes, remedy = reply.text.splitlines()
    assert first == "left keeps its program, the new one is refused:"
    places = [line.split(": ")[0].rsplit("/", 1)[1] for line in mistakes]
    assert places == ["left.points.yaml:1:17", "lid.prog:1:4", "lid.prog:2:1", "lid.prog:3:6"]
    assert remedy == "correct it and load again; `cell check` looks at all programs of a cell, `cell plot` at one"
    assert world.state.program.name == "left.prog"
    world.call(Run())
    until(world, ended(world))
    assert j1(world) == pytest.approx(20.0)


def test_of_many_mistakes_ten_are_told_and_none_at_length(tmp_path: Path) -> None:
    world = standing(tmp_path)
    (tmp_path / "lid.prog").write_text("".join(f"{'x' * 10_000}{number} 1\n" for number in range(25)))
    lines = answer(world, Load("lid.prog")).text.splitlines()
    assert (len(lines), lines[-2]) == (13, "and 15 more")
    assert max(map(len, lines)) <= 301


@pytest.mark.parametrize("file", ["/etc/passwd", "../other.prog", "a/../../b.prog", "", "a\0b"])
def test_only_files_below_the_folder_of_the_cell_file_are_read(tmp_path: Path, file: str) -> None:
    reply = answer(standing(tmp_path), Load(file))
    assert (reply.ok, "allowed is one in the folder of the cell file" in reply.text) == (False, True)


@pytest.mark.parametrize(("file", "found"), [("none.prog", "no such file"), ("parts", "a folder")])
def test_what_cannot_be_read_is_told(tmp_path: Path, file: str, found: str) -> None:
    (tmp_path / "parts").mkdir()
    reply = answer(standing(tmp_path), Load(file))
    assert (reply.ok, found in reply.text) == (False, True), reply.text


def test_a_running_program_is_not_exchanged(tmp_path: Path) -> None:
    world = enabled(tmp_path, AWAY)
    world.call(Run())
    until(world, lambda: j1(world) > 5.0)
    assert answer(world, Load()).text == "left is in mode running: halt it first with `cell halt left`"
    until(world, ended(world))


def test_a_program_that_begins_while_the_other_one_is_read_goes_on(tmp_path: Path) -> None:
    world = enabled(tmp_path, AWAY)
    (tmp_path / "lid.prog").write_text("MJ J1=-15\nEND\n")
    world.files_held = True
    call = world.call(Load("lid.prog"))
    world.step()
    taught = answer(world, Teach("here", PointKind.JOINTS, None, replace=False))
    assert taught.text == "a program of left is being read, and its points: teach once that is done"
    world.call(Run())
    until(world, lambda: j1(world) > 5.0)
    world.release_files()
    until(world, lambda: call in world.replies)
    assert world.replies[call].text == (
        "lid.prog is good, and was not taken: left is in mode running: halt it first with `cell halt left`, "
        "then load it again"
    )
    until(world, ended(world))
    assert world.state.program.name == "left.prog"


def test_a_halted_program_ends_by_it_and_the_robot_stays_where_it_is(tmp_path: Path) -> None:
    world = enabled(tmp_path, AWAY)
    world.call(Run())
    until(world, lambda: j1(world) > 20.0)
    world.call(Halt())
    until(world, lambda: at_rest(world)() and world.state.mode is Mode.HALTED)
    world.run(0.5)
    before = world.commanded
    (tmp_path / "left.prog").write_text("MJ J1=0\nEND\n")
    assert "the program that was begun has ended by that" in answer(world, Load()).text
    assert world.state.mode is Mode.READY
    assert not answer(world, Continue()).ok
    world.run(1.0)
    np.testing.assert_array_equal(world.commanded, before)
    world.call(Run())
    until(world, ended(world))
    assert j1(world) == pytest.approx(0.0, abs=1e-9)


def test_an_interrupted_program_does_not_come_back_after_another_one_was_loaded(tmp_path: Path) -> None:
    world = enabled(tmp_path, AWAY)
    world.call(Run())
    until(world, lambda: j1(world) > 20.0)
    world.agent.receive(Estop("e1", True, "test", "test"), world.now)
    world.quick_stop()
    world.run(0.5)
    assert "clear the emergency stop" in answer(world, Load()).text
    world.agent.receive(Estop("e1", False, "test", ""), world.now)
    world.faulty = False
    until(world, lambda: world.state.mode in (Mode.DISABLED, Mode.FAULT))
    assert world.state.mode is Mode.DISABLED
    assert answer(world, Load()).ok
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    assert world.state.program.state is ProgramState.LOADED


def test_who_waits_is_answered_when_the_gateway_is_lost(tmp_path: Path) -> None:
    world = enabled(tmp_path)
    world.files_held = True
    call = world.call(Load())
    world.step()
    world.agent.link.feedback = None
    world.feedback_lost = True
    until(world, lambda: call in world.replies)
    assert world.replies[call].text == "the robot's gateway has not accepted this agent yet"
    world.files_held = world.feedback_lost = False
    world.release_files()
    until(world, lambda: world.state.mode is not Mode.STARTING)
    assert answer(world, Load()).ok
