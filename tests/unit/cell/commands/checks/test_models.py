"""The robot files that come with the project, and what a robot file of each family must not say."""

import re
from pathlib import Path

import numpy as np
import pytest

from cell.commands.checks import check_cell
from cell.config import ConfigError, load_cell
from robot_agent.kinematics import load_model
from robot_agent.model import FAMILIES
from tests.unit.config_world import CELL, CONFIGS, Copy

MODELS = sorted((CONFIGS / "models").glob("*.yaml"))


def problems(copy: Copy, name: str) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        load_model(copy.folder / name)
    return [copy.shown(problem).split(": ", 1)[1] for problem in caught.value.problems]


def test_there_is_a_robot_of_each_family() -> None:
    assert {load_model(path).description.family for path in MODELS} == set(FAMILIES)


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_every_robot_is_well_at_home(path: Path) -> None:
    model = load_model(path)
    pose = model.forward(model.home)
    np.testing.assert_allclose(model.solve(pose, near=model.home), model.home, atol=1e-8)
    assert model.singularity(model.home).nearest > 0.05
    lower, upper = model.limits.position.T
    assert (model.home > lower).all()
    assert (model.home < upper).all()
    assert {capsule.link for capsule in model.body} == set(range(len(model.link_names)))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_every_robot_file_says_where_its_numbers_are_from(path: Path) -> None:
    assert "Sources of the numbers:" in path.read_text()


def test_lengths_of_slides_are_in_metres_and_turns_in_radians() -> None:
    scara = load_model(CONFIGS / "models/scara.yaml")
    np.testing.assert_allclose(scara.limits.position[2], [-0.15, 0.04])
    assert scara.limits.velocity[2] == pytest.approx(0.9)
    assert scara.limits.jerk[3] == pytest.approx(np.radians(160000))
    assert scara.home[1] == pytest.approx(np.radians(140))
    assert scara.linear_names == ("J3",)


def test_coupling_and_tools_come_from_the_file(tmp_path: Path) -> None:
    copy = Copy(tmp_path).add("models/palletizer.yaml", "tool: cups")
    model = load_model(copy.folder / "models/palletizer.yaml")
    np.testing.assert_allclose(model.coupling.axes(np.array([0.1, 0.2, 0.3, 0.4])), [0.1, 0.2, 0.5, 0.4])
    assert model.description.tool is not None
    assert model.description.tool.mass_kg == 18
    np.testing.assert_allclose(model.forward(model.home)[2, 3], model.links(model.home)[-1, 2, 3] - 0.18)
    assert len(model.body) == len(model.description.capsules) + 2


def test_a_delta_may_lack_its_fourth_axis(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change("models/delta.yaml", ", J4: 0}", "}")
    text = (copy.folder / "models/delta.yaml").read_text()
    kept, count = re.subn(r"^  J4:.*\n( {4}.*\n)*", "", text, flags=re.M)
    assert count == 2  # its joint and its motor
    (copy.folder / "models/delta.yaml").write_text(kept)
    assert load_model(copy.folder / "models/delta.yaml").n == 3


@pytest.mark.parametrize(
    ("name", "old", "new", "problem"),
    [
        ("scara", "J3: {type: linear, ", "J3: {",
         "joints.J3.type: found rotary, allowed linear, as in every robot of family scara"),
        ("scara", "  a4z: 20 ", "  a3z: 20 ",
         "geometry.a4z: found nothing, allowed lift of the spindle per turn of J4; 0 without a screw"),
        ("cobot", "family: cobot", "family: robot", "family: found 'robot', allowed 'cobot', 'delta', 'gantry', "
         "'palletizer', 'scara', 'six_axis' or 'urdf'"),
        ("palletizer", "coupling:\n  J3: {J2: -1}\n", "",
         "coupling: found nothing, allowed coupling: {J3: {J2: -1}} for a parallelogram driven from the base, {} for a "
         "motor at the elbow"),
        ("palletizer", "  J3: {J2: -1}", "  J3: {J4: -1}",
         "coupling.J3.J4: found joint J3, coupled to axis J4, allowed one of the axes before it: J1, J2"),
        ("palletizer", "mass_kg: 18", "mass_kg: -18", "tools.cups.mass_kg: found -18, allowed 0 or more"),
        ("delta", "home: {J1: 10", "home: {J1: 85", "home.J1: found 85, allowed -35 to 80, the limits of J1"),
        ("delta", "{link: 7, ", "{link: 8, ", "capsules[10].link: found 8, allowed 0 (base) to 7 (flange)"),
        ("gantry", "units: {length: mm, angle: deg}", "units: {length: mm, angle: deg}\ntool: none",
         "tool: found 'none', allowed a tool of this file: none"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_what_is_allowed(
    tmp_path: Path, name: str, old: str, new: str, problem: str
) -> None:
    copy = Copy(tmp_path).change(f"models/{name}.yaml", old, new)
    assert problem in problems(copy, f"models/{name}.yaml")


def test_the_chain_of_a_robot_counts_for_the_digest_of_its_cell(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    copy.cell.write_text(copy.cell.read_text().replace("../models/six_axis.yaml", "../models/painter.yaml"))
    before = load_cell(copy.cell).digest
    copy.change("models/painter.urdf", '<origin xyz="0 0 0.55"/>', '<origin xyz="0 0 0.56"/>')
    assert load_cell(copy.cell).digest != before


def test_a_bare_urdf_is_no_robot_of_a_cell(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    copy.cell.write_text(copy.cell.read_text().replace("../models/six_axis.yaml", "../models/painter.urdf", 1))
    _, found = check_cell(copy.cell)
    (problem,) = found
    assert copy.shown(problem) == (
        f"{copy.place(CELL, '§../models/painter.urdf')}: robots.left.model: found painter.urdf: a URDF, which has no "
        "acceleration, jerk, home position and capsules, allowed a robot file of family urdf that names it and adds "
        "them"
    )
