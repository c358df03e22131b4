"""The engraving of `cell_configs`: a program calls a CAM file, and the robot goes its path in the whole cell."""

from pathlib import Path

import numpy as np

from cell.geometry import from_xyz_abc
from cell.messages import DriveFeedback, ProgramState
from tests.sim.operator import PatientOperator
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy
from tests.unit.robot_agent.language.gcode_oracle import strokes

FOLDER = "engraving"
POSE_BASE_PLATE = from_xyz_abc(np.array([1.6, -0.15, 1.0, 0.0, 0.0, np.radians(30.0)]))
"""As the cell file says it; the base is the world."""
NEAR_M = 1e-4
"""What corners without a stop and the filter on the axes may take."""
STEP_M = 1.5e-3
"""The way of two cycles at the fastest feed."""


def test_the_tool_cuts_what_the_file_says_and_the_spindle_is_on_meanwhile(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change("two_arms/left_drives.yaml", "cycle_s: 0.004", "cycle_s: 0.02")
    copy.change(f"{FOLDER}/cell.yaml", "times: {", "times: {lead_s: 0.05, nominal_s: 0.16, ")
    world = World(load_bundle(copy.folder / FOLDER / "cell.yaml"), 2, BAD)
    cut, spindle, lines = list[np.ndarray](), set[int](), list[int]()

    def look(feedback: DriveFeedback) -> None:
        tcp = world.models["left"].forward(np.array(feedback.commanded))
        place = (np.linalg.inv(POSE_BASE_PLATE) @ tcp)[:3, 3]
        if place[2] < -1e-5:
            cut.append(place)
            spindle.add(feedback.outputs)
            np.testing.assert_allclose(tcp[:3, :3] @ np.array([1.0, 0.0, 0.0]), [0.0, 0.0, -1.0], atol=1e-4)
        state = world.seen.robots.get("left")
        if state is not None and state.program.name == "plate.nc" and state.program.line not in lines[-1:]:
            lines.append(state.program.line)

    world.on_feedback.append(look)
    PatientOperator(world)
    assert world.clock.run_until(
        world.clock.now + 90.0,
        lambda: "left" in world.seen.robots and world.seen.robots["left"].program.state is ProgramState.DONE,
    )
    meant = np.concatenate([each.places for each in strokes((copy.folder / FOLDER / "programs/plate.nc").read_text())])
    lowest = meant[meant[:, 2] < -1e-4]
    went = np.array(cut)
    assert np.linalg.norm(lowest[:, None] - went[None], axis=2).min(axis=1).max() < STEP_M
    assert _beside(went, meant) < NEAR_M
    assert spindle == {1}
    assert lines == sorted(lines)
    assert {8, 21, 22, 30} <= set(lines)


def _beside(places: np.ndarray, corners: np.ndarray) -> float:
    """How far places `(n, 3)` are away at most from the lines through corners `(m, 3)`, in their order."""
    begin, way = corners[:-1], np.diff(corners, axis=0)
    square = np.maximum((way**2).sum(axis=1), 1e-18)
    share = np.clip(((places[:, None] - begin) * way).sum(axis=2) / square, 0.0, 1.0)
    return float(np.linalg.norm(places[:, None] - begin - share[..., None] * way, axis=2).min(axis=1).max())
