"""A program switches an output of its robot's drives on a bad network: from the statement to the node, to the tick."""

from pathlib import Path

import numpy as np

from cell.messages import DriveFeedback, ProgramState
from tests.sim.operator import PatientOperator
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy

PROGRAM = "MJ J1=5 F=30\nSET DO gripper\nMJ J1=10 F=30\nRESET DO gripper\nMJ J1=12 F=30\nEND"
GRIPPER = 1 << 16


def test_the_gripper_is_closed_exactly_between_its_two_places(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    programs = copy.folder / "two_arms" / "programs"
    (programs / "left.prog").write_text(PROGRAM)
    (programs / "right.prog").write_text("HOME\nEND")
    world = World(load_bundle(copy.folder / "two_arms" / "cell.yaml"), 3, BAD)
    node = world.buses["gateway/left_bus"].nodes[6]
    heard: list[tuple[float, int]] = []
    on_bus: set[int] = set()

    def look(feedback: DriveFeedback) -> None:
        if feedback.robot == "left":
            heard.append((float(np.degrees(feedback.commanded[0])), feedback.outputs))
            on_bus.add(node.outputs[0].on)

    world.on_feedback.append(look)
    PatientOperator(world)
    assert world.clock.run_until(
        world.clock.now + 30.0,
        lambda: "left" in world.seen.robots and world.seen.robots["left"].program.state is ProgramState.DONE,
    )
    place, on = np.array(heard).T
    assert place[-1] > 11.9
    assert np.array_equal(on == 1, (place > 5.0 - 1e-3) & (place < 10.0 - 1e-3))
    assert on_bus == {0, GRIPPER}
    assert node.outputs[0].on == 0
