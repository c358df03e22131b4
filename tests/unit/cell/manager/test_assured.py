"""The manager and what operators say of where robots stay: told, kept in the journal, ended by itself."""

from dataclasses import replace
from pathlib import Path

import pytest

from cell.manager.journal import Journal
from cell.manager.records import AssuranceEnded, Assured
from cell.messages import Assurance, Confinement, ConfineRobot, EndAssurance, Heard, RobotStands
from tests.unit.cell.manager.separation.sections_on_a_line import place
from tests.unit.manager_world import World, settings

BOX = Confinement((1.0, 2.0, 3.0), (0.1, -0.2, 0.3), (0.0, 0.0, 0.6, 0.8))
CONFINE = ConfineRobot("right", BOX, "me")


@pytest.fixture
def world() -> World:
    """Right has lost where it is."""
    world = World().run(0.2)
    world.right.known = False
    return world.run(0.2)


def test_it_is_told_in_the_state_and_as_an_event_and_stored(world: World) -> None:
    reply = world.call(CONFINE)
    assert reply.ok
    world.run()
    assert world.state.assured == {"right": Assurance("me", BOX)}
    (event,) = [each for each in world.events if each.code == "robot_assured"]
    assert event.text == f"{reply.text}; said by me"
    (record,) = [each for each in world.records if isinstance(each, Assured)]
    assert (record.robot, record.assurance) == ("right", Assurance("me", BOX))


def test_it_ends_by_itself_and_by_an_order(world: World) -> None:
    world.call(CONFINE)
    world.right.known = True
    world.run(0.2)
    assert world.state.assured == {}
    assert [each.robot for each in world.records if isinstance(each, AssuranceEnded)] == ["right"]
    world.right.known = False
    world.run(0.2)
    world.call(CONFINE)
    assert world.call(EndAssurance("right", "me")).text == "what was said of where right stays counts no more"
    assert world.call(EndAssurance("right", "me")).text == "nobody has said where right stays"
    assert world.run().state.assured == {}
    assert world.codes().count("assurance_over") == 2


def test_a_manager_that_is_started_again_takes_it_up(world: World, tmp_path: Path) -> None:
    world.call(CONFINE)
    with Journal(tmp_path / "j") as journal:
        for record in world.records:
            journal.write(record)
        stored = journal.read()
    world.restart_manager(8, "m2", stored)
    world.right.silent = True
    assert world.run(1.0).state.assured == {}
    world.run(settings().times.moves_alone_s)
    assert world.state.assured == {"right": Assurance("me", BOX)}


@pytest.mark.parametrize("assurance", [Assurance("me"), Assurance("you", BOX)])
def test_the_journal_keeps_a_word_until_it_is_over(tmp_path: Path, assurance: Assurance) -> None:
    word = Assured("right", assurance, place(0.5, 0.75))
    with Journal(tmp_path / "j") as journal:
        journal.write(Assured("right", Assurance("somebody"), place(0.1)))
        journal.write(word)
        journal.write(Assured("left", Assurance("me"), place()))
    with Journal(tmp_path / "j") as journal:
        left, right = journal.read().assured
        assert (left.robot, len(left.place)) == ("left", 0)
        assert (right.robot, right.assurance) == ("right", assurance)
        for found, written in (
            (right.place.ids, word.place.ids),
            (right.place.points, word.place.points),
            (right.place.radii, word.place.radii),
        ):
            assert (found.dtype, found.tolist()) == (written.dtype, written.tolist())
        for robot in ("left", "right"):
            journal.write(AssuranceEnded(robot))
        assert journal.read().assured == ()


def test_what_makes_no_sense_is_refused(world: World) -> None:
    assert world.call(RobotStands("middle", "me")).text == "no robot 'middle'; this cell has left, right"
    assert not world.call(RobotStands("left", "me")).ok, "it says itself where it is"
    old = Heard(world.state.boot, world.state.sequence)
    world.run(1.0)
    assert "too old" in world.call(CONFINE, old).text
    alone = World(replace(settings(), separation=None)).run()
    assert alone.call(CONFINE).text.startswith("this cell does not keep its robots apart (`separation`)")
