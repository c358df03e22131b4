"""Inputs of the cell in a program: what an application says again and again on a key of its own."""

import pytest

from cell.config.points_file import Signal, SignalKind
from cell.core import Frozen
from cell.messages import Enable, Mode, Run
from cell.net.plain import PlainSlots, PlainText
from robot_agent.language import Names, ProgramError, parse_program
from tests.unit.agent_runs import at_rest, ended
from tests.unit.agent_world import AgentWorld

PALLET = {"pallet": Signal(SignalKind.KEY, "plant/pallet", 0.5)}
WAITS = "MJ J1=5\nWAIT DI pallet\nMJ J1=10\nEND"
AHEAD = "LOOKAHEAD 1\nMJ J1=5\nIF NOT DI pallet\nMJ J1=20\nENDIF\nMJ J1=10\nEND"


class Plant:
    """A robot, and an application that repeats what it says on its key."""

    def __init__(self, program: str, said: str | None) -> None:
        self.said = said
        self.world = AgentWorld(program, signals=PALLET)
        self.until(lambda: self.world.states != [] and self.world.state.mode is Mode.DISABLED)
        self.world.call(Enable())
        self.until(lambda: self.world.state.mode is Mode.READY)
        self.world.call(Run())

    def step(self) -> None:
        if self.said is not None:
            self.world.agent.receive(PlainText("plant/pallet", self.said, self.world.now), self.world.now)
        self.world.step()

    def until(self, done, seconds: float = 10.0) -> None:  # type: ignore[no-untyped-def]
        end = self.world.now + seconds
        while not done():
            assert self.world.now < end, self.world.state
            self.step()

    def waits_for(self, why: str) -> None:
        self.until(lambda: self.world.state.waiting_for == why and at_rest(self.world)())


def test_a_key_is_waited_for_as_an_input_is() -> None:
    plant = Plant(WAITS, "false")
    assert plant.world.heard_keys == ("plant/pallet",)
    plant.waits_for("key plant/pallet is off, WAIT DI goes on when it is on")
    plant.said = " true\n"
    plant.until(ended(plant.world))


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (None, "WAIT DI: nothing is heard on key plant/pallet"),
        ("on", "WAIT DI: key plant/pallet says `on`, allowed are true and false"),
        ("\ufffd" * 500, "WAIT DI: key plant/pallet says `" + "\ufffd" * 20 + "`, allowed are true and false"),
    ],
)
def test_a_key_that_says_nothing_of_use_is_neither_on_nor_off(said: str | None, why: str) -> None:
    Plant(WAITS, said).waits_for(why)


def test_what_was_said_before_the_robot_came_or_before_a_freeze_does_not_count() -> None:
    plant = Plant(WAITS, "true")
    plant.until(lambda: plant.world.commanded[0] > 0.087)
    plant.said = None
    plant.until(lambda: "nothing young is heard on key plant/pallet: the newest is 1." in plant.world.state.waiting_for)
    plant.world.agent.receive(PlainText("plant/pallet", "true", plant.world.now - 3.0), plant.world.now)
    plant.world.run(0.3)
    assert not ended(plant.world)()
    plant.world.agent.receive(PlainText("plant/pallet", "true", plant.world.now), plant.world.now)
    plant.world.agent.receive(Frozen(1.0), plant.world.now)
    plant.world.run(0.1)
    assert plant.world.state.waiting_for == "WAIT DI: nothing is heard on key plant/pallet"


def test_ahead_of_the_motion_a_key_counts_while_it_is_fresh() -> None:
    plant = Plant(AHEAD, "true")
    plant.until(ended(plant.world))
    assert max(q[0] for q in plant.world.played) < 0.2


def test_a_key_is_no_output() -> None:
    with pytest.raises(ProgramError, match="unknown output `pallet`"):
        parse_program("SET DO pallet", "p", Names(("J1",), outputs=("glue",), signals=PALLET))


def test_of_a_key_only_the_newest_text_waits_and_no_more_than_is_looked_at() -> None:
    slots = PlainSlots(lambda: 7.0)
    slots.store("a", b"false")
    slots.store("a", b"true" * 10_000)
    slots.store("b", b"\xff")
    assert [(each.key, len(each.text), each.at) for each in slots.take_new()] == [("a", 1000, 7.0), ("b", 1, 7.0)]
    assert slots.take_new() == []
