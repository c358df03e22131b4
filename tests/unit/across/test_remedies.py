"""What the manager tells people to do exists, and helps: each command is taken from its own words and tried."""

import re
from pathlib import Path

import pytest

import cell.manager
from cell.commands.cell_command import COMMANDS
from cell.messages import AdoptZone, ClearZone, Command, Reply, ResetEstop, ZoneState
from tests.unit.manager_world import INSIDE, OUTSIDE, World


def commands(text: str) -> list[str]:
    """The command lines in a text, without `cell`."""
    return re.findall(r"`cell ([^`]+)`", text)


def obey(world: World, line: str) -> Reply:
    """Do what a command line does."""
    words: list[str] = line.split()
    orders: dict[str, Command] = {
        "reset": ResetEstop("me", tuple(estop.id for estop in world.state.estops)),
        "zone adopt": AdoptZone(*words[2:4], "me") if words[1:2] == ["adopt"] else ClearZone("", ""),
        "zone clear": ClearZone(words[-1], "me"),
    }
    return world.call(orders[" ".join(words[:2])])


def remedy(world: World, code: str) -> str:
    return next(event.remedy for event in reversed(world.events) if event.code == code)


@pytest.fixture
def intruder() -> World:
    """Right moves in the zone without a grant."""
    world = World().run()
    world.right.x, world.right.moving = INSIDE, True
    return world.run()


def test_after_a_breach_the_named_commands_let_the_robot_drive_out(intruder: World) -> None:
    told = remedy(intruder, "zone_breach")
    assert commands(told) == ["reset", "zone adopt middle right", "zone clear middle"]
    assert commands(intruder.state.refused["right"]) == ["zone adopt middle right", "zone clear middle"]
    intruder.right.moving = False
    for line in commands(told)[:2]:
        reply = obey(intruder, line)
        assert reply.ok, reply.text
    intruder.run()
    assert (intruder.zone.state, intruder.zone.holder) == (ZoneState.OCCUPIED, "right")
    assert intruder.state.refused == {}
    intruder.right.x = OUTSIDE
    assert intruder.run().zone.state is ZoneState.FREE


def test_a_robot_that_stands_inside_at_the_start_is_let_out_by_the_named_command() -> None:
    world = World()
    world.right.x = INSIDE
    world.run()
    [adopt, _] = commands(remedy(world, "zone_blocked"))
    assert obey(world, adopt).ok
    assert world.run().zone.holder == "right"


def test_a_zone_whose_holder_died_is_freed_by_the_named_command() -> None:
    world = World().run()
    world.left.wants = True
    world.run()
    world.left.silent = True
    world.run(0.5)
    assert "zone adopt middle left" in commands(remedy(world, "zone_orphaned"))
    assert obey(world, "zone clear middle").ok
    assert world.run().zone.state is ZoneState.FREE


def test_a_blocked_zone_says_who_still_blocks_it_and_the_command_that_frees_it() -> None:
    world = World()
    world.left.x = INSIDE
    world.run()
    world.right.x, world.right.known = 0.6, False
    world.run()
    assert world.zone.reason.startswith("left is inside without a grant; right does not know where it is: ")
    world.right.known = True
    world.run()
    assert world.zone.reason.startswith("left is inside without a grant: ")
    assert commands(world.zone.reason) == ["zone adopt middle left", "zone clear middle"]
    assert obey(world, "zone adopt middle left").ok
    assert (world.run().zone.holder, world.zone.reason) == ("left", "")


def test_a_refused_clear_names_who_must_adopt_and_that_helps() -> None:
    world = World().run()
    world.left.wants = True
    world.run()
    world.left.x = INSIDE
    world.run()
    world.left.restart("b2")
    world.run(0.5)
    refusal = world.call(ClearZone("middle", "me"))
    assert not refusal.ok
    assert [obey(world, line).ok for line in commands(refusal.text)] == [True]


def test_a_refused_adoption_names_the_two_commands_that_let_it_succeed() -> None:
    world = World().run()
    world.left.wants = True
    world.run()
    world.right.x, world.left.silent = INSIDE, True
    world.run(0.5)
    refusal = world.call(AdoptZone("middle", "right", "me"))
    assert not refusal.ok
    clear, adopt = commands(refusal.text)
    obey(world, clear)
    assert obey(world, adopt).ok


def test_every_command_that_the_manager_names_exists() -> None:
    named = set()
    for file in ("core", "zones", "deadlock", "presences"):
        text = (Path(cell.manager.__file__).parent / f"{file}.py").read_text().replace('"\n', "").replace('f"', "")
        named |= {tuple(line.split()[: 2 if line.startswith("zone") else 1]) for line in commands(text)}
    known = {tuple(words.split()) for words in COMMANDS}
    assert len(named) > 5
    assert named <= known
