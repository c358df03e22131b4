"""URDF files that are wrong, or that no open chain can be: each mistake by its name, without another exception."""

from pathlib import Path

import numpy as np
import pytest

from robot_agent.kinematics import BadModel, load_model

LIMIT = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="2" effort="3"/>'


def links(*names: str) -> str:
    return "".join(f'<link name="{name}"/>' for name in names)


def joint(name: str, parent: str, child: str, kind: str = "revolute", inner: str = LIMIT) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0.1 0 0.2"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inner}</joint>'


def one(kind: str = "revolute", inner: str = LIMIT) -> tuple[str, ...]:
    return links("a", "b"), joint("j", "a", "b", kind, inner)


def written(folder: Path, text: str) -> Path:
    (folder / "robot.urdf").write_text(text)
    return folder / "robot.urdf"


def robot(folder: Path, *parts: str) -> Path:
    return written(folder, f'<robot name="r">{"".join(parts)}</robot>')


@pytest.mark.parametrize(
    ("parts", "problem"),
    [
        ((), "found no link"),
        ((links("a", "b", "b"), joint("j", "a", "b")), "found 2 links 'b', allowed names that are there once"),
        ((links("a", "b", ""), joint("j", "a", "b")), "found a link without a name"),
        ((links("a"), joint("j", "a", "b")), "joint j has the child link 'b', which is not there"),
        (
            one("wobbly"),
            "joint j is of type 'wobbly', allowed revolute, continuous",
        ),
        (one("planar"), "joint j moves in 3 directions, allowed 1"),
        (
            one(inner='<axis xyz="0 0 1"/>'),
            "joint j has no limit, allowed limit with",
        ),
        (one(inner=LIMIT.replace('"-1"', '"2"')), "joint j has the range 2 to 1"),
        (
            one(inner=LIMIT.replace('"-1"', '"nan"')),
            "joint j has the range nan to 1",
        ),
        (
            one(inner=LIMIT.replace('velocity="2" ', "")),
            "joint j has a limit without velocity",
        ),
        (
            one(inner=LIMIT.replace("0 0 1", "0 0 0")),
            "joint j has the axis '0 0 0'",
        ),
        (
            (links("a", "b", "c"), joint("j", "a", "c"), joint("k", "b", "c")),
            "link c hangs on the joints j, k: a closed loop, allowed an open chain",
        ),
        (
            (links("a", "b", "c"), joint("j", "a", "b"), joint("k", "b", "c"), joint("l", "c", "a")),
            "every link hangs on a joint: a closed loop",
        ),
        ((links("a", "b", "c"), joint("j", "a", "b")), "the links a, c hang on no joint, allowed one base"),
        (
            (links("a", "b", "c"), joint("j", "a", "b"), joint("k", "b", "c", inner=LIMIT + '<mimic joint="j"/>')),
            "joint k mimics j, allowed joints that move by themselves",
        ),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, parts: tuple[str, ...], problem: str) -> None:
    with pytest.raises(BadModel) as caught:
        load_model(robot(tmp_path, *parts))
    assert any(found.startswith(problem) for found in caught.value.problems)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "no XML, no element found: line 1, column 0"),
        ("\0\1\2", "no XML, not well-formed"),
        ("<robot><link></robot>", "no XML, mismatched tag: line 1, column 15"),
        ('<sdf version="1.6"/>', "a document 'sdf', allowed 'robot'"),
    ],
)
def test_what_is_no_urdf_says_where(tmp_path: Path, text: str, problem: str) -> None:
    with pytest.raises(BadModel, match="found no valid URDF") as caught:
        load_model(written(tmp_path, text))
    assert problem in str(caught.value)


def test_a_folder_in_place_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").mkdir()
    with pytest.raises(BadModel, match="found no file"):
        load_model(tmp_path / "robot.urdf")


def test_meshes_are_not_looked_for(tmp_path: Path) -> None:
    mesh = '<visual><geometry><mesh filename="package://nowhere/arm.stl"/></geometry></visual>'
    model = load_model(robot(tmp_path, links("a"), f'<link name="b">{mesh}</link>', joint("j", "a", "b")))
    assert model.n == 1
    np.testing.assert_allclose(model.forward(np.zeros(1))[:3, 3], [0.1, 0, 0.2])


def test_a_finger_that_mimics_another_one_is_no_part_of_the_chain(tmp_path: Path) -> None:
    finger = joint("f", "b", "d", "prismatic", LIMIT + '<mimic joint="j"/>')
    robot(tmp_path, links("a", "b", "c", "d"), joint("j", "a", "b"), joint("k", "b", "c"), finger)
    (tmp_path / "robot.yaml").write_text(
        """
name: r
family: urdf
units: {length: m, angle: rad}
geometry: {file: robot.urdf, flange: c}
joints:
  J1: {position: [-1, 1], speed: 1, acceleration: 1, jerk: 1}
  J2: {position: [-1, 1], speed: 1, acceleration: 1, jerk: 1}
ramp_factor: 1.5
path: {speed: 1, acceleration: 1, jerk: 1, angular_speed: 1, angular_acceleration: 1, angular_jerk: 1}
home: {J1: 0, J2: 0}
capsules: [{link: 0, start: [0, 0, 0], end: [0, 0, 0], radius: 1}]
"""
    )
    assert load_model(tmp_path / "robot.yaml").n == 2


def test_a_joint_that_slides_is_one_of_the_chain(tmp_path: Path) -> None:
    file = robot(tmp_path, links("a", "b", "c"), joint("j", "a", "b", "prismatic"), joint("k", "b", "c"))
    model = load_model(file)
    assert model.linear.tolist() == [True, False]
    np.testing.assert_allclose(model.forward(np.array([0.5, 0.0]))[:3, 3], [0.2, 0, 0.9])
    assert model.reach_m == pytest.approx(np.hypot(0.2, 1.4), rel=0.01)
