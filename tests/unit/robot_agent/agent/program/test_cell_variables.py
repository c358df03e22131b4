"""Variables of the cell: set where the robot is, told to all, and asked only while they are young."""

import numpy as np
import pytest

from cell.manager.variables import Variables
from cell.messages import (
    CellTime,
    CellVariables,
    Continue,
    Enable,
    Halt,
    Mode,
    RobotVariables,
    Run,
    SetOverride,
    VariableValue,
)
from robot_agent.language import Names, ProgramError, parse_program
from tests.unit.agent_runs import at_rest, ended
from tests.unit.agent_world import AgentWorld

OWNERS = {"boxes": "left", "taken": "right"}
COUNTS = "LET boxes = 1\nMJ J1=10 F=20\nLET boxes = boxes + 1\nMJ J1=20 F=20\nLET boxes = boxes * 10\nEND"
ASKS = "MJ J1=5\nIF taken >= 3\nMJ J1=20\nENDIF\nMJ J2=-5\nEND"


def passed_on(told: RobotVariables) -> CellVariables:
    return CellVariables({told.robot: told})


class Pair:
    """The left robot as it is, and of the right one what it tells."""

    def __init__(self, program: str, taken: float | None = None) -> None:
        self.taken = taken
        self.delay_s = 0.0
        self.silent = False
        self.told = 0
        self.world = AgentWorld(program, variables=OWNERS)
        self.until(lambda: self.world.states != [] and self.world.state.mode is Mode.DISABLED)
        self.world.call(Enable())
        self.until(lambda: self.world.state.mode is Mode.READY)
        self.world.call(Run())
        self.until(lambda: self.world.state.mode is Mode.RUNNING)

    def step(self) -> None:
        if not self.silent:
            self.told += 1
            at = CellTime("m", self.world.now - self.delay_s)
            value = VariableValue(self.taken or 0.0, "right.prog", 3, at)
            values = {} if self.taken is None else {"taken": value}
            self.world.agent.receive(passed_on(RobotVariables("right", "r", 1, self.told, at, values)), self.world.now)
        self.world.step()

    def until(self, done, seconds: float = 20.0) -> None:  # type: ignore[no-untyped-def]
        end = self.world.now + seconds
        while not done():
            assert self.world.now < end, self.world.state
            self.step()

    @property
    def boxes(self) -> float | None:
        """As it was told last."""
        told = self.world.variables[-1].values.get("boxes")
        return None if told is None else told.value


def degrees(world: AgentWorld) -> float:
    return float(np.degrees(world.commanded[0]))


def test_a_let_happens_where_the_robot_is_and_says_who_set_it_and_when() -> None:
    pair = Pair(COUNTS)
    seen = []
    while not ended(pair.world)():
        pair.step()
        if pair.world.variables and (not seen or seen[-1][0] != pair.boxes):
            seen.append((pair.boxes, degrees(pair.world), pair.world.variables[-1].values.get("boxes"), pair.world.now))
    pair.step()
    last = pair.world.variables[-1].values["boxes"]
    values = [value for value, *_ in seen] + [last.value]
    assert [each for each in dict.fromkeys(values) if each is not None] == [1.0, 2.0, 20.0]
    second = next(each for each in seen if each[0] == 2.0)
    assert 9.9 < second[1] < 12.0
    assert (second[2].program, second[2].line) == ("left.prog", 3)
    assert second[2].at is not None
    assert second[2].at.seconds == pytest.approx(second[3], abs=0.15)


def test_moves_join_over_it_and_going_back_or_a_halt_sets_nothing_twice() -> None:
    program = "MJ J1=10 J2=0 J3=0 J4=0 J5=30 J6=0 F=20 R=20\nLET boxes = boxes + 1\nMJ J1=10 J2=10 F=20\nEND"
    pair = Pair(f"LET boxes = 0\n{program}")
    pair.until(lambda: pair.boxes == 1.0)
    assert not at_rest(pair.world)()
    pair.world.call(Halt())
    pair.until(lambda: pair.world.state.mode is Mode.HALTED)
    pair.world.call(SetOverride(-50.0))
    pair.world.call(Continue())
    for _ in range(30):
        pair.step()
    pair.world.call(SetOverride(100.0))
    pair.until(ended(pair.world))
    assert pair.boxes == 1.0


def test_it_outlives_the_run_and_is_unset_after_a_start() -> None:
    pair = Pair(COUNTS)
    pair.until(ended(pair.world))
    pair.world.call(Run())
    pair.until(lambda: pair.world.state.mode is Mode.RUNNING)
    assert pair.boxes == 20.0
    counting = Pair("MJ J1=5\nLET boxes = boxes + 1\nEND")
    counting.until(lambda: counting.world.state.program.error != "")
    assert "the variable boxes is not set yet" in counting.world.state.program.error


@pytest.mark.parametrize(("taken", "place"), [(2.0, 5.0), (3.0, 20.0)])
def test_another_robots_variable_decides_at_rest(taken: float, place: float) -> None:
    pair = Pair(ASKS, 3.0 if taken == 2.0 else 2.0)
    pair.until(lambda: degrees(pair.world) > 4.0)
    pair.taken = taken
    pair.until(ended(pair.world))
    assert max(np.degrees(q[0]) for q in pair.world.played) == pytest.approx(place)


@pytest.mark.parametrize(
    ("trouble", "why"),
    [
        ("silent", "IF: nothing young is heard of variable taken, which right sets"),
        ("late", "IF: nothing young is heard of variable taken, which right sets"),
        ("unset", "IF: right has not set variable taken since its agent was started"),
    ],
)
def test_what_is_not_young_or_not_set_decides_nothing(trouble: str, why: str) -> None:
    pair = Pair(ASKS, None if trouble == "unset" else 3.0)
    pair.until(lambda: degrees(pair.world) > 4.99)
    pair.silent = trouble == "silent"
    pair.delay_s = 1.0 if trouble == "late" else 0.0
    pair.until(lambda: pair.world.state.waiting_for == why)
    for _ in range(50):
        pair.step()
    assert at_rest(pair.world)()
    pair.silent, pair.delay_s, pair.taken = False, 0.0, 3.0
    pair.until(ended(pair.world))


def test_a_run_before_counts_no_more() -> None:
    pair = Pair(ASKS, 9.0)
    before = RobotVariables("right", "old", 0, 10**6, CellTime("m", pair.world.now), {})
    pair.world.agent.receive(passed_on(before), pair.world.now)
    pair.until(ended(pair.world))


def test_the_manager_passes_on_the_newest_of_each_robot_that_sets_one() -> None:
    manager = Variables(OWNERS)
    for told in (RobotVariables("right", "r", 2, n, None, {}) for n in (7, 5)):
        manager.heard(told)
    manager.heard(RobotVariables("right", "old", 1, 99, None, {}))
    manager.heard(RobotVariables("nobody", "x", 1, 1, None, {}))
    news = manager.news()
    assert news is not None
    assert {robot: told.sequence for robot, told in news.robots.items()} == {"right": 7}
    assert manager.news() is None


@pytest.mark.parametrize(
    ("program", "found"),
    [
        ("LET taken = 1", "found LET taken, which is set by robot right, by variables of the cell file, allowed"),
        ("LET n = taken + 1", "found the variable `taken`, which robot right sets, allowed a variable of this robot"),
        ("IF token = 1\nENDIF", "found the variable `token`, which is never set"),
    ],
)
def test_whose_variable_it_is_is_known_before_a_robot_moves(program: str, found: str) -> None:
    with pytest.raises(ProgramError) as error:
        parse_program(program, "p", Names(("J1",), robot="left", variables=OWNERS))
    assert found in str(error.value)
