"""Set-up in a whole cell: real cores of manager, agents and gateways over a network that loses and delays."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from cell.commands.checks import CellBundle
from cell.messages import (
    AxisStatus,
    Command,
    Disable,
    Enable,
    Halt,
    HoldSetup,
    Mode,
    MoveAxes,
    Reply,
    Run,
)
from tests.sim.network import Weather
from tests.sim.world import World, load_bundle

HOLD_S = 0.1
FINE = Weather(loss=0.0, double=0.0, late=0.0)
LOSSY = Weather(loss=0.05)


def move(robot: str, way: float = 0.3) -> MoveAxes:
    return MoveAxes(robot, {"J1": way}, True, 0.5, False)


class Cell:
    """Two arms, switched off; an operator per robot, whose tools hold what they have begun."""

    def __init__(self, seed: int = 1, weather: Weather = FINE) -> None:
        self.world = World(BUNDLE, seed, weather)
        self.held: set[str] = set()
        self.both: list[float] = []
        """When both arms moved by themselves or by a program."""
        self.world.clock.after(0.0, self._hold)
        self.until(lambda: len(self.modes) == 2 and set(self.modes.values()) == {Mode.DISABLED})
        self.until(lambda: all(state.ready for state in self.world.seen.gateways.values()))
        self.run(0.5)
        self._before = self.axes()
        self.world.clock.after(0.02, self._watch)

    @property
    def modes(self) -> dict[str, Mode]:
        return {name: state.mode for name, state in self.world.seen.robots.items()}

    def gateway(self, robot: str) -> str:
        return f"gateway/{self.world.cell.robots[robot].gateway}"

    def ask(self, to: str, command: Command) -> Reply:
        """The answer; a call that the network loses is given again, as people do."""
        for _ in range(10):
            before = len(self.world.seen.replies)

            def found(start: int = before) -> list[Reply]:
                return [reply for *asked, reply in self.world.seen.replies[start:] if asked == [to, command]]

            self.world.operate(to, command)
            self.world.clock.run_until(self.world.clock.now + 3.0, lambda f=found: bool(f()))
            if found() and "too old" not in found()[0].text:
                return found()[0]
        raise AssertionError(f"{to} never answered")

    def until(self, done, within_s: float = 10.0) -> None:  # type: ignore[no-untyped-def]
        assert self.world.clock.run_until(self.world.clock.now + within_s, done), (self.modes, self.setup)

    def run(self, seconds: float) -> None:
        self.world.clock.run_until(self.world.clock.now + seconds)

    @property
    def setup(self) -> object:
        return None if self.world.seen.manager is None else self.world.seen.manager.setup

    def axes(self) -> dict[str, np.ndarray]:
        """Where the arms are, by the simulated drives themselves."""
        found = {}
        for robot in self.world.cell.robots:
            name = self.gateway(robot)
            axes = self.world.bundle.gateways[name.partition("/")[2]].robots[robot].axes
            nodes = self.world.buses[name].nodes
            found[robot] = np.array([nodes[a.node_id].drives[a.number - 1].position / a.counts_per_unit for a in axes])
        return found

    def has_torque(self, robot: str) -> bool:
        return any(axis is AxisStatus.OPERATION_ENABLED for axis in self.world.seen.feedback[robot].axes)

    def moves(self, robot: str) -> bool:
        return bool(np.abs(self.world.seen.feedback[robot].velocity).max() > 0.01)

    def _watch(self) -> None:
        now = self.axes()
        if all(np.abs(now[robot] - self._before[robot]).max() > 2e-4 for robot in now):
            self.both.append(self.world.clock.now)
        self._before = now
        self.world.clock.after(0.02, self._watch)

    def _order(self, robot: str) -> str:
        """Id of the newest order for it that was let in."""
        let_in = [
            reply.id
            for *_, command, reply in self.world.seen.replies
            if isinstance(command, MoveAxes) and command.robot == robot and reply.ok
        ]
        return let_in[-1] if let_in else ""

    def _hold(self) -> None:
        for robot in self.held:
            self.world.operate(self.gateway(robot), HoldSetup(robot, self._order(robot)))
        self.world.clock.after(HOLD_S, self._hold)


BUNDLE: CellBundle = load_bundle()


@pytest.fixture
def cell() -> Iterator[Cell]:
    cell = Cell()
    yield cell
    assert cell.both == []


def test_while_left_is_set_up_right_is_not_enabled_and_runs_nothing(cell: Cell) -> None:
    assert cell.ask(cell.gateway("left"), move("left")).ok
    cell.held.add("left")
    cell.until(lambda: cell.moves("left"))
    for order in (Enable(), Run()):
        assert "right stays at rest: left is in set-up" in cell.ask("robot/right", order).text
    assert cell.world.seen.robots["right"].waiting_for == "left is in set-up"
    assert cell.moves("left")
    cell.held.clear()
    cell.until(lambda: cell.world.seen.robots["right"].waiting_for == "")
    assert cell.ask("robot/right", Enable()).ok
    assert cell.ask("robot/right", Run()).ok


def test_left_is_not_set_up_before_right_has_heard_of_it(cell: Cell) -> None:
    both_on = list[float]()

    def watch() -> None:
        if cell.has_torque("left") and cell.has_torque("right"):
            both_on.append(cell.world.clock.now)
        cell.world.clock.after(0.02, watch)

    cell.world.network.delay("manager", "robot/right", 0.2, 5.0)
    cell.run(0.5)
    watch()
    cell.held.add("left")
    cell.world.operate(cell.gateway("left"), move("left"))
    cell.until(lambda: cell.setup is not None)
    cell.world.operate("robot/right", Enable())
    cell.until(lambda: cell.has_torque("right"))
    cell.run(1.0)
    assert both_on == []


def test_while_right_runs_its_program_left_is_not_set_up_and_right_goes_on(cell: Cell) -> None:
    assert cell.ask("robot/right", Enable()).ok
    assert cell.ask("robot/right", Run()).ok
    cell.until(lambda: cell.moves("right"))
    refused = cell.ask(cell.gateway("left"), move("left"))
    assert refused.text == "left is not set up: right is not at rest and switched off: cell disable right"
    assert cell.modes["right"] is Mode.RUNNING
    assert not cell.has_torque("left")


def test_of_two_robots_that_are_set_up_at_once_one_is_refused_by_name(cell: Cell) -> None:
    cell.held = {"left", "right"}
    seen = cell.world.seen.replies
    for robot in ("left", "right"):
        cell.world.operate(cell.gateway(robot), move(robot, 1.0))
    orders = lambda: [reply for _, command, reply in seen if isinstance(command, MoveAxes)]  # noqa: E731
    cell.until(lambda: len(orders()) == 2)
    begun, refused = sorted(orders(), key=lambda reply: not reply.ok)
    assert begun.ok
    assert "is in set-up; one robot at a time" in refused.text
    cell.run(2.0)


def test_the_second_begins_once_the_first_is_done(cell: Cell) -> None:
    assert cell.ask(cell.gateway("left"), move("left", 0.1)).ok
    cell.held = {"left"}
    cell.until(lambda: cell.moves("left"))
    cell.until(lambda: cell.setup is None)
    assert cell.ask(cell.gateway("right"), move("right", 0.1)).ok
    cell.held = {"right"}
    cell.until(lambda: cell.moves("right"))


def test_a_manager_that_dies_halts_the_motion_and_the_next_one_takes_it_over(cell: Cell) -> None:
    assert cell.ask(cell.gateway("left"), move("left", 1.0)).ok
    cell.held = {"left"}
    cell.until(lambda: cell.moves("left"))
    cell.world.kill("manager")
    died = cell.world.clock.now
    cell.until(lambda: not cell.moves("left"))
    assert cell.world.clock.now - died < 0.25 + 0.5
    cell.until(lambda: not cell.has_torque("left"))
    cell.world.start_manager()
    cell.run(1.0)
    assert cell.setup is None
    assert not cell.has_torque("left")
    assert cell.ask("robot/right", Enable()).ok
    assert cell.ask("robot/right", Disable()).ok


def test_without_a_manager_it_takes_the_operators_word_that_he_keeps_the_others_still(cell: Cell) -> None:
    cell.world.kill("manager")
    cell.run(1.5)
    assert "the manager is silent" in cell.ask(cell.gateway("left"), move("left")).text
    assert cell.ask(cell.gateway("left"), replace(move("left"), alone=True)).ok
    cell.held = {"left"}
    cell.until(lambda: cell.moves("left"))


@pytest.mark.parametrize(
    ("seed", "rounds"), [(0, 16), *(pytest.param(seed, 32, marks=pytest.mark.soak) for seed in range(50))]
)
def test_never_two_at_once_over_a_network_that_loses_and_delays(seed: int, rounds: int) -> None:
    """Both operators want to set up, enable and run, again and again, at random moments; the manager is restarted."""
    cell = Cell(seed, LOSSY)
    rng = cell.world.rng
    robots = sorted(cell.world.cell.robots)
    moved = 0
    for round_ in range(rounds):
        robot = rng.choice(robots)
        orders = [(cell.gateway(robot), move(robot, rng.choice([-0.1, 0.1])))] * 8
        orders += [
            (f"robot/{robot}", command) for command in (Enable(), Run(), Halt(), Disable(), Disable(), Disable())
        ]
        if round_ % 4 == 0:
            for name in robots:
                cell.world.operate(f"robot/{name}", Halt())
            cell.run(1.0)
            for name in robots:
                cell.world.operate(f"robot/{name}", Disable())
            cell.run(0.5)
        to, command = rng.choice(orders)
        cell.held = set(robots if rng.random() < 0.8 else ())
        cell.world.operate(to, command)
        if round_ == rounds // 2:
            cell.world.kill("manager")
            cell.world.clock.after(0.4, cell.world.start_manager)
        for _ in range(rng.randint(1, 8)):
            cell.run(0.1)
            moved += sum(map(cell.moves, robots))
    assert cell.both == []
    told = [event.code for event in cell.world.seen.events]
    assert moved >= rounds / 8
    assert told.count("setup_begins") > 2
    assert "setup" in told
