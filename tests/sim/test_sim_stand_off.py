"""Robots that wait for each other are parted by an operator, those that only wait are left alone."""

from pathlib import Path
from types import SimpleNamespace

from cell.messages import Deadlock, Halt, Mode, ProgramState, ProgramStatus, RobotState, SetOverride
from tests.sim.apart_cell import QUIET, apart_cell
from tests.sim.jog_aside import JogAside
from tests.sim.judge import Judge
from tests.sim.staff import Staff
from tests.sim.stand_off import StandOffs
from tests.sim.world import World, load_bundle

_STEP_S = 0.3
_PROGRAM = ProgramStatus("p", ProgramState.RUNNING, 3, "")


class _Two:
    """Two robots that say whom they wait for, and what they are ordered."""

    def __init__(self, **waiting_for: str) -> None:
        self.facts = SimpleNamespace(
            robots=tuple(waiting_for),
            now=0.0,
            moving=lambda robot: robot in self.moves,
            inside_now=lambda robot: self.inside.get(robot, frozenset()),
        )
        self.moves: set[str] = set()
        self.inside: dict[str, frozenset[str]] = {}
        self.mode = dict.fromkeys(waiting_for, Mode.RUNNING)
        self.waiting_for = waiting_for
        self.ordered: list[tuple[str, object]] = []
        self.stand_offs = StandOffs(self.facts, lambda robot, order: self.ordered.append((robot, order)))  # type: ignore[arg-type]

    def lasts(self, seconds: float) -> list[tuple[str, object]]:
        """What is ordered meanwhile."""
        self.ordered = []
        until = self.facts.now + seconds
        while self.facts.now < until:
            self.facts.now += _STEP_S
            self.stand_offs.look(
                RobotState(robot, "b", 1, self.mode[robot], _PROGRAM, *[None] * 4, None, waiting_for=text)
                for robot, text in self.waiting_for.items()
            )
        return self.ordered


def test_of_two_that_wait_for_each_other_one_is_let_back_halted_and_goes_on_after_the_other() -> None:
    two = _Two(r0="zone middle: held by r1 since 2 s", r1="r1's hand would come into where r0's hand may be")
    assert two.lasts(2.5) == [], "they may get on by themselves"
    assert set(two.lasts(1.0)) == {("r0", SetOverride(-50.0))}
    two.moves = {"r0"}
    assert set(two.lasts(1.0)) == {("r0", SetOverride(-50.0))}
    two.moves = {"r1"}
    two.waiting_for["r1"] = ""
    assert ("r0", Halt()) in two.lasts(1.5)
    two.mode["r0"] = Mode.HALTED
    assert two.stand_offs.busy_with("r0")
    assert two.lasts(7.0) == []
    assert not two.stand_offs.busy_with("r0")


def test_it_is_another_one_s_turn_the_next_time() -> None:
    two = _Two(r0="r1 is in the way", r1="r0 is in the way")
    backs = {robot for robot, order in two.lasts(30.0) if isinstance(order, SetOverride)}
    assert backs == {"r0", "r1"}


def test_one_that_returns_to_its_path_is_not_let_back_but_the_other_one_is() -> None:
    two = _Two(r0="zone middle: held by r1 since 2 s", r1="r1's hand would come into where r0's hand may be")
    two.mode["r0"] = Mode.RETURNING
    assert set(two.lasts(4.0)) == {("r1", SetOverride(-50.0))}


def test_one_that_is_out_of_the_zone_that_the_other_one_waits_for_goes_back_no_farther() -> None:
    """What is kept of its path may begin in the zone again (seed 110646)."""
    two = _Two(r0="zone middle: held by r1 since 2 s", r1="r1's hand would come into where r0's hand may be")
    two.mode["r0"], two.inside = Mode.RETURNING, {"r1": frozenset({"middle"})}
    assert set(two.lasts(4.0)) == {("r1", SetOverride(-50.0))}
    two.moves = {"r1"}
    assert set(two.lasts(1.0)) == {("r1", SetOverride(-50.0))}
    two.inside = {}
    assert set(two.lasts(1.0)) == {("r1", Halt())}


def test_who_waits_for_one_that_moves_or_has_ended_is_left_alone() -> None:
    assert _Two(r0="r1 is in the way", r1="").lasts(10.0) == []
    moves = _Two(r0="r1 is in the way", r1="r0 is in the way")
    moves.moves = {"r1"}
    assert moves.lasts(10.0) == []


def test_where_each_has_been_let_back_and_they_meet_again_one_is_jogged_aside() -> None:
    """What is kept of its path does not suffice, which the manager does not know (seed 260353)."""
    manager, ordered = SimpleNamespace(cell_time=0.0, deadlocks=()), list[object]()
    world = SimpleNamespace(operator=lambda _: SimpleNamespace(manager=manager))
    jog_aside = JogAside(world, SimpleNamespace(now=0.0), "pat", lambda robot, order: ordered.append((robot, order)))  # type: ignore[arg-type]
    states = [RobotState(robot, "b", 1, Mode.RUNNING, _PROGRAM, *[None] * 4, None) for robot in ("r0", "r1")]
    for since in (0.0, 13.0, 26.0):
        assert ordered == []
        manager.deadlocks = (Deadlock(("r0", "r1"), (), since, "they wait for each other", "let r1 back"),)
        for manager.cell_time in (since + 1.0, since + 4.0):
            jog_aside.look(states, set())
    assert ordered == [("r0", Halt())]


_TO_ONE_PLACE = """MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=100
ML X=2000 Y=0 Z=1250 A=0 B=90 C=0 F=300
"""
"""So slowly that neither is there before the other one is in its way, whoever begins first."""


def test_where_no_way_back_frees_them_one_is_jogged_aside_and_the_other_gets_through(tmp_path: Path) -> None:
    cell = apart_cell(tmp_path, dict.fromkeys(("left", "right"), _TO_ONE_PLACE))
    world = World(load_bundle(cell), 1, QUIET)
    judge = Judge(world)
    staff = Staff(world, judge.facts)
    staff.endless = False
    assert world.clock.run_until(world.clock.now + 30.0, lambda: bool(staff.done))
    (standoff,) = [event for event in world.seen.events if event.code == "space_standoff"]
    assert "no way back frees them" in standoff.remedy
