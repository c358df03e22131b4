"""Two arms that each hold a zone the other one needs: found, told to both, and freed by the commands that are told.

Where a motion leads through both zones without a stop between them, it never comes to that; nor where robots are kept
apart, as far as their plans are known, whose order knows the zones, too: `tests.sim.scenes` has that.
"""

import re
from collections.abc import Callable
from pathlib import Path

from cell.messages import (
    Command,
    Continue,
    Enable,
    Halt,
    Heard,
    Jog,
    JogFrame,
    JogHeld,
    Mode,
    ProgramState,
    RobotState,
    Run,
    SetOverride,
    ZoneState,
)
from tests.sim.invariants import Invariants
from tests.sim.network import Weather
from tests.sim.two_zones import PAUSE, two_zones
from tests.sim.world import World, load_bundle


class Cell:
    """Both arms are switched on; `left` and `right` is what they do on the way from zone to zone."""

    def __init__(self, folder: Path, left: str, right: str, *, planned: bool = True) -> None:
        self.world = World(load_bundle(two_zones(folder, left, right)), 0, Weather(0.0, 0.0, 0.0))
        self.invariants = Invariants(self.world, planned=planned)
        self.until(lambda: all(self.mode(robot) is Mode.DISABLED for robot in ("left", "right")))
        for robot, order, after in (("left", Enable(), Mode.READY), ("right", Enable(), Mode.READY)):
            self.order(robot, order)
            self.until(lambda robot=robot, after=after: self.mode(robot) is after)

    def stuck(self) -> None:
        """Until each of them waits for the other one."""
        self.until(lambda: self.codes.count("zone_deadlock") == 1, 40.0)

    @property
    def back(self) -> tuple[str, str, str]:
        """Who is to go back, out of which zone, and who goes on then, by what was told."""
        [event] = [event for event in self.world.seen.events if event.code == "zone_deadlock"]
        found = re.search(r"`cell override (\w+) -100` until it is out of (\w+), then `cell halt \1`", event.remedy)
        assert found is not None, event.remedy
        robot, zone = found.groups()
        return robot, zone, "right" if robot == "left" else "left"

    @property
    def codes(self) -> list[str]:
        return [event.code for event in self.world.seen.events]

    def until(self, done: Callable[[], bool], longest_s: float = 20.0) -> None:
        assert self.world.clock.run_until(self.world.clock.now + longest_s, done), self.world.seen.robots

    def state(self, robot: str) -> RobotState | None:
        return self.world.seen.robots.get(robot)

    def waits(self) -> str:
        """What both say that they wait for."""
        states = [self.state(robot) for robot in ("left", "right")]
        return "; ".join(state.waiting_for for state in states if state is not None)

    def mode(self, robot: str) -> Mode | None:
        state = self.state(robot)
        return None if state is None else state.mode

    def order(self, robot: str, command: Command) -> None:
        replies = len(self.world.seen.replies)
        self.world.operate(f"robot/{robot}", command)
        self.until(lambda: len(self.world.seen.replies) > replies)
        reply = self.world.seen.replies[-1][2]
        assert reply is not None
        assert reply.ok, reply.text

    def zone(self, name: str) -> tuple[ZoneState, str | None]:
        manager = self.world.seen.manager
        assert manager is not None
        return manager.zones[name].state, manager.zones[name].holder

    def done(self, robot: str) -> bool:
        state = self.state(robot)
        return state is not None and state.program.state is ProgramState.DONE


def test_arms_that_cannot_stop_between_two_zones_take_both_and_never_wait_for_each_other(tmp_path: Path) -> None:
    cell = Cell(tmp_path, "", "")
    for robot in ("left", "right"):
        cell.order(robot, Run())
    cell.until(lambda: cell.done("left") and cell.done("right"), 60.0)
    assert "zone_deadlock" not in cell.codes
    cell.world.clock.run_until(cell.world.clock.now + 1.0)
    cell.invariants.check_at_rest()


def test_two_arms_that_wait_for_each_others_zones_are_told_both_how_to_go_on(tmp_path: Path) -> None:
    stuck = Cell(tmp_path, PAUSE, PAUSE)
    for robot in ("left", "right"):
        stuck.order(robot, Run())
    stuck.stuck()
    [event] = [event for event in stuck.world.seen.events if event.code == "zone_deadlock"]
    assert event.text == "left waits for zone south held by right; right waits for zone north held by left"
    stuck.until(lambda: all(event.remedy in str(stuck.state(robot)) for robot in ("left", "right")))
    stuck.world.clock.run_until(stuck.world.clock.now + 5.0)
    assert stuck.codes.count("zone_deadlock") == 1


def halted_between(folder: Path) -> Cell:
    """The left arm, halted in the first zone, gives up the second one, which the right arm takes."""
    stuck = Cell(folder, "", PAUSE)
    stuck.order("left", Run())
    stuck.until(lambda: stuck.zone("north") == (ZoneState.OCCUPIED, "left"))
    stuck.order("left", Halt())
    stuck.until(lambda: stuck.zone("south")[0] is ZoneState.FREE)
    stuck.order("right", Run())
    stuck.until(lambda: stuck.zone("south") == (ZoneState.OCCUPIED, "right"))
    stuck.order("left", Continue())
    stuck.stuck()
    return stuck


def test_going_back_as_told_frees_them_and_both_programs_end(tmp_path: Path) -> None:
    stuck = halted_between(tmp_path)
    robot, zone, other = stuck.back
    stuck.order(robot, SetOverride(-100.0))
    stuck.until(lambda: stuck.zone(zone)[0] is not ZoneState.OCCUPIED)
    stuck.order(robot, Halt())
    stuck.until(lambda: stuck.done(other))
    assert stuck.world.seen.manager is not None
    assert stuck.world.seen.manager.deadlocks == ()
    stuck.order(robot, SetOverride(100.0))
    stuck.order(robot, Continue())
    stuck.until(lambda: stuck.done(robot))
    stuck.world.clock.run_until(stuck.world.clock.now + 1.0)
    stuck.invariants.check_at_rest()


def test_where_the_motion_begins_inside_jogging_out_as_told_frees_them(tmp_path: Path) -> None:
    stuck = Cell(tmp_path, PAUSE, PAUSE, planned=False)
    for each in ("left", "right"):
        stuck.order(each, Run())
    stuck.stuck()
    robot, _, other = stuck.back
    stuck.order(robot, Halt())
    stuck.until(lambda: stuck.mode(robot) is Mode.HALTED)
    away = -0.2 if robot == "left" else 0.2

    def hold() -> None:
        state = stuck.state(robot)
        if state is not None:
            stuck.world.press(JogHeld(robot, "press", True, Heard(state.boot, state.sequence)))
        stuck.world.clock.after(0.03, hold)

    stuck.order(robot, Jog("press", "X", away, JogFrame.WORLD, 0.6))
    hold()
    stuck.until(lambda: stuck.done(other))
    assert stuck.world.seen.manager is not None
    assert stuck.world.seen.manager.deadlocks == ()
