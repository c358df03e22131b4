"""A robot that a stop has taken off its path: where it is kept, how it comes back, and what it may not do."""

from collections.abc import Callable
from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from cell.config.settings import OnManagerReturn
from cell.messages import (
    Command,
    Continue,
    Disable,
    Enable,
    Estop,
    Halt,
    Jog,
    JogFrame,
    Mode,
    ProgramState,
    ResetRobot,
    Return,
    Run,
    SetOverride,
    Step,
    Token,
    ZoneState,
    ZoneStatus,
)
from robot_agent.agent.parameters import MANUAL_SPEED_M_S
from robot_agent.agent.planning.plans import PlanFailed
from tests.unit.agent_world import CYCLE_S, STEP_S, AgentWorld

LINE = "MJ J5=30\nML Y=150 F=200\nMJ J1=15\nEND"
IN_ZONE = "MJ J2=-20 J3=30 J5=60\nMJ J2=50 J3=-25 J5=30 F=50\nEND"
WINDOW = np.radians(0.5)
BESIDE = np.radians([0.0, 0.3, -0.2, 0.1, 0.0, 0.4])
"""Inside the window, in any direction."""
FAR = np.radians([2.0, -3.0, 1.0, 0.0, 4.0, 5.0])


class Interrupted:
    """A robot in the middle of its program, and an operator."""

    def __init__(self, program: str = LINE, on_manager_return: OnManagerReturn = OnManagerReturn.CONTINUE) -> None:
        self.world = AgentWorld(program, on_manager_return)
        self.until(Mode.DISABLED)
        self.enable(Mode.READY)

    def order(self, command: Command) -> str:
        """What the robot says; `no: ` in front of a refusal."""
        id = self.world.call(command)
        self.wait(lambda: id in self.world.replies, seconds=0.1)
        reply = self.world.replies[id]
        return reply.text if reply.ok else f"no: {reply.text}"

    def until(self, *modes: Mode, seconds: float = 30.0) -> None:
        self.wait(lambda: self.world.states != [] and self.mode in modes, seconds)

    def wait(self, done: Callable[[], bool], seconds: float = 30.0) -> None:
        for _ in range(round(seconds / STEP_S)):
            if done():
                return
            self.world.step()
        raise AssertionError(f"not reached in {seconds} s; state {self.world.states[-1:]}")

    def enable(self, *modes: Mode) -> None:
        self.order(Enable())
        self.until(*modes)

    def reset(self, *modes: Mode) -> None:
        """After a fault: acknowledge and switch on, which moves nothing."""
        self.until(Mode.FAULT)
        assert not self.order(ResetRobot()).startswith("no: ")
        self.until(Mode.DISABLED)
        self.enable(*modes)

    def run_to(self, line: int, more_s: float = 0.3) -> None:
        self.order(Run())
        self.wait(lambda: self.world.state.program.line == line)
        self.world.run(more_s)

    def stop(self, beside: np.ndarray) -> None:
        """By the drives, which are enabled again."""
        self.world.quick_stop(beside)
        self.reset(Mode.HALTED, Mode.OFF_PATH)

    @property
    def mode(self) -> Mode:
        return self.world.state.mode

    @property
    def played(self) -> np.ndarray:
        return np.array(self.world.played)

    def ended(self) -> bool:
        return self.world.state.program.state is ProgramState.DONE


@cache
def _in_mid_line() -> Interrupted:
    robot = Interrupted()
    robot.run_to(2)
    return robot


def in_mid_line() -> Interrupted:
    """A robot in the middle of its second line."""
    return deepcopy(_in_mid_line())


def stopped(beside: np.ndarray) -> Interrupted:
    """One that its drives have stopped there, enabled again."""
    robot = in_mid_line()
    robot.stop(beside)
    return robot


def path(robot: Interrupted) -> np.ndarray:
    """Densely, the joints of all moves of the program; ways back are not among them."""
    motions = [planned.motion for planned in robot.world.planned if planned.id > 0]
    return np.vstack([motion.q(np.arange(0.0, motion.duration_s, 0.001)) for motion in motions])


def farthest_from_path(robot: Interrupted, first: int) -> float:
    """[rad] of all that was played from a cycle on, every fifth sample."""
    places = path(robot)
    return max(float(np.abs(places - q).max(axis=1).min()) for q in robot.played[first::5])


def test_after_a_fault_in_the_middle_of_a_line_the_program_goes_on_from_there() -> None:
    robot = stopped(BESIDE)
    assert robot.mode is Mode.HALTED
    assert robot.world.state.program.state is ProgramState.INTERRUPTED
    stood = len(robot.played)
    robot.world.run(0.3)
    assert (robot.played[stood:] == robot.played[stood]).all()
    assert robot.order(Continue()) == "left goes on"
    robot.wait(robot.ended)
    assert np.abs(robot.played[-1] - path(robot)[-1]).max() < 1e-3
    assert farthest_from_path(robot, stood) <= WINDOW
    assert np.abs(np.diff(robot.played[stood:], axis=0)).max() / CYCLE_S < 3.0


def test_the_part_of_the_line_that_was_done_is_not_done_again() -> None:
    robot = in_mid_line()
    robot.world.run(0.2)
    robot.stop(np.zeros(6))
    left = robot.world.commanded
    robot.order(Continue())
    robot.wait(robot.ended)
    line = next(planned for planned in robot.world.planned if planned.lines[0] == 2).motion
    taus = np.linspace(0.0, line.duration_s, 4001)
    begun = int(np.argmin(np.abs(line.q(taus) - left).max(axis=1)))
    assert begun > 200
    early = line.q(taus[: begun - 40 : 20])
    resumed = robot.played[np.flatnonzero((robot.played == left).all(axis=1))[-1] :]
    assert min(np.abs(resumed - q).max(axis=1).min() for q in early) > 1e-4


def test_a_robot_that_was_pushed_away_is_off_its_path_until_it_has_returned() -> None:
    robot = stopped(FAR)
    assert robot.mode is Mode.OFF_PATH
    assert "deg beside its path" in robot.world.state.program.error
    assert "cell return left" in robot.world.state.program.error
    stood = len(robot.played)
    for refused in (Continue(), Step()):
        answer = robot.order(refused)
        assert answer.startswith("no: ")
        assert "cell return left" in answer
    robot.world.run(0.2)
    assert (robot.played[stood:] == robot.played[stood]).all()
    assert "deg beside its path" in robot.order(Return())
    robot.until(Mode.HALTED)
    back = robot.played[stood:]
    assert np.abs(path(robot) - back[-1]).max(axis=1).min() < 2e-3
    robot.world.run(0.2)
    assert np.abs(robot.played[stood + len(back) :] - back[-1]).max() < 1e-9
    assert robot.world.state.program.state is ProgramState.RUNNING
    assert robot.order(Continue()) == "left goes on"
    robot.wait(robot.ended)


def test_a_halted_robot_whose_axes_settle_beside_its_path_says_so_and_is_brought_back() -> None:
    robot = in_mid_line()
    robot.order(Halt())
    robot.world.run(1.0)
    robot.order(Jog("j1", "J1", 0.1, JogFrame.BASE, step=0.9 * WINDOW))
    robot.until(Mode.HALTED)
    robot.world.measured = robot.world.commanded + np.array([1.01 * WINDOW, 0.0, 0.0, 0.0, 0.0, 0.0])
    robot.until(Mode.OFF_PATH, seconds=0.1)
    assert "`cell return left`" in robot.world.state.program.error
    assert [event.code for event in robot.world.events].count("off_path") == 1
    robot.world.measured = None
    robot.order(Return())
    robot.until(Mode.HALTED)


def test_the_way_back_is_slow() -> None:
    robot = stopped(2.0 * FAR)
    stood = len(robot.played)
    robot.order(Return())
    robot.until(Mode.HALTED, seconds=60.0)
    back = robot.played[stood:]
    model = robot.world.planner.model
    speed = np.abs(np.diff(back, axis=0)) / CYCLE_S
    assert speed.max() > 0.0
    assert (speed <= 0.1 * robot.world.planner.limits.velocity + 1e-6).all()
    flange = model.forward(back)[:, :3, 3]
    assert np.linalg.norm(np.diff(flange, axis=0), axis=1).max() / CYCLE_S <= MANUAL_SPEED_M_S * 1.001


def test_after_an_emergency_stop_it_goes_on_only_by_a_call_behind_the_reset() -> None:
    robot = in_mid_line()
    world = robot.world
    world.agent.receive(Estop("e1", True, "test", "a hand in the cell"), world.now)
    robot.until(Mode.ESTOP)
    assert robot.order(Continue()).startswith("no: ")
    robot.wait(lambda: world.state.tcp_speed_m_s == 0.0)
    world.run(0.1)
    world.enabled = False
    world.run(0.2)
    world.agent.receive(Estop("e1", False, "test", ""), world.now)
    robot.until(Mode.DISABLED)
    assert robot.order(Continue()).startswith("no: ")
    stood = len(robot.played)
    robot.enable(Mode.HALTED)
    world.run(0.3)
    assert (robot.played[stood:] == robot.played[stood]).all()
    robot.order(Continue())
    robot.wait(robot.ended)
    assert farthest_from_path(robot, stood) < 2e-3


def test_a_second_fault_on_the_way_back_leaves_it_off_its_path() -> None:
    robot = stopped(FAR)
    robot.order(Return())
    robot.world.run(0.3)
    assert robot.mode is Mode.RETURNING
    robot.world.quick_stop(FAR)
    robot.reset(Mode.OFF_PATH)
    assert robot.world.state.program.state is ProgramState.INTERRUPTED


def test_a_way_back_that_cannot_be_planned_is_named_and_the_robot_stays_where_it_is() -> None:
    robot = stopped(FAR)
    planner = robot.world.planner
    planner.plan = lambda request: PlanFailed(request.id, 2, "drawn")  # type: ignore[method-assign]
    robot.order(Return())
    robot.until(Mode.OFF_PATH)
    told = next(event for event in robot.world.events if event.code == "return")
    assert told.text == "there is no way back to the path: drawn"
    assert "cell jog" in told.remedy


def test_halt_stops_the_way_back_and_another_return_goes_on() -> None:
    robot = stopped(FAR)
    robot.order(Return())
    robot.world.run(0.3)
    assert "brakes" in robot.order(Halt())
    assert robot.mode is Mode.OFF_PATH
    robot.world.run(0.3)
    stood = robot.world.commanded
    robot.world.run(0.2)
    assert (robot.world.commanded == stood).all()
    robot.order(Return())
    robot.until(Mode.HALTED)


def test_run_starts_anew_and_forgets() -> None:
    robot = stopped(FAR)
    assert "from its first line" in robot.order(Run())
    robot.wait(lambda: robot.world.state.program.line == 1)
    robot.order(Halt())
    robot.wait(lambda: robot.world.state.tcp_speed_m_s == 0.0)
    assert "no path to return to" in robot.order(Return())


def test_switching_off_does_not_forget() -> None:
    robot = in_mid_line()
    robot.order(Halt())
    robot.wait(lambda: robot.world.state.tcp_speed_m_s == 0.0)
    robot.world.run(0.1)
    robot.order(Disable())
    robot.until(Mode.DISABLED)
    assert robot.world.state.program.state is ProgramState.INTERRUPTED
    robot.world.push(FAR)
    robot.enable(Mode.OFF_PATH)
    robot.order(Disable())
    robot.until(Mode.DISABLED)
    robot.world.push(-FAR)
    robot.enable(Mode.HALTED)
    robot.order(Continue())
    robot.wait(robot.ended)


def test_robot_jogged_back_into_its_window_may_continue() -> None:
    robot = stopped(np.radians([0.0, 0.0, 0.0, 0.0, 0.0, -3.0]))
    assert robot.mode is Mode.OFF_PATH
    robot.order(Jog("press", "J6", 0.2, JogFrame.WORLD, np.radians(3.0)))
    robot.wait(lambda: robot.mode in (Mode.HALTED, Mode.OFF_PATH) or robot.world.state.waiting_for != "")
    robot.until(Mode.HALTED, Mode.OFF_PATH)
    assert robot.world.state.program.state is ProgramState.INTERRUPTED


def test_a_step_goes_on_from_where_it_was_interrupted_to_the_end_of_that_line() -> None:
    robot = stopped(BESIDE)
    robot.order(Step())
    robot.until(Mode.RUNNING)
    robot.until(Mode.HALTED)
    line = next(planned for planned in robot.world.planned if 2 in planned.lines)
    end = line.motion.q(line.motion.ends[line.lines.index(2)])
    assert np.abs(robot.world.commanded - end).max() < 1e-3


def test_the_way_back_leads_forwards_when_the_override_is_backwards() -> None:
    robot = stopped(FAR)
    robot.order(SetOverride(-100.0))
    robot.order(Return())
    robot.until(Mode.HALTED, seconds=60.0)
    assert np.abs(path(robot) - robot.world.commanded).max(axis=1).min() < 2e-3


def test_the_way_back_into_a_zone_waits_for_its_grant() -> None:
    robot = Interrupted(IN_ZONE)
    world = robot.world
    world.grant()
    robot.run_to(2, more_s=0.0)
    robot.wait(lambda: "handover" in world.state.zones)
    robot.wait(lambda: world.commanded[1] > np.radians(49.0))
    away = np.radians([22.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    world.quick_stop(away)
    robot.until(Mode.FAULT)
    robot.wait(lambda: world.state.zones == ())
    world.granting = False
    world.zone = ZoneStatus(ZoneState.OCCUPIED, "right", Token(5, 99), (), 1, 0.0)
    robot.reset(Mode.OFF_PATH)
    robot.order(Return())
    robot.wait(lambda: "held by right" in world.state.waiting_for, seconds=60.0)
    stood = world.commanded
    world.run(0.3)
    assert (world.commanded == stood).all()
    assert robot.mode is Mode.RETURNING
    assert "handover" in world.presences[-1].wants
    world.grant()
    robot.until(Mode.HALTED, seconds=60.0)
    assert world.state.zones == ("handover",)


def test_inside_a_zone_nothing_goes_on_while_the_manager_does_not_confirm_its_token() -> None:
    robot = Interrupted(IN_ZONE)
    world = robot.world
    world.grant()
    robot.run_to(2, more_s=0.0)
    robot.wait(lambda: world.commanded[1] > np.radians(49.0))
    world.quick_stop(BESIDE)
    world.granting = False
    world.zone = ZoneStatus(ZoneState.ORPHANED, "left", None, (), 1, 0.0, "silent")
    robot.reset(Mode.HALTED)
    robot.order(Continue())
    stood = world.commanded
    world.run(0.3)
    assert (world.commanded == stood).all()
    assert "orphaned" in world.state.waiting_for


@pytest.mark.parametrize(
    ("choice", "modes"), [(OnManagerReturn.CONTINUE, (Mode.HALTED,)), (OnManagerReturn.OPERATOR, (Mode.OFF_PATH,))]
)
def test_a_silent_manager_stops_the_way_back(choice: OnManagerReturn, modes: tuple[Mode, ...]) -> None:
    robot = Interrupted(on_manager_return=choice)
    robot.run_to(2)
    robot.stop(2.0 * FAR)
    robot.order(Return())
    robot.world.run(0.3)
    robot.world.manager_silent = True
    robot.world.run(0.8)
    stood = robot.world.commanded
    robot.world.run(0.2)
    assert (robot.world.commanded == stood).all()
    robot.world.manager_silent = False
    robot.until(*modes)


def lose_reference(robot: Interrupted) -> None:
    robot.world.referenced = False
    robot.world.run(0.1)
    robot.world.referenced = True


def change_zones(robot: Interrupted) -> None:
    robot.world.zone = ZoneStatus(ZoneState.FREE, None, None, (), 2, 0.0)
    robot.world.run(0.1)


@pytest.mark.parametrize(
    ("happens", "words"), [(lose_reference, "lost their reference"), (change_zones, "zones have changed")]
)
def test_where_it_was_is_forgotten_when_that_means_nothing_any_more(
    happens: Callable[[Interrupted], None], words: str
) -> None:
    robot = in_mid_line()
    robot.world.quick_stop(BESIDE)
    robot.until(Mode.FAULT)
    happens(robot)
    robot.reset(Mode.READY)
    assert robot.world.state.program.state is ProgramState.FAILED
    assert words in robot.world.state.program.error
    assert robot.order(Continue()).startswith("no: ")


@pytest.mark.parametrize("order", [Continue(), Step()])
def test_a_halted_program_does_not_go_on_after_a_change_of_zones_and_says_what_does(order: Command) -> None:
    robot = in_mid_line()
    robot.order(Halt())
    robot.until(Mode.HALTED)
    robot.world.run(1.0)
    change_zones(robot)
    answer = robot.order(order)
    assert answer.startswith("no: "), answer
    assert "the zones have changed since its motion was planned: `cell run left`" in answer
    assert robot.mode is Mode.HALTED
    assert not robot.order(Run()).startswith("no: ")
