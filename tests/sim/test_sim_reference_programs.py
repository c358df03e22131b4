"""The textbook's programs in a whole cell: points and signals in files, manager, agent, gateway, bus and drives.

What the drives measure is judged by formulas of its own, as in `test_reference_runs`.
"""

from pathlib import Path

import numpy as np
import pytest

from cell.config.points_file import PosePoint
from cell.messages import DriveFeedback, ProgramState
from tests.sim.network import Weather
from tests.sim.operator import PatientOperator
from tests.sim.world import World, load_bundle
from tests.unit.config_world import CELL, DRIVES, ROBOT, Copy
from tests.unit.played_route import Numbers, arc, assert_follows, joint_line, joints_at, line, polygon
from tests.unit.robot_agent.language.reference_programs import HOME, MODEL, POINTS, SUB, at
from tests.unit.turned_arm import flange

MEASURED_M = 3e-4
"""The drives lag, and cut corners at which the robot does not rest by little."""
TOOLS = "tools:\n" + "".join(
    f"  {name}: {{tcp: {{X: 0, Y: 0, Z: 0, A: 0, B: 0, C: 0}}, mass_kg: 1, centre: [0, 0, 0],\n"
    "    capsules: [{start: [0, 0, 0], end: [10, 0, 0], radius: 10}]}\n"
    for name in ("t1", "t2")
)
FRAMES = "frames: {" + ", ".join(f"z{n}: {{pose: {{X: -1800, Y: 0, Z: 0, A: 0, B: 0, C: 0}}}}" for n in (1, 2)) + "}"
"""Where the base of the robot is."""


def points(tools: dict[str, str]) -> str:
    """The points file, with the tools that points were taught with."""
    lines = ["points:"]
    for name, point in POINTS.items():
        assert isinstance(point, PosePoint)
        numbers = [*(1000.0 * each for each in point.position_m), *np.degrees(point.orientation_abc)]
        pose = ", ".join(f"{letter}: {number:.9f}" for letter, number in zip("XYZABC", numbers, strict=True))
        tool = f", tool: {tools[name]}" if name in tools else ""
        lines.append(f"  {name}: {{{pose}{tool}}}")
    return "\n".join([*lines, "signals:", "  di3: {input: part}", "  laser: {output: gripper}", ""])


class Ran:
    """One program of the left robot, from its start to its end."""

    def __init__(self, folder: Path, text: str, tools: dict[str, str] | None = None) -> None:
        copy = Copy(folder)
        copy.change(DRIVES, "at_stop: keep}", "at_stop: keep}\n    inputs:\n      part: {axis: J6, bit: 20}")
        copy.add(ROBOT, TOOLS).add(CELL, FRAMES)
        copy.change(
            CELL, "program: programs/left.prog", "program: programs/left.prog\n    mounted_at_start: as_described"
        )
        programs = copy.folder / "two_arms" / "programs"
        (programs / "left.prog").write_text(text)
        (programs / "left.points.yaml").write_text(points(tools or {}))
        (programs / "right.prog").write_text("END")
        world = World(load_bundle(copy.cell), 3, Weather(loss=0.0, double=0.0, late=0.0))
        self._measured: list[Numbers] = []
        self._on: list[bool] = []
        world.on_feedback.append(self._look)
        PatientOperator(world)
        ended = (ProgramState.DONE, ProgramState.FAILED)
        left = world.seen.robots
        assert world.clock.run_until(
            world.clock.now + 90.0, lambda: "left" in left and left["left"].program.state in ended
        )
        assert left["left"].program.state is ProgramState.DONE, left["left"].program.error
        world.clock.run_until(world.clock.now + 0.3, lambda: False)
        self.places = flange(np.array(self._measured))[0]

    def _look(self, feedback: DriveFeedback) -> None:
        if feedback.robot == "left" and feedback.enabled:
            self._measured.append(feedback.position)
            self._on.append(bool(feedback.outputs))

    def switches_at(self, *names: str) -> None:
        """That the output changes at these points, on first."""
        changes = np.flatnonzero(np.diff(np.array(self._on).astype(int))) + 1
        assert len(changes) == len(names)
        assert self._on[changes[0]]
        for sample, name in zip(changes, names, strict=True):
            near = np.linalg.norm(self.places[sample - 3 : sample + 4] - at(name)[0], axis=1).min()
            assert near < 2e-3 + MEASURED_M, name  # feedback comes every 20 ms


def to_p1() -> Numbers:
    """The joint move from home."""
    home = np.array(MODEL.home)
    return joint_line(home, joints_at(at("P1")[0], HOME[:3, :3], home))


@pytest.mark.soak
def test_it_turns_twice(tmp_path: Path) -> None:
    ran = Ran(tmp_path, "ML P1 F200\nSET DO laser\nMC P2 Q3 H-720\nRESET DO laser")
    p0, p1, p2, p3 = at("P0", "P1", "P2", "P3")
    assert_follows(ran.places, [line(p0, p1), arc(p1, p3, p2, -4.0 * np.pi)], MEASURED_M)
    ran.switches_at("P1", "P1")


@pytest.mark.soak
def test_it_goes_to_and_fro_six_times(tmp_path: Path) -> None:
    text = """HOME F30
MJ P1 T0 F100 //move to starting point
LOOP:
ML P2 T1 Z1 F100
SET DO laser
ML P3 T1 Z1
RESET DO laser
GOTO LOOP 5 //repeat this loop 5 times
END
"""
    ran = Ran(tmp_path, text, {"P2": "t1", "P3": "t1"})
    p1, p2, p3 = at("P1", "P2", "P3")
    assert_follows(ran.places, [to_p1(), line(p1, p2), *5 * polygon(p2, p3, p2), line(p2, p3)], MEASURED_M)
    ran.switches_at(*6 * ("P2", "P3"))


@pytest.mark.soak
def test_it_cuts_once_and_then_three_times(tmp_path: Path) -> None:
    text = SUB.replace("ML P5 T2 Z2", "ML P5 T2 Z2 F1000\n  SET DO laser").replace("ML P2", "ML P2 T0")
    ran = Ran(tmp_path, text.replace("ML P6 T2 Z2", "ML P6 T2 Z2\n  RESET DO laser"), {"P5": "t2", "P6": "t2"})
    way = [to_p1(), *polygon(*at("P1", "P5", "P6", "P2", "P5", "P6", "P5", "P6", "P5", "P6"))]
    assert_follows(ran.places, way, MEASURED_M)
    ran.switches_at(*4 * ("P5", "P6"))


@pytest.mark.soak
def test_it_goes_by_an_input_of_a_drive(tmp_path: Path) -> None:
    ran = Ran(tmp_path, "ML P1 F100\nIF DI3\n  ML P2\nSET DO laser\nELSE\n  ML P3\nENDIF")
    assert_follows(ran.places, polygon(*at("P0", "P1", "P2")), MEASURED_M)  # simulated drives begin with it closed
    ran.switches_at("P2")
