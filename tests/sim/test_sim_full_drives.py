"""Agent, gateway and fully simulated drives that carry the masses of the robot's file: the shipped cell."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cell.messages import AxisStatus, Command, Enable, Mode, PlayoutState, ProgramState, Run, SetEstop
from drive_gateway.sim.axis.full_servo import FullServo
from tests.sim.network import Weather
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy

GATEWAY, ROBOT, DRIVES = "gateway/stacker_bus", "robot/stacker", "full_drives/drives.yaml"
PROGRAM = "MJ J1=-8 J2=-5 J3=7 F=90\nMJ J1=0 J2=-20 J3=20 F=90\nEND\n"


class FullArm(World):
    """The cell `full_drives` with a shorter program and `feed_forward` on every axis."""

    def __init__(self, folder: Path, feed_forward: str) -> None:
        copy = Copy(folder)
        drives = copy.folder / DRIVES
        drives.write_text(drives.read_text().replace("feed_forward: torque", f"feed_forward: {feed_forward}"))
        (copy.folder / "full_drives" / "programs" / "stacker.prog").write_text(PROGRAM)
        super().__init__(load_bundle(copy.folder / "full_drives" / "cell.yaml"), 1, Weather())
        self.axes = self.bundle.gateways["stacker_bus"].robots["stacker"].axes
        self.servos: list[FullServo] = [
            drive.servo for node in self.buses[GATEWAY].nodes.values() for drive in node.drives
        ]
        self.errors: list[np.ndarray] = []
        self.on_feedback.append(lambda _: self.errors.append(self._errors()))
        self.until(lambda: "stacker_bus" in self.seen.gateways and self.seen.gateways["stacker_bus"].ready)
        self.until(lambda: self.seen.robots["stacker"].mode is Mode.DISABLED)
        while self.seen.robots["stacker"].mode is Mode.DISABLED:  # the network may lose the order
            self.operate(ROBOT, Enable())
            self.clock.run_until(self.clock.now + 0.5, lambda: self.seen.robots["stacker"].mode is not Mode.DISABLED)
        self.until(lambda: self.seen.feedback["stacker"].enabled)
        self.until(lambda: self.seen.robots["stacker"].mode is Mode.READY)
        self.closed_when_enabled = [servo.machine.brake_closed for servo in self.servos]

    def until(self, happened: Callable[[], bool], within_s: float = 5.0) -> None:
        assert self.clock.run_until(self.clock.now + within_s, happened), self.seen.events

    def order(self, to: str, command: Command) -> None:
        """An operator's order that is done; one that the network lost is given again."""
        before = len(self.seen.replies)
        while len(self.seen.replies) == before:
            self.operate(to, command)
            self.clock.run_until(self.clock.now + 3.0, lambda: len(self.seen.replies) > before)
        reply = self.seen.replies[-1][2]
        assert reply is not None
        assert reply.ok, reply.text

    def places(self) -> np.ndarray:
        """`(4,)` [rad] where the links really are."""
        return np.array(
            [
                axis.offset + servo.machine.mechanics.load_angle * servo._per_rad / axis.counts_per_unit
                for axis, servo in zip(self.axes, self.servos, strict=True)
            ]
        )

    def _errors(self) -> np.ndarray:
        counts = [axis.counts_per_unit for axis in self.axes]
        return np.array([servo.error for servo in self.servos]) / counts


@pytest.fixture(scope="module")
def arms(tmp_path_factory: pytest.TempPathFactory) -> dict[str, FullArm]:
    """One has run the program to its end, the other, which shall only be compared, its first move."""
    found = {kind: FullArm(tmp_path_factory.mktemp(kind), kind) for kind in ("torque", "velocity")}
    for arm in found.values():
        arm.order(ROBOT, Run())
    states = {kind: arm.seen.robots for kind, arm in found.items()}
    found["torque"].until(lambda: states["torque"]["stacker"].program.state is ProgramState.DONE)
    found["velocity"].until(lambda: states["velocity"]["stacker"].program.line == 2)
    return found


def test_torque_fed_forward_makes_the_following_error_several_times_smaller(arms: dict[str, FullArm]) -> None:
    with_torque, without = (np.abs(arms[kind].errors).max(axis=0)[:3] for kind in ("torque", "velocity"))
    # Measured on J1 to J3: 0.18 to 0.28 mrad, which is mostly friction, against 0.46 to 3.5 mrad.
    assert (with_torque < 4e-4).all()
    assert (with_torque < 0.5 * without).all()


def test_a_robot_is_enabled_when_its_brakes_are_open(arms: dict[str, FullArm]) -> None:
    assert arms["torque"].closed_when_enabled == [False] * 4


def test_an_arm_whose_agent_dies_in_motion_is_held_where_it_stands_until_its_brakes_close(
    arms: dict[str, FullArm],
) -> None:
    arm = arms["torque"]
    arm.order(ROBOT, Run())
    arm.until(lambda: abs(arm.seen.feedback["stacker"].velocity[1]) > 0.4)
    arm.kill(ROBOT)
    arm.until(lambda: arm.seen.feedback["stacker"].state is PlayoutState.STARVED)
    arm.clock.run_until(arm.clock.now + 0.1)
    stood = arm.places()
    arm.clock.run_until(arm.clock.now + 0.6)
    assert arm.seen.feedback["stacker"].enabled
    # Measured: 0.02 mrad.
    assert np.abs(arm.places() - stood).max() < 2e-4
    carried = arm.seen.feedback["stacker"].torque
    assert carried is not None
    assert carried[2] < -300.0

    arm.operate("manager", SetEstop("e1", "test", "the agent is dead"))
    arm.until(lambda: set(arm.seen.feedback["stacker"].axes) == {AxisStatus.SWITCH_ON_DISABLED})
    arm.clock.run_until(arm.clock.now + 0.2)
    assert all(servo.machine.brake_closed for servo in arm.servos)
    assert arm.servos[1].machine.torque == 0.0
    assert np.abs(arm.places() - stood).max() < 4e-4
