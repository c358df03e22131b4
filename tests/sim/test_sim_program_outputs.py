"""A program switches an output of its robot's drives on a bad network: from the statement to the node, to the tick."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cell.messages import Command, DriveFeedback, ForceOutput, Halt, Mode, ProgramState, Reply, SwitchOutput
from tests.sim.operator import PatientOperator
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import DRIVES, Copy

PROGRAM = "MJ J1=5 F=30\nSET DO gripper\nMJ J1=10 F=30\nRESET DO gripper\nMJ J1=12 F=30\nEND"
GRIPPER = 1 << 16


@pytest.mark.parametrize("place", ["at a drive", "at an I/O node"])
def test_the_gripper_is_closed_exactly_between_its_two_places(tmp_path: Path, place: str) -> None:
    copy = Copy(tmp_path).slow_buses()
    at_io = place == "at an I/O node"
    if at_io:
        copy.change(DRIVES, "gripper: {axis: J6, bit: 16,", "gripper: {io: coupler, bit: 16,")
        copy.add(DRIVES, "io_nodes: {coupler: {node: 20, input_bytes: 1, output_bytes: 3}}")
    programs = copy.folder / "two_arms" / "programs"
    (programs / "left.prog").write_text(PROGRAM)
    (programs / "right.prog").write_text("HOME\nEND")
    world = World(load_bundle(copy.folder / "two_arms" / "cell.yaml"), 3, BAD)
    nodes = world.buses["gateway/left_bus"].nodes
    heard: list[tuple[float, int]] = []
    on_bus: set[int] = set()

    def on_node() -> int:
        return nodes[20].outputs if at_io else nodes[6].outputs[0].on

    def look(feedback: DriveFeedback) -> None:
        if feedback.robot == "left":
            heard.append((float(np.degrees(feedback.commanded[0])), feedback.outputs))
            on_bus.add(on_node())

    world.on_feedback.append(look)
    PatientOperator(world)
    assert world.clock.run_until(
        world.clock.now + 30.0,
        lambda: "left" in world.seen.robots and world.seen.robots["left"].program.state is ProgramState.DONE,
    )
    angle, on = np.array(heard).T
    assert angle[-1] > 11.9
    assert np.array_equal(on == 1, (angle > 5.0 - 1e-3) & (angle < 10.0 - 1e-3))
    assert on_bus == {0, GRIPPER}
    assert on_node() == 0


def test_by_hand_it_opens_only_while_the_program_is_halted_and_the_next_statement_closes_it_again(
    tmp_path: Path,
) -> None:
    copy = Copy(tmp_path).slow_buses()
    programs = copy.folder / "two_arms" / "programs"
    (programs / "left.prog").write_text("SET DO gripper\nWAIT 0.8\nSET DO gripper\nEND")
    (programs / "right.prog").write_text("END")
    world = World(load_bundle(copy.folder / "two_arms" / "cell.yaml"), 5, BAD)
    node = world.buses["gateway/left_bus"].nodes[6]
    operator = PatientOperator(world)

    def until(happened: Callable[[], bool], within_s: float = 30.0) -> bool:
        return world.clock.run_until(world.clock.now + within_s, happened)

    def insisting(to: str, command: Command) -> Reply:
        """The first answer to a call that is made again and again, because the network loses some."""
        world.seen.replies.clear()
        for _ in range(20):
            world.operate(to, command)
            if until(lambda: any(asked is command for _, asked, _ in world.seen.replies), within_s=0.15):
                break
        return next(said for _, asked, said in world.seen.replies if asked is command)

    def opened() -> Reply:
        return insisting("gateway/left_bus", SwitchOutput("left", "gripper", False, "anna@pc"))

    assert until(lambda: node.outputs[0].on == GRIPPER)
    assert opened().text.startswith("left: its program runs and switches the outputs; first: cell halt left")
    operator.working = False
    assert insisting("robot/left", Halt()).ok
    assert until(lambda: world.seen.robots["left"].mode is Mode.HALTED, within_s=0.1)
    assert node.outputs[0].on == GRIPPER
    assert opened().ok
    assert node.outputs[0].on == 0
    operator.working = True
    assert until(lambda: world.seen.robots["left"].program.state is ProgramState.DONE)
    assert until(lambda: node.outputs[0].on == GRIPPER, within_s=0.1)


def test_what_is_forced_for_a_test_stays_so_while_the_program_runs_to_its_end(tmp_path: Path) -> None:
    copy = Copy(tmp_path).slow_buses()
    programs = copy.folder / "two_arms" / "programs"
    (programs / "left.prog").write_text("SET DO gripper\nWAIT 1\nRESET DO gripper\nWAIT 1\nSET DO gripper\nEND")
    (programs / "right.prog").write_text("END")
    world = World(load_bundle(copy.folder / "two_arms" / "cell.yaml"), 5, BAD)
    node = world.buses["gateway/left_bus"].nodes[6]
    PatientOperator(world)
    shown: set[int] = set()

    def forced(on: bool | None) -> None:
        order = ForceOutput("left", "gripper", on, "anna@pc")
        for _ in range(20):
            world.operate("gateway/left_bus", order)
            if world.clock.run_until(
                world.clock.now + 0.15, lambda: any(asked is order and said.ok for _, asked, said in world.seen.replies)
            ):
                return
        raise AssertionError(f"{order} was never carried out")

    assert world.clock.run_until(world.clock.now + 30.0, lambda: node.outputs[0].on == GRIPPER)
    forced(True)
    world.on_feedback.append(lambda _: shown.add(node.outputs[0].on))
    assert world.clock.run_until(
        world.clock.now + 30.0, lambda: world.seen.robots["left"].program.state is ProgramState.DONE
    )
    assert shown == {GRIPPER}
    forced(None)
    assert world.clock.run_until(world.clock.now + 1.0, lambda: not world.seen.gateways["left_bus"].forced)
    assert node.outputs[0].on == GRIPPER
