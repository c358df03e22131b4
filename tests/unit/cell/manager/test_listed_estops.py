"""However many emergency stops are asked for, with whatever texts: all are obeyed, and one reset clears them."""

import sqlite3
from pathlib import Path

import pytest

from cell.manager.journal import Journal
from cell.manager.listed_estops import ONE_OF_MANY, ListedEstops
from cell.manager.records import EstopCleared, EstopLatched
from cell.messages import Call, Estop, Heard, ManagerState, Presence, ResetEstop, SetEstop
from cell.messages.estop import LONGEST_WORDS
from cell.net.codec import MOST_URGENT_BYTES, decode, decode_call, encode, encode_call
from cell.net.estops import MOST_LISTED, MOST_OBEYED, REMEMBERED, ObeyedEstops
from tests.unit.manager_world import Robot, World


def stop(number: int, by: str = "door script", reason: str = "door open") -> Estop:
    return Estop(f"e{number}", True, by, reason)


class Obedient(Robot):
    """A robot that keeps its stops as agents do."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.estops = ObeyedEstops(self.boot)

    def listen(self, message: object) -> None:
        if isinstance(message, ManagerState):
            self.heard = Heard(message.boot, message.sequence)
            self.estops.answered(message, Heard(self.boot, self.sequence))
            for each in message.estops:
                self.estops.hear(each)
        if isinstance(message, Estop):
            self.estops.hear(message)

    def presence(self) -> Presence:
        first = self.estops.first
        self.estop = None if first is None else first.id
        if first is not None:
            self.estops.named(first.id, self.sequence + 1)
        return super().presence()


@pytest.fixture
def world() -> World:
    world = World()
    world.robots = {name: Obedient(name) for name in world.robots}
    return world.run()


def send(world: World, *stops: Estop) -> None:
    """Each goes to everybody, as on the network."""
    for each in stops:
        world.manager.receive(each, world.now)
        for robot in world.robots.values():
            robot.listen(each)
        world.run(0.01)


def reset(world: World) -> bool:
    """As `cell reset`: it clears what the state lists, in bytes as they travel."""
    shown = decode(ManagerState, encode(world.state)).estops
    call = Call("c", ResetEstop("me", tuple(each.id for each in shown)))
    ok = world.call(decode_call("manager", "reset", encode_call(call)).command).ok
    world.run(2.0)
    return ok


def test_a_thousand_stops_are_listed_as_few_and_end_by_one_reset(world: World) -> None:
    send(world, *map(stop, range(1005)))
    listed = world.state.estops
    assert [each.id for each in listed] == [*(f"e{n}" for n in range(MOST_LISTED - 1)), "e1004"]
    assert listed[-1].reason == "door open" + ONE_OF_MANY
    assert (world.left.estop, world.right.estop) == ("e0", "e0")
    assert reset(world)
    assert (world.state.estops, world.left.estop, world.right.estop) == ((), None, None)
    send(world, *map(stop, range(900, 1005)))
    assert world.run(1.0).state.estops == ()


def test_who_obeys_stops_that_are_not_listed_stands_until_they_are_cleared(world: World) -> None:
    world.left.listen(stop(50))
    send(world, *map(stop, range(100)))
    assert world.left.estop == "e50"
    assert world.call(SetEstop("e60", "me", "again")).text == "the emergency stop is set; confirmed by left, right"
    assert reset(world)
    assert (world.state.estops, world.left.estop) == ((), None)


def test_a_reset_clears_no_stop_that_came_after_its_list(world: World) -> None:
    send(world, *map(stop, range(MOST_LISTED + 10)))
    shown = [each.id for each in world.state.estops]
    send(world, stop(900))
    assert not world.call(ResetEstop("me", tuple(shown))).ok
    assert [each.id for each in world.run(3.0).state.estops] == ["e900"]
    assert (world.left.estop, world.right.estop) == ("e900", "e900")
    assert reset(world)
    assert world.left.estop is None


def test_a_script_that_stops_again_and_again_hides_no_other_stop(world: World) -> None:
    send(world, *map(stop, range(100)), stop(500, "bert", "person inside"), *map(stop, range(100, 200)))
    assert stop(500, "bert", "person inside" + ONE_OF_MANY) in world.state.estops
    assert len(world.state.estops) == MOST_LISTED


def test_a_robot_that_obeys_as_many_as_it_keeps_stands_under_a_later_one_too(world: World) -> None:
    send(world, *map(stop, range(MOST_OBEYED)), stop(900))
    shown = tuple(f"e{number}" for number in range(MOST_OBEYED))
    world.call(ResetEstop("me", shown))
    for _ in range(300):
        world.run(0.01)
        assert world.left.estop is not None
    assert world.left.estop == "e900"


@pytest.mark.parametrize("text", ["\x01" * 2**17, "," * 2**18, '\\"' * 2**17, "x" * (MOST_URGENT_BYTES - 100)])
def test_stops_with_the_longest_texts_are_obeyed_and_end_by_a_reset(world: World, text: str) -> None:
    send(world, *(decode(Estop, encode_long(number, text)) for number in range(MOST_LISTED + 5)))
    assert len(world.state.estops) == MOST_LISTED
    assert all(len(each.by + each.reason) <= 2 * LONGEST_WORDS for each in world.state.estops)
    assert reset(world)
    assert world.state.estops == ()


def encode_long(number: int, text: str) -> bytes:
    """As somebody else writes it."""
    data = encode(stop(number, "BY", "REASON"))
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\x01", "\\u0001").encode()
    return data.replace(b"BY", b"somebody").replace(b"REASON", escaped)


def test_after_a_restart_the_same_stops_are_in_force_and_a_reset_clears_them(world: World, tmp_path: Path) -> None:
    send(world, *map(stop, range(200)))
    with Journal(tmp_path / "j") as journal:
        for record in world.records:
            journal.write(record)
        stored = journal.read()
    listed = world.state.estops
    world.restart_manager(8, "m2", stored)
    assert world.run().state.estops == listed
    assert reset(world)
    assert (world.state.estops, world.left.estop) == ((), None)


def fill(path: Path, *stops: Estop, cleared: bool = False) -> None:
    """As managers before this version did."""
    with sqlite3.connect(path) as journal:
        rows = [
            (each.id, each.by, each.reason, n, "me" if cleared else None, n if cleared else None)
            for n, each in enumerate(stops)
        ]
        journal.executemany("INSERT INTO estops VALUES (?, ?, ?, ?, ?, ?)", rows)


def test_a_journal_that_holds_far_too_many_stops_starts_a_manager_that_can_be_reset(
    world: World, tmp_path: Path
) -> None:
    world.records.clear()
    with Journal(tmp_path / "j") as journal:
        fill(journal.path, *(stop(number, reason="x" * 2**17) for number in range(1500)))
        world.restart_manager(8, "m2", journal.read())
        world.run()
        assert len(world.state.estops) == MOST_LISTED
        assert reset(world)
        for record in world.records:
            journal.write(record)
        stored = journal.read()
    assert stored.estops == ()
    assert len(stored.cleared) == REMEMBERED


def test_the_journal_keeps_the_newest_stops_that_were_cleared(tmp_path: Path) -> None:
    with Journal(tmp_path / "j") as journal:
        fill(journal.path, *map(stop, range(REMEMBERED + 50)), cleared=True)
        journal.write(EstopLatched(stop(9999)))
        journal.write(EstopCleared("e9999", "me"))
        stored = journal.read()
    assert stored.cleared == (*(f"e{number}" for number in range(51, REMEMBERED + 50)), "e9999")
    with sqlite3.connect(tmp_path / "j") as database:
        assert list(database.execute("SELECT count(*) FROM estops")) == [(REMEMBERED,)]


def test_what_is_remembered_of_stops_is_bounded() -> None:
    estops = ListedEstops()
    for number in range(3 * REMEMBERED):
        assert estops.hear(stop(number))
    for each in estops.in_force:
        estops.hear(Estop(each.id, False, "", ""))
    assert estops.in_force == ()
    assert not estops.holds(f"e{3 * REMEMBERED - 100}")
    assert estops.was_cleared(f"e{3 * REMEMBERED - 100}")
    assert not estops.was_cleared("e40")
