"""One robot runs virtually beside another one that moves, in bad weather: nobody waits for it, nothing moves by it."""

from pathlib import Path

import numpy as np

from cell.messages import DriveFeedback, Enable, ManagerState, ProgramState, RobotState, Run, SetpointBlock
from tests.sim.judge import Judge
from tests.sim.planning_cache import remember_plans
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy

INTO = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=80\nML X=1650 Y=0 Z=1350 A=0 B=90 C=0 F=900\n"
LEFT = INTO + "SET DO gripper\nWAIT 0.8\nRESET DO gripper\nML X=980 F=900\nEND"
RIGHT = INTO + "WAIT 0.8\nML X=980 F=900\nHOME F=80\nEND"


class Watched:
    """What is said while the left robot runs virtually, or should."""

    def __init__(self, world: World) -> None:
        self.left: list[RobotState] = []
        self.blocks: list[SetpointBlock] = []
        self.commanded: list[np.ndarray] = []
        self.waited: set[str] = set()
        self.both_inside = False
        """The picture is in the zone that the right robot holds."""
        world.on_published.append(self._published)
        world.on_feedback.append(self._feedback)

    def _published(self, _: str, message: object) -> None:
        match message:
            case RobotState(robot="left"):
                self.left.append(message)
            case RobotState(robot="right"):
                self.waited |= set(message.waited_s)
                seen = self.left[-1].virtual if self.left else None
                inside = seen is not None and seen.tcp_position_m is not None and abs(seen.tcp_position_m[0]) < 0.3
                self.both_inside |= inside and "handover" in message.zones
            case SetpointBlock(robot="left"):
                self.blocks.append(message)
            case ManagerState(zones=zones):
                self.waited |= {each for zone in zones.values() for each in zone.queue if each == "left"}

    def _feedback(self, feedback: DriveFeedback) -> None:
        if feedback.robot == "left" and feedback.enabled:
            self.commanded.append(feedback.commanded)


def test_beside_a_virtual_run_another_robot_works_as_if_there_were_none(tmp_path: Path) -> None:
    copy = Copy(tmp_path).slow_buses()
    for robot, program in (("left", LEFT), ("right", RIGHT)):
        (copy.folder / f"two_arms/programs/{robot}.prog").write_text(program)
    world = World(load_bundle(copy.cell), 4, BAD)
    remember_plans(world)
    Judge(world)
    watched = Watched(world)

    def order(robot: str, command: Enable | Run, until: str) -> None:
        def asked() -> bool:
            world.operate(f"robot/{robot}", command)
            return world.clock.run_until(world.clock.now + 0.5, lambda: until in str(world.seen.robots.get(robot)))

        assert any(asked() for _ in range(20)), world.seen.robots

    order("right", Enable(), "READY")
    order("left", Enable(), "READY")
    order("right", Run(), "RUNNING")
    order("left", Run(virtual=True), "VirtualStatus")
    done = world.clock.run_until(
        world.clock.now + 40.0,
        lambda: (
            world.seen.robots["right"].program.state is ProgramState.DONE
            and "virtual_ended" in [event.code for event in world.seen.events]
        ),
    )
    assert done, world.seen.robots
    assert watched.both_inside
    assert watched.waited == set()
    assert {"gripper": True} in [state.virtual.outputs for state in watched.left if state.virtual is not None]
    assert all(np.ptp(block.position, axis=0).max() == 0.0 and not block.events for block in watched.blocks)
    assert np.ptp(np.array(watched.commanded), axis=0).max() < 1e-6
    assert world.buses["gateway/left_bus"].nodes[6].outputs[0].on == 0
    (ended,) = [event for event in world.seen.events if event.code == "virtual_ended"]
    assert ended.text.startswith("the virtual run of left.prog is done")
