"""The robot file: SI description of a good one, all problems of a bad one."""

from pathlib import Path

import numpy as np
import pytest

from cell.config import ConfigError
from robot_agent.kinematics import load_model
from robot_agent.model import ProfileKind, Shaping, load_description
from robot_agent.trajectory import Limits
from tests.unit.config_world import CONFIGS, ROBOT, Copy

SIX_AXIS = CONFIGS / ROBOT
FK_OF_THE_BOOK = {
    (0, 0, 0, 0, 0, 0): (1755, 0, 2660),
    (90, 0, 0, 0, 0, 0): (0, 1755, 2660),
    (130, -60, 30, 60, -90, 60): (11.8, 314.7, 2740.3),
    (-46, 46, 46, 46, 46, 46): (962.3, -814.8, 810.6),
}


def test_the_description_is_in_si() -> None:
    robot = load_description(SIX_AXIS)
    assert (robot.name, robot.family) == ("BOOK6", "six_axis")
    assert robot.geometry["a3z"] == 1.1
    assert robot.joint_names == ("J1", "J2", "J3", "J4", "J5", "J6")
    assert robot.limits.position[1] == pytest.approx(np.radians([-95, 130]))
    assert robot.limits.jerk[0] == pytest.approx(np.radians(2800))
    assert (robot.path.speed_m_s, robot.path.angular_speed_rad_s) == (1.5, pytest.approx(np.radians(150)))
    assert robot.capsules[2].end_m == (0.0, 0.0, 1.1)


def test_a_joint_may_accelerate_differently_towards_lower_values(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(ROBOT, "acceleration: 280, jerk", "acceleration: 280, acceleration_down: 70, jerk")
    limits = Limits.of(load_description(copy.robot))
    assert limits.acceleration_bounds[:, 0] == pytest.approx(np.radians([-70.0, 280.0]))
    assert limits.acceleration_bounds[0, 1:] == pytest.approx(-limits.acceleration_bounds[1, 1:])


def test_a_jerk_that_is_left_out_is_ten_times_the_acceleration(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(ROBOT, ", jerk: 2800}", "}").change(ROBOT, "  jerk: 50000\n", "")
    robot = load_description(copy.change(ROBOT, "  angular_jerk: 5000\n", "").robot)
    assert robot.limits.jerk[0] == pytest.approx(10.0 * robot.limits.acceleration[0])
    assert robot.path.jerk_m_s3 == pytest.approx(10.0 * robot.path.acceleration_m_s2)
    assert robot.path.angular_jerk_rad_s3 == pytest.approx(10.0 * robot.path.angular_acceleration_rad_s2)


def test_profile_filter_and_blend_are_named_in_the_robot_file(tmp_path: Path) -> None:
    assert load_description(SIX_AXIS).shaping == Shaping()
    motion = "ramp_factor: 1.5\nmotion: {profile: sinusoidal, filter_ms: 25, blend_mm: 0.5}"
    robot = load_description(Copy(tmp_path).change(ROBOT, "ramp_factor: 1.5", motion).robot)
    assert robot.shaping == Shaping(ProfileKind.SINUSOIDAL, 0.025, 0.0005)


@pytest.mark.parametrize(("joints", "position_mm"), FK_OF_THE_BOOK.items())
def test_the_books_poses_lie_inside_the_limits_and_come_out_as_printed(
    joints: tuple[float, ...], position_mm: tuple[float, ...]
) -> None:
    model = load_model(SIX_AXIS)
    q = np.radians(joints)
    assert ((model.limits.position[:, 0] <= q) & (q <= model.limits.position[:, 1])).all()
    assert 1000 * model.forward(q)[:3, 3] == pytest.approx(position_mm, abs=0.05)


def test_neighbouring_capsules_of_the_arm_touch_at_home() -> None:
    model = load_model(SIX_AXIS)
    share = np.linspace(0, 1, 101)[:, None]
    axes = [start + share * (end - start) for start, end in model.capsules(model.home)]
    for i in range(len(axes) - 1):
        distance = np.linalg.norm(axes[i][:, None] - axes[i + 1][None], axis=-1).min()
        assert distance < model.capsule_radii[i] + model.capsule_radii[i + 1]


@pytest.mark.parametrize(
    ("old", "new", "at", "problem"),
    [
        ("family: six_axis", "family: seven_axis", "§seven_axis",
         "family: found 'seven_axis', allowed 'cobot', 'delta', 'gantry', 'palletizer', 'scara', 'six_axis' or 'urdf'"),
        ("  a3z: 1100", "  a3z: -1100", "§-1100", "geometry.a3z: found -1100, allowed more than 0"),
        ("  a4x: 766\n", "", "§geometry:", "geometry.a4x: found nothing, allowed axis 3 to axis 4, along X"),
        ("J1: {position: [-180, 180]", "J1: {position: [180, -180]", "§[180, -180]",
         "joints.J1.position: found 180 to -180, allowed a lower limit below the upper one"),
        ("speed: 110,", "speed: 0,", "§0, acceleration: 280", "joints.J1.speed: found 0, allowed more than 0"),
        ("  J6: {position", "  J7: {position", "§joints:\n",
         "joints: found J1, J2, J3, J4, J5, J7, allowed each of J1, J2, J3, J4, J5, J6"),
        ("ramp_factor: 1.5", "ramp_factor: 1", "ramp_factor: §1", "ramp_factor: found 1, allowed 1.25 or more"),
        ("J5: 90, J6", "J5: 190, J6", "§190, J6", "home.J5: found 190, allowed -125 to 125, the limits of J5"),
        ("J5: 90, J6: 0", "J5: 90", "§home:", "home: found J1, J2, J3, J4, J5, allowed each of J1, J2, J3, J4, J5, J6"),
        ("ramp_factor: 1.5", "ramp_factor: 1.5\nmotion: {profile: trapezoidal}", "motion: §{profile",
         "motion: found a mapping, allowed trapezoidal only together with filter_ms above 0: its acceleration steps"),
        ("ramp_factor: 1.5", "ramp_factor: 1.5\nmotion: {filter_ms: -5}", "filter_ms: §-5",
         "motion.filter_ms: found -5, allowed 0 or more"),
        ("ramp_factor: 1.5", "ramp_factor: 1.5\nmotion: {blend_mm: 2}", "blend_mm: §2",
         "motion.blend_mm: found 2, allowed 1 or less"),
        ("acceleration: 280, jerk: 2800", "acceleration: -280", "acceleration: §-280",
         "joints.J1.acceleration: found -280, allowed more than 0"),
        ("acceleration: 280, jerk: 2800", "acceleration: 280, acceleration_down: 0", "acceleration_down: §0",
         "joints.J1.acceleration_down: found 0, allowed more than 0"),
        ("link: 6, start", "link: 7, start", "link: §7", "capsules[6].link: found 7, allowed 0 (base) to 6 (flange)"),
        ("radius: 110", "radius: 0", "radius: §0", "capsules[5].radius: found 0, allowed more than 0"),
    ],
)  # fmt: skip
def test_each_mistake_is_one_line_at_its_place(tmp_path: Path, old: str, new: str, at: str, problem: str) -> None:
    copy = Copy(tmp_path).change(ROBOT, old, new)
    with pytest.raises(ConfigError) as caught:
        load_description(copy.robot)
    assert f"{copy.place(ROBOT, at)}: {problem}" in [copy.shown(problem) for problem in caught.value.problems]


def test_what_is_left_without_a_wrong_value_is_no_second_problem(tmp_path: Path) -> None:
    motion = "ramp_factor: 1.5\nmotion: {profile: trapezoidal, filter_ms: much}"
    copy = Copy(tmp_path).change(ROBOT, "ramp_factor: 1.5", motion)
    with pytest.raises(ConfigError) as caught:
        load_description(copy.robot)
    assert [copy.shown(problem) for problem in caught.value.problems] == [
        f"{copy.place(ROBOT, '§much')}: motion.filter_ms: found 'much', allowed a number"
    ]


def test_joints_in_another_order_are_refused(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(ROBOT, "  J1: {position", "  J0: {position")
    copy.change(ROBOT, "  J2: {position", "  J1: {position").change(ROBOT, "  J0: {position", "  J2: {position")
    with pytest.raises(ConfigError, match="joints: found the order J2, J1, J3, J4, J5, J6, allowed the order J1, J2"):
        load_description(copy.robot)
