"""Arms that do not say where they are: others wait for them by name, go on by an operator's word, and home in turn."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from cell.geometry import Box, capsule_box_distance
from cell.messages import (
    AxisStatus,
    Clearance,
    Command,
    Confinement,
    ConfineRobot,
    DriveFeedback,
    HoldSetup,
    Home,
    Mode,
    ProgramState,
    Reply,
    RobotStands,
)
from tests.sim.apart_cell import MARGIN_M, QUIET, SIDES, Apart, apart_cell
from tests.unit.config_world import Copy

AHEAD = """MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=100
ML X={x:g} Y=0 Z=1250 A=0 B=90 C=0 F=1500
ML X=980 F=1500
HOME F=100
"""
FORWARD = (0.0, 0.0, 0.0, 1.0)
ABOUT_RIGHT = Confinement((2.4, 1.6, 3.0), (1.5, 0.0, 1.5), FORWARD)
"""From 300 mm beyond the middle of the cell on: all of the right arm at home."""
NOT_HEARD = "right not heard yet: start its agent, or say where it stays: `cell confine right`"


class Cell(Apart):
    """The left arm's tool goes as far as x = 2.0 m in front of it; the right arm does nothing before that."""

    def __init__(self, folder: Path, x_mm: float, drives: Callable[[Copy], object] | None = None) -> None:
        cell = apart_cell(folder, {"left": AHEAD.format(x=x_mm), "right": AHEAD.format(x=1200)}, drives=drives)
        super().__init__(cell, weather=QUIET)
        self.cleared: set[str] = set()
        """Who was cleared anything."""
        self.world.on_published.append(self._note)

    def _note(self, _name: str, message: object) -> None:
        if isinstance(message, Clearance) and message.cleared > 0:
            self.cleared.add(message.robot)

    def state(self, robot: str) -> ProgramState:
        seen = self.world.seen.robots.get(robot)
        return ProgramState.LOADED if seen is None else seen.program.state

    def until(self, done: Callable[[], bool], within_s: float = 20.0) -> None:
        clock = self.world.clock
        waits = {name: state.waiting_for for name, state in self.world.seen.robots.items()}
        assert clock.run_until(clock.now + within_s, done), waits

    def mode(self, robot: str) -> Mode:
        seen = self.world.seen.robots.get(robot)
        return Mode.STARTING if seen is None else seen.mode

    def knows(self, robot: str) -> bool:
        return robot in self.presences and self.presences[robot].body.known

    def waits(self, robot: str) -> str:
        seen = self.world.seen.robots.get(robot)
        return "" if seen is None else seen.waiting_for

    def say(self, command: object, to: str = "manager") -> Reply:
        """The answer; it is given again until there is one that is not too old."""
        for _ in range(10):
            answers: list[Reply | None] = []
            self.world.operate(to, command, then=answers.append)  # type: ignore[arg-type]
            self.world.clock.run_until(self.world.clock.now + 6.0, lambda a=answers: bool(a))
            if answers and answers[0] is not None and "too old" not in answers[0].text:
                return answers[0]
        raise AssertionError(f"{to} never answered")

    @property
    def said(self) -> list[str]:
        manager = self.world.seen.manager
        return [] if manager is None else list(manager.assured)


def _right_is_off(cell: Cell) -> None:
    """Both were there; then the right arm's agent and the manager ended, and only the manager is started again."""
    cell.until(lambda: len(cell.presences) == 2)
    cell.world.kill("robot/right")
    cell.world.kill("manager")
    cell.world.clock.run_until(cell.world.clock.now + 0.5)
    cell.presences.clear()
    cell.world.start_manager()


def test_the_others_wait_for_an_arm_whose_agent_does_not_run_go_on_by_a_box_and_keep_away_from_it(
    tmp_path: Path,
) -> None:
    cell = Cell(tmp_path, 2300)
    box = Box.at(ABOUT_RIGHT.size_m, ABOUT_RIGHT.position_m, ABOUT_RIGHT.quaternion_xyzw)
    nearest: list[float] = []

    def look(_: object) -> None:
        if len(cell._measured) == 2:
            capsules, radii = cell._capsules("left")
            nearest.append(float(np.min(capsule_box_distance(capsules, radii, box))))

    cell.world.on_feedback.append(look)
    _right_is_off(cell)
    cell.until(lambda: cell.waits("left") == NOT_HEARD)
    reply = cell.say(RobotStands("right", "me"))
    assert (reply.ok, reply.text.partition(":")[0]) == (False, "the drives of right are on")
    reply = cell.say(ConfineRobot("right", ABOUT_RIGHT, "me"))
    assert reply.ok, reply.text
    cell.until(lambda: "the box to which right is confined; 30 mm are kept" in cell.waits("left"))
    assert MARGIN_M <= min(nearest) < MARGIN_M + 0.1
    cell.world.kill("manager")
    cell.world.clock.run_until(cell.world.clock.now + 1.0)
    cell.world.start_manager()
    cell.until(lambda: "the box to which right is confined; 30 mm are kept" in cell.waits("left"))
    assert cell.said == ["right"]
    cell.world.start_agent("right")
    cell.until(lambda: cell.said == [])
    cell.run(30.0)
    assert cell.done
    assert cell.nearest_m >= MARGIN_M
    assert cell.forced == []


def incremental(copy: Copy) -> None:
    """Axis 6 of both arms counts from zero after each start of its drive, and homes to the next index pulse."""
    for side in SIDES:
        for old in ("quick_stop: 1300, following_window: 3",):
            homing = "homing: {method: 33, fast: 3, slow: 1, acceleration: 20, position: 0}"
            copy.change(f"two_arms/{side}_drives.yaml", old, f"{old}, encoder: incremental, {homing}")


def _incremental(copy: Copy, *sides: str) -> None:
    """Axis 6 counts from zero after each start of its drive, and homes to the next index pulse."""
    quick_stop = "quick_stop: 1300, following_window: 3"
    homing = "homing: {method: 33, fast: 3, slow: 1, acceleration: 20, position: 0}"
    for side in sides:
        copy.change(f"two_arms/{side}_drives.yaml", quick_stop, f"{quick_stop}, encoder: incremental, {homing}")


class _Homing:
    """`cell home` of these arms at once: it asks again while another one is in set-up, and holds what it has begun."""

    def __init__(self, cell: Cell, *sides: str) -> None:
        self._cell = cell
        self.refused: list[str] = []
        for side in sides:
            self._ask(side)

    def _ask(self, side: str) -> None:
        self._order(side, Home(side, ()), lambda reply: self._begun(side, reply))

    def _begun(self, side: str, reply: Reply | None) -> None:
        if reply is None or not reply.ok:
            self.refused.append("" if reply is None else reply.text)
            self._cell.world.clock.after(0.1, self._ask, side)
            return
        self._hold(side, reply.id)

    def _hold(self, side: str, order: str) -> None:
        def held(reply: Reply | None) -> None:
            if reply is None or reply.data == "moving":
                self._cell.world.clock.after(0.1, self._hold, side, order)

        self._order(side, HoldSetup(side, order), held)

    def _order(self, side: str, command: Command, then: Callable[[Reply | None], None]) -> None:
        self._cell.world.operate(f"gateway/{side}_bus", command, then=then)


def test_the_others_go_on_beside_an_arm_that_has_lost_its_reference_and_stands_where_it_was_last_known(
    tmp_path: Path,
) -> None:
    cell = Cell(tmp_path, 2000, lambda copy: _incremental(copy, "right"))
    cell.operator.working = False
    _Homing(cell, "right")
    cell.until(lambda: all(cell.knows(side) and cell.mode(side) is Mode.DISABLED for side in SIDES))
    cell.until(lambda: cell.world.seen.manager is not None and cell.world.seen.manager.setup is None)
    cell.world.clock.run_until(cell.world.clock.now + 0.5)  # its gateway, too, knows that the set-up is over
    cell.world.buses["gateway/right_bus"].nodes[6].power_cycle()
    cell.until(lambda: not cell.knows("right"))
    cell.operator.working = True
    cell.until(lambda: "right does not know where it is" in cell.waits("left"))
    assert "`cell stands right`" in cell.waits("left")
    reply = cell.say(RobotStands("right", "me"))
    assert reply.ok, reply.text
    cell.until(lambda: cell.state("left") is ProgramState.DONE)
    assert cell.nearest_m >= MARGIN_M
    assert cell.said == ["right"]
    assert cell.forced == []


def test_two_arms_that_are_not_referenced_home_one_after_the_other_and_then_run(tmp_path: Path) -> None:
    cell = Cell(tmp_path, 1500, lambda copy: _incremental(copy, *SIDES))
    with_torque: set[str] = set()
    together: list[float] = []

    def look(feedback: DriveFeedback) -> None:
        on = AxisStatus.OPERATION_ENABLED in feedback.axes
        (with_torque.add if on else with_torque.discard)(feedback.robot)
        if len(with_torque) == 2 and not all(map(cell.knows, SIDES)):
            together.append(cell.world.clock.now)

    cell.world.on_feedback.append(look)
    cell.until(lambda: set(cell.presences) == set(SIDES) == set(cell.world.seen.feedback))
    assert not any(map(cell.knows, SIDES))
    homing = _Homing(cell, *SIDES)
    cell.until(lambda: all(map(cell.knows, SIDES)), 60.0)
    assert together == []
    assert any("is in set-up; one robot at a time" in text for text in homing.refused)
    cell.until(lambda: cell.cleared == set(SIDES))
