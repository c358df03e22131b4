"""A drive fails as its robot enters a zone for which the other one waits: the zone is its own until it is out of it."""

from pathlib import Path

import numpy as np
import pytest

from cell.messages import DriveFeedback, Enable, Mode, PlayoutState, RobotState, ZoneState, ZoneStatus
from tests.sim.invariants import Invariants
from tests.sim.network import Weather
from tests.sim.operator import PatientOperator
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy

FAST_RAD_S = 0.25
OVERLOAD = 0x2310
ZONE = "handover"


class OneAfterTheOther(PatientOperator):
    """Starts the right robot so late that it has to wait for the zone."""

    def _serve(self, state: RobotState) -> None:
        if state.robot != "right" or state.mode is not Mode.READY or self._world.clock.now > 1002.0:
            super()._serve(state)


class Entry:
    """Lets a drive fail once as a robot moves into the zone that it holds and that the other one wants."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._invariants = Invariants(world)
        self.robot = ""
        self.braked_inside = False
        self.holders: set[str | None] = set()
        world.on_feedback.append(self._look)

    @property
    def zone(self) -> ZoneStatus:
        assert self._world.seen.manager is not None
        return self._world.seen.manager.zones[ZONE]

    def inside(self, robot: str, ahead: np.ndarray | float = 0.0) -> bool:
        """Where its drives really are, or `ahead` of it."""
        return bool(self._invariants._touches(robot, (self._invariants._measured(robot) + ahead)[None])[ZONE][0])

    def _look(self, feedback: DriveFeedback) -> None:
        robot = feedback.robot
        if self.robot == robot and feedback.state is PlayoutState.STOPPING:
            self.braked_inside |= self.inside(robot)
        if self.robot:
            self.holders.add(self.zone.holder)
        elif (
            self._world.seen.manager is not None
            and self.zone.holder == robot
            and self.zone.queue
            and feedback.state is PlayoutState.PLAYING
            and np.abs(feedback.velocity).max() > FAST_RAD_S
            and not self.inside(robot)
            and self.inside(robot, feedback.velocity * 0.03)
        ):
            self.robot = robot
            bus = self._world.buses[f"gateway/{self._world.cell.robots[robot].gateway}"]
            bus.nodes[min(bus.nodes)].raise_emergency(OVERLOAD)


@pytest.mark.timeout(300)
def test_a_zone_that_its_holder_brakes_into_after_a_fault_is_not_given_away(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    for robot in ("left", "right"):
        copy.change(f"two_arms/programs/{robot}.prog", "GOTO again 1\n", "")
    world = World(load_bundle(copy.cell), 1, Weather(0.0, 0.0, 0.0))
    entry, operator = Entry(world), OneAfterTheOther(world)
    assert world.clock.run_until(world.clock.now + 20.0, lambda: entry.robot != "")
    operator.working = False
    world.clock.run_until(world.clock.now + 2.0)
    assert world.seen.feedback[entry.robot].state is PlayoutState.FAULT
    assert entry.braked_inside
    assert entry.inside(entry.robot)
    assert entry.holders == {entry.robot}
    assert entry.zone.state is ZoneState.OCCUPIED

    operator.working = True
    assert world.clock.run_until(world.clock.now + 40.0, lambda: operator.all_done)
    assert not [event for event in world.seen.events if event.code in ("zone_breach", "zone_orphaned", "estop")]


def test_a_robot_that_stands_in_a_zone_with_its_drives_on_is_no_breach_for_a_manager_that_starts(
    tmp_path: Path,
) -> None:
    copy = Copy(tmp_path).slow_buses()
    pose = "pose: {X: %s, Y: 0, Z: 1400, A: 0, B: 0, C: 0}"
    copy.change("two_arms/cell.yaml", pose % 0, pose % -1000)
    world = World(load_bundle(copy.cell), 1, Weather(0.0, 0.0, 0.0))

    def both(mode: Mode) -> bool:
        return [world.seen.robots[robot].mode for robot in sorted(world.seen.robots)] == [mode, mode]

    assert world.clock.run_until(world.clock.now + 20.0, lambda: both(Mode.DISABLED))
    for robot in world.cell.robots:
        world.operate(f"robot/{robot}", Enable())
    assert world.clock.run_until(world.clock.now + 5.0, lambda: both(Mode.READY))
    world.clock.run_until(world.clock.now + 0.5)
    world.kill("manager")
    world.clock.run_until(world.clock.now + 1.0)
    world.seen.events.clear()
    world.start_manager()
    world.clock.run_until(world.clock.now + 2.0)
    assert world.seen.manager is not None
    assert world.seen.manager.zones[ZONE].state is ZoneState.ORPHANED
    assert not world.seen.manager.estops
    assert "zone_blocked" in [event.code for event in world.seen.events]
    assert "zone_breach" not in [event.code for event in world.seen.events]
